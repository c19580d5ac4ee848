"""UsdLux's inputs and formulas.

    L = intensity * 2^exposure * color * (BB(colorTemperature) if enabled) / sizeFactor

in nits (usdLux/schema.usda, "Quantities and Units"). What is read here leaves out the sizeFactor,
which depends on where an instance of the light stands (`light_carriers`).

The diffuse and specular multipliers are no part of the formula: the light is as bright as ever to who looks at it, and
surfaces reflect it by them (`extras.usdLux`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from pxr import Sdf, Usd, UsdLux

from . import light_groups, light_visibility
from .arnold_placement import placement_names
from .gltf_document import number
from .light_attributes import LightAttributes, arnold_names, arnold_names_of, is_arnolds_mesh_light, is_finite
from .light_filters import FilterReader, LightFilters
from .light_losses import report_losses
from .light_networks import Computed, LightNetworks
from .light_shaping import IesProfile, Shaping, read_shapings
from .report import Notebook
from .stage import Frames
from .vendors import report_others

SIZES = {
    "RectLight": ("width", "height"),
    "DiskLight": ("radius",),
    "SphereLight": ("radius",),
    "CylinderLight": ("length", "radius"),
}
"""Size inputs of the intrinsic area lights, in local units."""

_AXES = {
    "RectLight": ("width", "height", None),
    "DiskLight": ("radius", "radius", "radius"),
    "SphereLight": ("radius", "radius", "radius"),
    "CylinderLight": ("length", "radius", "radius"),
}
"""Which size stretches the shape along X, Y and Z."""

_THINNEST = 1e-6
"""A size that shrinks to 0 shrinks to this share of its largest: a matrix of scale 0 has no axes."""

_BRIGHTNESS = ("intensity", "exposure", "color", "enableColorTemperature", "colorTemperature")


@dataclass
class Light:
    """A light prim, read: everything but where it stands."""

    path: str
    type: str
    rgb: np.ndarray
    """Emission before the sizeFactor: (3,), or (frames, 3) if it is animated."""
    normalize: np.ndarray
    """Whether the sizeFactor applies: (), or (frames,) if it is animated."""
    size: dict[str, float] = field(default_factory=dict)
    """Its size in local units; where it is animated, the largest of all frames."""
    stretch: np.ndarray | None = None
    """(frames, 4, 4): what `size` is scaled by, if it is animated."""
    shaping: dict | None = None
    profile: IesProfile | None = None
    angle_deg: float = 0.0
    """Full angle of a DistantLight."""
    is_point: bool = False
    """Whether `treatAsPoint` is set."""
    is_line: bool = False
    """Whether `treatAsLine` is set."""
    force: bool = False
    casts_shadows: bool = True
    """`shadow:enable`: whether anything casts shadows from it."""
    texture: Usd.Attribute | None = None
    texture_format: str = "automatic"
    texels: np.ndarray | None = None
    """A picture that a network computes, (h, w, 3), which then takes the place of `texture`."""
    pole_z: bool = False
    material_sync: str = "noMaterialResponse"
    inputs: dict = field(default_factory=dict)
    visibility: dict = field(default_factory=dict)
    others: list[Light] = field(default_factory=list)
    """The lights in its place that it is at other times, if its shaping changes (`light_shaping`)."""
    lit_at: float | None = None
    """If there are others, the first time code at which it is the one that shines."""
    response: dict[str, float] = field(default_factory=dict)
    """How much of it surfaces reflect, `diffuse` and `specular`, where that is not 1."""
    group: str | None = None
    """The light group that it is in, if the stage names one."""

    @property
    def extras(self) -> dict:
        """The part of `extras.usdLux` that does not depend on where the light stands."""
        # A DomeLight_1 differs by its pole axis only, which is in the node's matrix by now.
        kind = "DomeLight" if self.type == "DomeLight_1" else self.type
        extras: dict = {"type": kind, "inputs": self.inputs}
        if self.shaping is not None:
            extras["shaping"] = self.shaping
        if self.force:
            extras["force"] = True
        if self.visibility:
            extras["visibility"] = self.visibility
        if self.group is not None:
            extras["group"] = self.group
        extras.update(self.response)
        return extras


def light_type(prim: Usd.Prim) -> str | None:
    """The UsdLux type of a light prim, `MeshLight` and `VolumeLight` by their API; else None."""
    if prim.HasAPI(UsdLux.MeshLightAPI) or is_arnolds_mesh_light(prim):
        return "MeshLight"
    if prim.HasAPI(UsdLux.VolumeLightAPI):
        return "VolumeLight"
    return str(prim.GetTypeName()) or "Light" if prim.HasAPI(UsdLux.LightAPI) else None


def read_light(
    prim: Usd.Prim, kind: str, frames: Frames, networks: LightNetworks, filters: FilterReader, has_fog: bool, report: Notebook
) -> Light:
    """Read all inputs of a light; bad numbers are reported and made harmless. `has_fog` says whether the stage has any."""
    inputs = LightAttributes(prim, frames, report)
    computed = networks.color(inputs, kind)
    light = Light(
        path=str(prim.GetPath()),
        type=kind,
        rgb=_emission(inputs, computed, LightFilters(inputs, kind, filters)),
        texels=None if computed is None else computed.texels,
        normalize=_track([bool(inputs.at("normalize", code)) for code in _codes(inputs, "normalize")]),
        # The schema names these without `inputs:`.
        is_point=kind == "SphereLight" and _flag(prim, "treatAsPoint", frames),
        is_line=kind == "CylinderLight" and _flag(prim, "treatAsLine", frames),
        force=_flag(prim, "candelabra:force", frames),
        casts_shadows=bool(inputs.still("shadow:enable")),
        material_sync="independent" if inputs.is_arnolds else str(prim.GetAttribute("light:materialSyncMode").Get() or "noMaterialResponse"),
        inputs=_verbatim(inputs),
        response=_response(inputs),
        visibility=light_visibility.read_visibility(prim, kind, frames.first, report),
        group=light_groups.read_group(prim, frames.first, report),
    )
    _measure(light, inputs)
    if kind in ("RectLight", "DomeLight", "DomeLight_1"):
        light.texture = inputs.asset("texture:file")
        light.texture_format = str(inputs.first("texture:format"))
        if computed is not None and not computed.is_tinted:
            light.texture = None
    if kind == "DomeLight_1":
        pole = prim.GetAttribute("poleAxis").Get() or "scene"
        up = prim.GetStage().GetMetadata("upAxis")
        light.pole_z = pole == "Z" or (pole == "scene" and up == "Z")
    _shape(light, read_shapings(inputs, kind), frames)
    report_losses(inputs)
    if inputs.is_arnolds:
        _report_arnolds(inputs, light)
        return light
    read = inputs.names | light_visibility.NAMES | set(light_groups.NAMES)
    read |= {"filters", "treatAsPoint", "treatAsLine"} | placement_names(prim)
    report_others(prim, read, frames.first, report, _in_arnolds_words(light, inputs), _idle(kind, has_fog))
    return light


def _report_arnolds(inputs: LightAttributes, light: Light) -> None:
    """What of a mesh light of Arnold's is read in another way than Arnold's."""
    prim, code, report = inputs.prim, inputs.frames.first, inputs.report
    report.note(inputs.path, "primvars:arnold:light", "the mesh is a light, beside what its material is")
    values = (prim.GetAttribute(name).Get(code) for name in arnold_names_of(prim, "camera") if prim.HasAttribute(name))
    if light.visibility.get("camera", True) and next(values, 0) != 1:
        why = "Arnold's camera sees the mesh without its light; here it sees the light, too"
        report.warn(inputs.path, "camera of a mesh light", why)
    prefixes = arnold_names("light:")
    others = {p.GetName() for p in prim.GetAuthoredProperties() if not p.GetName().startswith(prefixes)}
    known = {name for parameter in ("camera", "aov", "shaders") for name in arnold_names_of(prim, parameter)}
    report_others(prim, inputs.names | known | others, code, report, {}, _idle("MeshLight", False))


def _in_arnolds_words(light: Light, inputs: LightAttributes) -> dict[str, object]:
    """What Arnold's parameters are, computed of the light's inputs as arnold-usd does it (read_light.cpp)."""
    if light.type != "RectLight":
        return {}
    x, y = (inputs.size(name, inputs.frames.first) / 2 for name in ("width", "height"))
    return {"vertices": [(x, -y, 0.0), (-x, -y, 0.0), (-x, y, 0.0), (x, y, 0.0)]}


def _shape(light: Light, shapings: list[Shaping], frames: Frames) -> None:
    """Give the light its shaping; if it has several, it becomes as many lights."""
    rgb, found = light.rgb, []
    for shaping in shapings:
        shaped = light if not found else replace(light)
        shaped.shaping, shaped.profile, shaped.angle_deg = shaping.cone, shaping.profile, shaping.angle_deg
        if shaping.lit is not None:
            shaped.rgb = np.where(shaping.lit[:, None], rgb, 0.0)
            shaped.lit_at = frames.codes[int(np.flatnonzero(shaping.lit)[0])]
        found.append(shaped)
    light.others = [other for other in found[1:] if other.rgb.any()]


def _idle(kind: str, has_fog: bool) -> set[str]:
    """Arnold's parameters that a light of this kind has no use for, or none in this stage."""
    return ({"angle"} if kind != "DistantLight" else set()) | (set() if has_fog else {"volume", "cast_volumetric_shadows"})


def _measure(light: Light, inputs: LightAttributes) -> None:
    """The light's size; one that is animated becomes the largest, and a scale for each frame."""
    names = SIZES.get(light.type, ())
    codes = _codes(inputs, *names)
    rows = {name: np.array([inputs.size(name, code) for code in codes]) for name in names}
    light.size = {name: float(row.max()) for name, row in rows.items()}
    if any((row != row[0]).any() for row in rows.values()):
        light.stretch = np.tile(np.eye(4), (len(codes), 1, 1))
        for axis, name in enumerate(_AXES[light.type]):
            if name is not None and light.size[name] > 0:
                light.stretch[:, axis, axis] = np.maximum(rows[name] / light.size[name], _THINNEST)


def _codes(inputs: LightAttributes, *names: str) -> tuple[float, ...]:
    """All time codes if one of the inputs may vary, else the first frame."""
    attributes = (inputs.attribute(name) for name in names)
    varying = any(attribute and attribute.ValueMightBeTimeVarying() for attribute in attributes)
    return inputs.frames.codes if varying else (inputs.frames.first,)


def _track(values: list) -> np.ndarray:
    """An array of one value for each frame, or one value if all are the same."""
    array = np.array(values)
    return array[0] if (array == array[0]).all() else array


def _flag(prim: Usd.Prim, name: str, frames: Frames) -> bool:
    attribute = prim.GetAttribute(name)
    return bool(attribute.Get(frames.first)) if attribute else False


def _emission(inputs: LightAttributes, computed: Computed | None, filters: LightFilters) -> np.ndarray:
    """intensity * 2^exposure * color * temperature, and what filters multiply it by; one row for each frame if it varies."""
    varies = filters.vary or (computed is not None and computed.rows.ndim == 2)
    codes = inputs.frames.codes if varies else _codes(inputs, *_BRIGHTNESS)
    rows = np.array([filters.factor(code) * _emission_at(inputs, computed, code) for code in codes])
    good = np.isfinite(rows) & (rows >= 0) & (rows <= float(np.finfo(np.float32).max))
    if not good.all():
        inputs.report.warn(
            inputs.path,
            "emission is negative or not finite",
            "intensity, exposure, color and temperature give "
            f"{rows[~good.all(axis=1)][0].tolist()}; 0 is used for such components",
        )
        rows = np.where(good, rows, 0.0)
    return rows[0] if (rows == rows[0]).all() else rows


def _emission_at(inputs: LightAttributes, computed: Computed | None, code: float) -> np.ndarray:
    exposure = inputs.at("exposure", code)
    scale = inputs.at("intensity", code) * (2.0**exposure if abs(exposure) < 1000 else math.nan)
    color = inputs.color(code) if computed is None else computed.at(inputs.frames, code)
    if inputs.at("enableColorTemperature", code) and (computed is None or computed.is_tinted):
        kelvin = inputs.at("colorTemperature", code)
        if not is_finite(kelvin):
            return np.full(3, math.nan)
        if not 1000 <= kelvin <= 10000:
            why = f"{kelvin:g} K is outside UsdLux's 1000 to 10000 K; it has the colour of the nearer end, as in USD itself"
            inputs.report.note(inputs.path, "color temperature out of range", why)
        color = color * np.array(UsdLux.BlackbodyTemperatureAsRgb(kelvin), dtype=float)
    with np.errstate(invalid="ignore", over="ignore"):
        return scale * color


def _response(inputs: LightAttributes) -> dict[str, float]:
    """The multipliers of what surfaces reflect, those that are not 1."""
    response = {}
    for name in ("diffuse", "specular"):
        value = float(inputs.still(name))
        if not 0 <= value <= float(np.finfo(np.float32).max):
            why = f"it is {value}; 0 is used"
            inputs.report.warn(inputs.path, f"inputs:{name} is negative or not finite", why)
            value = 0.0
        if value != 1.0:
            response[name] = number(value)
    return response


def _verbatim(inputs: LightAttributes) -> dict:
    """Authored inputs at the first frame as JSON values, for people and for diffs."""
    prim, code = inputs.prim, inputs.frames.first
    authored = {}
    for attribute in prim.GetAuthoredPropertiesInNamespace("inputs"):
        if isinstance(attribute, Usd.Attribute):
            authored[attribute.GetName().removeprefix("inputs:")] = _json(attribute.Get(code))
    for name in ("light:materialSyncMode", "poleAxis", "treatAsPoint", "treatAsLine", *sorted(inputs.used)):
        attribute = prim.GetAttribute(name)
        if attribute and attribute.HasAuthoredValue():
            authored.setdefault(name, _json(attribute.Get(code)))
    return dict(sorted(authored.items()))


def _json(value):
    """A USD value as JSON; what JSON cannot say becomes a string."""
    if isinstance(value, bool | int | str) or value is None:
        return value
    if isinstance(value, float):
        return float(f"{value:.9g}") if math.isfinite(value) else str(value)
    if isinstance(value, Sdf.AssetPath):
        return value.path
    try:
        return [_json(item) for item in value]
    except TypeError:
        return str(value)
