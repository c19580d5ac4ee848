"""Exit codes, reports, strictness, no-ops, determinism, and broken input."""

import json
import os
import shutil
import subprocess
import sys

import pytest
from conftest import ROOT, Gltf

LAMP = 'def RectLight "L" { float inputs:intensity = 5 }'


def test_the_script_runs_by_itself(tmp_path):
    source = tmp_path / "a.usda"
    source.write_text('#usda 1.0\ndef SphereLight "L" {}\n')
    command = [sys.executable, str(ROOT / "scripts" / "usd_to_gltf.py"), str(source), str(tmp_path / "a.glb")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert "a.glb: written" in done.stdout
    again = subprocess.run(command, capture_output=True, text=True, check=False)
    assert again.returncode == 0 and "up to date" in again.stdout


@pytest.mark.parametrize(
    "arguments",
    [["--frames", "5-1"], ["--frames", "1-10:2"], ["--purpose", "prxy"], ["--normalize-area", "foot"], ["--nonsense"]],
)
def test_usage_errors_exit_2(export, arguments):
    assert export(LAMP, *arguments).code == 2


def test_the_output_must_be_gltf(export):
    assert export(LAMP, out="scene.obj").code == 2


def test_nothing_to_do_when_up_to_date(export, tmp_path):
    first = export(LAMP)
    written = first.path.stat().st_mtime_ns
    again = export(LAMP)
    assert again.code == 0 and "up to date" in again.out
    assert again.path.stat().st_mtime_ns == written
    # Another option, another source, a lost report: each is work to do.
    assert "written" in export(LAMP, "--normalize-area", "metre").out
    assert "written" in export(LAMP.replace("5", "6")).out
    again.report_path.unlink()
    assert "written" in export(LAMP.replace("5", "6")).out


def test_a_layer_or_a_texture_that_changes_is_noticed(export, tmp_path):
    from PIL import Image

    (tmp_path / "lib.usda").write_text('#usda 1.0\ndef Xform "Lib" {\n def RectLight "L" {\n asset inputs:texture:file = @t.png@\n}\n}\n')
    Image.new("RGB", (2, 2), (1, 2, 3)).save(tmp_path / "t.png")
    text = 'def "A" (references = @lib.usda@</Lib>) {}'
    assert "written" in export(text).out
    assert "up to date" in export(text).out
    Image.new("RGB", (2, 2), (3, 2, 1)).save(tmp_path / "t.png")
    assert "written" in export(text).out
    with (tmp_path / "lib.usda").open("a") as layer:
        layer.write("# edited\n")
    assert "written" in export(text).out


def test_same_input_same_bytes(export, tmp_path):
    text = 'def SphereLight "B" {}\n' + LAMP + '\ndef Cube "C" {}\ndef Sphere "S" {}'
    first = export(text).path.read_bytes()
    # In a fresh process, where hashes and addresses differ.
    command = [sys.executable, str(ROOT / "scripts" / "usd_to_gltf.py"), str(tmp_path / "scene.usda"), str(tmp_path / "b.glb")]
    environment = {**os.environ, "PYTHONHASHSEED": "7"}
    subprocess.run(command, check=True, capture_output=True, env=environment)
    assert (tmp_path / "b.glb").read_bytes() == first


def test_the_report_is_the_same_in_every_process(export, tmp_path):
    names = [f"part{number}.usda" for number in range(12)]
    for name in names:
        (tmp_path / name).write_text('#usda 1.0\ndef SphereLight "L" {}\n')
    parts = "\n".join(f'def "P{n}" (references = @{name}@</L>) {{}}' for n, name in enumerate(names))
    export(parts)
    reports = set()
    for seed in range(4):
        command = [sys.executable, str(ROOT / "scripts" / "usd_to_gltf.py"), "scene.usda", "a.glb"]
        environment = {**os.environ, "PYTHONHASHSEED": str(seed)}
        subprocess.run(command, check=True, capture_output=True, env=environment, cwd=tmp_path)
        reports.add((tmp_path / "a.glb.report.json").read_text())
        (tmp_path / "a.glb").unlink()
    assert len(reports) == 1
    dependencies = list(json.loads(reports.pop())["dependencies"])
    assert dependencies == sorted([*names, "scene.usda"])


def test_it_matters_not_by_which_path_a_scene_is_reached(tmp_path):
    real = tmp_path / "real"
    (real / "sub").mkdir(parents=True)
    (real / "scene.usda").write_text('#usda 1.0\ndef "A" (references = @sub/current.usda@</B>) {}\n')
    for version in "12":
        lamp = f'#usda 1.0\ndef SphereLight "B" {{\n float inputs:intensity = {version}\n}}\n'
        (real / "sub" / f"v{version}.usda").write_text(lamp)
    (real / "sub" / "current.usda").symlink_to("v1.usda")
    (tmp_path / "link").symlink_to("real")

    def exported(source, output, folder=tmp_path):
        command = [sys.executable, str(ROOT / "scripts" / "usd_to_gltf.py"), str(source), str(output)]
        done = subprocess.run(command, check=True, capture_output=True, text=True, cwd=folder)
        return done.stdout

    sources = [real / "scene.usda", tmp_path / "link" / "scene.usda", "real/scene.usda", "link/../link/scene.usda"]
    for number, source in enumerate(sources):
        assert "written" in exported(source, tmp_path / f"{number}.glb")
    assert "written" in exported("scene.usda", tmp_path / "4.glb", tmp_path / "link")
    assert len({(tmp_path / f"{number}.glb").read_bytes() for number in range(5)}) == 1
    for source in sources:
        assert "up to date" in exported(source, tmp_path / "0.glb")
    # A link that leads elsewhere is another scene.
    (real / "sub" / "current.usda").unlink()
    (real / "sub" / "current.usda").symlink_to("v2.usda")
    assert "written" in exported(sources[1], tmp_path / "0.glb")


def test_what_is_up_to_date_is_told_as_candelabra_run_hears_it(export, monkeypatch):
    path = export(LAMP).path
    monkeypatch.setenv("CANDELABRA_PROGRESS", "json")
    assert export(LAMP).out == f'{{"event":"up-to-date","frame":null,"output":"{path}"}}\n'
    monkeypatch.setenv("CANDELABRA_PROGRESS", "openjd")
    assert export(LAMP).out == f"{path}: up to date\n"


def test_progress_is_told_as_events_where_that_is_asked_for(export, monkeypatch):
    prims = "\n".join(f'def Xform "X{at}" {{ def Cube "C" {{}} }}' for at in range(50))
    monkeypatch.setattr("usd_gltf.progress._PAUSE_S", {"json": 0.0, "terminal": 0.0})
    *events, written = export(prims, "--progress", "json").out.splitlines()
    events = [json.loads(event) for event in events]
    stages = [event["name"] for event in events if event["event"] == "stage"]
    assert stages == ["opening the stage", "reading prims", "making nodes", "writing"]
    done = [event["done"] for event in events if event["event"] == "progress"]
    assert len(done) == 100 and done == sorted(set(done)) and 0 < done[0] and done[-1] <= 1
    assert all(event.get("frame", 0) is None for event in events if event["event"] == "progress")
    assert "written" in written


@pytest.mark.parametrize("form", ["auto", "none"])
def test_progress_is_a_line_on_a_terminal_that_is_gone_at_the_end(export, monkeypatch, form):
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    text = LAMP + "\n" + 'def PluginLight "P" {}'
    err = export(text, f"--progress={form}", out="shown.glb").err
    assert ("reading prims: " in err) == (form == "auto")
    assert "\n" not in err.split("warning: ")[0], "one line, written over"
    if form == "auto":
        cleared = err.split("warning: ")[0].split("\r")
        assert cleared[-1] == "" and cleared[-2].strip() == "", "the report has a line of its own"
    # Without a terminal nothing is told of it.
    monkeypatch.setattr("sys.stderr.isatty", lambda: False, raising=False)
    assert "reading prims" not in export(text, f"--progress={form}", out="still.glb").err


def test_strict_writes_the_report_and_nothing_else(export):
    text = LAMP + '\ndef PluginLight "P" {}'
    result = export(text, "--strict")
    assert result.code == 1
    assert not result.path.exists()
    assert result.report["warnings"][0]["path"] == "/P"
    assert "--strict" in result.err
    assert export(text).code == 0
    assert export(text, "--strict").code == 1, "an up-to-date output is no excuse"
    assert export(LAMP, "--strict").code == 0


def test_the_report(export, tmp_path):
    result = export(LAMP + "".join(f'\ndef PluginLight "P{i}" {{}}' for i in range(500)), "--report", str(tmp_path / "r.json"))
    report = json.loads((tmp_path / "r.json").read_text())
    assert set(report) >= {"source", "output", "warnings", "counts"}
    assert set(report["warnings"][0]) == {"category", "path", "what", "why"}
    assert report["counts"]["lights RectLight"] == 1
    assert len(report["warnings"]) == 500
    assert len(result.err.splitlines()) == 1 and "500" in result.err


def test_a_missing_payload_is_named_and_an_error_under_strict(export):
    text = LAMP + '\ndef Xform "Hall" (payload = @gone/hall.usd@) {}'
    result = export(text)
    assert result.code == 0
    (warning,) = [w for w in result.report["warnings"] if w["what"] == "missing payload"]
    assert warning["path"] == "/Hall" and "gone/hall.usd" in warning["why"]
    assert export(text, "--strict").code == 1


LOSSES = {
    "lights": 'def RectLight "K" { float inputs:shadow:distance = 3 }',
    "materials": 'def Material "M" {}\ndef Cube "C" (prepend apiSchemas = ["MaterialBindingAPI"]) { rel material:binding = </M> }',
    "geometry": 'def BasisCurves "C" {}',
    "cameras": 'def Camera "C" { float4[] clippingPlanes = [(0, 1, 0, 2)] }',
    "animation": 'def Xform "C" { token visibility.timeSamples = { 1: "inherited", 2: "invisible" }\n def Cube "M" {}\n def Camera "C" {} }',
    "other": 'def Xform "Hall" (references = @gone/hall.usd@) {}',
}


@pytest.mark.parametrize("category", LOSSES)
def test_strict_by_category(export, category):
    text = LAMP + "\n" + LOSSES[category]
    others = ",".join(c for c in LOSSES if c != category)
    result = export(text, f"--strict={others}")
    assert result.code == 0, result.err
    assert result.warned() and result.warned() == result.warned(category)
    assert export(text, f"--strict={category}").code == 1, "an up-to-date output is no excuse"
    assert export(text, "--strict").code == 1
    assert export(text, f"--strict={others},{category}").code == 1


@pytest.mark.parametrize("scene", sorted(p.stem for p in (ROOT / "scenes").glob("*/*.usda") if p.stem == p.parent.name))
def test_the_projects_own_scenes_pass_strict(export, scene):
    result = export(ROOT / "scenes" / scene / f"{scene}.usda", "--strict")
    assert result.code == 0, result.err


def test_strict_never_takes_the_word_after_it(export, tmp_path):
    (tmp_path / "scene.usda").write_text("#usda 1.0\n")
    command = [sys.executable, str(ROOT / "scripts" / "usd_to_gltf.py"), "--strict", "scene.usda", "out.glb"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    for wrong in ("--strict=light", "--strict=", "--strict=lights,,"):
        assert export(LAMP, wrong).code == 2


@pytest.mark.parametrize("light", [True, False])
def test_a_mesh_light_that_is_hidden_beside_a_camera_is_a_matter_of_lights(export, light):
    inside = 'def Cube "C" (prepend apiSchemas = ["MeshLightAPI"]) {}' if light else 'def Cube "C" {}'
    inside += '\ndef Camera "V" {}'
    result = export(f'def Xform "X" {{ token visibility.timeSamples = {{ 1: "inherited", 2: "invisible" }}\n {inside} }}')
    assert result.warned("lights" if light else "animation") == {"animated visibility"}


FILES = {
    "x.mtlx": ('<?xml version="1.0"?><materialx', "is there, but cannot be read", "materials"),
    "x.abc": ("Ogawa", "is there, but this USD has no plugin for .abc (Alembic)", "geometry"),
    "x.vdb": ("VDB", "is there, but this USD has no plugin for .vdb (OpenVDB)", "geometry"),
    "x.xyz": ("1 2 3", "is there, but this USD has no plugin for .xyz", "other"),
    "x.usda": ("#usda 1.0\ndef Xform { no", "is there, but cannot be read", "other"),
    "x.usdc": ("PXR-USDC", "is there, but cannot be read", "other"),
    "empty.usd": ("", "is there, but cannot be read", "other"),
    "folder.usda": (None, "is a folder", "other"),
    "gone.mtlx": ("gone", "cannot be found", "materials"),
    "gone.usda": ("gone", "cannot be found", "other"),
}
ARCS = {
    "reference": 'def "A" (references = @{}@) {{}}',
    "payload": 'def "A" (payload = @{}@) {{}}',
    "sublayer": "#usda 1.0\n(\n subLayers = [@{}@]\n)\n",
}


@pytest.mark.parametrize("arc", ARCS)
@pytest.mark.parametrize("name", FILES)
def test_what_a_message_says_of_a_layer_is_what_is_so(export, tmp_path, name, arc):
    content, words, category = FILES[name]
    if content is None:
        (tmp_path / name).mkdir()
    elif content != "gone":
        (tmp_path / name).write_text(content)
    result = export(ARCS[arc].format(name))
    assert result.code == 0
    (warning,) = result.report["warnings"]
    assert warning["category"] == category
    assert name in warning["why"] and words in warning["why"]
    assert ("missing" in warning["what"]) == (words == "cannot be found")
    assert ("payload" in warning["what"]) == (arc == "payload")


GOOD = '#usda 1.0\ndef SphereLight "lamp"\n{\n    float inputs:intensity = %s\n}\n'


@pytest.mark.parametrize("broken", ["broken.usda", "cache.abc", "missing.usda", "unknown.xyz", "folder.usda"])
@pytest.mark.parametrize("arc", ["sublayer", "reference"])
def test_a_layer_that_cannot_be_read_does_not_hide_that_another_changed(export, tmp_path, broken, arc):
    if broken == "folder.usda":
        (tmp_path / broken).mkdir()
    elif broken != "missing.usda":
        (tmp_path / broken).write_text("#usda 1.0\ndef Xform { this is not usda")
    text = f"#usda 1.0\n(\n subLayers = [@./good.usda@, @./{broken}@]\n)\n"
    if arc == "reference":
        text = f'#usda 1.0\ndef "a" (references = @./{broken}@) {{}}\ndef "b" (references = @./good.usda@</lamp>) {{}}\n'
    (tmp_path / "root.usda").write_text(text)
    root = tmp_path / "root.usda"
    for intensity in (10, 77):
        (tmp_path / "good.usda").write_text(GOOD % intensity)
        result = export(root)
        assert "written" in result.out
        assert Gltf(result.path).nits("/lamp" if arc == "sublayer" else "/b") == pytest.approx([intensity] * 3)
        assert "up to date" in export(root).out
    # What could not be read is part of the key too: mended, it is read.
    if broken.endswith(".usda") and broken != "folder.usda":
        (tmp_path / broken).write_text('#usda 1.0\n(\n defaultPrim = "x"\n)\ndef Xform "x" {\n def Cube "C" {}\n}\n')
        assert "written" in export(root).out


def test_textures_that_come_and_go_are_noticed(export, tmp_path):
    from PIL import Image

    text = 'def RectLight "L" { asset inputs:texture:file = @t.png@ }'
    assert "missing texture" in export(text).warned()
    assert "up to date" in export(text).out
    Image.new("RGB", (2, 2), (9, 9, 9)).save(tmp_path / "t.png")
    assert "written" in export(text).out
    (tmp_path / "t.png").unlink()
    assert "written" in export(text).out


def test_a_moved_folder_is_still_up_to_date(export, tmp_path):
    first = tmp_path / "a"
    first.mkdir()
    (first / "good.usda").write_text(GOOD % 3)
    (first / "root.usda").write_text("#usda 1.0\n(\n subLayers = [@./good.usda@]\n)\n")
    assert "written" in export(first / "root.usda", out="a/out.glb").out
    first.rename(tmp_path / "b")
    assert "up to date" in export(tmp_path / "b" / "root.usda", out="b/out.glb").out
    # A report of another source is no proof.
    (tmp_path / "b" / "other.usda").write_text("#usda 1.0\n")
    assert "written" in export(tmp_path / "b" / "other.usda", out="b/out.glb").out


def test_a_layer_that_changes_while_it_is_read_is_exported_again(export, tmp_path, monkeypatch):
    import time

    import usd_gltf.source_hash as module

    # The export seems to start long before the layer was last written.
    ticks = iter([time.time_ns() - 10**12])
    monkeypatch.setattr(module.time, "time_ns", lambda real=time.time_ns: next(ticks, real()))
    assert "written" in export(LAMP).out
    monkeypatch.undo()
    (tmp_path / "scene.usda").touch()  # no content changes from here on
    assert "written" in export(tmp_path / "scene.usda").out
    assert "up to date" in export(tmp_path / "scene.usda").out


@pytest.mark.parametrize(("arc", "what", "why"), [
    ("references = @b.usda@</Nope>", "missing prim of a reference", "b.usda has no prim /Nope, which the reference at /A of scene.usda names"),
    ("payload = @b.usda@</Nope>", "missing prim of a payload", "b.usda has no prim /Nope, which the payload at /A of scene.usda names"),
    ("references = @b.usda@", "missing prim of a reference", "b.usda has no defaultPrim, and the reference at /A of scene.usda names none"),
    ("references = </Gone>", "missing prim of a reference", "scene.usda has no prim /Gone, which the reference at /A names"),
])  # fmt: skip
def test_a_prim_that_is_named_and_not_there_is_told_of(export, tmp_path, arc, what, why):
    (tmp_path / "b.usda").write_text('#usda 1.0\ndef Xform "B" {\n}\n')
    result = export(LAMP + f'\ndef Xform "A" ({arc}) {{}}')
    assert result.warned() == {what} and why in result.said()


def test_a_missing_source_is_one_line(export, tmp_path):
    result = export(tmp_path / "nowhere.usd")
    assert result.code == 1
    assert result.err == f"error: {tmp_path / 'nowhere.usd'}: no such file\n"


def test_an_unwritable_output_is_one_line(export, tmp_path):
    (tmp_path / "file").write_text("")
    result = export(LAMP, out="file/scene.glb")
    assert result.code == 1
    assert len(result.err.splitlines()) == 1 and result.err.startswith("error: ")


def test_an_empty_stage_is_an_empty_scene(gltf):
    assert gltf("").json["nodes"] == [{"name": "stage"}]


def test_output_leaves_no_temporary_files(export, tmp_path):
    export(LAMP)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["scene.glb", "scene.glb.report.json", "scene.usda"]


def test_malformed_usd_is_refused_in_one_line_or_exported(export, shared):
    folder = shared / "real" / "malformed"
    files = sorted(p for p in folder.glob("usd_*/**/*") if p.suffix in (".usd", ".usda", ".usdc", ".usdz"))
    assert files
    refused = 0
    for file in files:
        result = export(file, out=f"{file.stem}.glb")
        assert result.code in (0, 1)
        if result.code == 1:
            refused += 1
            assert result.err.startswith(f"error: {file}: ")
            assert len(result.err.splitlines()) == 1
            assert not result.path.exists()
    assert refused >= 20


@pytest.mark.parametrize(
    ("name", "lights"),
    [
        ("openusd_usdlux_tests/usd/usdLux/testenv/testUsdLuxLightListAPI/root_with_instances.usda", 3),
        ("usdwg_standard_shader_ball/standard_shader_ball_scene.usda", 5),
    ],
)
def test_real_stages(gltf, shared, name, lights):
    scene = gltf(shared / "real" / name)
    assert sum("usdLux" in node.get("extras", {}) for node in scene.nodes) == lights


def test_the_khronos_validator_finds_no_errors(gltf, export, tmp_path):
    """Needs GLTF_VALIDATOR, the path of the npm package gltf-validator, and node."""
    package = os.environ.get("GLTF_VALIDATOR")
    if not package or not shutil.which("node"):
        pytest.skip("no gltf-validator (GLTF_VALIDATOR)")
    result = export(
        """def SphereLight "S" { color3f inputs:color = (1, 0.5, 0) }
        def DiskLight "D" { bool inputs:normalize = 1 }
        def CylinderLight "C" {}
        def DistantLight "Sun" {}
        def DomeLight "Dome" {}
        def Cone "G" { color3f[] primvars:displayColor = [(1, 0, 0)] }
        def Camera "Cam" {}"""
    )
    assert Gltf(result.path).nodes
    script = (
        "const v=require(process.argv[1]),fs=require('fs');"
        "v.validateBytes(new Uint8Array(fs.readFileSync(process.argv[2])))"
        ".then(r=>console.log(JSON.stringify(r.issues)))"
    )
    done = subprocess.run(
        ["node", "-e", script, package, str(result.path)], capture_output=True, text=True, check=True
    )
    issues = json.loads(done.stdout)
    assert (issues["numErrors"], issues["numWarnings"]) == (0, 0), issues["messages"]
