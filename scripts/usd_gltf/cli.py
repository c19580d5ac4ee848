"""The command line: `usd_to_gltf.py in.usd out.glb [options]`.

Exit codes: 0 done or up to date, 1 failed (also warnings that --strict makes errors), 2 usage.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
import traceback
from pathlib import Path

from pxr import Sdf, Tf, UsdUtils

from .events import tell_up_to_date
from .export import export
from .whole_file import write_atomically
from .progress import FORMS, Progress, form_of_environment
from .report import CATEGORIES, ExportError
from .source_hash import recorded_hash, up_to_date
from .stage import Options, first_line
from .subdivision import LEVELS

_PURPOSES = ("default", "render", "proxy", "guide")


def main(arguments: list[str]) -> int:
    """Run the exporter; returns the exit code."""
    options = _parser().parse_args(["--strict=" + ",".join(CATEGORIES) if a == "--strict" else a for a in arguments])
    sys.setrecursionlimit(20_000)  # a prim hierarchy may be deep
    try:
        return _run(options)
    except ExportError as error:
        print(f"error: {error}", file=sys.stderr)
    except OSError as error:
        print(f"error: {error.filename or options.output}: {error.strerror or error}", file=sys.stderr)
    except Tf.ErrorException as error:
        print(f"error: {options.source}: USD failed: {first_line(error, options.source)}", file=sys.stderr)
    except MemoryError:
        print(f"error: {options.source}: not enough memory", file=sys.stderr)
    except Exception as error:  # noqa: BLE001 (a farm's log wants one line, and an exit code)
        place = traceback.extract_tb(error.__traceback__)[-1]
        text = " ".join(str(error).split())
        where = f"{Path(place.filename).name}:{place.lineno}"
        print(f"error: {options.source}: unexpected {type(error).__name__} at {where}: {text}", file=sys.stderr)
    return 1


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="usd_to_gltf.py",
        description="Export a USD stage to glTF without losing its lights.",
        allow_abbrev=False,
    )
    parser.add_argument("source", type=Path, help="a .usd, .usda, .usdc or .usdz file")
    parser.add_argument("output", type=_output, help="the .glb or .gltf file to write")
    parser.add_argument("--frames", type=_frames, metavar="A-B",
                        help="frames (time codes) to export; default: the stage's")  # fmt: skip
    parser.add_argument("--variant", nargs="+", action="extend", default=[], type=_variant,
                        metavar="/PRIM:SET=NAME", help="variants to select, in this order; or /PRIM{SET=NAME}, "
                        "as Sdf writes it")  # fmt: skip
    parser.add_argument("--mask", type=_mask, default=(), metavar="/PRIM[,/PRIM...]",
                        help="export these prims alone, what is below them, and what they need: materials, "
                        "skeletons, prototypes")  # fmt: skip
    parser.add_argument("--purposes", type=_purposes_and_default, default=("default", "render"), metavar="LIST",
                        help="purposes to export beside default, of render,proxy,guide (default: render)")  # fmt: skip
    parser.add_argument("--purpose", type=_purposes, dest="purposes", metavar="LIST",
                        help="the same, of default,render,proxy,guide: `default` only if it is named")  # fmt: skip
    parser.add_argument("--normalize-area", choices=("stage", "metre"), default="stage",
                        help="unit of the area that `normalize` divides by (default: stage)")  # fmt: skip
    parser.add_argument("--complexity", choices=tuple(LEVELS), default="high",
                        help="how far subdivision surfaces and curves are refined, as in usdrecord: 0, 1, 2 or 3 times "
                        "(default: high)")  # fmt: skip
    # `--strict` alone stands for all categories (`main` spells it out), so that it never takes the
    # word after it for its list.
    parser.add_argument("--strict", type=_categories, default=(), metavar="[=LIST]",
                        help="fail if anything was lost or changed; --strict=LIST looks only at some categories, "
                        f"of {','.join(CATEGORIES)}")  # fmt: skip
    parser.add_argument("--progress", choices=FORMS, help="how progress is shown: auto (a line on a terminal), json "
                        "(events on standard output), none (default: CANDELABRA_PROGRESS, else auto)")  # fmt: skip
    parser.add_argument("--report", type=Path, metavar="FILE", help="where the report goes (default: OUT.report.json)")
    return parser


def _output(text: str) -> Path:
    path = Path(text)
    if path.suffix.lower() not in (".glb", ".gltf"):
        raise argparse.ArgumentTypeError(f"'{text}' must end in .glb or .gltf")
    return path


def _frames(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"(-?\d+)(?:-(-?\d+))?", text)
    if not match:
        raise argparse.ArgumentTypeError(f"'{text}' is no range of frames; write 1001-1024")
    first, last = int(match[1]), int(match[2] if match[2] is not None else match[1])
    if last < first:
        raise argparse.ArgumentTypeError(f"'{text}' runs backwards")
    return first, last


def _variant(text: str) -> tuple[str, str, str]:
    match = re.fullmatch(r"(/[^{}:]+)(?:\{([^{}=]+)=([^{}=]*)\}|:([^{}=]+)=([^{}=]*))", text)
    if not match or not _is_prim(match[1]):
        raise argparse.ArgumentTypeError(f"'{text}' is no variant selection; write /Prim:set=name")
    return match[1], match[2] or match[4], match[5] if match[3] is None else match[3]


def _mask(text: str) -> tuple[str, ...]:
    chosen = tuple(word.strip() for word in text.split(","))
    for word in chosen:
        if not _is_prim(word):
            raise argparse.ArgumentTypeError(f"'{word}' is no path of a prim; write /World/Lamps")
    return tuple(sorted(set(chosen)))


def _is_prim(text: str) -> bool:
    return Sdf.Path.IsValidPathString(text) and Sdf.Path(text).IsAbsolutePath() and Sdf.Path(text).IsPrimPath()


def _purposes_and_default(text: str) -> tuple[str, ...]:
    return tuple(sorted({*_purposes(text), "default"}))


def _purposes(text: str) -> tuple[str, ...]:
    chosen = tuple(word.strip() for word in text.split(","))
    for word in chosen:
        if word not in _PURPOSES:
            raise argparse.ArgumentTypeError(f"'{word}' is no purpose; choose of {', '.join(_PURPOSES)}")
    return tuple(sorted(set(chosen)))


def _categories(text: str) -> tuple[str, ...]:
    chosen = tuple(word.strip() for word in text.split(","))
    for word in chosen:
        if word not in CATEGORIES:
            raise argparse.ArgumentTypeError(f"'{word}' is no category; choose of {', '.join(CATEGORIES)}")
    return tuple(category for category in CATEGORIES if category in chosen)


def _run(arguments: argparse.Namespace) -> int:
    source, output = arguments.source, arguments.output
    report_path = arguments.report or output.with_name(output.name + ".report.json")
    options = Options(
        frames=arguments.frames,
        variants=tuple(arguments.variant),
        purposes=arguments.purposes,
        mask=arguments.mask,
        normalize_area=arguments.normalize_area,
        complexity=arguments.complexity,
    )
    if not source.is_file():
        raise ExportError(f"{source}: no such file")
    # Takes USD's own messages off stderr; what matters of them comes through the report.
    diagnostics = UsdUtils.CoalescingDiagnosticDelegate()
    recorded = recorded_hash(output)
    if recorded is not None and _is_current(report_path, recorded, source, options, arguments.strict):
        tell_up_to_date(output)
        return 0

    progress = Progress(arguments.progress or form_of_environment())
    with progress:
        exported = export(source, output, options, progress)
    diagnostics.TakeUncoalescedDiagnostics()
    report = exported.report
    for line in report.summary():
        print(line, file=sys.stderr)
    text = report.to_json(str(source), str(output), exported.fingerprint, exported.dependencies)
    refused = report.warnings_in(arguments.strict)
    if refused:
        _write_report(report_path, text)
        count = len(refused)
        strict = "--strict" if arguments.strict == CATEGORIES else f"--strict={','.join(arguments.strict)}"
        why = f"{count} warning{'s' * (count != 1)} under {strict}; nothing was written (see {report_path})"
        raise ExportError(f"{source}: {why}")
    with progress:
        progress.stage("writing")
        exported.document.write(exported.usd)
    _write_report(report_path, text)
    counts = ", ".join(f"{number} {what}" for what, number in sorted(report.counts.items()))
    if report.notes:
        counts += f"; {len(report.notes)} notes in {report_path.name}"
    print(f"{output}: written ({counts})")
    return 0


def _write_report(path: Path, text: str) -> None:
    write_atomically(path, text.encode("utf-8", errors="replace"))


def _is_current(path: Path, fingerprint: str, source: Path, options: Options, strict: tuple[str, ...]) -> bool:
    """Whether the report at `path` is of the export with this fingerprint, whose files are still the
    same, and has no warning that `strict` makes an error."""
    try:
        report = json.loads(path.read_bytes())
        if report["sourceHash"] != fingerprint or any(w["category"] in strict for w in report["warnings"]):
            return False
        return up_to_date(source, options, fingerprint, report["dependencies"])
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return False
