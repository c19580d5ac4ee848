"""Jobs, and the programs run on them: ours, and those of the farms."""

import os
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from local_slurm import daemons, slurm  # noqa: F401
from lxml import etree

ROOT = Path(__file__).resolve().parents[2]
PROGRAMS = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")).absolute() / "debug"
PIPELINES = sorted((ROOT / "pipelines").rglob("*.xml"))

_DOCTYPE = (
    '<!DOCTYPE spec PUBLIC "SPI Cue  Specification Language" "http://localhost:8080/spcue/dtd/cjsl-1.15.dtd">'
)
_DTD = etree.DTD(str(Path(__file__).with_name("cjsl.dtd")))


@dataclass
class Layer:
    name: str
    command: str
    range: str = "1"
    chunk: int = 1
    cores: str | None = None
    memory: str | None = None
    env: dict[str, str] = field(default_factory=dict)
    after: list[str] = field(default_factory=list)
    """Layers, each waited for as a whole, or frame by frame if its name ends in `*`."""


def job_file(folder: Path, layers: list[Layer]) -> Path:
    """Writes a job called `tested` and returns its file."""
    spec = etree.Element("spec")

    def put(parent, tag: str, text: str | None = None, /, **attributes: str):
        element = etree.SubElement(parent, tag, attributes)
        element.text = text
        return element

    for name, text in (("show", "testing"), ("shot", "sh010"), ("user", "jane")):
        put(spec, name, text)
    layers_element = put(put(spec, "job", name="tested"), "layers")
    depends = put(spec, "depends")
    for layer in layers:
        element = put(layers_element, "layer", name=layer.name, type="Render")
        put(element, "cmd", layer.command)
        put(element, "range", layer.range)
        put(element, "chunk", str(layer.chunk))
        for name in ("cores", "memory"):
            if getattr(layer, name):
                put(element, name, getattr(layer, name))
        env = put(element, "env")
        for key, value in layer.env.items():
            put(env, "key", value, name=key)
        for other in layer.after:
            kind = "FRAME_BY_FRAME" if other.endswith("*") else "LAYER_ON_LAYER"
            depend = put(depends, "depend", type=kind, anyframe="False")
            for name, text in (
                ("depjob", "tested"),
                ("deplayer", layer.name),
                ("onjob", "tested"),
                ("onlayer", other.rstrip("*")),
            ):
                put(depend, name, text)
    path = folder / "tested.xml"
    path.write_text(_DOCTYPE + etree.tostring(spec, encoding="unicode", pretty_print=True))
    return path


def candelabra(*arguments: object, **options) -> subprocess.CompletedProcess:
    """Runs our program."""
    command = [PROGRAMS / "candelabra", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=600, **options)


def farm(job: Path, to: str, *arguments: object) -> str:
    """A job, written down for a farm."""
    told = candelabra("farm", job, "--to", to, *arguments)
    assert told.returncode == 0, told.stderr
    return told.stdout


def commands(job: Path, *arguments: object) -> list[str]:
    """What a job runs, in order, each task as `# name` and its command."""
    told = candelabra("run", job, "--dry-run", *arguments)
    assert told.returncode == 0, told.stderr
    return told.stdout.splitlines()[1:]


def is_valid(document) -> bool:
    """Whether a document keeps the rules of CJSL."""
    return _DTD.validate(document)


def complaints() -> str:
    """Why the last document did not."""
    return "\n".join(map(str, _DTD.error_log))


WITNESS = (
    "printf '%s|' '#ZFRAME#' '#IFRAME#' #FRAME_START# #FRAME_END# #FRAME_CHUNK# '#FRAMESPEC#' '#FRAME#' #LAYER# "
    '"$CUE_JOB" "$CUE_LAYER" "$CUE_FRAME" "$CUE_IFRAME" "$CUE_RANGE" "$CUE_CHUNK" "$CUE_SHOW" "$ODD" '
    ">> seen/#FRAME#; echo >> seen/#FRAME#"
)
"""A command that writes down all that a task is told."""
ODD = """it's {{Odd}} {{{{{x}}}}} \\"&" $HOME `x` #"""
"""A value that wants to be quoted."""


def witnesses() -> list[Layer]:
    """Layers whose frames and chunks are of many kinds, each after the first."""
    ranges = {
        "single": ("1", 1),
        "above": ("1001-1024", 5),
        "stepped": ("1-30x3", 4),
        "listed": ("7,9,1003-1005,2000", 3),
        "below": ("-3-2", 4),
    }
    layers = [Layer(name, WITNESS, frames, chunk, env={"ODD": ODD}) for name, (frames, chunk) in ranges.items()]
    for layer in layers[1:]:
        layer.after = [layers[0].name]
    return layers


def seen(folder: Path) -> dict[str, str]:
    """What the tasks wrote down."""
    return {path.name: path.read_text() for path in (folder / "seen").iterdir()}


def seen_here(folder: Path, layers: list[Layer]) -> dict[str, str]:
    """What they write down if the job is carried out by `candelabra run`."""
    (folder / "seen").mkdir(parents=True)
    told = candelabra("run", job_file(folder, layers))
    assert told.returncode == 0, told.stderr
    return seen(folder)


@pytest.fixture(scope="session", autouse=True)
def programs() -> None:
    """The programs are there."""
    if not (PROGRAMS / "candelabra").exists():
        sys.exit(f"{PROGRAMS}/candelabra is missing: run cargo build first")
