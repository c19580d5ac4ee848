"""The light group of a light, as each renderer's own attributes name it.

UsdLux has no such attribute. The first name that is authored becomes `extras.usdLux.group`
(`src/ingest/carriers.md`).

| attribute | source |
|---|---|
| `candelabra:lightGroup` | ours |
| `primvars:arnold:aov`, `arnold:aov` | Arnold's light parameter; "default" is no group |
| `karma:light:lpetag`, `inputs:karma:light:lpetag` | Karma |
| `ri:light:lightGroup`, `inputs:ri:light:lightGroup` | RenderMan (hdPrman's light.cpp) |
| `primvars:ri:attributes:identifier:lpegroup` | RenderMan |
| `cycles:lightgroup`, `primvars:cycles:object:lightgroup` | Cycles |
| `moonray:label` | MoonRay's label for light path expressions |
"""

from __future__ import annotations

from pxr import Usd

from .light_attributes import arnold_names, arnold_names_of
from .report import Notebook

_LPE_GROUP = "ri:attributes:identifier:lpegroup"
NAMES = (
    "candelabra:lightGroup",
    *arnold_names("aov"),
    "karma:light:lpetag", "inputs:karma:light:lpetag",
    "ri:light:lightGroup", "inputs:ri:light:lightGroup",
    f"primvars:{_LPE_GROUP}", _LPE_GROUP,
    "cycles:lightgroup", "primvars:cycles:object:lightgroup",
    "moonray:label",
)  # fmt: skip
"""All attributes that are read here; the first that is authored counts."""

_NONE = ("", "default")
"""What says that a light is in no group."""


def read_group(prim: Usd.Prim, code: float, report: Notebook) -> str | None:
    """The group's name, or None; attributes that name another are reported."""
    names = (NAMES[0], *arnold_names_of(prim, "aov"), *NAMES[3:])
    said = [(name, value) for name in names if (value := _value(prim, name, code, report)) is not None]
    for name, value in said[1:]:
        if value != said[0][1]:
            why = f"it names {value!r}; {said[0][0]} names {said[0][1]!r}, which is used"
            report.warn(prim.GetPath(), f"{name} overruled", why)
    if not said or said[0][1] in _NONE:
        return None
    report.note(prim.GetPath(), said[0][0], f"the light is in light group {said[0][1]!r}")
    return said[0][1]


def _value(prim: Usd.Prim, name: str, code: float, report: Notebook) -> str | None:
    attribute = prim.GetAttribute(name)
    value = attribute.Get(code) if attribute and attribute.HasAuthoredValue() else None
    if value is None:
        return None
    # Arnold's plug-ins write an array of one value where they mean the value.
    if not isinstance(value, str) and hasattr(value, "__len__") and len(value) == 1:
        value = value[0]
    if not isinstance(value, str):
        report.warn(prim.GetPath(), f"{name} of a wrong type", f"it is {value!r}; it is ignored")
        return None
    return value
