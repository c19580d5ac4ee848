"""UsdLux's inputs and formulas.

    L = intensity * 2^exposure * color * (BB(colorTemperature) if enabled) / sizeFactor

in nits (usdLux/schema.usda, "Quantities and Units"). What is read here leaves out the sizeFactor,
which depends on where an instance of the light stands (`light_carriers`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from pxr import Gf, Sdf, Usd, UsdLux

from .report import Report
from .stage import Frames, changes

SIZES = {
    "RectLight": ("width", "height"),
    "DiskLight": ("radius",),
    "SphereLight": ("radius",),
    "CylinderLight": ("length", "radius"),
}
"""Size inputs of the intrinsic area lights, in local units."""

_FALLBACKS = {
    "intensity": 1.0, "exposure": 0.0, "color": Gf.Vec3f(1), "normalize": False,
    "enableColorTemperature": False, "colorTemperature": 6500.0, "width": 1.0, "height": 1.0,
    "length": 1.0, "radius": 0.5, "angle": 0.53, "diffuse": 1.0, "specular": 1.0,
}  # fmt: skip


@dataclass
class Light:
    """A light prim, read: everything but where it stands."""

    path: str
    type: str
    rgb: np.ndarray
    """Emission before the sizeFactor: (3,), or (frames, 3) if it is animated."""
    normalize: bool
    size: dict[str, float] = field(default_factory=dict)
    shaping: dict | None = None
    angle_deg: float = 0.0
    treat_as_point: bool = False
    force: bool = False
    texture: Usd.Attribute | None = None
    pole_z: bool = False
    material_sync: str = "noMaterialResponse"
    inputs: dict = field(default_factory=dict)

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
        return extras


def light_type(prim: Usd.Prim) -> str | None:
    """The UsdLux type of a light prim, `MeshLight` and `VolumeLight` by their API; else None."""
    if prim.HasAPI(UsdLux.MeshLightAPI):
        return "MeshLight"
    if prim.HasAPI(UsdLux.VolumeLightAPI):
        return "VolumeLight"
    return str(prim.GetTypeName()) or "Light" if prim.HasAPI(UsdLux.LightAPI) else None


def read_light(prim: Usd.Prim, kind: str, frames: Frames, report: Report) -> Light:
    """Read all inputs of a light; bad numbers are reported and made harmless."""
    reader = _Reader(prim, frames, report)
    light = Light(
        path=str(prim.GetPath()),
        type=kind,
        rgb=reader.emission(),
        normalize=bool(reader.at_first("normalize")),
        size={name: reader.size(name) for name in SIZES.get(kind, ())},
        shaping=reader.shaping(kind),
        # The schema names this one without `inputs:`.
        treat_as_point=kind == "SphereLight" and bool(prim.GetAttribute("treatAsPoint").Get(frames.first)),
        force=bool(prim.GetAttribute("candelabra:force").Get(frames.first) or False),
        material_sync=str(prim.GetAttribute("light:materialSyncMode").Get() or "noMaterialResponse"),
        inputs=_verbatim(prim, frames),
    )
    if kind == "DistantLight":
        light.angle_deg = min(max(reader.size("angle"), 0.0), 360.0)
    texture = prim.GetAttribute("inputs:texture:file")
    asset = texture.Get(frames.first) if texture else None
    if asset is not None and asset.path:
        light.texture = texture
    if kind == "DomeLight_1":
        pole = prim.GetAttribute("poleAxis").Get() or "scene"
        up = prim.GetStage().GetMetadata("upAxis")
        light.pole_z = pole == "Z" or (pole == "scene" and up == "Z")
    _report_unsupported(prim, kind, frames, report)
    return light


class _Reader:
    """Reads `inputs:*` of one prim with UsdLux's fallbacks."""

    def __init__(self, prim: Usd.Prim, frames: Frames, report: Report) -> None:
        self.prim, self.frames, self.report = prim, frames, report

    def at(self, name: str, code: float):
        """Value at a time code, the schema's fallback if it has none."""
        attribute = self.prim.GetAttribute(f"inputs:{name}")
        value = attribute.Get(code) if attribute else None
        return _FALLBACKS[name] if value is None else value

    def at_first(self, name: str):
        """Value at the first frame; a value that varies is reported."""
        attribute = self.prim.GetAttribute(f"inputs:{name}")
        if changes(attribute, self.frames):
            self.report.warn(self.prim.GetPath(), f"animated inputs:{name}", "the first frame's value is used")
        return self.at(name, self.frames.first)

    def size(self, name: str) -> float:
        """A length or an angle that is finite and not negative."""
        value = float(self.at_first(name))
        if not 0 <= value < 1e30:
            self.report.warn(self.prim.GetPath(), f"inputs:{name} is not a size", f"it is {value}; 0 is used")
            return 0.0
        return value

    def emission(self) -> np.ndarray:
        """intensity * 2^exposure * color * temperature; one row for each frame if it varies."""
        names = ("intensity", "exposure", "color", "enableColorTemperature", "colorTemperature")
        animated = any(
            attribute and attribute.ValueMightBeTimeVarying()
            for attribute in (self.prim.GetAttribute(f"inputs:{name}") for name in names)
        )
        codes = self.frames.codes if animated else self.frames.codes[:1]
        rows = np.array([self._emission_at(code) for code in codes])
        good = np.isfinite(rows) & (rows >= 0) & (rows <= float(np.finfo(np.float32).max))
        if not good.all():
            self.report.warn(
                self.prim.GetPath(),
                "emission is negative or not finite",
                "intensity, exposure, color and temperature give "
                f"{rows[~good.all(axis=1)][0].tolist()}; 0 is used for such components",
            )
            rows = np.where(good, rows, 0.0)
        return rows[0] if len(rows) == 1 or (rows == rows[0]).all() else rows

    def _emission_at(self, code: float) -> np.ndarray:
        exposure = float(self.at("exposure", code))
        scale = float(self.at("intensity", code)) * (2.0**exposure if abs(exposure) < 1000 else math.nan)
        color = np.array(self.at("color", code), dtype=float)
        if self.at("enableColorTemperature", code):
            kelvin = float(self.at("colorTemperature", code))
            if not math.isfinite(kelvin):
                return np.full(3, math.nan)
            if not 1000 <= kelvin <= 10000:
                why = f"{kelvin:g} K is outside UsdLux's 1000 to 10000 K; the nearer end is used"
                self.report.warn(self.prim.GetPath(), "color temperature out of range", why)
            color = color * np.array(UsdLux.BlackbodyTemperatureAsRgb(kelvin), dtype=float)
        with np.errstate(invalid="ignore", over="ignore"):
            return scale * color

    def shaping(self, kind: str) -> dict | None:
        """`extras.usdLux.shaping` in degrees, or None if the light is not shaped."""
        prim = self.prim

        def value(name: str, fallback):
            attribute = prim.GetAttribute(f"inputs:shaping:{name}")
            found = attribute.Get(self.frames.first) if attribute else None
            if changes(attribute, self.frames):
                self.report.warn(prim.GetPath(), f"animated inputs:shaping:{name}", "the first frame's value is used")
            return fallback if found is None else found

        # Without the applied schema there is no fallback of 90 degrees, and no cone.
        cone = float(value("cone:angle", 180.0))
        softness = float(value("cone:softness", 0.0))
        focus = float(value("focus", 0.0))
        tint = [float(c) for c in value("focusTint", (0.0, 0.0, 0.0))]
        if not all(map(math.isfinite, [cone, softness, focus, *tint])):
            self.report.warn(prim.GetPath(), "shaping is not finite", "the light is exported unshaped")
            return None
        cone, focus = min(max(cone, 0.0), 180.0), max(focus, 0.0)
        softness = min(max(softness, 0.0), 1.0) if prim.GetAttribute("inputs:shaping:cone:angle") else 0.0
        widest = 90.0 if kind in ("RectLight", "DiskLight") else 180.0
        if cone >= widest and softness == 0.0 and focus == 0.0:
            return None
        return {
            "coneAngle": cone,
            "coneSoftness": softness,
            "focus": focus,
            "focusTint": [max(c, 0.0) for c in tint],
        }


def _verbatim(prim: Usd.Prim, frames: Frames) -> dict:
    """Authored inputs at the first frame as JSON values, for people and for diffs."""
    authored = {}
    for attribute in prim.GetAuthoredPropertiesInNamespace("inputs"):
        if isinstance(attribute, Usd.Attribute):
            authored[attribute.GetName().removeprefix("inputs:")] = _json(attribute.Get(frames.first))
    for name in ("light:materialSyncMode", "poleAxis"):
        attribute = prim.GetAttribute(name)
        if attribute and attribute.HasAuthoredValue():
            authored[name] = _json(attribute.Get(frames.first))
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


def _report_unsupported(prim: Usd.Prim, kind: str, frames: Frames, report: Report) -> None:
    """Everything about a light that the file can hold only as extras, or not at all."""
    path = prim.GetPath()

    def authored(name: str):
        attribute = prim.GetAttribute(name)
        return attribute.Get(frames.first) if attribute and attribute.HasAuthoredValue() else None

    for name in ("diffuse", "specular"):
        value = authored(f"inputs:{name}")
        if value is not None and value != 1.0:
            report.warn(path, f"inputs:{name}", "a non-physical control without a carrier")
    ies = authored("inputs:shaping:ies:file")
    if ies is not None and ies.path:
        report.warn(path, "IES profile", f"{ies.path} is kept in extras only; the light is exported without it")
    shadow = {name: authored(f"inputs:shadow:{name}") for name in ("enable", "color", "distance")}
    if shadow["enable"] is False:
        report.warn(path, "shadow:enable = false", "a non-physical control without a carrier")
    if shadow["color"] is not None and any(shadow["color"]):
        report.warn(path, "shadow:color", "a non-physical control without a carrier")
    if shadow["distance"] is not None and shadow["distance"] >= 0:
        report.warn(path, "shadow:distance", "a non-physical control without a carrier")
    filters = prim.GetRelationship("light:filters")
    if filters and filters.GetTargets():
        report.warn(path, "light filters", "they have no carrier; the light is exported unfiltered")
    for link in ("lightLink", "shadowLink"):
        collection = Usd.CollectionAPI(prim, link)
        root = prim.GetAttribute(f"collection:{link}:includeRoot").Get()
        listed = prim.GetRelationship(f"collection:{link}:includes"), prim.GetRelationship(
            f"collection:{link}:excludes"
        )
        if collection and (root is False or any(rel and rel.GetTargets() for rel in listed)):
            report.warn(path, link, "linking has no carrier; the light lights everything")
    for attribute in prim.GetAuthoredPropertiesInNamespace("inputs"):
        if isinstance(attribute, Usd.Attribute) and attribute.HasAuthoredConnections():
            report.warn(path, f"connected {attribute.GetName()}", "shader networks on lights have no carrier")
    format_ = authored("inputs:texture:format")
    if kind.startswith("DomeLight") and format_ not in (None, "automatic", "latlong"):
        report.warn(path, f"texture:format {format_}", "only latitude-longitude has a carrier; read as such")
    if kind.startswith("DomeLight"):
        portals = prim.GetRelationship("portals")
        if portals and portals.GetTargets():
            report.warn(path, "dome portals", "they only guide sampling and have no carrier")
