"""Which glTF object carries which light (`src/ingest/carriers.md`).

Area lights become emissive meshes in nits, points and spots `KHR_lights_punctual` in candela, suns
`directional` in lux, domes extras. Here the sizeFactor of `normalize` comes in, since it depends on
the world-space area of one instance.

Lights of no size. UsdLux gives a light without area no power, unless it is normalized: then the
limit is carried, a point (`L'/4` candela in all directions from a sphere, `L' cos(theta)` from a flat
light), and a light of some length but no width is widened to a thousandth of its length. But
maya-usd writes radius 0 and `treatAsPoint` for every point light, never `normalize`; arnold-usd then
leaves Arnold's point_light normalized, and Cycles sizes a light of radius 0 as if it were (both
`intensity/4`). So a sphere or cylinder of radius 0 counts as normalized here whatever `normalize`
says. With a radius, `treatAsPoint` is the hint that its text says: the power stays the sphere's.
"""

from __future__ import annotations

import math

import numpy as np

from .animation import strength_keys
from .gltf_document import Document, number, numbers
from .light_growth import keys_of_growth
from .light_inputs import SIZES, Light
from .light_profiles import WITHOUT_CONE, LightProfiles
from .light_shapes import Tessellation, tessellate, world_area
from .light_textures import LightTextures
from .materials import Emission, Materials
from .mesh import GLOW, MeshSource
from .report import Notebook
from .stage import Frames

_THIN = 1e-3


class LightCarriers:
    """Puts lights onto glTF nodes."""

    def __init__(
        self,
        document: Document,
        materials: Materials,
        pictures: LightTextures,
        profiles: LightProfiles,
        frames: Frames,
        meters_per_unit: float,
        normalize_area: str,
        report: Notebook,
    ) -> None:
        self.document, self.materials, self.pictures = document, materials, pictures
        self.profiles = profiles
        self.frames, self.report = frames, report
        self.square_metres = meters_per_unit**2
        self.normalize_unit = 1.0 if normalize_area == "stage" else self.square_metres
        self._tessellations: dict[tuple, dict] = {}
        self._posed: dict[tuple[int, bytes], tuple[MeshSource, np.ndarray]] = {}

    def carry(self, light: Light, node: dict, world: np.ndarray, mesh: MeshSource | None) -> None:
        """Make `node`, which stands at `world` (stage units; one matrix or one a frame), this light."""
        extras = dict(light.extras)
        ies = self.profiles.carry(light)
        if ies is not None:
            extras["shaping"] = {**(light.shaping or WITHOUT_CONE), "ies": ies}
        node["extras"]["usdLux"] = extras
        self.report.count(f"lights {light.type}")
        if mesh is not None:
            self._mesh_light(light, node, extras, world, mesh)
        elif light.type in SIZES:
            self._area_light(light, node, extras, world)
        elif light.type == "DistantLight":
            self._distant(light, node, extras)
        elif light.type in ("DomeLight", "DomeLight_1"):
            self._dome(light, extras)
        else:
            why = "it has no carrier; its inputs are kept in extras"
            self.report.warn(light.path, light.type, why)

    # -- area lights -----------------------------------------------------------------------------

    def _area_light(self, light: Light, node: dict, extras: dict, world: np.ndarray) -> None:
        size, normalize = light.size, light.normalize
        area = _each_frame(world, lambda linear: world_area(light.type, size, linear))
        if np.max(area) <= 0.0:
            if min(size.values()) > 0.0:
                self.report.warn(light.path, f"{light.type} emits nothing", "its scale is 0")
                return
            normalize = self._normalized_anyway(light)
            if not np.any(normalize):
                why = "its area is 0 and it is not normalized"
                self.report.warn(light.path, f"{light.type} emits nothing", why)
                return
            if max(size.values()) <= 0.0:
                self._without_size(light, normalize, node, extras)
                return
            size = {name: max(value, _THIN * max(size.values())) for name, value in size.items()}
            area = _each_frame(world, lambda linear: world_area(light.type, size, linear))
        nits = self._normalized(light.rgb, normalize, area)
        texture = None
        if light.texture is not None or light.texels is not None:
            texture, factor = self.pictures.rect(light)
            nits = nits * factor
            if not np.any(factor):
                return
        nits = _settled(self._writable(light, nits))
        if light.is_point:
            self._punctual(light, node, extras, _times(nits, area * (self.square_metres / 4)))
            return
        if light.type == "SphereLight":
            extras["radius"] = number(light.size["radius"])
        grown = keys_of_growth(self.frames, normalize, world, lambda linear: world_area(light.type, size, linear), nits)
        self._animated(light, extras, nits, grown)
        material = self.materials.light_material(Emission(self._first(nits), texture, nits.ndim == 2))
        primitive = {**self._tessellated(light.type, size, texture is not None), "material": material}
        node["mesh"] = self.document.shared("meshes", {"name": light.type, "primitives": [primitive]})

    def _normalized_anyway(self, light: Light) -> np.ndarray:
        """`normalize`, or True for a sphere or cylinder of radius 0 (see above)."""
        if light.type not in ("SphereLight", "CylinderLight") or light.size["radius"] > 0.0:
            return light.normalize
        if not (light.is_point or light.is_line or np.all(light.normalize)):
            shape = "line" if light.size.get("length") else "point"
            why = f"UsdLux gives it no power; it is carried as the {shape} that Arnold and Cycles light with"
            self.report.warn(light.path, f"{light.type} of radius 0", f"{why}, as if normalized")
        return np.ones((), bool)

    def _normalized(self, rgb: np.ndarray, normalize: np.ndarray, area) -> np.ndarray:
        """The emission over the sizeFactor: world-space area where `normalize` asks for it."""
        if not np.any(normalize):
            return rgb
        area = np.asarray(area, dtype=float) * self.normalize_unit
        inverse = np.where(area > 0, 1.0 / np.maximum(area, 1e-300), 0.0)
        return _times(rgb, np.where(normalize, inverse, 1.0))

    def _writable(self, light: Light, rgb: np.ndarray) -> np.ndarray:
        """Emission that a 32-bit number holds."""
        top = float(np.finfo(np.float32).max)
        if not (rgb <= top).all():
            why = "its area is so small that its radiance overflows a 32-bit number; the largest is used"
            self.report.warn(light.path, "emission too strong", why)
        return np.minimum(rgb, top)

    def _without_size(self, light: Light, normalize: np.ndarray, node: dict, extras: dict) -> None:
        """The limit of a normalized light that shrinks to a point."""
        power = _times(light.rgb, np.where(normalize, self.square_metres / self.normalize_unit, 0.0))
        if light.type in ("RectLight", "DiskLight"):
            shaping = extras.get("shaping") or WITHOUT_CONE
            if light.shaping and any(light.shaping["focusTint"]):
                why = "the cosine of a flat light and the tint cannot both be carried; the tint is lost"
                self.report.warn(light.path, "focusTint of a light without size", why)
            extras["shaping"] = {
                **shaping,
                "coneAngle": min(shaping["coneAngle"], 90.0),
                "focus": shaping["focus"] + 1.0,
                "focusTint": [0.0] * 3,
            }
            self._punctual(light, node, extras, power)
        else:
            self._punctual(light, node, extras, power / 4)

    def _tessellated(self, kind: str, size: dict[str, float], textured: bool) -> dict:
        """The primitive, without its material, of a light's shape."""
        key = (kind, *size.values(), textured)
        if key not in self._tessellations:
            shape: Tessellation = tessellate(kind, size)
            attributes = {
                "POSITION": self.document.accessor(shape.positions.astype(np.float32), 34962, bounds=True),
                "NORMAL": self.document.accessor(shape.normals.astype(np.float32), 34962),
            }
            if textured:
                attributes["TEXCOORD_0"] = self.document.accessor(shape.uvs.astype(np.float32), 34962)
            indices = self.document.indices(shape.triangles.reshape(-1))
            self._tessellations[key] = {"attributes": attributes, "indices": indices}
        return self._tessellations[key]

    def _mesh_light(
        self, light: Light, node: dict, extras: dict, world: np.ndarray, mesh: MeshSource
    ) -> None:
        rgb = light.rgb
        if np.any(light.normalize):
            area = _each_frame(world, mesh.area) if mesh.motion is None else self._areas(world, mesh)
            if np.max(area) <= 0.0:
                self.report.warn(light.path, f"{light.type} emits nothing", "it has no area")
            rgb = _settled(self._writable(light, self._normalized(light.rgb, light.normalize, area)))
        if rgb.ndim == 2 and len({piece.glow for piece in mesh.pieces_lit(light.material_sync)}) > 1:
            why = "its parts glow differently; the first frame's values are used"
            self.report.warn(light.path, "animated light on a mesh of several materials", why)
            rgb = self._first(rgb)
        if light.material_sync == GLOW:
            mesh.report_still_glow(self.report)
        lit = mesh.lit_primitives(self.materials, light, Emission(self._first(rgb), varies=rgb.ndim == 2))
        if rgb.ndim == 2 and lit:
            grown = {}
            if mesh.motion is None:
                grown = keys_of_growth(self.frames, light.normalize, world, mesh.area, rgb)
            glow = np.array(mesh.pieces_lit(light.material_sync)[0].glow)
            self._animated(light, extras, rgb * glow, {code: row * glow for code, row in grown.items()})
        body = {"name": mesh.name, "primitives": lit}
        if mesh.motion is not None:
            body["extras"] = {"targetNames": mesh.motion.names}
        node["mesh"] = self.document.shared("meshes", body)

    def _areas(self, world: np.ndarray, mesh: MeshSource) -> np.ndarray:
        """The area of a mesh that deforms, at each frame; it is posed once for all instances of even scale."""
        linear = world[..., :3, :3]
        gram = np.swapaxes(linear, -1, -2) @ linear
        even = np.trace(gram, axis1=-2, axis2=-1) / 3
        if (np.abs(gram - even[..., None, None] * np.eye(3)).max(axis=(-2, -1)) <= 1e-9 * even).all():
            return even * self._areas_under(np.eye(3), mesh)
        if world.ndim == 2:
            return self._areas_under(linear, mesh)
        return np.array([mesh.area(*at) for at in zip(linear, self.frames.codes, strict=True)])

    def _areas_under(self, linear: np.ndarray, mesh: MeshSource) -> np.ndarray:
        """The same under one linear map."""
        key = (id(mesh), linear.tobytes())
        if key not in self._posed:
            self._posed[key] = mesh, np.array([mesh.area(linear, code) for code in self.frames.codes])
        return self._posed[key][1]

    # -- lights without area ---------------------------------------------------------------------

    def _punctual(self, light: Light, node: dict, extras: dict, candela: np.ndarray) -> None:
        """A point, or a spot if the light is shaped."""
        candela = _settled(candela)
        self._animated(light, extras, candela)
        shaping = extras.get("shaping")
        if shaping is None:
            self._khr_light(node, "point", self._first(candela))
            return
        outer = math.radians(min(shaping["coneAngle"], 90.0))
        if outer <= 0.0:
            self.report.warn(light.path, f"{light.type} emits nothing", "its cone angle is 0")
            return
        inner = min(math.radians(shaping["coneAngle"] * (1 - shaping["coneSoftness"])), outer * 0.9999)
        spot = {"innerConeAngle": number(inner), "outerConeAngle": min(number(outer), math.pi / 2)}
        self._khr_light(node, "spot", self._first(candela), spot)

    def _distant(self, light: Light, node: dict, extras: dict) -> None:
        """Lux on a surface that faces it."""
        facing = np.vectorize(_facing)(light.angle_deg, light.normalize)
        lux = _settled(_times(light.rgb, facing))
        extras["angle"] = number(light.angle_deg)
        self._animated(light, extras, lux)
        self._khr_light(node, "directional", self._first(lux))
        if extras.pop("shaping", None) is not None:
            self.report.warn(light.path, "shaping of a DistantLight", "it has no position to be shaped from")

    def _dome(self, light: Light, extras: dict) -> None:
        rgb = light.rgb
        if light.texture is not None or light.texels is not None:
            uri, factor = self.pictures.dome(light)
            rgb = _settled(self._writable(light, rgb * factor))
            if uri is not None:
                extras["texture"] = uri
        extras["radiance"] = numbers(self._first(rgb))
        self._animated(light, extras, rgb)
        if extras.pop("shaping", None) is not None:
            self.report.warn(light.path, "shaping of a DomeLight", "it has no position to be shaped from")

    def _khr_light(self, node: dict, kind: str, rgb: np.ndarray, spot: dict | None = None) -> None:
        strength = float(np.max(rgb))
        color = rgb / strength if strength > 0 else np.ones(3)
        light: dict = {"type": kind, "color": numbers(color), "intensity": number(strength)}
        if spot is not None:
            light["spot"] = spot
        index = self.document.shared("lights", light)
        extension = self.document.use("KHR_lights_punctual")
        node["extensions"] = {extension: {"light": index}}

    def _first(self, rgb: np.ndarray) -> np.ndarray:
        """The first frame's of (times, 3)."""
        return rgb[self.frames.rest] if rgb.ndim == 2 else rgb

    def _animated(self, light: Light, extras: dict, rgb: np.ndarray, between: dict[float, np.ndarray] | None = None) -> None:
        """`extras.usdLux.values`, if the light varies; `between` the time codes that are sampled too."""
        if rgb.ndim == 2:
            extras["values"] = strength_keys(self.frames, rgb, between, is_mostly_dark=light.lit_at is not None)


def _each_frame(world: np.ndarray, area) -> np.ndarray | float:
    """`area` of the linear part of `world`; one for each frame if the scale varies."""
    if world.ndim == 2:
        return area(world[:3, :3])
    linear = world[:, :3, :3]
    gram = np.swapaxes(linear, 1, 2) @ linear
    if np.allclose(gram, gram[0], rtol=1e-6, atol=0):
        return area(linear[0])
    return np.array([area(matrix) for matrix in linear])


def _facing(angle_deg: float, normalize: bool) -> float:
    """Lux on a facing surface for each nit: `pi sin^2(angle/2)` over the sizeFactor. A sun of no
    angle is given in lux."""
    half = math.radians(angle_deg) / 2
    if half <= 0.0:
        return 1.0
    facing = math.pi * math.sin(min(half, math.pi / 2)) ** 2
    if not normalize:
        return facing
    return 1.0 if half <= math.pi / 2 else 1.0 / (2 - math.sin(half) ** 2)


def _times(rgb: np.ndarray, factor) -> np.ndarray:
    """rgb, (3,) or (frames, 3), times a number or one number for each frame."""
    factor = np.asarray(factor, dtype=float)
    return rgb * (factor[..., None] if factor.ndim else factor)


def _settled(rgb: np.ndarray) -> np.ndarray:
    """One row for (frames, 3) whose rows differ by no more than single precision's noise."""
    return rgb[0] if rgb.ndim == 2 and np.allclose(rgb, rgb[0], rtol=1e-6, atol=0) else rgb
