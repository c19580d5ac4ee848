"""Publishing: whole files under their names, nothing else, whatever happens."""

import os
import signal
import subprocess
import time
from pathlib import Path

import pytest
from conftest import ROOT

PUBLISH = ROOT / "scripts/publish.sh"


@pytest.mark.parametrize(("mask", "mode"), [(0o022, 0o644), (0o077, 0o600)])
def test_a_copy_is_whole_and_as_open_as_the_mask_allows(tmp_path: Path, mask: int, mode: int) -> None:
    for name in ("a.ltree", "b c.ltree"):
        (tmp_path / name).write_bytes(os.urandom(100_000))
    subprocess.run([PUBLISH, "a.ltree", "b c.ltree"], cwd=tmp_path, check=True, umask=mask)
    published = tmp_path / "out/published"
    assert sorted(path.name for path in published.iterdir()) == ["a.ltree", "b c.ltree"]
    for path in published.iterdir():
        assert path.read_bytes() == (tmp_path / path.name).read_bytes()
        assert path.stat().st_mode & 0o777 == mode


@pytest.mark.parametrize("number", [signal.SIGHUP, signal.SIGINT, signal.SIGTERM])
def test_a_publisher_that_is_stopped_leaves_nothing(tmp_path: Path, number: int) -> None:
    os.mkfifo(tmp_path / "a.ltree")
    child = subprocess.Popen([PUBLISH, "a.ltree"], cwd=tmp_path, start_new_session=True)
    # The copy is under way: it waits for what comes.
    with (tmp_path / "a.ltree").open("wb") as file:
        file.write(b"half")
        file.flush()
        published = tmp_path / "out/published"
        while not any(path.stat().st_size for path in published.glob(".candelabra-*.part")):
            time.sleep(0.01)
        os.killpg(child.pid, number)
    assert child.wait(60) == 128 + number
    assert list(published.iterdir()) == []
