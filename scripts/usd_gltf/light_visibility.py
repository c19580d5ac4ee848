"""Which rays see a light's shape, as each renderer's own attributes say it.

UsdLux says nothing of it. What is authored becomes `extras.usdLux.visibility`
(`src/ingest/carriers.md`); what is not is left to the renderer's default.

| attribute | says | source |
|---|---|---|
| `visibleInPrimaryRay`, also `inputs:` and `primvars:` | camera | hdCycles (light.cpp), Omniverse RTX |
| `inputs:visibility:camera` | camera | Houdini's light mixer and others |
| `primvars:arnold:camera` | camera: a weight of 0 hides it | Arnold's light parameters |
| `primvars:arnold:visibility:camera`, `:specular_reflect`, `:shadow` | camera, reflections, shadows | Arnold's shape visibility |
| `primvars:arnold:visibility` | a mask, what is not in it: 1 camera, 2 shadow, 64 specular reflection | AI_RAY_* |
| `primvars:ri:attributes:visibility:camera`, `:indirect`, `:transmission` | camera, reflections, shadows | RenderMan |
| `karma:light:renderlightgeo` | camera | Karma, hdOSPRay |
| `primvars:karma:object:rendervisibility` | a pattern over primary, reflect, shadow | Karma |
| `moonray:visible_in_camera`, `:visible_glossy_reflection`, `:visible_shadow` | the same three; "use default" says nothing | MoonRay |
| `ospray:visibleToCamera` | camera | hdOSPRay |
| `cycles:visibility:camera`, `:glossy`, `:shadow`, also `primvars:cycles:object:` | the same three | Cycles' ray visibility |
"""  # noqa: E501

from __future__ import annotations

import re

from pxr import Usd

from .light_attributes import arnold_names
from .report import Notebook

_RI, _KARMA = "ri:attributes:visibility", "karma:object:rendervisibility"
_FLAGS = (
    *((name, "camera") for name in ("visibleInPrimaryRay", "inputs:visibleInPrimaryRay",
                                    "primvars:visibleInPrimaryRay", "inputs:visibility:camera")),
    *((name, "camera") for name in arnold_names("camera")),
    *((name, "camera") for name in arnold_names("visibility:camera")),
    *((name, "reflections") for name in arnold_names("visibility:specular_reflect")),
    *((name, "shadows") for name in arnold_names("visibility:shadow")),
    *((f"{prefix}{_RI}:{ray}", kind) for prefix in ("primvars:", "")
      for ray, kind in (("camera", "camera"), ("indirect", "reflections"), ("transmission", "shadows"))),
    ("karma:light:renderlightgeo", "camera"), ("primvars:karma:light:renderlightgeo", "camera"),
    ("moonray:visible_in_camera", "camera"), ("moonray:visible_glossy_reflection", "reflections"),
    ("moonray:visible_shadow", "shadows"),
    ("ospray:visibleToCamera", "camera"),
    *((f"{prefix}visibility:{ray}", kind) for prefix in ("cycles:", "cycles:object:", "primvars:cycles:object:")
      for ray, kind in (("camera", "camera"), ("glossy", "reflections"), ("shadow", "shadows"))),
)  # fmt: skip
_HIDDEN = ("RectLight", "DiskLight", "SphereLight", "CylinderLight")
"""Lights whose shape neither the camera sees nor anything is shadowed by, unless the stage says it (`carriers.md`)."""
_MASKS = arnold_names("visibility")
_PATTERNS = (f"primvars:{_KARMA}", _KARMA)
_BITS = {"camera": 1, "shadows": 2, "reflections": 64}
_KARMA_RAYS = {"camera": "primary", "reflections": "reflect", "shadows": "shadow"}

NAMES = frozenset([name for name, _ in _FLAGS]) | {*_MASKS, *_PATTERNS}
"""All attributes that are read here."""


def read_visibility(prim: Usd.Prim, kind: str, code: float, report: Notebook) -> dict[str, bool]:
    """`camera`, `reflections` and `shadows` of a light of some kind, each only if an attribute says so. What is so anyhow
    is not noted."""
    default = kind not in _HIDDEN
    found: dict[str, tuple[bool, str]] = {}
    said: dict[str, list[str]] = {}
    for ray, seen, source in _statements(prim, code, report):
        if ray not in found:
            found[ray] = seen, source
            if seen != (default or ray == "reflections"):
                said.setdefault(source, []).append(f"visibility.{ray} is {seen}")
        elif found[ray][0] != seen:
            why = f"{found[ray][1]} says {found[ray][0]} of visibility.{ray}, which is used"
            report.warn(prim.GetPath(), f"{source} overruled", why)
    for source, meanings in said.items():
        report.note(prim.GetPath(), f"{source} = {_value(prim, source, code)}", ", ".join(meanings))
    return {ray: seen for ray, (seen, _) in found.items()}


def _statements(prim: Usd.Prim, code: float, report: Notebook):
    """(kind, seen, attribute) for all that the prim's attributes say, in the order of the table."""
    for name, kind in _FLAGS:
        value = _value(prim, name, code)
        if value == "use default" or (name.startswith("moonray:") and value == 2):
            continue  # MoonRay's word for it, and its number
        weight = _weight(value)
        if weight is not None:
            if 0 < weight < 1:
                why = f"a visibility of {weight:g} has no carrier; the light is fully visible"
                report.warn(prim.GetPath(), f"{name} between 0 and 1", why)
            yield kind, weight > 0, name
        elif value is not None:
            report.warn(prim.GetPath(), f"{name} of a wrong type", f"it is {value!r}; it is ignored")
    for name in _MASKS:
        mask = _value(prim, name, code)
        if isinstance(mask, int):
            yield from ((kind, False, name) for kind, bit in _BITS.items() if not mask & bit)
    for name in _PATTERNS:
        pattern = _value(prim, name, code)
        if isinstance(pattern, str):
            said = ((kind, _matches(pattern, ray)) for kind, ray in _KARMA_RAYS.items())
            yield from ((kind, seen, name) for kind, seen in said if seen is not None)


def _value(prim: Usd.Prim, name: str, code: float):
    attribute = prim.GetAttribute(name)
    return attribute.Get(code) if attribute and attribute.HasAuthoredValue() else None


def _weight(value) -> float | None:
    """A switch as a number: a bool, a number, or MoonRay's words."""
    words = {"force off": 0.0, "force on": 1.0}
    if isinstance(value, str):
        return words.get(value)
    try:
        return float(value)
    except (TypeError, ValueError):
        return None


def _matches(pattern: str, ray: str) -> bool | None:
    """What Karma's pattern says of a ray: `*`, or the rays that see it; `-ray` or `^ray` takes one
    away, and an empty pattern all. None if it is only among `*`: that is the default."""
    words = [word for word in re.split(r"[\s|&,]+", pattern) if word]
    seen = None if words and words[0][0] in "-^" else False
    for word in words:
        if word[0] in "-^":
            seen = False if word[1:] in ("*", ray) else seen
        elif word == "*":
            seen = None
        elif word == ray:
            seen = True
    return seen
