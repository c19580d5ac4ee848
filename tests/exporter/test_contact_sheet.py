"""The contact sheet: up to date only if it shows the very pictures, and as open as the mask says."""

from __future__ import annotations

import fcntl
import os
import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image

SCRIPT = Path(__file__).parents[2] / "scripts/contact_sheet.py"


def sheet(folder: Path, *names: str, mask: int = 0o022, columns: int = 6) -> str:
    command = [sys.executable, SCRIPT, *names, "--output", "sheet.png", "--columns", str(columns)]
    done = subprocess.run(
        command, cwd=folder, check=True, capture_output=True, text=True, umask=mask
    )
    return done.stdout


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for number in range(3):
        Image.new("RGB", (40, 30), (80 * number, 0, 0)).save(tmp_path / f"{number}.png")
    return tmp_path


def test_it_is_made_again_when_anything_it_shows_is_another(folder: Path) -> None:
    names = ["0.png", "1.png", "2.png"]
    assert "3 frames" in sheet(folder, *names)
    assert "up to date" in sheet(folder, *names)
    assert "2 frames" in sheet(folder, *names[:2])
    assert "2 frames" in sheet(folder, *names[1::-1])
    assert "3 frames" in sheet(folder, *names)
    assert "3 frames" in sheet(folder, *names, columns=2)
    assert "3 frames" in sheet(folder, *names)
    # Another picture under an old time.
    before = os.stat(folder / "1.png")
    Image.new("RGB", (40, 30), (0, 255, 0)).save(folder / "1.png")
    os.utime(folder / "1.png", ns=(before.st_atime_ns, before.st_mtime_ns - 10**10))
    assert "3 frames" in sheet(folder, *names)
    # A sheet with rot in it.
    whole = (folder / "sheet.png").read_bytes()
    (folder / "sheet.png").write_bytes(whole[: len(whole) // 2])
    assert "3 frames" in sheet(folder, *names)
    assert (folder / "sheet.png").read_bytes() == whole


@pytest.mark.parametrize(("mask", "mode"), [(0o022, 0o644), (0o027, 0o640), (0o002, 0o664)])
def test_it_is_as_open_as_the_mask_allows(folder: Path, mask: int, mode: int) -> None:
    sheet(folder, "0.png", mask=mask)
    assert os.stat(folder / "sheet.png").st_mode & 0o777 == mode


def test_what_dead_writers_left_is_removed_and_what_lives_stays(folder: Path) -> None:
    boot = Path("/proc/sys/kernel/random/boot_id").read_text().split("-")[0]
    dead, alive = (folder / f".candelabra-{boot}-{name}.part" for name in ("dead", "alive"))
    elsewhere = folder / ".candelabra-0other-a.part"
    dead.write_text("half")
    elsewhere.write_text("half")
    with alive.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        sheet(folder, "0.png")
        assert alive.exists() and elsewhere.exists() and not dead.exists()
