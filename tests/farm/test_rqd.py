"""A job for OpenCue, its commands run by RQD: OpenCue's own program on every machine of its farm.

Cuebot, which hands the tasks out, cannot be had here, so its part is played: it divides frames into chunks and
replaces tokens.
"""

import shutil
from pathlib import Path
from unittest.mock import MagicMock

import pytest
from conftest import farm, job_file, seen, seen_here, witnesses
from FileSequence import FrameSet
from lxml import etree

rqcore = pytest.importorskip("rqd.rqcore", reason="opencue_rqd is not installed")
rqnetwork = pytest.importorskip("rqd.rqnetwork")
rqd_pb2 = pytest.importorskip("opencue_proto.rqd_pb2")


def run_frames(tree) -> list:
    """What Cuebot tells RQD of each task."""
    job = "testing-sh010-jane_tested"
    frames = []
    for layer in tree.iter("layer"):
        all_frames = list(dict.fromkeys(FrameSet(layer.findtext("range")).getAll()))
        size = int(layer.findtext("chunk"))
        for at in range(0, len(all_frames), size):
            chunk = all_frames[at : at + size]
            name = f"{chunk[0]:04d}-{layer.get('name')}"
            tokens = {
                "ZFRAME": f"{chunk[0]:04d}",
                "IFRAME": chunk[0],
                "FRAME_START": chunk[0],
                "FRAME_END": chunk[-1],
                "FRAME_CHUNK": size,
                "LAYER": layer.get("name"),
                "JOB": job,
                "FRAMESPEC": spec(chunk),
                "FRAME": name,
            }
            command = layer.findtext("cmd")
            for token, value in tokens.items():
                command = command.replace(f"#{token}#", str(value))
            told = {
                "CUE_JOB": job,
                "CUE_LAYER": layer.get("name"),
                "CUE_FRAME": name,
                "CUE_IFRAME": str(chunk[0]),
                "CUE_RANGE": spec(all_frames),
                "CUE_CHUNK": str(size),
                "CUE_SHOW": "testing",
            }
            frame = rqd_pb2.RunFrame(frame_id=name, frame_name=name, job_name=job, user_name="jane", command=command)
            frame.environment.update(told | {key.get("name"): key.text for key in layer.iter("key")})
            frames.append(frame)
    return frames


def spec(frames: list[int]) -> str:
    return ",".join(map(str, frames))


def expanded(tasks: dict[str, str]) -> dict[str, list]:
    """What was seen, with lists of frames for however they were written."""
    frames = {5, 12}
    return {
        name: [FrameSet(part).getAll() if at in frames else part for at, part in enumerate(text.split("|"))]
        for name, text in tasks.items()
    }


@pytest.mark.skipif(not shutil.which("/usr/bin/time"), reason="RQD wants /usr/bin/time: Debian's time has it")
def test_tasks_see_what_they_see_here(tmp_path: Path) -> None:
    # Cuebot knows no frames below zero.
    layers = [layer for layer in witnesses() if layer.name != "below"]
    here = seen_here(tmp_path / "here", layers)
    there = tmp_path / "there"
    (there / "seen").mkdir(parents=True)
    tree = etree.fromstring(farm(job_file(there, layers), "opencue").encode())
    core = MagicMock(docker_agent=None)
    core.machine.getPathEnv.return_value = "/usr/bin:/bin"
    core.machine.getTimezone.return_value = "UTC"
    core.machine.getHostname.return_value = "here"
    core.machine.getTempPath.return_value = f"{tmp_path}/"
    core.machine.getGpuMemoryFree.return_value = 0
    core.machine.isDesktop.return_value = False
    for frame in run_frames(tree):
        frame.log_dir = str(tmp_path / "logs")
        running = rqnetwork.RunningFrame(core, frame)
        attendant = rqcore.FrameAttendantThread(core, frame, running)
        attendant.setup()
        attendant.runLinux()
        assert running.exitStatus == 0, Path(frame.log_dir_file).read_text()
    assert expanded(seen(there)) == expanded(here)
