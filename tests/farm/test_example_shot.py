"""The example shot, carried out here, by OpenJD and by Slurm: the same files, whoever does it."""

import subprocess
import sys
from pathlib import Path

import pytest
from conftest import PROGRAMS, ROOT, candelabra, farm
from local_slurm import Slurm

JOB = ROOT / "pipelines" / "lantern_street.xml"
FRAMES = ["--frames", "1001-1008"]


@pytest.fixture
def root(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A project with nothing in out/, and tiny pictures."""
    for name in ("scripts", "scenes", ".venv"):
        (tmp_path / name).symlink_to(ROOT / name)
    (tmp_path / "out").mkdir()
    for name, value in {"CANDELABRA_BIN": str(PROGRAMS), "RES": "16x9", "SPP": "1"}.items():
        monkeypatch.setenv(name, value)
    return tmp_path


def pictures(root: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted((root / "out").glob("*.*")) if path.suffix != ".json"}


def run_here(root: Path) -> str:
    told = candelabra("run", JOB, "--root", root, *FRAMES)
    assert told.returncode == 0, told.stdout + told.stderr
    return told.stdout


def test_the_shot_is_made_here_and_published(root: Path) -> None:
    told = run_here(root)
    assert "lantern_street: 6 of 6 tasks done" in told, told
    made = pictures(root)
    names = {f"lantern_street.{frame}.{kind}" for frame in range(1001, 1009) for kind in ("exr", "png")}
    assert names | {"lantern_street.glb", "lantern_street.ltree", "contact_sheet.png"} <= set(made)
    log = root / "out/logs/lantern_street/0001-diff.rqlog"
    assert "nothing is published yet" in log.read_text()
    # A version is published, and the next run tells the difference.
    publish = [ROOT / "scripts/publish.sh", "out/lantern_street.ltree"]
    subprocess.run(publish, cwd=root, check=True, stdout=subprocess.DEVNULL)
    published = root / "out/published/lantern_street.ltree"
    assert published.read_bytes() == made["lantern_street.ltree"]
    assert [path.name for path in published.parent.iterdir()] == [published.name]
    # All but the comparison is as it was, and every program says so.
    assert "6 of 6 tasks done, 5 of them up to date before" in run_here(root)
    assert "lights" in log.read_text() and (root / "out/lantern_street.diff.html").exists()
    assert {name: made[name] for name in names} == {name: pictures(root)[name] for name in names}


def test_openjd_makes_the_same(root: Path) -> None:
    template = root / "template.json"
    template.write_text(farm(JOB, "openjd", "--root", root, *FRAMES))
    openjd = [Path(sys.executable).with_name("openjd"), "run", template]
    told = subprocess.run(openjd, capture_output=True, text=True, timeout=600)
    assert told.returncode == 0, told.stdout + told.stderr
    compare_with_a_run_here(root)


def test_slurm_makes_the_same(root: Path, slurm: Slurm) -> None:
    slurm.submit(farm(JOB, "slurm", "--root", root, *FRAMES))
    slurm.wait()
    compare_with_a_run_here(root)


def compare_with_a_run_here(root: Path) -> None:
    theirs = pictures(root)
    for name in theirs:
        (root / "out" / name).unlink()
    run_here(root)
    assert pictures(root) == theirs
    assert len(theirs) == 2 * 8 + 3
