"""A Slurm of this machine, started for the tests: munged, slurmctld and slurmd on loopback, in a folder of their own."""

import os
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

_DAEMONS = ("munged", "slurmctld", "slurmd")
_SBIN = os.pathsep.join([os.environ["PATH"], "/usr/sbin", "/usr/local/sbin"])


def _configuration(folder: Path) -> str:
    with socket.socket() as one, socket.socket() as two:
        for each in (one, two):
            each.bind(("127.0.0.1", 0))
        ports = [each.getsockname()[1] for each in (one, two)]
    host = socket.gethostname().split(".")[0]
    return f"""
ClusterName=tests
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CryptoType=crypto/munge
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerType=sched/builtin
SchedulerParameters=sched_interval=1,batch_sched_delay=0,max_depend_depth=10
MinJobAge=600
ReturnToService=2
NodeName={host} NodeAddr=127.0.0.1 CPUs={os.cpu_count()} RealMemory=4096 State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES State=UP
"""


class Slurm:
    """A Slurm of this machine."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    @property
    def environment(self) -> dict[str, str]:
        """That of this moment: a task gets what `sbatch` had."""
        return {**os.environ, "PATH": _SBIN, "SLURM_CONF": str(self.folder / "slurm.conf")}

    def call(self, *command: object) -> str:
        told = subprocess.run(
            list(map(str, command)), env=self.environment, capture_output=True, text=True, timeout=60
        )
        assert told.returncode == 0, told.stdout + told.stderr
        return told.stdout

    def submit(self, script: str) -> None:
        """Runs a script that submits jobs."""
        path = self.folder / "submit.sh"
        path.write_text(script)
        self.call("sh", path)

    def wait(self, seconds: float = 240) -> None:
        """Waits until nothing is queued or runs."""
        end = time.monotonic() + seconds
        while left := self.call("squeue", "--noheader", "--format=%i %T %R"):
            assert time.monotonic() < end, left + self.logs()
            time.sleep(0.5)

    def states(self) -> dict[str, set[str]]:
        """How the tasks of each layer have ended."""
        states: dict[str, set[str]] = {}
        for line in self.call("squeue", "--noheader", "--states=all", "--format=%j %T").splitlines():
            name, state = line.split()
            states.setdefault(name.split(".")[1], set()).add(state)
        return states

    def logs(self) -> str:
        return "\n".join(path.read_text(errors="replace")[-3000:] for path in self.folder.glob("*.log"))


@pytest.fixture(scope="session")
def daemons(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Slurm]:
    missing = [name for name in (*_DAEMONS, "sbatch") if not shutil.which(name, path=_SBIN)]
    if missing:
        pytest.skip(f"no {', '.join(missing)} here: Debian's slurm-wlm has them")
    if os.geteuid() != 0:
        pytest.skip("slurmd wants to be root")
    # A socket's path must be short.
    folder = tmp_path_factory.mktemp("slurm")
    slurm = Slurm(folder)
    for name in ("state", "spool"):
        (folder / name).mkdir()
    (folder / "slurm.conf").write_text(_configuration(folder))
    key = folder / "munge.key"
    key.write_bytes(os.urandom(128))
    key.chmod(0o400)
    folder.chmod(0o755)
    munge = [f"--{name}={folder}/munge.{name.split('-')[0]}" for name in ("key-file", "socket", "pid-file", "log-file")]
    munge += [f"--seed-file={folder}/munge.seed", "--force", "--foreground", "--num-threads=1"]
    running = []
    try:
        for command in (["munged", *munge], ["slurmctld", "-D"], ["slurmd", "-D"]):
            with (folder / f"{command[0]}.out.log").open("w") as log:
                running.append(
                    subprocess.Popen(command, env=slurm.environment, stdout=log, stderr=log, stdin=subprocess.DEVNULL)
                )
            if command[0] == "munged":
                wait_for(lambda: (folder / "munge.socket").exists(), slurm)
        wait_for(lambda: "idle" in ask(slurm, "sinfo", "--noheader", "--format=%T"), slurm)
        yield slurm
    finally:
        for process in reversed(running):
            process.terminate()
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()


def ask(slurm: Slurm, *command: str) -> str:
    """What a program says, whether it ends well or not."""
    return subprocess.run(command, env=slurm.environment, capture_output=True, text=True, timeout=60).stdout


def wait_for(is_so, slurm: Slurm) -> None:
    end = time.monotonic() + 60
    while not is_so():
        assert time.monotonic() < end, slurm.logs()
        time.sleep(0.1)


@pytest.fixture
def slurm(daemons: Slurm) -> Iterator[Slurm]:
    yield daemons
    # What a test that failed has left.
    daemons.call("scancel", "--user=root")
