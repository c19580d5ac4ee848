"""How a light is shaped, over time too: cone, focus and photometric profile, and the angle of a distant light.

A light of the file has one shaping. So a light whose shaping changes is as many lights in one place as it has, each dark
but at its own sampled times. Lights in one place all shine, and one that is dark is not there (`src/ingest/carriers.md`): at
every sampled time the light is the authored one. Between two of them the light of one shaping fades into that of the next.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pxr import Usd

from .light_attributes import LightAttributes, is_finite
from .stage import changes

_INPUTS = (
    "shaping:cone:angle", "shaping:cone:softness", "shaping:focus", "shaping:focusTint",
    "shaping:ies:file", "shaping:ies:angleScale", "shaping:ies:normalize",
)  # fmt: skip
_SHAPED = ("RectLight", "DiskLight", "SphereLight", "CylinderLight")
MOST = 2000
"""Shapings of one light."""


@dataclass(frozen=True)
class IesProfile:
    """A photometric profile, by the attribute that names its file at a time code."""

    file: Usd.Attribute
    code: float
    angle_scale: float
    normalize: bool


@dataclass
class Shaping:
    """What a light of the file has one of."""

    cone: dict | None = None
    """`extras.usdLux.shaping`, without a profile."""
    profile: IesProfile | None = None
    angle_deg: float = 0.0
    """Full angle of a DistantLight."""
    lit: np.ndarray | None = None
    """At which of the sampled time codes the light has it; None for all of them."""


def read_shapings(inputs: LightAttributes, kind: str) -> list[Shaping]:
    """The shapings of a light, that of the first frame first."""
    frames = inputs.frames
    names = _INPUTS if kind in _SHAPED else ("angle",) if kind == "DistantLight" else ()
    codes = frames.codes if any(changes(inputs.attribute(name), frames) for name in names) else (frames.first,)
    found: dict[tuple, tuple[int, Shaping]] = {}
    rows = []
    for code in codes:
        shaping = _read(inputs, kind, code)
        profile = shaping.profile
        asset = None if profile is None else (inputs.at("shaping:ies:file", code), profile.angle_scale, profile.normalize)
        cone = None if shaping.cone is None else tuple((name, str(value)) for name, value in shaping.cone.items())
        key = (cone, str(asset), shaping.angle_deg)
        rows.append(found.setdefault(key, (len(found), shaping))[0])
    for name in _INPUTS[: 4 if inputs.asset("shaping:ies:file") is None else None] if kind not in _SHAPED else ():
        inputs.still(name)
    shapings = [shaping for _, shaping in found.values()]
    if len(shapings) > MOST:
        why = f"it has {len(shapings)} shapings, more than {MOST}; the first frame's is used"
        inputs.report.warn(inputs.path, "animated shaping", why)
        return [shapings[rows[frames.rest]]]
    if len(shapings) == 1:
        return shapings
    for number, shaping in enumerate(shapings):
        shaping.lit = np.array(rows) == number
    first = shapings.pop(rows[frames.rest])
    return [first, *shapings]


def _read(inputs: LightAttributes, kind: str, code: float) -> Shaping:
    angle = min(inputs.size("angle", code), 360.0) if kind == "DistantLight" else 0.0
    return Shaping(_cone(inputs, kind, code), _profile(inputs, code), angle)


def _cone(inputs: LightAttributes, kind: str, code: float) -> dict | None:
    """`extras.usdLux.shaping` in degrees, or None if the light is not shaped."""
    cone, softness = inputs.at("shaping:cone:angle", code), inputs.at("shaping:cone:softness", code)
    focus, tint = inputs.at("shaping:focus", code), [float(c) for c in inputs.at("shaping:focusTint", code)]
    if not is_finite(cone, softness, focus, *tint):
        inputs.report.warn(inputs.path, "shaping is not finite", "the light is exported unshaped")
        return None
    cone, focus = min(max(cone, 0.0), 180.0), max(focus, 0.0)
    softness = min(max(softness, 0.0), 1.0) if inputs.attribute("shaping:cone:angle") else 0.0
    widest = 90.0 if kind in ("RectLight", "DiskLight") else 180.0
    if cone >= widest and softness == 0.0 and focus == 0.0:
        return None
    return {
        "coneAngle": cone,
        "coneSoftness": softness,
        "focus": focus,
        "focusTint": [max(c, 0.0) for c in tint],
    }


def _profile(inputs: LightAttributes, code: float) -> IesProfile | None:
    """The photometric profile, if there is one."""
    file = inputs.asset("shaping:ies:file")
    if file is None or not getattr(file.Get(code), "path", ""):
        return None
    scale, normalize = inputs.at("shaping:ies:angleScale", code), bool(inputs.at("shaping:ies:normalize", code))
    if not is_finite(scale):
        inputs.report.warn(inputs.path, "shaping:ies:angleScale is not finite", "0 is used, which scales nothing")
        scale = 0.0
    return IesProfile(file, code, scale, normalize)
