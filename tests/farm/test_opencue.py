"""Job files, against the rules of CJSL and against what OpenCue's own library makes of the same job."""

import copy
import random
from pathlib import Path

import FileSequence
import outline
import outline.backend.cue
import outline.cuerun
import outline.modules.shell
import outline.util
import pytest
from conftest import PIPELINES, Layer, candelabra, commands, complaints, farm, is_valid, job_file
from lxml import etree

LAYERS = [
    Layer("prepare", "echo 'it''s' < in && sleep 0", cores="1.0", memory="512m", env={"A": "<&>'\""}),
    Layer("paint", "paint -f #FRAMESPEC# > #ZFRAME#.log", "1001-1010", 4, "2.5", "2g", after=["prepare"]),
    Layer("blend", "blend #IFRAME#", "1001-1010", 4, after=["paint*", "prepare"]),
]


def parse(text: str):
    return etree.fromstring(text.encode())


@pytest.mark.parametrize("job", PIPELINES, ids=lambda job: job.stem)
def test_what_we_ship_and_write_is_valid(job: Path) -> None:
    assert is_valid(etree.parse(job)), complaints()
    for arguments in ([], ["--frames", "1001-1003", "--layer", "render"]):
        assert is_valid(parse(farm(job, "opencue", *arguments))), complaints()


def test_a_job_for_opencue_is_the_job_in_its_folder(tmp_path: Path) -> None:
    job = job_file(tmp_path, LAYERS)
    (tmp_path / "written").mkdir()
    written = tmp_path / "written" / "x.xml"
    written.write_text(farm(job, "opencue"))
    assert is_valid(etree.parse(written)), complaints()
    change = f"cd '{tmp_path}' || exit 1; "
    expected = [line if line.startswith("# ") else change + line for line in commands(job)]
    assert commands(written) == expected
    # All that is not a command is kept.
    before, after = (etree.parse(path).getroot() for path in (job, written))
    for tree in (before, after):
        for command in tree.iter("cmd"):
            command.text = ""
    canonical = [etree.tostring(tree, method="c14n2", strip_text=True) for tree in (before, after)]
    assert canonical[0] == canonical[1]


def test_the_reader_takes_no_more_than_the_rules_allow(tmp_path: Path) -> None:
    """Elements moved, doubled, renamed and taken out at random: what lxml refuses, we refuse."""
    dice = random.Random(12)
    good = etree.parse(job_file(tmp_path, LAYERS)).getroot()
    taken = refused = 0
    for _ in range(300):
        tree = copy.deepcopy(good)
        elements = [element for element in tree.iter() if element is not tree]
        one, other = dice.choice(elements), dice.choice(elements)
        match dice.randrange(5):
            case 0:
                one.getparent().remove(one)
            case 1:
                one.addnext(copy.deepcopy(one))
            case 2:
                one.tag = other.tag
            case 3:
                one.getparent().insert(dice.randrange(len(one.getparent())), one)
            case 4:
                other.append(copy.deepcopy(one))
        path = tmp_path / "changed.xml"
        doctype = job_file(tmp_path, LAYERS).read_text().split("<spec>")[0]
        path.write_text(doctype + etree.tostring(tree, encoding="unicode"))
        told = candelabra("run", path, "--dry-run")
        assert told.returncode in (0, 2), told.stderr
        if told.returncode == 0:
            assert is_valid(tree), f"{complaints()}\n{path.read_text()}"
            taken += 1
        else:
            assert "changed.xml:" in told.stderr
            refused += 1
    assert taken > 10 and refused > 100, (taken, refused)


def serialised(layers: list[Layer], monkeypatch: pytest.MonkeyPatch) -> str:
    """What pyoutline makes of a job."""
    monkeypatch.setattr(outline.util, "get_uid", lambda: 1000)
    job = outline.Outline("tested", show="testing", shot="sh010", user="jane")
    made = {}
    for layer in layers:
        arguments = {"cores": layer.cores, "memory": layer.memory} if layer.cores else {}
        made[layer.name] = outline.modules.shell.Shell(
            layer.name, command=layer.command, chunk=layer.chunk, range=layer.range, **arguments
        )
        for key, value in layer.env.items():
            made[layer.name].set_env(key, value)
        for other in layer.after:
            on = made[other.rstrip("*")]
            if other.endswith("*"):
                made[layer.name].depend_on(on)
            else:
                made[layer.name].depend_all(on)
        job.add_layer(made[layer.name])
    launcher = outline.cuerun.OutlineLauncher(job, user="jane")
    launcher.set_flag("show", "testing")
    launcher.set_flag("shot", "sh010")
    launcher.set_flag("user", "jane")
    return outline.backend.cue.serialize_simple(launcher)


def facts(tree) -> dict:
    """What a job says, whatever way it is written."""
    text = lambda element, name: element.findtext(name)  # noqa: E731
    layers = [
        {
            "name": layer.get("name"),
            "cmd": text(layer, "cmd"),
            "range": FileSequence.FrameSet(text(layer, "range")).getAll(),
            **{name: text(layer, name) for name in ("chunk", "cores", "memory")},
            "env": {key.get("name"): key.text for key in layer.iter("key")},
        }
        for layer in tree.iter("layer")
    ]
    depends = {
        (depend.get("type"), depend.get("anyframe"), *(child.text for child in depend))
        for depend in tree.iter("depend")
    }
    return {"job": tree.find("job").get("name"), "layers": layers, "depends": depends}


def test_pyoutline_makes_the_same_of_a_job(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    theirs = serialised(LAYERS, monkeypatch)
    assert is_valid(parse(theirs)), complaints()
    ours = job_file(tmp_path, LAYERS)
    assert facts(parse(theirs)) == facts(etree.parse(ours).getroot())
    # And we read theirs as we read ours.
    path = tmp_path / "theirs.xml"
    path.write_text(theirs)
    assert commands(path) == commands(ours)


@pytest.mark.parametrize("job", PIPELINES, ids=lambda job: job.stem)
def test_pyoutline_makes_the_same_of_what_we_ship(
    job: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tree = etree.parse(job).getroot()
    layers = {
        layer.get("name"): Layer(
            layer.get("name"),
            layer.findtext("cmd"),
            layer.findtext("range"),
            int(layer.findtext("chunk")),
            layer.findtext("cores"),
            layer.findtext("memory"),
        )
        for layer in tree.iter("layer")
    }
    for depend in tree.iter("depend"):
        mark = "*" if depend.get("type") == "FRAME_BY_FRAME" else ""
        layers[depend.findtext("deplayer")].after.append(depend.findtext("onlayer") + mark)
    theirs = facts(parse(serialised(list(layers.values()), monkeypatch)))
    ours = facts(tree)
    for depends in (theirs, ours):
        # The job is called `tested` there.
        depends["depends"] = {(kind, layer, on) for kind, _, _, layer, _, on in depends["depends"]}
    for theirs_layer, ours_layer in zip(theirs["layers"], ours["layers"], strict=True):
        if ours_layer["cores"] is None:
            theirs_layer["memory"] = ours_layer["memory"]
    assert theirs["layers"] == ours["layers"]
    assert theirs["depends"] == ours["depends"]


def test_frames_are_those_of_opencue(tmp_path: Path) -> None:
    dice = random.Random(7)
    texts = ["1-10x3", "1-10y3", "1-10:3", "10-1", "10-1x-3", "-5--1", "1-3,2-5", "20-1y-6", "9-1:-8", "5"]
    for _ in range(150):
        first, last, step = dice.randint(-12, 40), dice.randint(-12, 40), dice.randint(-9, 9)
        texts.append(f"{first}-{last}{dice.choice('xy:')}{step}")
    agreed = 0
    for text in texts:
        told = candelabra("run", job_file(tmp_path, [Layer("one", "#IFRAME#", text)]), "--dry-run")
        try:
            frames = FileSequence.FrameSet(text).getAll()
        except (ValueError, ZeroDivisionError):
            frames = []
        unique = list(dict.fromkeys(frames))
        if unique:
            assert told.returncode == 0, f"{text}: {told.stderr}"
            assert [int(line) for line in told.stdout.splitlines()[2::2]] == unique, text
            agreed += 1
        else:
            # Of what has no frames no task can be made.
            assert told.returncode == 2 and "tested.xml:" in told.stderr, text
    assert agreed > 50
