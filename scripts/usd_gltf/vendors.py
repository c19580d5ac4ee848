"""What else is authored on a light or a camera: attributes of renderers and of tools that have no carrier.

Whatever is neither in the prim's schema nor read elsewhere is listed. What has no effect on a picture, or a value
that changes nothing, is named in one note for the whole stage; the rest is a warning, one for each prim and namespace.
"""

from __future__ import annotations

from collections.abc import Mapping, Set

import numpy as np
from pxr import Sdf, Usd

from .primvars import as_rows
from .report import Notebook

_TOOLS = ("houdini", "userProperties", "nodeHandle", "maya", "blender", "omni")
"""Namespaces of tools that keep their own notes on a prim."""
_NOT_OURS = ("xformOp:", "collection:", "candelabra:", "material:", "skel:", "primvars:skel:", "physics:")
"""What USD's other schemas say of a prim, applied or not."""
_SAMPLING = (
    "samples", "volume_samples", "aov", "aov_indirect", "name", "id", "resolution", "motion_start",
    "motion_end", "matrix", "light_group", "camera_samples", "label", "lightGroup", "lightgroup",
    "samplingquality", "misbias", "lpetag", "sampling_mode", "fixedSampleCount",
    "importanceMultiplier",
)  # fmt: skip
"""Settings, in any namespace, of how a renderer samples or names a prim."""
_NEUTRAL = {
    "diffuse": 1.0, "specular": 1.0, "sss": 1.0, "indirect": 1.0, "volume": 1.0, "spread": 1.0,
    "roundness": 0.0, "soft_edge": 0.0, "shadow_density": 1.0, "cast_shadows": True,
    "cast_volumetric_shadows": True, "shadow_color": (0.0, 0.0, 0.0), "position": (0.0, 0.0, 0.0),
    "direction": (0.0, 0.0, -1.0), "look_at": (0.0, 0.0, -1.0), "up": (0.0, 1.0, 0.0), "transmission": 0.0, "max_bounces": 999,
    "aperture_size": 0.0, "lens_shift": (0.0, 0.0), "lens_tilt_angle": (0.0, 0.0), "shutter_type": "box",
    "screen_window_min": (-1.0, -1.0), "screen_window_max": (1.0, 1.0), "uv_remap": (0.0, 0.0, 0.0, 1.0),
}  # fmt: skip
"""Arnold's parameters of lights and cameras that do nothing at these values."""


def report_others(
    prim: Usd.Prim,
    known: set[str],
    code: float,
    report: Notebook,
    said: Mapping[str, object],
    unused: Set[str] = frozenset(),
) -> None:
    """List what is authored on a prim besides its schema's properties and the `known` names. `said` are values of
    Arnold's parameters that say what the prim says anyhow, `unused` those of its parameters that do nothing here."""
    known = known | set(prim.GetPrimDefinition().GetPropertyNames())
    lines: dict[str, list[str]] = {}
    idle: list[str] = []
    for property_ in prim.GetAuthoredProperties():
        name = property_.GetName()
        if name in known or name.startswith(_NOT_OURS):
            continue
        words = name.removeprefix("primvars:").removeprefix("inputs:").split(":")
        if words[:2] == ["arnold", "light"] and len(words) == 3:
            del words[1]  # of a mesh light
        if len(words) == 1 and name.startswith("primvars:") and prim.HasAttribute("faceVertexCounts"):
            continue  # a mesh's own primvar
        value = property_.Get(code) if isinstance(property_, Usd.Attribute) else property_.GetTargets()
        times = property_.GetTimeSamples() if isinstance(property_, Usd.Attribute) else ()
        values = [value, *(property_.Get(time) for time in times)]
        if all(_is_idle(words, v, said) for v in values) or (words[0] == "arnold" and words[-1] in unused):
            idle.append(name)
        else:
            lines.setdefault(words[0] if len(words) > 1 else "", []).append(f"{name} = {_short(value)}")
    if idle:
        report.idle(prim.GetPath(), idle)
    for namespace, found in lines.items():
        what = f"{namespace} attributes" if namespace else "attributes that USD does not know"
        own = [name for name in said if namespace == "arnold" and any(line.split(" = ")[0].endswith(f":{name}") for line in found)]
        why = f"they have no carrier: {', '.join(found)}"
        if own:
            why += f" ({', '.join(own)} stand{'s' * (len(own) == 1)} beside USD's own, which count)"
        report.warn(prim.GetPath(), what, why)


def _is_idle(words: list[str], value, said: Mapping[str, object]) -> bool:
    """Whether an attribute does not change the picture."""
    if words[0] in _TOOLS or words[-1] in _SAMPLING or words[-1] in ("dcc_name", "maya_full_name"):
        return True
    if value is None or value == [] or value == "" or (isinstance(value, Sdf.AssetPath) and not value.path):
        return True
    if words[-1].startswith("barndoor") and value == 0:
        return True
    if words == ["arnold", "normalize"] and isinstance(value, bool):
        return True  # read elsewhere, but on a dome
    if words[0] != "arnold" or len(words) != 2:
        return False
    if words[1] == "portal_mode":
        return value != "interior_only"  # else portals only guide sampling
    if words[1] in said and _repeats(value, said[words[1]]):
        return True
    return words[1] in _NEUTRAL and _same(value, _NEUTRAL[words[1]])


def _repeats(value, known) -> bool:
    """Whether a value is a known one, up to the rounding of those who wrote it."""
    wanted = np.atleast_1d(np.asarray(known, float))
    width = wanted.shape[-1] if wanted.ndim == 2 else 1
    rows = np.asarray(as_rows(value if hasattr(value, "__len__") else [value], width), float)
    return rows.shape == wanted.shape and bool(np.allclose(rows, wanted, rtol=1e-5, atol=1e-6))


def _same(value, neutral) -> bool:
    """Whether a value, or each of an array of values, is the neutral one."""
    if isinstance(neutral, str):
        return value == neutral
    width = len(neutral) if isinstance(neutral, tuple) else 1
    rows = as_rows(value, width).reshape(-1, width)
    return len(rows) > 0 and bool((rows == neutral).all())


def _short(value) -> str:
    text = " ".join(str(value).split())
    return text if len(text) <= 40 else text[:37] + "..."
