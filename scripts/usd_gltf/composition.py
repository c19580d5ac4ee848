"""What USD's composition complained of, in words that say what was found on disk."""

from __future__ import annotations

import os
import re
from pathlib import PurePath

from pxr import Ar, Usd

from .report import Notebook

_FORMATS = {
    ".abc": ("Alembic", "geometry"), ".vdb": ("OpenVDB", "geometry"),
    ".obj": ("Wavefront OBJ", "geometry"), ".ply": ("PLY", "geometry"), ".stl": ("STL", "geometry"),
    ".fbx": ("FBX", "geometry"), ".gltf": ("glTF", "geometry"), ".glb": ("glTF", "geometry"),
    ".drc": ("Draco", "geometry"), ".bgeo": ("Houdini geometry", "geometry"), ".ass": ("Arnold", "other"),
}  # fmt: skip
"""Formats that a USD with plugins composes: their names, and what such files mostly hold."""
_MATERIALX = (".mtlx", ".mtlx]")


def report_composition(stage: Usd.Stage, problems: dict[str, str], report: Notebook) -> None:
    """One warning for each composition error of the stage. `problems` says what is wrong with files that are read here."""
    for error in stage.GetCompositionErrors():
        text = " ".join(str(error).split())
        path = error.rootSite.path
        named = re.match(r"Could not (?:open asset|load sublayer) @(.*?)@", text)
        if named is None:
            report.warn(path, *_unresolved(text))
            continue
        file = named[1].split(":SDF_FORMAT_ARGS:")[0]
        kind = "payload" if f"@{file}@ for payload" in text else "layer"
        _, _, reason = text.partition(" -- ")
        format_name, category = _FORMATS.get(PurePath(file).suffix.lower(), ("", "other"))
        lines = report.about("materials" if file.lower().endswith(_MATERIALX) else category)
        if os.path.isdir(file):
            lines.warn(path, f"unreadable {kind}", f"{file} is a folder; what it should hold is left out")
        elif not _is_there(file):
            lines.warn(path, f"missing {kind}", f"{file} cannot be found; what it should hold is left out")
        elif file in problems:
            lines.warn(path, f"unreadable {kind}", f"{file} is there, but cannot be read: {problems[file]}; it is left out")
        elif reason.startswith("Cannot determine file format"):
            suffix = PurePath(file).suffix or "files without a suffix"
            named_format = f" ({format_name})" if format_name else ""
            why = (
                f"{file} is there, but this USD has no plugin for {suffix}{named_format}; "
                "what it holds is left out: convert it to USD"
            )
            lines.warn(path, f"{kind} of a format without a plugin", why)
        else:
            why = reason.removesuffix("; skipping.").strip(" .") or "USD cannot open it"
            lines.warn(path, f"unreadable {kind}", f"{file} is there, but cannot be read: {why}")


def _unresolved(text: str) -> tuple[str, str]:
    """What is wrong where no file is, and why: a prim that is referred to and not there, or else USD's own text."""
    found = re.fullmatch(r"Unresolved (\w+) prim path @(.*?)@<(.*?)> introduced by @(.*?)@<(.*?)>.*", text)
    if found is None:
        return "composition error", text
    kind, file, prim, layer, at = found.groups()
    where = "" if layer == file else f" of {PurePath(layer).name}"
    if prim == "defaultPrim":
        lack = f"{file} has no defaultPrim, and the {kind} at {at}{where} names none; name a prim, or set the defaultPrim"
    else:
        lack = f"{file} has no prim {prim}, which the {kind} at {at}{where} names"
    return f"missing prim of a {kind}", f"{lack}; what it should hold is left out"


def _is_there(file: str) -> bool:
    outer = Ar.SplitPackageRelativePathOuter(file)[0] if Ar.IsPackageRelativePath(file) else file
    return os.path.exists(outer) or bool(str(Ar.GetResolver().Resolve(outer)))
