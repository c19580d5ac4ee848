"""The Slurm script, submitted to a Slurm of one machine that is started for the tests."""

from pathlib import Path

import pytest
from conftest import PIPELINES, Layer, farm, job_file, seen, seen_here, witnesses
from local_slurm import Slurm


def test_tasks_see_what_they_see_here(slurm: Slurm, tmp_path: Path) -> None:
    layers = witnesses()
    here = seen_here(tmp_path / "here", layers)
    there = tmp_path / "there%j"
    (there / "seen").mkdir(parents=True)
    slurm.submit(farm(job_file(there, layers), "slurm"))
    slurm.wait()
    assert seen(there) == here
    # A log for each task.
    logs = [path.read_text() for path in (there / "out/logs/tested").iterdir()]
    assert sorted(log.split(":")[0] for log in logs) == sorted(here)


def test_dependences_hold_and_a_failure_stops_what_waits(slurm: Slurm, tmp_path: Path) -> None:
    layers = [
        Layer("first", 'test -d "$CUE_LOG_PATH" && touch one'),
        Layer("middle", "cp one two.#IFRAME# && test #IFRAME# -ne 1003", "1001-1004", 1, after=["first"]),
        Layer("by_frame", "cp two.#IFRAME# three.#IFRAME#", "1001-1004", 1, after=["middle*"]),
        Layer("other_chunks", "touch never", "1001-1004", 2, after=["middle*"]),
        Layer("whole", "touch never", after=["middle"]),
    ]
    slurm.submit(farm(job_file(tmp_path, layers), "slurm"))
    slurm.wait()
    assert {path.name for path in tmp_path.glob("t*.*") if path.suffix != ".xml"} == {
        *(f"two.{frame}" for frame in range(1001, 1005)),
        *(f"three.{frame}" for frame in (1001, 1002, 1004)),
    }
    assert not (tmp_path / "never").exists()
    states = slurm.states()
    assert states["middle"] == {"COMPLETED", "FAILED"}
    assert states["whole"] == {"CANCELLED"}


def test_more_chunks_than_an_array_holds(slurm: Slurm, tmp_path: Path) -> None:
    """Frames far above Slurm's own limit; only the first and last tasks of each array are looked at."""
    script = farm(job_file(tmp_path, [Layer("many", "touch #IFRAME#", "5001-7500")]), "slurm")
    assert script.count("sbatch") == 3
    # The machine would need minutes for 2,500 tasks: every 250th is run.
    few = script.replace("--array=0-999", "--array=0-999:250").replace("--array=0-499", "--array=0-499:499")
    slurm.submit(few)
    slurm.wait()
    made = sorted(int(path.name) for path in tmp_path.iterdir() if path.name.isdigit())
    assert made == [5001, 5251, 5501, 5751, 6001, 6251, 6501, 6751, 7001, 7500]


@pytest.mark.parametrize("job", PIPELINES, ids=lambda job: job.stem)
def test_slurm_takes_what_we_ship(slurm: Slurm, job: Path, tmp_path: Path) -> None:
    slurm.submit(farm(job, "slurm", "--root", tmp_path).replace("sbatch ", "sbatch --hold "))
