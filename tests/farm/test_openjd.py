"""The OpenJD template, checked and run by `openjd`."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from FileSequence import FrameSet
from conftest import PIPELINES, Layer, farm, job_file, seen, seen_here, witnesses

OPENJD = Path(sys.executable).with_name("openjd")


def openjd(*arguments: object) -> subprocess.CompletedProcess:
    return subprocess.run([OPENJD, *map(str, arguments)], capture_output=True, text=True, timeout=600)


def template(folder: Path, layers: list[Layer]) -> Path:
    path = folder / "template.json"
    path.write_text(farm(job_file(folder, layers), "openjd"))
    return path


@pytest.mark.parametrize("job", PIPELINES, ids=lambda job: job.stem)
def test_what_we_ship_is_checked(job: Path, tmp_path: Path) -> None:
    path = tmp_path / "template.json"
    path.write_text(farm(job, "openjd"))
    for verb in ("check", "summary"):
        told = openjd(verb, path)
        assert told.returncode == 0, told.stdout + told.stderr


def by_layer(tasks: dict[str, str]) -> dict[str, tuple[list[int], set[str]]]:
    """Of each layer: all its frames, and what is the same for all chunks."""
    layers: dict[str, tuple[list[int], set[str]]] = {}
    for name, text in tasks.items():
        padded, first, start, end, size, spec, *rest = text.rstrip("|\n").split("|")
        frames = FrameSet(spec).getAll()
        assert int(padded) == int(first) == int(start) == frames[0] and int(end) == frames[-1], text
        assert len(padded) >= 4 and rest[0] == name == f"{padded}-{rest[1]}" == rest[4] and rest[5] == first, text
        assert len(frames) <= int(size), text
        made, same = layers.setdefault(rest[1], ([], set()))
        made += frames
        same.add("|".join([size, *rest[1:4], *rest[6:]]))
    return {layer: (sorted(made), same) for layer, (made, same) in layers.items()}


def test_tasks_see_what_they_see_here(tmp_path: Path) -> None:
    layers = witnesses()
    here = by_layer(seen_here(tmp_path / "here", layers))
    there = tmp_path / "there"
    (there / "seen").mkdir(parents=True)
    told = openjd("run", template(there, layers))
    assert told.returncode == 0, told.stdout + told.stderr
    # OpenJD makes chunks alike: 4, 3 and 3 frames where we make 4, 4 and 2.
    assert by_layer(seen(there)) == here
    assert len(here) == len(layers)


def test_dependences_hold_and_a_failure_stops_what_waits(tmp_path: Path) -> None:
    layers = [
        Layer("last", "cp two three", after=["middle"]),
        Layer("middle", "cp one two && test #IFRAME# -ne 3", "1-4", 2, after=["first"]),
        Layer("first", "touch one"),
    ]
    told = openjd("run", template(tmp_path, layers))
    assert told.returncode == 1, told.stdout + told.stderr
    assert (tmp_path / "two").exists() and not (tmp_path / "three").exists()
    layers[1].command = "cp one two"
    told = openjd("run", template(tmp_path, layers))
    assert told.returncode == 0, told.stdout + told.stderr
    assert (tmp_path / "three").exists()


def test_a_part_of_a_job_is_run(tmp_path: Path) -> None:
    layers = witnesses()
    (tmp_path / "seen").mkdir()
    path = tmp_path / "template.json"
    path.write_text(farm(job_file(tmp_path, layers), "openjd", "--layer", "above", "--frames", "1003-1004"))
    assert [step["name"] for step in json.loads(path.read_text())["steps"]] == ["above"]
    told = openjd("run", path)
    assert told.returncode == 0, told.stdout + told.stderr
    assert list(seen(tmp_path)) == ["1003-above"]


def test_many_frames_without_order(tmp_path: Path) -> None:
    frames = ",".join(str(frame * frame % 9973 + frame) for frame in range(3000))
    told = openjd("summary", template(tmp_path, [Layer("many", "true", frames, 7)]))
    assert told.returncode == 0, told.stdout + told.stderr


def test_a_command_that_is_cancelled_may_clean_up(tmp_path: Path) -> None:
    command = "trap 'touch cleaned; exit 3' TERM; touch started; while :; do sleep 0.05; done"
    path = template(tmp_path, [Layer("long", command)])
    child = subprocess.Popen([OPENJD, "run", path], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    end = time.monotonic() + 60
    while not (tmp_path / "started").exists():
        assert child.poll() is None and time.monotonic() < end
        time.sleep(0.05)
    child.send_signal(signal.SIGINT)
    told, _ = child.communicate(timeout=120)
    assert child.returncode != 0 and (tmp_path / "cleaned").exists(), told


def test_programs_tell_the_session_how_far_they_are(tmp_path: Path) -> None:
    told = openjd("run", template(tmp_path, [Layer("asks", 'echo "openjd_status: in $CANDELABRA_PROGRESS"')]))
    assert told.returncode == 0 and "openjd_status: in openjd" in told.stdout, told.stdout
    layer = Layer("asks", 'echo "in $CANDELABRA_PROGRESS"', env={"CANDELABRA_PROGRESS": "none"})
    assert "\tin none" in openjd("run", template(tmp_path, [layer])).stdout
