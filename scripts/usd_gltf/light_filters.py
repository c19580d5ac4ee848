"""Light filters: what only multiplies a light is put into it; all others are reported, and leave the light as it is.

| filter | meaning | source |
|---|---|---|
| `PxrIntMultLightFilter` | times `intensity * 2^exposure`, or over that with `invert` | RenderMan's documentation; hdPrman (lightFilterUtils.cpp) reads no `density` and no `combineMode` of it |
| `arnold:light_decay` without near and far attenuation; `arnold:light_blocker` of density 0 | nothing | Arnold's user guide |
| `LightFilter` without `lightFilter:shaderId` | nothing | usdLux/schema.usda |

A filter link multiplies for some geometry alone. Then the filter is lost, unless it holds everything.
"""  # noqa: E501

from __future__ import annotations

import math

from pxr import Sdf, Usd, UsdShade

from .light_attributes import LightAttributes
from .light_networks import SHADERS, connected, graph_of
from .stage import changes

MULTIPLIER = "PxrIntMultLightFilter"
_NEUTRAL = {"diffuse": 1.0, "specular": 1.0, "saturation": 1.0, "colorSaturation": 1.0}
_READ = ("intensity", "exposure", "invert")
_WITHOUT_MEANING = ("density", "combineMode")
_MOST_IN_A_GRAPH = 64


class LightFilters:
    """The filters of one light."""

    def __init__(self, inputs: LightAttributes) -> None:
        self.inputs = inputs
        self._multipliers: list[Usd.Prim] = []
        prim, lost = inputs.prim, []
        for target in _targets(prim):
            found = prim.GetStage().GetPrimAtPath(target)
            if found and found.GetTypeName() == MULTIPLIER and not _why_not(found):
                self._multipliers.append(found)
            elif not (found and _is_idle(found)):
                lost.append(f"{target} ({_why_not(found) if found else 'it is not there'})")
        for name in SHADERS:
            graph = graph_of(prim, name)
            shaders = [shader for shader in _arnold_filters(graph)] if graph else []
            lost += [f"{shader.GetPath()} ({shader.GetIdAttr().Get()})" for shader in shaders if not _is_idle(shader.GetPrim())]
        if lost:
            why = f"they have no carrier; the light is exported without {', '.join(dict.fromkeys(lost))}"
            inputs.report.warn(inputs.path, "light filters", why)
        for found in self._multipliers:
            why = "it multiplies the light, and is put into it"
            inputs.report.note(inputs.path, f"light filter {found.GetPath()}", why)

    @property
    def vary(self) -> bool:
        """Whether the factor may depend on the time."""
        return any(changes(attribute, self.inputs.frames) for prim in self._multipliers for attribute in prim.GetAuthoredAttributes())

    def factor(self, code: float) -> float:
        """What the filters multiply the light by at a time code."""
        return math.prod(_multiplier(prim, code) for prim in self._multipliers)


def _targets(light: Usd.Prim) -> list[Sdf.Path]:
    # Files before USD 21.02 say `filters`.
    relationships = (light.GetRelationship(name) for name in ("light:filters", "filters"))
    return list(dict.fromkeys(path for found in relationships if found for path in found.GetForwardedTargets()))


def _arnold_filters(graph: Usd.Prim) -> list[UsdShade.Shader]:
    names = ["outputs:filters", *(f"outputs:filters:i{number}" for number in range(1, _MOST_IN_A_GRAPH + 1))]
    outputs = (connected(graph, name) for name in names)
    return [UsdShade.Shader(output.GetPrim()) for output in outputs if output is not None]


def _is_idle(prim: Usd.Prim) -> bool:
    """Whether a filter does nothing."""
    if prim.GetTypeName() == "LightFilter":
        return not prim.GetAttribute("lightFilter:shaderId").Get()
    shader = UsdShade.Shader(prim)
    kind = str(shader.GetIdAttr().Get() or "") if shader else ""
    if kind == "arnold:light_decay":
        return not any(_given(prim, f"inputs:{name}", False) for name in ("use_near_atten", "use_far_atten"))
    return kind == "arnold:light_blocker" and _given(prim, "inputs:density", 1.0) == 0.0


def _given(prim: Usd.Prim, name: str, default: object) -> object:
    """A constant; true if it is connected, so that nobody takes it for idle."""
    attribute = prim.GetAttribute(name)
    if attribute and attribute.HasAuthoredConnections():
        return True
    value = attribute.Get(Usd.TimeCode.EarliestTime()) if attribute else None
    return default if value is None else value


def _why_not(prim: Usd.Prim) -> str:
    """Why a filter does not only multiply; empty if that is all that it does."""
    if prim.GetTypeName() != MULTIPLIER:
        return str(prim.GetTypeName()) or "it has no type"
    for attribute in prim.GetAuthoredAttributes():
        words = attribute.GetName().split(":")
        if words[0] in ("collection", "ui", "xformOp", "visibility", "purpose", "xformOpOrder"):
            continue
        name = words[-1]
        if attribute.HasAuthoredConnections():
            return f"its {name} is connected"
        if name in _NEUTRAL and attribute.Get(Usd.TimeCode.EarliestTime()) != _NEUTRAL[name]:
            return f"its {name} is {attribute.Get(Usd.TimeCode.EarliestTime())}"
        if name not in (*_READ, *_NEUTRAL, *_WITHOUT_MEANING) and words[0] in ("inputs", "ri"):
            return f"nobody knows its {name}"
    links = {p.GetBaseName(): p for p in prim.GetAuthoredPropertiesInNamespace("collection:filterLink")}
    root = links.pop("includeRoot", None)
    links.pop("expansionRule", None)
    return "it is linked to some geometry alone" if links or (root and not root.Get()) else ""


def _multiplier(prim: Usd.Prim, code: float) -> float:
    values = {"intensity": 1.0, "exposure": 0.0, "invert": False}
    for attribute in prim.GetAuthoredAttributes():
        name = attribute.GetName().split(":")[-1]
        value = attribute.Get(code)
        if name in values and isinstance(value, bool | int | float):
            values[name] = value
    exposure = float(values["exposure"])
    factor = float(values["intensity"]) * (2.0**exposure if abs(exposure) < 1000 else math.nan)
    if not values["invert"]:
        return factor
    return 1 / factor if factor else math.nan
