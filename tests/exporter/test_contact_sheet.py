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


def told(folder: Path, *arguments: str, mask: int = 0o022) -> subprocess.CompletedProcess:
    command = [sys.executable, SCRIPT, *arguments, "--output", "sheet.png"]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, umask=mask)


def sheet(folder: Path, *names: str, mask: int = 0o022, columns: int = 6) -> str:
    done = told(folder, *names, "--columns", str(columns), mask=mask)
    assert done.returncode == 0, done.stderr
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


def test_frames_of_a_pattern_are_those_asked_for(folder: Path) -> None:
    for number in range(-1, 6):
        name = f"shot.{number:04}.png"
        Image.new("RGB", (40, 30), (40 * number + 50, 0, 0)).save(folder / name)
    pattern = ["--pattern", "shot.####.png"]
    for spec, names in {
        "1-3": ["0001", "0002", "0003"],
        "1-5x2": ["0001", "0003", "0005"],
        "5-1x-4,2": ["0005", "0001", "0002"],
        "-1-1": ["-001", "0000", "0001"],
        "4": ["0004"],
    }.items():
        made = told(folder, *pattern, f"--frames={spec}")
        assert made.returncode == 0 and f"{len(names)} frame" in made.stdout, made.stderr
        # The same as of the files by their names.
        assert "up to date" in sheet(folder, *(f"shot.{name}.png" for name in names))
    for spec in ("1-3x0", "3-1x1", "1-", "a", "1:3", "1-99999", "0" * 100_000):
        refused = told(folder, *pattern, f"--frames={spec}")
        assert refused.returncode == 2 and "Traceback" not in refused.stderr and len(refused.stderr) < 2000, spec
    for arguments in (pattern, ["0.png", "--frames=1"], [], ["--pattern", "shot.png", "--frames=1"], ["0.png", *pattern]):
        assert told(folder, *arguments).returncode == 2, arguments


def test_missing_and_broken_frames_are_named(folder: Path) -> None:
    missing = told(folder, "--pattern", "#.png", "--frames=1-30")
    assert missing.returncode == 1
    assert "28 of 30 pictures are missing: 3.png, 4.png, " in missing.stderr and "and 18 more" in missing.stderr
    whole = (folder / "1.png").read_bytes()
    for broken in (b"", whole[: len(whole) // 2]):
        (folder / "1.png").write_bytes(broken)
        done = told(folder, "0.png", "1.png")
        assert done.returncode == 1 and done.stderr.startswith("error: ") and "1.png" in done.stderr, done.stderr
    assert not (folder / "sheet.png").exists()


def test_pictures_of_several_sizes_are_told(folder: Path) -> None:
    assert told(folder, "0.png", "1.png").stderr == ""
    Image.new("RGB", (20, 10)).save(folder / "2.png")
    done = told(folder, "0.png", "1.png", "2.png")
    assert done.returncode == 0
    assert "differ in size: 2 of 40x30, the first is 0.png; 1 of 20x10, the first is 2.png" in done.stderr


def test_what_is_up_to_date_is_told_as_candelabra_run_hears_it(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sheet(folder, "0.png")
    monkeypatch.setenv("CANDELABRA_PROGRESS", "json")
    assert sheet(folder, "0.png") == '{"event":"up-to-date","frame":null,"output":"sheet.png"}\n'


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


def test_it_is_no_wider_than_its_pictures(folder: Path) -> None:
    def width(*names: str) -> int:
        sheet(folder, *names)
        with Image.open(folder / "sheet.png") as picture:
            return picture.width

    one, two, three = width("0.png"), width("0.png", "1.png"), width("0.png", "1.png", "2.png")
    assert two - one == three - two > 0 and one < 2 * (two - one)
