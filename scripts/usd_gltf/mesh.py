"""UsdGeomMesh and the intrinsic gprims to glTF primitives.

A mesh is cut into pieces, one for each material (GeomSubset). Corners with equal position, normal,
texture coordinates and colour share a vertex. Texture coordinates are turned over: USD's v runs up
from the image's last row, glTF's down from its first.

A subdivision surface is refined (`subdivision`); at complexity low its cage is exported, with smooth normals
(weighted by area) if it has none of its own, and reported. A polygon mesh without normals has none in glTF
either: flat shading.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from pxr import Usd, UsdGeom, UsdShade

from . import gprims
from .gltf_document import Document
from .light_inputs import Light
from .materials import Emission, Look, Materials
from .primvars import CornerValues, as_rows, read_normals, read_primvar
from .report import Notebook
from .skinning import Skinning
from .stage import Frames, changes
from .subdivision import Subdivider, Surface
from .triangulate import triangulate

if TYPE_CHECKING:
    from .linking import LinkSubsets

GLOW = "materialGlowTintsLight"


@dataclass
class Glow:
    """What a piece's material contributes to a mesh light: a factor, and perhaps a texture."""

    glow: tuple[float, float, float]
    texture: dict | None


@dataclass
class Piece:
    """One primitive with the look it is given."""

    primitive: dict
    look: Look
    double_sided: bool
    tint: tuple[float, float, float, float] | None
    """A display colour for the whole piece; one that varies is in `COLOR_0`."""
    translucent: bool
    """Whether a display opacity is below 1."""


@dataclass
class Authored:
    """A mesh as it is authored, which its primvars are read against, and the surface that is made of it."""

    prim: Usd.Prim
    counts: np.ndarray
    corners: np.ndarray
    surface: Surface | None = None
    carried: dict[tuple[str, int], CornerValues] = field(default_factory=dict)
    """Primvars that are on the surface already: the pieces of a mesh share them."""


@dataclass
class MeshSource:
    """A mesh read and triangulated; its glTF mesh depends on the light it may be."""

    path: str
    name: str
    pieces: list[Piece]
    points: np.ndarray
    triangles: np.ndarray

    def area(self, linear: np.ndarray) -> float:
        """World-space surface area (one side) under the linear part of a transform."""
        corners = (self.points @ linear.T)[self.triangles]
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        return float(np.linalg.norm(cross, axis=1).sum() / 2)

    def primitives(self, materials: Materials) -> list[dict]:
        """glTF primitives of a mesh that is no light."""
        return [{**piece.primitive, "material": materials.index(piece)} for piece in self.pieces]

    def glow_keys(self) -> np.ndarray | None:
        """(frames, 3) nits of a mesh whose glow is animated, and the same in all its pieces."""
        first = self.pieces[0].look.emission_keys
        same = all(piece.look.emission_keys is not None for piece in self.pieces) and all(
            np.array_equal(piece.look.emission_keys, first) for piece in self.pieces
        )
        return first if same else None

    def report_still_glow(self, report: Notebook) -> None:
        """Say which materials have an animated glow whose first frame is used."""
        for look in (piece.look for piece in self.pieces):
            if look.emission_keys is not None:
                why = "one node carries one animation for all parts of a mesh; the first frame is used"
                report.warn(look.path, "animated emissiveColor", why)

    def pieces_lit(self, material_sync: str) -> list[Glow]:
        """How each piece glows under `light:materialSyncMode`."""
        white = Glow((1.0, 1.0, 1.0), None)
        if material_sync != GLOW:
            return [white] * len(self.pieces)
        return [
            Glow(piece.look.emission, piece.look.emission_texture) if piece.look.glow_is_known else white
            for piece in self.pieces
        ]

    def lit_primitives(self, materials: Materials, light: Light, emitted: Emission) -> list[dict]:
        """glTF primitives of a mesh light that emits so much (times the material's glow)."""
        primitives = []
        for piece, glow in zip(self.pieces, self.pieces_lit(light.material_sync), strict=True):
            if not any(glow.glow):
                why = f"{piece.look.path} does not glow, and materialGlowTintsLight multiplies by its glow"
                materials.report.about("lights").warn(light.path, "mesh light emits nothing", why)
            emission = Emission(emitted.rgb * np.array(glow.glow), glow.texture, emitted.varies)
            if light.material_sync == "noMaterialResponse":
                index = materials.light_material(emission, piece.double_sided)
            else:
                if light.material_sync == "independent" and any(piece.look.emission):
                    why = "the eye is to see the material's own glow; it sees the light's"
                    materials.report.about("lights").warn(light.path, "materialSyncMode = independent", why)
                index = materials.index(piece, emission)
            primitives.append({**piece.primitive, "material": index})
        return primitives


class MeshReader:
    """Reads meshes once: what USD shares (instances) or repeats is stored once."""

    def __init__(
        self,
        document: Document,
        materials: Materials,
        skinning: Skinning,
        frames: Frames,
        complexity: str,
        report: Notebook,
    ) -> None:
        self.document, self.materials, self.skinning = document, materials, skinning
        self.frames, self.code, self.report = frames, frames.first, report
        self.subdivider = Subdivider(complexity, frames, report)
        self._read: dict[tuple, MeshSource | None] = {}
        self.link_subsets: LinkSubsets | None = None
        """Subsets that light links divide meshes by, besides materials."""

    def read(self, prim: Usd.Prim) -> MeshSource | None:
        """The mesh of a Mesh or an intrinsic gprim; None (reported) if it has no faces."""
        subsets = _material_subsets(prim)
        if self.link_subsets is not None:
            subsets += self.link_subsets.of(prim, subsets)
        bound = [self.materials.bound(p) for p in (prim, *subsets)]
        color = self._inherited_color(prim, bound)
        source = prim.GetPrimInPrototype() if prim.IsInstanceProxy() else prim
        names = tuple(subset.GetName() for subset in subsets)
        looks = tuple(look.path for look in bound)
        key = (source.GetPath(), looks, color, names, self.skinning.name(prim))
        if key not in self._read:
            self._read[key] = self._build(prim, subsets, bound)
        return self._read[key]

    @staticmethod
    def _inherited_color(prim: Usd.Prim, bound: list[Look]) -> str:
        """Tells apart instances that inherit different colours from outside their prototype."""
        if not prim.IsInstanceProxy():
            return ""
        api = UsdGeom.PrimvarsAPI(prim)
        names = dict.fromkeys(["displayColor", "displayOpacity", *(look.color_primvar for look in bound)])
        found = [api.FindPrimvarWithInheritance(name) for name in names]
        return " ".join(str(p.Get()) for p in found if p and p.GetAttr().GetPrim() != prim)

    def _build(self, prim: Usd.Prim, subsets: list[UsdGeom.Subset], bound: list[Look]) -> MeshSource | None:
        polygons = self._polygons(prim)
        if polygons is None:
            return None
        points, counts, corners, normals = polygons
        points = np.where(np.abs(points) < 3e38, points, np.nan)
        if not np.isfinite(points).all():
            self.report.warn(prim.GetPath(), "points that are not finite", "faces that use them are left out")
        authored, surface = Authored(prim, counts, corners), None
        if prim.GetTypeName() not in gprims.TYPES:
            surface = authored.surface = self.subdivider.surface(prim, points, counts, corners)
        owner = np.zeros(len(counts), int)
        if surface is not None:
            points, counts, corners = surface.points, surface.counts, surface.corners
            if normals and surface.normals:
                why = "UsdGeom gives them no meaning; a mesh of polygons has subdivisionScheme = none"
                self.report.note(prim.GetPath(), "authored normals of a subdivision surface are not used", why)
            normals = surface.normals or (normals and surface.carry(normals))
        with np.errstate(invalid="ignore", over="ignore"):  # the faces of such points go below
            triangles, faces = triangulate(points, counts, corners) if surface is None else surface.triangles
        hidden = np.zeros(len(counts), bool) if surface is None else surface.hidden
        parents = faces if surface is None else surface.parents[faces]
        keep = ~(np.isin(parents, self._holes(prim)) | hidden[faces])
        keep &= np.isfinite(points).all(axis=1)[corners[triangles]].all(axis=1)
        triangles, parents = triangles[keep], parents[keep]
        if not len(triangles):
            self.report.warn(prim.GetPath(), "mesh without faces", "it is left out")
            return None
        points = np.where(np.isfinite(points), points, 0.0)
        if prim.GetAttribute("orientation").Get() == UsdGeom.Tokens.leftHanded:
            triangles = triangles[:, ::-1]
        if normals is None and surface is None and self._is_cage(prim):
            normals = _smooth_normals(points, corners, triangles)
        if normals is not None:
            normals = _unit(normals, points, corners, triangles)

        for number, subset in enumerate(subsets, start=1):
            members = as_rows(UsdGeom.Subset(subset).GetIndicesAttr().Get(self.code), 1, int)
            inside = (members >= 0) & (members < len(owner))
            if not inside.all():
                self.report.warn(subset.GetPath(), "GeomSubset indices out of range", "they are left out")
            members = members[inside]
            owner[members[owner[members] == 0]] = number
        double_sided = bool(prim.GetAttribute("doubleSided").Get(self.code) or False)
        pieces = []
        for number, look in enumerate(bound):
            chosen = triangles[owner[parents] == number]
            if len(chosen):
                piece = self._piece(authored, look, double_sided, points, corners, normals, chosen)
                if number:
                    piece.primitive["extras"] = {"usdPath": str(subsets[number - 1].GetPath())}
                pieces.append(piece)
        self.report.count("meshes")
        self.report.count("triangles", len(triangles))
        return MeshSource(str(prim.GetPath()), prim.GetName(), pieces, points, corners[triangles])

    def _polygons(self, prim: Usd.Prim) -> tuple[np.ndarray, np.ndarray, np.ndarray, CornerValues | None] | None:
        """Points, corner counts, corners, and normals; None (reported) if they make no mesh."""
        path = prim.GetPath()
        if prim.GetTypeName() in gprims.TYPES:
            shape = gprims.build(prim, self.code)
            normals = CornerValues(shape.normals, np.arange(len(shape.corners)))
            return shape.points, shape.counts, shape.corners, normals
        mesh = UsdGeom.Mesh(prim)
        attributes = {
            "points": mesh.GetPointsAttr(),
            "faceVertexCounts": mesh.GetFaceVertexCountsAttr(),
            "faceVertexIndices": mesh.GetFaceVertexIndicesAttr(),
        }
        for name, attribute in attributes.items():
            if changes(attribute, self.frames):
                self.report.about("animation").warn(path, f"animated {name}", "deforming meshes have no carrier; the first frame is used")
        points = as_rows(attributes["points"].Get(self.code), 3)
        counts = as_rows(attributes["faceVertexCounts"].Get(self.code), 1, int)
        corners = as_rows(attributes["faceVertexIndices"].Get(self.code), 1, int)
        if not (len(points) and len(counts) and len(corners)):
            self.report.warn(path, "mesh without faces", "it is left out")
            return None
        if (counts < 0).any() or counts.sum() != len(corners):
            why = f"faceVertexCounts sum to {counts.sum()}, faceVertexIndices are {len(corners)}; it is left out"
            self.report.warn(path, "mesh with a broken topology", why)
            return None
        if corners.min() < 0 or corners.max() >= len(points):
            why = f"faceVertexIndices run from {corners.min()} to {corners.max()}, points are {len(points)}"
            self.report.warn(path, "mesh with a broken topology", f"{why}; it is left out")
            return None
        normals = read_normals(prim, self.code, counts, corners, self.report)
        points, normals = self.skinning.pose(prim, points, corners, normals)
        return points, counts, corners, normals

    def _holes(self, prim: Usd.Prim) -> np.ndarray:
        attribute = prim.GetAttribute("holeIndices")
        return as_rows(attribute.Get(self.code) if attribute else None, 1, int)

    def _is_cage(self, prim: Usd.Prim) -> bool:
        """Whether the mesh is a subdivision surface, of which the cage is exported (reported)."""
        if prim.GetTypeName() in gprims.TYPES:
            return False
        scheme = UsdGeom.Mesh(prim).GetSubdivisionSchemeAttr().Get()
        if scheme == UsdGeom.Tokens.none or (scheme == UsdGeom.Tokens.bilinear and self.subdivider.level):
            return False
        self.report.warn(prim.GetPath(), "subdivision surface", f"{scheme}: its cage is exported, with smooth normals")
        return True

    def _piece(
        self,
        mesh: Authored,
        look: Look,
        double_sided: bool,
        points: np.ndarray,
        corners: np.ndarray,
        normals: CornerValues | None,
        triangles: np.ndarray,
    ) -> Piece:
        """The primitive of some of a mesh's triangles."""
        values: dict[str, CornerValues] = {}
        if normals is not None:
            values["NORMAL"] = normals
        for number, name in enumerate(look.uv_names):
            uv = self._primvar(mesh, name, 2)
            if uv is None:
                why = f"{look.path} reads primvars:{name}; (0, 0) is used"
                self.report.warn(mesh.prim.GetPath(), "mesh without the texture coordinates of its material", why)
                uv = CornerValues(np.zeros((1, 2)), np.zeros(len(corners), int))
            values[f"TEXCOORD_{number}"] = replace(uv, values=uv.values * [1, -1] + [0, 1])
        tint, translucent = None, False
        color = self._color(mesh, look, corners) if look.uses_display_color else None
        if color is not None:
            translucent = bool((color.values[:, 3] < 1.0).any())
            if color.constant:
                tint = tuple(color.values[color.index[0]].tolist())
            else:
                tint = (1.0, 1.0, 1.0, 1.0)
                values["COLOR_0"] = color
        primitive = self._primitive(points, corners, values, triangles)
        return Piece(primitive, look, double_sided, tint, translucent)

    def _primvar(self, mesh: Authored, name: str, width: int) -> CornerValues | None:
        """A primvar on the corners of the mesh, or of its refined surface; None if there is none."""
        if (name, width) in mesh.carried:
            return mesh.carried[name, width]
        found = read_primvar(mesh.prim, name, width, self.code, mesh.counts, mesh.corners, self.report)
        if found is not None and mesh.surface is not None:
            found = mesh.carried[name, width] = mesh.surface.carry(found)
        return found

    def _color(self, mesh: Authored, look: Look, corners: np.ndarray) -> CornerValues | None:
        """The primvar of a look's colour as linear RGBA."""
        if look.color_primvar == "displayColor" and look.color_default is None:
            return self._display_color(mesh, corners)
        color = self._primvar(mesh, look.color_primvar, 3)
        if color is None:
            why = f"{look.path} reads primvars:{look.color_primvar}; its default is used"
            self.report.about("materials").warn(mesh.prim.GetPath(), "mesh without the colours of its material", why)
            color = CornerValues(np.array([look.color_default or (0.0,) * 3]), np.zeros(len(corners), int), True)
        rgb = np.clip(color.values * look.color_scale, 0.0, 1.0)
        return replace(color, values=np.hstack([rgb, np.full((len(rgb), 1), look.base_color[3])]))

    def _display_color(self, mesh: Authored, corners: np.ndarray) -> CornerValues | None:
        """displayColor and displayOpacity as linear RGBA."""
        color, opacity = self._primvar(mesh, "displayColor", 3), self._primvar(mesh, "displayOpacity", 1)
        if color is None and opacity is None:
            return None
        one = CornerValues(np.ones((1, 1)), np.zeros(len(corners), int), True)
        grey = CornerValues(np.full((1, 3), 0.5), one.index, True)
        color, opacity = color or grey, opacity or one
        if opacity.constant:
            alpha = np.full((len(color.values), 1), opacity.values[opacity.index[0], 0])
            both = CornerValues(np.hstack([color.values, alpha]), color.index, color.constant, exact=color.exact)
        else:
            rgba = np.hstack([color.values[color.index], opacity.values[opacity.index]])
            both = CornerValues(rgba, np.arange(len(corners)))
        both.values = np.clip(both.values, 0.0, 1.0)
        return both

    def _primitive(
        self, points: np.ndarray, corners: np.ndarray, values: dict[str, CornerValues], triangles: np.ndarray
    ) -> dict:
        """Weld equal corners and store the attributes."""
        used = triangles.reshape(-1)
        key = corners[used]
        for found in values.values():
            index = found.index[used]
            if found.exact and found.index is not corners:
                key = _paired(key, index)
            elif found.index is not corners:
                key = _refined(key, found.values.astype(np.float32)[index])
        _, first, index = np.unique(key, return_index=True, return_inverse=True)
        vertex = used[first]
        attributes = {
            "POSITION": self.document.accessor(points[corners[vertex]].astype(np.float32), 34962, bounds=True)
        }
        for name, found in values.items():
            array = found.values[found.index[vertex]].astype(np.float32)
            attributes[name] = self.document.accessor(array, 34962)
        return {"attributes": attributes, "indices": self.document.indices(index.reshape(-1))}


def _material_subsets(prim: Usd.Prim) -> list[Usd.Prim]:
    """Face subsets of the family materialBind."""
    imageable = UsdGeom.Imageable(prim)
    if prim.GetTypeName() in gprims.TYPES:
        return []
    found = UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets() if imageable else []
    return [s.GetPrim() for s in found if s.GetElementTypeAttr().Get() == UsdGeom.Tokens.face]


def _paired(key: np.ndarray, index: np.ndarray) -> np.ndarray:
    """Keys that tell apart what `key` does and, besides, different indices."""
    width = int(index.max(initial=0)) + 1
    if int(key.max(initial=0)) >= (1 << 62) // width:
        _, key = np.unique(key, return_inverse=True)
    return key * width + index


def _refined(key: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Keys that tell apart what `key` does and, besides, different rows."""
    _, key = np.unique(key, return_inverse=True)
    for column in rows.T + np.float32(0):
        bits = np.ascontiguousarray(column).view(np.uint32).astype(np.uint64)
        _, key = np.unique((key.astype(np.uint64) << np.uint64(32)) | bits, return_inverse=True)
    return key


def _area_normals(points: np.ndarray, corners: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """For each point the sum of the area vectors around it."""
    index = corners[triangles]
    corner = points[index]
    area = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    total = np.zeros((len(points), 3))
    for axis in range(3):
        total[:, axis] = np.bincount(index.reshape(-1), np.repeat(area[:, axis], 3), minlength=len(points))
    return total


def _smooth_normals(points: np.ndarray, corners: np.ndarray, triangles: np.ndarray) -> CornerValues:
    """Vertex normals weighted by area."""
    return CornerValues(_area_normals(points, corners, triangles), corners)


def _unit(normals: CornerValues, points: np.ndarray, corners: np.ndarray, triangles: np.ndarray) -> CornerValues:
    """Unit normals. Where one is zero, the geometric one at its point, and at worst +Z."""
    length = np.linalg.norm(normals.values, axis=1, keepdims=True)
    if (length > 0).all():
        return replace(normals, values=normals.values / length)
    if normals.exact:
        place = np.zeros(len(length), int)
        place[normals.index] = corners
        geometric = np.where(length > 0, normals.values, _area_normals(points, corners, triangles)[place])
        length = np.linalg.norm(geometric, axis=1, keepdims=True)
        return replace(normals, values=np.where(length > 0, geometric / np.where(length > 0, length, 1.0), [0.0, 0.0, 1.0]))
    spread = normals.values[normals.index]
    geometric = _area_normals(points, corners, triangles)[corners]
    spread = np.where(np.linalg.norm(spread, axis=1, keepdims=True) > 0, spread, geometric)
    length = np.linalg.norm(spread, axis=1, keepdims=True)
    spread = np.where(length > 0, spread / np.where(length > 0, length, 1.0), [0.0, 0.0, 1.0])
    return CornerValues(spread, np.arange(len(corners)))
