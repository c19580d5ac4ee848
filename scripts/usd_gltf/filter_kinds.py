"""What single light filters do, where that is published: `extras.usdLightFilter` of `src/ingest/carriers.md`.

| filter | what it does | source |
|---|---|---|
| `PxrRodLightFilter` | light at points inside a box with rounded edges is `intensity` times as bright, fading into 1 across a shell | usdRi's schema: parameters and what they are if they are not authored; RenderMan for Blender (rman_ui_viewport) draws the box: `width`, `height` and `depth` are half its size, `radius` and the shell are around it |
| `PxrBlockerLightFilter` | the same without scales and refinements | RenderMan's documentation; nobody publishes what is not authored |
| `arnold:light_blocker` | light that passes a shape on its way is `shader` times as bright | Arnold's user guide; GafferHQ (LightBlockerVisualiser.cpp) draws the shapes |
| `arnold:light_decay` | fades in and out with the distance from the light | Arnold's user guide, which says "a smooth ramp" |

What has no published meaning is `Lost`: soft edges of Arnold's shapes, the axis of its cylinder, shells whose sides differ.
"""  # noqa: E501

from __future__ import annotations

import numpy as np
from pxr import Gf, Usd, UsdGeom

from .gltf_document import number, numbers
from .primvars import as_rows
from .stage import Frames, changes
from .transforms import column

RODS = ("PxrRodLightFilter", "PxrBlockerLightFilter")
BLOCKER, DECAY = "arnold:light_blocker", "arnold:light_decay"

_ROD = {
    "width": 0.0, "height": 0.0, "depth": 0.0, "radius": 1.0, "edge": 0.25,
    "scaleWidth": 1.0, "scaleHeight": 1.0, "scaleDepth": 1.0,
    "left": 0.0, "right": 0.0, "bottom": 0.0, "top": 0.0, "back": 0.0, "front": 0.0,
    "leftEdge": 1.0, "rightEdge": 1.0, "bottomEdge": 1.0, "topEdge": 1.0, "backEdge": 1.0, "frontEdge": 1.0,
    "density": 1.0, "intensity": 0.0, "exposure": 0.0, "diffuse": 1.0, "specular": 1.0, "saturation": 1.0, "invert": False,
    "combineMode": "multiply", "falloff": 6, "falloff_Knots": (0.0, 0.0, 0.3, 0.7, 1.0, 1.0),
    "falloff_Floats": (0.0, 0.0, 0.2, 0.8, 1.0, 1.0), "falloff_Interpolation": "bspline",
    "colorRamp": 4, "colorRamp_Knots": (), "colorRamp_Colors": (), "colorRamp_Interpolation": "linear",
}  # fmt: skip
"""A rod's parameters under RenderMan's names, and what usdRi's schema (until USD 21.11) says that they are."""
_OLD = {
    "edge": "edgeThickness", "saturation": "color:saturation",
    **{f"scale{side}": f"scale:{side.lower()}" for side in ("Width", "Height", "Depth")},
    **{side: f"refine:{side}" for side in ("left", "right", "bottom", "top", "back", "front")},
    **{f"{side}Edge": f"edgeScale:{side}" for side in ("left", "right", "bottom", "top", "back", "front")},
    **{name: f"ri:{name}" for name in ("density", "intensity", "exposure", "diffuse", "specular", "invert", "combineMode")},
    **{name: name.replace("_", ":").lower().replace("ramp", "Ramp") for name in _ROD if "_" in name},
}  # fmt: skip
"""Their names in that schema where they differ."""
_SHAPE = ("width", "height", "depth", "radius", "edge", "intensity")
_SIDES = (("left", "right", "width"), ("bottom", "top", "height"), ("back", "front", "depth"))
_NOT_OURS = ("collection", "ui", "xformOp", "xformOpOrder", "visibility", "purpose", "lightFilter", "kind")
_SAMPLES = 64
"""Samples of a smooth falloff."""
_BASES = {
    "bspline": np.array([[-1, 3, -3, 1], [3, -6, 3, 0], [-3, 0, 3, 0], [1, 4, 1, 0]]) / 6,
    "catmull-rom": np.array([[-1, 3, -3, 1], [2, -5, 4, -1], [-1, 0, 1, 0], [0, 2, 0, 0]]) / 2,
}


class Lost(Exception):
    """Why a filter cannot be carried."""


def kind_of(prim: Usd.Prim) -> str:
    """The type of a filter's prim, or of the shader that a prim of another type names."""
    kind = str(prim.GetTypeName())
    if kind == "LightFilter":
        return str(prim.GetAttribute("lightFilter:shaderId").Get() or "") or kind
    if kind == "Shader":
        return str(prim.GetAttribute("info:id").Get() or "")
    return kind


def is_filter(prim: Usd.Prim) -> bool:
    """Whether a prim is a light filter, or one of Arnold's shaders that are."""
    return str(prim.GetTypeName()).endswith("LightFilter") or kind_of(prim) in (BLOCKER, DECAY)


def is_linked(prim: Usd.Prim) -> bool:
    """Whether a filter is for some geometry alone."""
    links = {p.GetBaseName(): p for p in prim.GetAuthoredPropertiesInNamespace("collection:filterLink")}
    root = links.pop("includeRoot", None)
    rule = links.pop("expansionRule", None)
    return bool(links or (root and not root.Get()) or (rule and rule.Get() == Usd.Tokens.explicitOnly))


def is_hidden(prim: Usd.Prim, code: float) -> bool:
    """Whether a filter is invisible, by itself or what is above it. hdPrman leaves such a filter out (light.cpp). Nothing hides
    a shader."""
    above = None if prim.GetTypeName() == "Shader" else prim
    while above and not above.IsPseudoRoot():
        visibility = UsdGeom.Imageable(above).GetVisibilityAttr() if above.IsA(UsdGeom.Imageable) else above.GetAttribute("visibility")
        if visibility and visibility.Get(code) == UsdGeom.Tokens.invisible:
            return True
        above = above.GetParent()
    return False


def varying(prim: Usd.Prim, frames: Frames) -> list[str]:
    """The attributes of a filter that change over time, other than its place."""
    found = (attribute for attribute in prim.GetAuthoredAttributes() if changes(attribute, frames))
    return [a.GetName() for a in found if not a.GetName().startswith(("xformOp", "inputs:geometry_matrix"))]


def combines(prim: Usd.Prim, code: float) -> bool:
    """Whether a rod is combined with a light's other filters in another way than by multiplying them."""
    return kind_of(prim) in RODS and _Rod(prim, code).get("combineMode") not in ("multiply", "mult", "")


def carrier(prim: Usd.Prim, code: float, meters_per_unit: float) -> dict:
    """`extras.usdLightFilter` of a filter at a time code."""
    kind = kind_of(prim)
    if kind in RODS:
        return _rod(_Rod(prim, code))
    if kind == BLOCKER:
        return _blocker(prim, code)
    if kind == DECAY:
        return _decay(prim, code, meters_per_unit)
    raise Lost(kind or "it has no type")


def world_matrix(shader: Usd.Prim, frames: Frames) -> np.ndarray | None:
    """The matrix of one of Arnold's filters that stands by itself in the world: (4, 4), or (times, 4, 4) if it moves. None for
    one that stands nowhere."""
    if kind_of(shader) != BLOCKER:
        return None
    attribute = shader.GetAttribute("inputs:geometry_matrix")
    codes = frames.codes if changes(attribute, frames) else (frames.first,)
    matrices = np.array([column(Gf.Matrix4d(attribute.Get(code))) for code in codes])
    return matrices if len(codes) > 1 else matrices[0]


# -- RenderMan ---------------------------------------------------------------------------------------


class _Rod:
    """The parameters of a rod, under whichever names they are authored."""

    def __init__(self, prim: Usd.Prim, code: float) -> None:
        self.prim, self.code = prim, code

    def attribute(self, name: str) -> Usd.Attribute | None:
        old = _OLD.get(name, name)
        found = map(self.prim.GetAttribute, (f"inputs:ri:lightFilter:{name}", f"inputs:{old}", old))
        return next((attribute for attribute in found if attribute and attribute.HasAuthoredValue()), None)

    def get(self, name: str):
        """The value of a parameter in the type of its default."""
        attribute, usual = self.attribute(name), _ROD[name]
        value = attribute.Get(self.code) if attribute else None
        if value is None:
            return usual
        try:
            if isinstance(usual, tuple):
                return as_rows(value, 3 if name.endswith("Colors") else 1).astype(float)
            return type(usual)(value)
        except (TypeError, ValueError, OverflowError) as error:
            raise Lost(f"its {name} is {value!r}") from error

    def check(self) -> None:
        """Raise `Lost` for what nobody knows, and what is computed by a shader."""
        known = {name for own in _ROD for old in (_OLD.get(own, own),) for name in (f"inputs:ri:lightFilter:{own}", f"inputs:{old}", old)}
        for attribute in self.prim.GetAuthoredAttributes():
            name = attribute.GetName()
            if attribute.HasAuthoredConnections():
                raise Lost(f"its {name.split(':')[-1]} is connected")
            if name not in known and name.split(":")[0] not in _NOT_OURS and attribute.Get(self.code) not in ("", None):
                raise Lost(f"nobody knows its {name.split(':')[-1]}")


def _rod(rod: _Rod) -> dict:
    rod.check()
    kind = kind_of(rod.prim)
    missing = [name for name in _SHAPE if kind != RODS[0] and rod.attribute(name) is None]
    if missing:
        raise Lost(f"its {missing[0]} is not authored, and what it then is, is not published")
    low, high = [], []
    for before, after, size in _SIDES:
        half = rod.get(size) * rod.get(f"scale{size.capitalize()}")
        low.append(-half - rod.get(before))
        high.append(half + rod.get(after))
    radius, edge = rod.get("radius"), rod.get("edge")
    scales = {rod.get(f"{side}Edge") for pair in _SIDES for side in pair[:2]}
    if edge != 0 and len(scales) > 1:
        raise Lost("the edges of its sides differ, and what is between them is not published")
    edge *= scales.pop() if edge != 0 else 1.0
    if not np.isfinite([*low, *high, radius, edge]).all() or radius < 0 or edge < 0 or any(np.array(low) > high):
        raise Lost("its size is none")
    extras = {"type": "rod", "min": numbers(low), "max": numbers(high), "radius": number(radius), "edge": number(edge)}
    if edge > 0:
        extras["ramp"] = _ramp(rod)
    inside = _inside(rod)
    if rod.get("invert"):
        if inside != 0:
            raise Lost("inverted, with another intensity than 0 or another density than 1, it is not published what it does")
        return {**extras, "inside": [1.0] * 3, "outside": [0.0] * 3}
    return {**extras, "inside": numbers([inside] * 3)}


def _inside(rod: _Rod) -> float:
    """The share of the light that is left inside."""
    density, intensity = rod.get("density"), rod.get("intensity")
    if not 0 <= density <= 1:
        raise Lost(f"its density is {density:g}")
    if not 0 <= intensity < 1e30:
        raise Lost(f"its intensity is {intensity:g}")
    if density == 0 or (intensity == 0 and density == 1):
        return 1 - density
    for name in ("exposure", "diffuse", "specular", "saturation"):
        if intensity != 0 and rod.get(name) != _ROD[name]:
            raise Lost(f"its {name} is {rod.get(name):g}")
    colors = rod.get("colorRamp_Colors")
    if intensity != 0 and len(colors) and not (np.asarray(colors) == 1).all():
        raise Lost("its colours are not white")
    return 1 - density * (1 - intensity)


def _ramp(rod: _Rod) -> list[list[float]]:
    """The falloff as a line of knots that ascend from (0, 0) to (1, 1)."""
    knots, floats = (np.asarray(rod.get(f"falloff_{name}"), float).reshape(-1) for name in ("Knots", "Floats"))
    interpolation = rod.get("falloff_Interpolation")
    if rod.attribute("falloff") is not None:
        knots, floats = knots[: rod.get("falloff")], floats[: rod.get("falloff")]
    points = np.column_stack([knots, floats]) if len(knots) == len(floats) else np.zeros((0, 2))
    ascends = len(points) > 1 and np.isfinite(points).all() and (np.diff(points, axis=0) >= 0).all()
    if not ascends or tuple(points[0]) != (0, 0) or tuple(points[-1]) != (1, 1):
        raise Lost("its falloff does not ascend from 0 in the core to 1 at the edge")
    if interpolation in _BASES and len(points) > 3:
        points = _smooth(points, _BASES[interpolation])
    elif interpolation != "linear":
        raise Lost(f"its falloff is {interpolation}")
    line = [[0.0, 0.0]]
    for x, y in points:
        if line[-1][0] < x < 1:
            line.append([number(x), number(max(y, line[-1][1]))])
    return [*line, [1.0, 1.0]]


def _smooth(points: np.ndarray, basis: np.ndarray) -> np.ndarray:
    """Points of a spline of which the first and last only say how it bends, as OSL has it: places and values are both splines."""
    t = np.linspace(0, 1, max(_SAMPLES // (len(points) - 3), 2), endpoint=False)
    powers = np.stack([t**3, t**2, t, np.ones_like(t)], axis=1)
    spans = [powers @ basis @ points[start : start + 4] for start in range(len(points) - 3)]
    end = np.ones(4) @ basis @ points[-4:]
    return np.clip(np.concatenate([*spans, end[None]]), 0, 1)


# -- Arnold ------------------------------------------------------------------------------------------


def _input(shader: Usd.Prim, name: str, code: float):
    """An input's value, or None if it is not authored."""
    attribute = shader.GetAttribute(f"inputs:{name}")
    if attribute and attribute.HasAuthoredConnections():
        raise Lost(f"its {name} is connected")
    return attribute.Get(code) if attribute else None


def _blocker(shader: Usd.Prim, code: float) -> dict:
    shape = _input(shader, "geometry_type", code)
    if _input(shader, "geometry_matrix", code) is None:
        raise Lost("its geometry_matrix is not authored")
    if shape not in ("box", "sphere", "plane"):
        raise Lost(f"the place of a {shape} is not published" if shape else "its geometry_type is not authored")
    for name in ("width_edge", "height_edge", "ramp", *(("roundness",) if shape == "plane" else ())):
        if _input(shader, name, code) not in (None, 0.0):
            raise Lost(f"its {name} is {_input(shader, name, code):g}, and what that does is not published")
    density, color = _input(shader, "density", code), _input(shader, "shader", code)
    density = 1.0 if density is None else float(density)
    color = np.zeros(3) if color is None else np.array(color, dtype=float)
    if not 0 <= density <= 1 or color.shape != (3,) or not ((color >= 0) & (color < 1e30)).all():
        raise Lost(f"its density is {density:g} and its shader {color.tolist()}")
    return {"type": "blocker", "shape": shape, "through": numbers(1 - density * (1 - color))}


def _decay(shader: Usd.Prim, code: float, meters_per_unit: float) -> dict:
    extras: dict = {"type": "decay"}
    for name in ("near", "far"):
        if not _input(shader, f"use_{name}_atten", code):
            continue
        ends = [_input(shader, f"{name}_{end}", code) for end in ("start", "end")]
        if None in ends:
            raise Lost(f"its {name}_start or {name}_end is not authored")
        if not np.isfinite(ends).all() or not 0 <= ends[0] <= ends[1]:
            raise Lost(f"its {name}_start is {ends[0]:g} and its {name}_end {ends[1]:g}")
        extras[name] = numbers(np.array(ends) * meters_per_unit)
    return extras
