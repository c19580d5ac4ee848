"""Light filters: what only multiplies a light is put into it, what `filter_kinds` can carry stands at a node that the light
names, all others are reported and leave the light as it is.

| filter | meaning | source |
|---|---|---|
| `PxrIntMultLightFilter` | times `intensity * 2^exposure`, or over that with `invert` | RenderMan's documentation; hdPrman (lightFilterUtils.cpp) reads no `density` and no `combineMode` of it |
| `arnold:light_decay` without near and far attenuation; `arnold:light_blocker` of density 0 | nothing | Arnold's user guide |
| `LightFilter` without `lightFilter:shaderId`; one that is inactive or invisible | nothing | usdLux/schema.usda; hdPrman (light.cpp) |

A filter with a filter link multiplies for some geometry alone (`linking`). So a `PxrIntMultLightFilter` that has one stands at a
node, too; it is not put into the light.
"""  # noqa: E501

from __future__ import annotations

import math
from collections.abc import Iterator

from pxr import Sdf, Usd, UsdShade

from .filter_kinds import BLOCKER, DECAY, Lost, carrier, combines, is_hidden, is_linked, kind_of, varying
from .gltf_document import numbers
from .light_attributes import LightAttributes, arnold_names_of
from .light_networks import connected, graph_of
from .stage import Frames, changes

MULTIPLIER = "PxrIntMultLightFilter"
_NEUTRAL = {"diffuse": 1.0, "specular": 1.0, "saturation": 1.0, "colorSaturation": 1.0}
_READ = ("intensity", "exposure", "invert")
_WITHOUT_MEANING = ("density", "combineMode")
_MOST_IN_A_GRAPH = 64
_PLACED_NOWHERE = ("DistantLight", "DomeLight", "DomeLight_1")


class FilterReader:
    """Reads the filters of a stage that stand at nodes, each once."""

    def __init__(self, frames: Frames, meters_per_unit: float) -> None:
        self.frames, self.meters_per_unit = frames, meters_per_unit
        self._read: dict[Usd.Prim, dict | str] = {}

    def carrier(self, prim: Usd.Prim) -> dict | str:
        """`extras.usdLightFilter` of a filter, or why it has none."""
        if prim not in self._read:
            try:
                is_multiplier = kind_of(prim) == MULTIPLIER and is_linked(prim)
                read = _linked_multiplier if is_multiplier else carrier
                self._read[prim] = read(prim, self.frames.first, self.meters_per_unit)
            except Lost as lost:
                self._read[prim] = str(lost)
        return self._read[prim]

    def of_light(self, prim: Usd.Prim, kind: str) -> dict | str:
        """The same of a filter of a light of some kind."""
        return _why_lost(prim, kind, self.frames.first) or self.carrier(prim)

    def carried(self, light: Usd.Prim, kind: str) -> list[Usd.Prim]:
        """The filters of a light that stand at nodes."""
        return [prim for prim in filters_of(light, self.frames.first) if isinstance(self.of_light(prim, kind), dict)]


class LightFilters:
    """The filters of one light."""

    def __init__(self, inputs: LightAttributes, kind: str, reader: FilterReader) -> None:
        self.inputs = inputs
        self._multipliers: list[Usd.Prim] = []
        prim, lost = inputs.prim, []
        for target in _targets(prim):
            if not prim.GetStage().GetPrimAtPath(target):
                lost.append(f"{target} (it is not there)")
        for found in filters_of(prim, inputs.frames.first):
            if kind_of(found) == MULTIPLIER and not is_linked(found) and not _why_not(found):
                self._multipliers.append(found)
                continue
            read = reader.of_light(found, kind)
            if isinstance(read, str):
                lost.append(f"{found.GetPath()} ({read})")
            else:
                self._say(found, read)
        if lost:
            why = f"they have no carrier; the light is exported without {', '.join(dict.fromkeys(lost))}"
            inputs.report.warn(inputs.path, "light filters", why)
        for found in self._multipliers:
            why = "it multiplies the light, and is put into it"
            inputs.report.note(inputs.path, f"light filter {found.GetPath()}", why)

    def _say(self, found: Usd.Prim, extras: dict) -> None:
        """Report what of a filter that is carried is not as the stage says."""
        report, path = self.inputs.report, found.GetPath()
        names = varying(found, self.inputs.frames)
        if names:
            report.warn(path, "animated light filter", f"of {', '.join(names)} the first frame's values are used")
        if any(start < end for start, end in (extras[name] for name in ("near", "far") if name in extras)):
            why = 'Arnold\'s user guide says that it fades by "a smooth ramp", but not by which; it is a smoothstep'
            report.warn(path, "ramp of a light_decay", why)
        if len(extras.get("ramp", ())) > 6:
            why = "its falloff is a spline of places and values, as OSL has it; RenderMan's documentation does not say which"
            report.note(path, "falloff of a light filter", why)
        report.note(path, "light filter", "it is carried")

    @property
    def vary(self) -> bool:
        """Whether the factor may depend on the time."""
        return any(changes(attribute, self.inputs.frames) for prim in self._multipliers for attribute in prim.GetAuthoredAttributes())

    def factor(self, code: float) -> float:
        """What the filters multiply the light by at a time code."""
        return math.prod(_multiplier(prim, code) for prim in self._multipliers)


def filters_of(light: Usd.Prim, code: float) -> list[Usd.Prim]:
    """The filters of a light that do something: prims of filters, and Arnold's shaders."""
    found = dict.fromkeys(_all_of(light))
    return [prim for prim in found if not _is_idle(prim) and not is_hidden(prim, code)]


def _why_lost(found: Usd.Prim, kind: str, code: float) -> str:
    """Why a light of some kind cannot have a filter, whatever that does; empty if it can."""
    if kind_of(found) == MULTIPLIER:
        return _why_not(found)
    if kind_of(found) == DECAY and kind in _PLACED_NOWHERE:
        return "its light is at no distance"
    if combines(found, code):
        return "it is combined with others"
    return ""


def _all_of(light: Usd.Prim) -> Iterator[Usd.Prim]:
    stage = light.GetStage()
    for target in _targets(light):
        found = stage.GetPrimAtPath(target)
        if found and found.IsA(UsdShade.Material):
            outputs = (connected(found, name) for name in ("outputs:arnold:surface", "outputs:surface"))
            found = next((output.GetPrim() for output in outputs if output is not None), found)
        if found:
            yield found
    for name in arnold_names_of(light, "shaders"):
        graph = graph_of(light, name)
        names = ["outputs:filters", *(f"outputs:filters:i{number}" for number in range(1, _MOST_IN_A_GRAPH + 1))]
        outputs = (connected(graph, name) for name in names) if graph else ()
        yield from (output.GetPrim() for output in outputs if output is not None)


def _targets(light: Usd.Prim) -> list[Sdf.Path]:
    # Files before USD 21.02 say `filters`.
    relationships = (light.GetRelationship(name) for name in ("light:filters", "filters"))
    return list(dict.fromkeys(path for found in relationships if found for path in found.GetForwardedTargets()))


def _is_idle(prim: Usd.Prim) -> bool:
    """Whether a filter does nothing."""
    kind = kind_of(prim)
    if kind == "LightFilter" or not prim.IsActive():
        return True
    if kind == DECAY:
        return not any(_given(prim, f"inputs:{name}", False) for name in ("use_near_atten", "use_far_atten"))
    return kind == BLOCKER and _given(prim, "inputs:density", 1.0) == 0.0


def _given(prim: Usd.Prim, name: str, default: object) -> object:
    """A constant; true if it is connected, so that nobody takes it for idle."""
    attribute = prim.GetAttribute(name)
    if attribute and attribute.HasAuthoredConnections():
        return True
    value = attribute.Get(Usd.TimeCode.EarliestTime()) if attribute else None
    return default if value is None else value


def _why_not(prim: Usd.Prim) -> str:
    """Why a multiplier does not only multiply; empty if that is all that it does."""
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
    return ""


def _linked_multiplier(prim: Usd.Prim, code: float, _meters_per_unit: float) -> dict:
    factor = _multiplier(prim, code)
    if not 0 <= factor < 1e30:
        raise Lost(f"it multiplies by {factor:g}")
    return {"type": "multiplier", "share": numbers([factor] * 3)}


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
