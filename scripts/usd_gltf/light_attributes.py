"""Where the value of a light's input is authored, under whichever name.

UsdLux has named its inputs `inputs:intensity` since USD 21.02. Older files say `intensity`, and
arnold-usd reads `primvars:arnold:intensity` on a UsdLux light besides (`ReadArnoldParameters` in its
read_light.cpp). `LightAttributes` takes the first name that has an authored value, in that order,
and reports every name but the first.

A mesh with `primvars:arnold:light` is a mesh light of Arnold's, whose parameters are below that name
(`ReadMeshLight` in arnold-usd's read_geometry.cpp). They are all that is read of it.
"""

from __future__ import annotations

import functools
import math

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade

from .color_spaces import is_known, to_rec709
from .report import Notebook
from .stage import Frames, changes

FALLBACKS = {
    "intensity": 1.0, "exposure": 0.0, "color": Gf.Vec3f(1), "normalize": False,
    "enableColorTemperature": False, "colorTemperature": 6500.0, "width": 1.0, "height": 1.0,
    "length": 1.0, "radius": 0.5, "angle": 0.53, "diffuse": 1.0, "specular": 1.0,
    "shadow:enable": True, "shadow:color": Gf.Vec3f(0), "shadow:distance": -1.0,
    "shadow:falloff": -1.0, "shadow:falloffGamma": 1.0,
    "shaping:focus": 0.0, "shaping:focusTint": Gf.Vec3f(0), "shaping:cone:angle": 180.0,
    "shaping:cone:softness": 0.0, "shaping:ies:angleScale": 0.0, "shaping:ies:normalize": False,
    "shaping:ies:file": None, "texture:file": None, "texture:format": "automatic",
}  # fmt: skip
"""The inputs that are read, and what they are without a schema: no shaping without ShapingAPI, so
no cone of 90 degrees either."""

_OF_THE_SCHEMA = ("width", "height", "length", "radius", "angle", "texture:file", "texture:format")
"""Inputs that only lights have whose schema has them."""
_ARNOLD = {
    "intensity": "intensity", "exposure": "exposure", "color": "color", "normalize": "normalize",
    "angle": "angle", "radius": "radius", "diffuse": "diffuse", "specular": "specular",
    "shadow:enable": "cast_shadows", "shadow:color": "shadow_color",
}  # fmt: skip
"""Arnold's light parameters that mean what a UsdLux input means."""


def arnold_names(parameter: str) -> tuple[str, str]:
    """The attributes that arnold-usd reads, or has read, for a parameter."""
    return f"primvars:arnold:{parameter}", f"arnold:{parameter}"


def is_arnolds_mesh_light(prim: Usd.Prim) -> bool:
    """Whether Arnold alone makes a light of a mesh."""
    if prim.HasAPI(UsdLux.MeshLightAPI) or not prim.IsA(UsdGeom.Mesh):
        return False
    return any(prim.GetAttribute(name).Get(Usd.TimeCode.EarliestTime()) for name in arnold_names("light") if prim.HasAttribute(name))


def arnold_names_of(prim: Usd.Prim, parameter: str) -> tuple[str, str]:
    """The attributes that give a light prim one of Arnold's parameters."""
    return arnold_names(f"light:{parameter}" if is_arnolds_mesh_light(prim) else parameter)


class LightAttributes:
    """The inputs of one light prim."""

    def __init__(self, prim: Usd.Prim, frames: Frames, report: Notebook) -> None:
        self.prim, self.frames, self.report = prim, frames, report
        self.path = prim.GetPath()
        self.is_arnolds = is_arnolds_mesh_light(prim)
        """Whether it is a mesh light of Arnold's; these are normalized if nothing else is authored."""
        self.color_link: Usd.Attribute | None = None
        """`inputs:color`, if a shader's output is connected to it."""
        self.color_output: Usd.Attribute | None = None
        self.known: set[str] = set()
        """Other names that something else reads."""
        self.used: set[str] = set()
        """The names, other than `inputs:`, whose values are used or known to be overruled."""
        self._found = {name: self._find(name) for name in FALLBACKS}

    @property
    def names(self) -> set[str]:
        """All attributes that are read here, or known to be overruled."""
        everywhere = {f"inputs:{name}" for name in FALLBACKS if name not in _OF_THE_SCHEMA}
        return self.used | self.known | everywhere

    def attribute(self, name: str) -> Usd.Attribute | None:
        """The attribute that gives the input `name` its value."""
        return self._found[name]

    def is_authored(self, name: str) -> bool:
        """Whether any layer gives the input a value."""
        attribute = self._found[name]
        return attribute is not None and attribute.HasAuthoredValue()

    def varies(self, name: str) -> bool:
        """Whether the input differs between two of the frames."""
        return changes(self._found[name], self.frames)

    def at(self, name: str, code: float):
        """Value at a time code; the fallback where there is none, or none of a fitting type."""
        attribute = self._found[name]
        value = attribute.Get(code) if attribute else None
        fallback = True if self.is_arnolds and name == "normalize" else FALLBACKS[name]
        if value is None or fallback is None:
            return fallback if value is None else value
        fitting = _like(fallback, value)
        if fitting is None:
            why = f"it is {value!r}, of type {attribute.GetTypeName()}; {fallback} is used"
            self.report.warn(self.path, f"{attribute.GetName()} of a wrong type", why)
            return fallback
        return fitting

    def color(self, code: float) -> np.ndarray:
        """`color` at a time code in linear Rec. 709: of the colour space that the attribute says, or what is above it."""
        value = np.array(self.at("color", code), dtype=float)
        return to_rec709(self._color_space, value) if self._color_space else value

    @functools.cached_property
    def _color_space(self) -> str:
        """That of `color`; empty for linear Rec. 709, and (reported) for one that is not known."""
        attribute = self._found["color"]
        space = str(Usd.ColorSpaceAPI.ComputeColorSpaceName(attribute, None) or "") if attribute else ""
        if is_known(space):
            return space
        if space and space not in ("unknown", "identity"):
            self.report.warn(self.path, f"color space {space}", f"{attribute.GetName()} is taken for linear Rec. 709")
        return ""

    def first(self, name: str):
        """Value at the first frame."""
        return self.at(name, self.frames.first)

    def still(self, name: str):
        """Value at the first frame, of an input without a carrier for change (reported)."""
        if self.varies(name):
            why = "it has no carrier; the first frame's value is used"
            self.report.warn(self.path, f"animated {self._found[name].GetName()}", why)
        return self.first(name)

    def size(self, name: str, code: float) -> float:
        """A length or an angle at a time code, finite and not negative."""
        value = float(self.at(name, code))
        if not 0 <= value < 1e30:
            self.report.warn(self.path, f"inputs:{name} is not a size", f"it is {value}; 0 is used")
            return 0.0
        return value

    def asset(self, name: str) -> Usd.Attribute | None:
        """The attribute of a file input, if it names a file at any frame."""
        attribute = self._found[name]
        if not attribute:
            return None
        codes = self.frames.codes if attribute.ValueMightBeTimeVarying() else (self.frames.first,)
        values = (attribute.Get(code) for code in codes)
        return attribute if any(isinstance(v, Sdf.AssetPath) and v.path for v in values) else None

    def _find(self, name: str) -> Usd.Attribute | None:
        if self.is_arnolds:
            found = map(self.prim.GetAttribute, arnold_names(f"light:{_ARNOLD[name]}") if name in _ARNOLD else ())
            found = [attribute for attribute in found if attribute and attribute.HasAuthoredValue()]
            self.used |= {attribute.GetName() for attribute in found}
            return next(iter(found), None)
        own = self.prim.GetAttribute(f"inputs:{name}")
        own = self._connected(own) if own and own.HasAuthoredConnections() else own
        if not own and name in _OF_THE_SCHEMA:
            return None
        # A Sphere that is a mesh light has a `radius` of its own.
        geometric = name in self.prim.GetPrimDefinition().GetPropertyNames()
        others = [] if geometric else [self.prim.GetAttribute(name)]
        # A dome has nothing to be normalized by.
        is_dome = str(self.prim.GetTypeName()).startswith("DomeLight")
        if name in _ARNOLD and not (is_dome and name == "normalize"):
            others += [self.prim.GetAttribute(arnold) for arnold in arnold_names(_ARNOLD[name])]
        others = [attribute for attribute in others if attribute and attribute.HasAuthoredValue()]
        authored = own if own and own.HasAuthoredValue() else None
        for other in others:
            self.used.add(other.GetName())
            old = other.GetName() == name
            if authored is None:
                authored = other
                why = (
                    f"files before USD 21.02 name inputs:{name} so; it is read as such"
                    if old
                    else f"it is read as inputs:{name}, which is not authored"
                )
                self.report.note(self.path, f"old attribute {name}" if old else other.GetName(), why)
            elif other.Get(self.frames.first) != authored.Get(self.frames.first):
                why = f"it is {other.Get(self.frames.first)}, but {authored.GetName()} is "
                why += f"{authored.Get(self.frames.first)}, which is used"
                self.report.warn(self.path, f"{other.GetName()} overruled", why)
        return authored or own or None

    def _connected(self, own: Usd.Attribute) -> Usd.Attribute:
        """What a connected input reads if that is a constant; else (reported) the input itself."""
        sources = UsdShade.Utils.GetValueProducingAttributes(UsdShade.Input(own))
        if sources and not UsdShade.Output.IsOutput(sources[0]):
            return sources[0]
        if sources and own.GetName() == "inputs:color":
            self.color_link, self.color_output = own, sources[0]
            return own
        used = "its own value" if own.HasAuthoredValue() else "the schema's value"
        why = f"shader networks on lights have no carrier; {used} is used, and the light may be too bright"
        self.report.warn(self.path, f"connected {own.GetName()}", why)
        return own


def _like(fallback, value):
    """`value` in the type of `fallback`; None if it cannot be."""
    try:
        if isinstance(fallback, bool):
            return bool(float(value))
        if isinstance(fallback, float):
            return float(value)
        if isinstance(fallback, str):
            return str(value)
        # Arnold's plug-ins write an array of one value where they mean the value.
        numbers = value[0] if len(value) == 1 else value
        return Gf.Vec3f(*(float(c) for c in numbers)) if len(numbers) == 3 else None
    except (TypeError, ValueError, OverflowError):
        return None


def is_finite(*values: float) -> bool:
    """Whether all numbers are finite."""
    return all(map(math.isfinite, values))
