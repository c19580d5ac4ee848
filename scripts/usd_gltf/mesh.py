"""UsdGeomMesh, the intrinsic gprims and UsdGeomBasisCurves to glTF primitives.

A mesh is cut into pieces, one for each material (GeomSubset). Corners with equal position, normal,
texture coordinates and colour share a vertex. Texture coordinates are turned over: USD's v runs up
from the image's last row, glTF's down from its first.

A mesh that deforms has morph targets (`deformation`), whether it emits light or not.

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
from .animation import NOISE
from .deformation import Deformer, Motion, Part, TooMuch
from .gltf_document import Document
from .light_inputs import Light
from .materials import Emission, Look, Materials
from .normals import refined, smooth_normals, unit_normals
from .polygons import PolygonReader, Polygons, Unlike
from .primvars import CornerValues, as_rows, read_primvar
from .report import Notebook
from .skinning import Skinning
from .stage import Frames
from .subdivision import Subdivider, Surface
from .triangulate import triangulate
from .tubes import Strander, Strands

if TYPE_CHECKING:
    from collections.abc import Callable

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
    """A mesh, or curves, as authored, which its primvars are read against, and the surface that is made of it."""

    prim: Usd.Prim
    counts: np.ndarray
    corners: np.ndarray
    surface: Surface | Strands | None = None
    varying: int | None = None
    """How many `varying` values curves have."""
    carried: dict[tuple[str, int], CornerValues] = field(default_factory=dict)
    """Primvars that are on the surface already: the pieces of a mesh share them."""

    def shape(self, points: np.ndarray, code: float) -> tuple[np.ndarray, CornerValues | None]:
        """Points and normals of the surface, of the mesh's points at a time."""
        return self.surface.shape(points, code) if isinstance(self.surface, Strands) else self.surface.shape(points)


@dataclass
class MeshSource:
    """A mesh read and triangulated; its glTF mesh depends on the light it may be."""

    path: str
    name: str
    pieces: list[Piece]
    points: np.ndarray
    triangles: np.ndarray
    motion: Motion | None = None
    """How it deforms: over the targets of its pieces' primitives."""
    points_at: Callable[[float], np.ndarray] | None = None
    """The points at a time code, if it deforms."""

    def area(self, linear: np.ndarray, code: float | None = None) -> float:
        """World-space surface area (one side) under the linear part of a transform, at the first frame or another."""
        points = self.points if code is None or self.points_at is None else self.points_at(code)
        corners = (points @ linear.T)[self.triangles]
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
        self.code, self.report = frames.first, report
        self.polygons = PolygonReader(skinning, frames, report)
        self.deformer = Deformer(document, frames, report)
        self.subdivider = Subdivider(complexity, frames, report)
        self.strander = Strander(complexity, report)
        self._read: dict[tuple, MeshSource | None] = {}
        self.link_subsets: LinkSubsets | None = None
        """Subsets that light links divide meshes by, besides materials."""

    def read(self, prim: Usd.Prim) -> MeshSource | None:
        """The mesh of a Mesh, an intrinsic gprim or curves; None (reported) if it has no faces."""
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
        polygons = self.polygons.first(prim)
        if polygons is None:
            return None
        points, counts, corners, normals = polygons.points, polygons.counts, polygons.corners, polygons.normals
        points = polygons.points = np.where(np.abs(points) < 3e38, points, np.nan)
        if not np.isfinite(points).all():
            self.report.warn(prim.GetPath(), "points that are not finite", "faces that use them are left out")
        authored, surface = Authored(prim, counts, corners), None
        if polygons.layout is not None:
            authored.varying = int(polygons.layout.varying.sum())
            surface = authored.surface = self.strander.surface(prim, polygons.layout, points, polygons.deforms, self.code)
        elif prim.GetTypeName() not in gprims.TYPES:
            surface = authored.surface = self.subdivider.surface(prim, points, counts, corners, polygons.deforms)
        owner = np.zeros(len(counts), int)
        if surface is not None:
            points, counts, corners = surface.points, surface.counts, surface.corners
            if normals and surface.normals:
                why = "UsdGeom gives them no meaning; a mesh of polygons has subdivisionScheme = none"
                self.report.note(prim.GetPath(), "authored normals of a subdivision surface are not used", why)
                polygons.normals = None
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
        if polygons.layout is None and prim.GetAttribute("orientation").Get() == UsdGeom.Tokens.leftHanded:
            triangles = triangles[:, ::-1]
        smooth = normals is None and surface is None and self._is_cage(prim)
        normals = _finished(normals, smooth, points, corners, triangles)

        for number, subset in enumerate(subsets, start=1):
            members = as_rows(UsdGeom.Subset(subset).GetIndicesAttr().Get(self.code), 1, int)
            inside = (members >= 0) & (members < len(owner))
            if not inside.all():
                self.report.warn(subset.GetPath(), "GeomSubset indices out of range", "they are left out")
            members = members[inside]
            owner[members[owner[members] == 0]] = number
        double_sided = bool(prim.GetAttribute("doubleSided").Get(self.code) or False)
        pieces, parts = [], []
        for number, look in enumerate(bound):
            chosen = triangles[owner[parents] == number]
            if len(chosen):
                piece, corner = self._piece(authored, look, double_sided, points, corners, normals, chosen)
                if number:
                    piece.primitive["extras"] = {"usdPath": str(subsets[number - 1].GetPath())}
                pieces.append(piece)
                parts.append(Part(piece.primitive, corner))
        self.report.count("meshes")
        self.report.count("triangles", len(triangles))
        motion = self._motion(authored, polygons, parts, corners, triangles, smooth) if polygons.deforms else None
        points_at = (lambda code: self._posed(authored, polygons, code)[0]) if motion is not None else None
        return MeshSource(str(prim.GetPath()), prim.GetName(), pieces, points, corners[triangles], motion, points_at)

    def _posed(
        self, mesh: Authored, polygons: Polygons, code: float
    ) -> tuple[np.ndarray, CornerValues | None]:
        """Points and normals of the surface of a mesh that deforms."""
        points, normals = self.polygons.at(mesh.prim, code, polygons)
        points = np.where(np.isfinite(points), points, 0.0)
        if mesh.surface is not None:
            points, own = mesh.shape(points, code)
            normals = own or (normals and mesh.surface.carry(normals))
        return points, normals

    def _motion(
        self,
        mesh: Authored,
        polygons: Polygons,
        parts: list[Part],
        corners: np.ndarray,
        triangles: np.ndarray,
        smooth: bool,
    ) -> Motion | None:
        """How a mesh deforms; None (reported) if that cannot be carried."""
        corner = np.concatenate([part.corner for part in parts])

        def shape(code: float) -> np.ndarray:
            """Points and normals of all vertices, made as those of the first frame are."""
            points, normals = self._posed(mesh, polygons, code)
            normals = _finished(normals, smooth, points, corners, triangles)
            rows = [points[corners[corner]]]
            if normals is not None:
                rows.append(normals.values[normals.index[corner]])
            return np.hstack(rows).astype(np.float32)

        try:
            motion = self.deformer.carry(parts, shape)
            if motion is not None and motion.near > NOISE:
                why = f"all keys are too many bytes; those that are kept show its points to {motion.near:g} of its largest coordinate"
                self.report.about("animation").warn(mesh.prim.GetPath(), "deformation with fewer keys", why)
            return motion
        except (Unlike, TooMuch) as why:
            self.polygons.lose(mesh.prim, polygons, why)
            return None

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
    ) -> tuple[Piece, np.ndarray]:
        """The primitive of some of a mesh's triangles, and the corner (n,) that each of its vertices is."""
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
        primitive, corner = self._primitive(points, corners, values, triangles)
        return Piece(primitive, look, double_sided, tint, translucent), corner

    def _primvar(self, mesh: Authored, name: str, width: int) -> CornerValues | None:
        """A primvar on the corners of the mesh, or of its refined surface; None if there is none."""
        if (name, width) in mesh.carried:
            return mesh.carried[name, width]
        frames, layout = self.polygons.frames, (mesh.counts, mesh.corners)
        found = read_primvar(mesh.prim, name, width, self.code, *layout, self.report, frames, mesh.varying)
        if found is not None and mesh.surface is not None:
            found = mesh.carried[name, width] = mesh.surface.carry(found)
        return found

    def _color(self, mesh: Authored, look: Look, corners: np.ndarray) -> CornerValues | None:
        """The primvar of a look's colour as linear RGBA."""
        if look.color_primvar == "displayColor" and look.color_default is None:
            return self._display_color(mesh, corners)
        color = self._primvar(mesh, look.color_primvar, 3)
        if color is None:
            why = f"{look.path} reads primvars:{look.color_primvar}; the default that the material gives is used"
            self.report.about("materials").note(mesh.prim.GetPath(), "mesh without the colours of its material", why)
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
    ) -> tuple[dict, np.ndarray]:
        """Weld equal corners and store the attributes; the corner (n,) of each vertex."""
        used = triangles.reshape(-1)
        key = corners[used]
        for found in values.values():
            index = found.index[used]
            if found.exact and found.index is not corners:
                key = _paired(key, index)
            elif found.index is not corners:
                key = refined(key, found.values.astype(np.float32)[index])
        _, first, index = np.unique(key, return_index=True, return_inverse=True)
        vertex = used[first]
        attributes = {
            "POSITION": self.document.accessor(points[corners[vertex]].astype(np.float32), 34962, bounds=True)
        }
        for name, found in values.items():
            array = found.values[found.index[vertex]].astype(np.float32)
            attributes[name] = self.document.accessor(array, 34962)
        return {"attributes": attributes, "indices": self.document.indices(index.reshape(-1))}, vertex


def _finished(
    normals: CornerValues | None, smooth: bool, points: np.ndarray, corners: np.ndarray, triangles: np.ndarray
) -> CornerValues | None:
    """The normals that are exported: unit ones, or `smooth` ones."""
    if smooth:
        normals = smooth_normals(points, corners, triangles)
    return None if normals is None else unit_normals(normals, points, corners, triangles)


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
