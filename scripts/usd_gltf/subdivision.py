"""Subdivision surfaces as UsdGeomMesh defines them, refined to a level and laid on their limit.

`catmullClark`, `loop` and `bilinear`, with creases, corners, boundary rules, holes and primvars of every
interpolation. `subdivision_topology` says how faces meet, `subdivision_masks` how values are averaged,
`subdivision_normals` where the limit surface faces, `subdivision_seams` what face-varying values do.

The level is usdrecord's `--complexity`: low, medium, high and veryhigh refine 0, 1, 2 and 3 times (UsdImaging's
refine levels). A mesh is refined less, and reported, where it would have more than `MOST_FACES` faces.
"""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from pxr import Usd, UsdGeom

from .primvars import CornerValues, as_rows
from .report import Notebook
from .stage import Frames, changes
from .subdivision_masks import limit, refine, refine_linear
from .subdivision_normals import LimitNormals
from .subdivision_seams import torn
from .subdivision_topology import INFINITE, Topology, boundaries, build, crease, sharpen_vertices, split_to_quads, split_to_triangles
from .triangulate import triangulate

LEVELS = {"low": 0, "medium": 1, "high": 2, "veryhigh": 3}
"""Refine level of each complexity."""

MOST_FACES = 2_000_000
"""Faces of one refined mesh. A mesh at this bound takes about 2 GB while it is refined."""

MOST_FACES_OF_A_STAGE = 16_000_000
"""Faces of all refined meshes of a stage, each counted once however often it is instanced."""

_FACES_KEPT = 200_000
"""Faces of the last surfaces that are kept for meshes like them; about 1 kB each."""

_RULES = (
    "subdivisionScheme", "interpolateBoundary", "faceVaryingLinearInterpolation", "triangleSubdivisionRule",
    "creaseIndices", "creaseLengths", "creaseSharpnesses", "cornerIndices", "cornerSharpnesses",
)  # fmt: skip


@dataclass
class Rules:
    """A mesh's subdivision attributes at one time."""

    scheme: str
    boundary: str
    face_varying: str
    smooth_triangles: bool
    left_handed: bool = False


@dataclass
class Cage:
    """The part of a mesh that is refined."""

    topology: Topology
    points: np.ndarray
    faces: np.ndarray
    """(f,) the mesh's number of each face."""
    kept: np.ndarray
    """(all corners,) which of the mesh's corners belong to these faces."""


class Surface:
    """A mesh refined: its faces, and how its primvars follow.

    `points` (v, 3), `counts` (f,), `corners` (c,) are the refined polygons', `parents` (f,) the mesh's own face
    that each of them is part of, `hidden` (f,) whether the boundary rule leaves it out, `normals` those of
    the limit surface, or None for `bilinear`, which has none.
    """

    def __init__(self, mesh: Cage, rules: Rules, level: int) -> None:
        self._mesh, self._rules, self.level = mesh, rules, level
        self._triangular = rules.scheme == "loop"
        open_ends = rules.boundary == "none" and not self._linear
        hidden = _open_faces(mesh.topology) if open_ends else np.zeros(len(mesh.faces), bool)
        sharpen_vertices(mesh.topology, rules.boundary == "edgeAndCorner")
        self._levels = self._split(mesh.topology, level)
        self.counts, self.corners = self._levels[-1].counts, self._levels[-1].corners
        first = np.arange(len(mesh.faces)) if self._triangular else mesh.topology.face
        self._own_face = np.repeat(first, 4**level if self._triangular else 4 ** (level - 1))
        self.parents, self.hidden = mesh.faces[self._own_face], hidden[self._own_face]
        self.points, self.normals = self.shape(mesh.points)

    def shape(self, points: np.ndarray) -> tuple[np.ndarray, CornerValues | None]:
        """`points` and `normals` for other points (v, 3) of the mesh, which are finite."""
        points, last = self._refine(self._levels, points, self._linear), self._levels[-1]
        if self._linear:
            return points, None
        normals = self._facing(points)
        facing = CornerValues(-normals if self._rules.left_handed else normals, self._facing.index, exact=True)
        return limit(last, points, self._triangular), facing

    @cached_property
    def _facing(self) -> LimitNormals:
        return LimitNormals(self._levels[-1], self._triangular)

    @cached_property
    def triangles(self) -> tuple[np.ndarray, np.ndarray]:
        """What `triangulate` makes of the refined faces."""
        return triangulate(self.points, self.counts, self.corners)

    @property
    def _linear(self) -> bool:
        return self._rules.scheme == "bilinear"

    def carry(self, found: CornerValues) -> CornerValues:
        """A primvar of the mesh on the refined surface."""
        kind, index = found.interpolation, found.index[self._mesh.kept]
        if kind == "constant":
            return CornerValues(found.values, np.full(len(self.corners), found.index[0]), True)
        if kind == "uniform":
            of_face = index[self._mesh.topology.starts]
            return CornerValues(found.values, np.repeat(of_face[self._own_face], self.counts))
        linear = self._linear or kind == "varying" or (kind == "faceVarying" and self._rules.face_varying == "all")
        if kind == "faceVarying":
            # Without indices, equal values at a vertex are one.
            numbers = index if found.indexed else np.unique(found.values, axis=0, return_inverse=True)[1].reshape(-1)[index]
            seams, shown = torn(self._mesh.topology, numbers, self._rules.face_varying)
            levels, values = self._split(seams, len(self._levels) - 1), found.values[index[shown]]
        else:
            levels, values = self._levels, np.zeros((self._mesh.topology.vertices, found.values.shape[1]))
            values[self._mesh.topology.corners] = found.values[index]
        values = self._refine(levels, values, linear)
        if not linear:
            values = limit(levels[-1], values, self._triangular)
        return CornerValues(values, levels[-1].corners, exact=True)

    def _split(self, base: Topology, level: int) -> list[Topology]:
        levels = [base]
        for _ in range(level):
            levels.append(split_to_triangles(levels[-1]) if self._triangular else split_to_quads(levels[-1]))
        return levels

    def _refine(self, levels: list[Topology], values: np.ndarray, linear: bool) -> np.ndarray:
        for level in levels[:-1]:
            if linear:
                values = refine_linear(level, values, self._triangular)
            else:
                values = refine(level, values, self._triangular, self._rules.smooth_triangles)
        return values


class Subdivider:
    """Refines the meshes of a stage to the level of a complexity."""

    def __init__(self, complexity: str, frames: Frames, report: Notebook) -> None:
        self.level, self.frames, self.report = LEVELS[complexity], frames, report
        self._faces = 0
        self._kept: OrderedDict[bytes, Surface] = OrderedDict()

    def surface(
        self, prim: Usd.Prim, points: np.ndarray, counts: np.ndarray, corners: np.ndarray, deforms: bool
    ) -> Surface | None:
        """A mesh's surface, or None if it is no subdivision surface, is bilinear and flat (and stays so), or cannot be
        refined (the last is reported). Faces with `points` that are not finite, or of fewer than three corners, are no part of it."""
        mesh, code = UsdGeom.Mesh(prim), self.frames.first
        scheme = str(mesh.GetSubdivisionSchemeAttr().Get(code))
        if scheme == "none" or self.level == 0:
            return None
        lost = np.bincount(np.repeat(np.arange(len(counts)), counts)[~np.isfinite(points).all(axis=1)[corners]], minlength=len(counts))
        usable = (counts > 2) & (lost == 0)
        faces, kept = np.flatnonzero(usable), np.repeat(usable, counts)
        if scheme == "bilinear" and not deforms and _flat(points, counts[faces], corners[kept]):
            return None
        if not len(faces) or not self._can_be_refined(prim.GetPath(), scheme, counts[faces]):
            return None
        for name in _RULES:
            if changes(prim.GetAttribute(name), self.frames):
                self.report.about("animation").warn(prim.GetPath(), f"animated {name}", "the first frame's is used")
        rules = Rules(
            scheme,
            str(mesh.GetInterpolateBoundaryAttr().Get(code)),
            str(mesh.GetFaceVaryingLinearInterpolationAttr().Get(code)),
            mesh.GetTriangleSubdivisionRuleAttr().Get(code) == UsdGeom.Tokens.smooth,
            mesh.GetOrientationAttr().Get(code) == UsdGeom.Tokens.leftHanded,
        )
        topology, keys = build(len(points), counts[faces], corners[kept])
        self._sharpen(mesh, topology, keys)
        surface = self._shared(prim.GetPath(), Cage(topology, np.where(np.isfinite(points), points, 0.0), faces, kept), rules)
        if surface is not None:
            self.report.count("subdivision surfaces")
        return surface

    def _shared(self, path: object, cage: Cage, rules: Rules) -> Surface | None:
        """The surface of a cage, or that of an equal one among the last: props are often repeated without instancing."""
        digest = hashlib.blake2b(repr(rules).encode())
        topology = cage.topology
        for part in (cage.points, cage.faces, cage.kept, topology.counts, topology.corners, topology.edge_sharpness,
                     topology.vertex_sharpness, topology.creased):  # fmt: skip
            digest.update(np.ascontiguousarray(part).tobytes() + b"|")
        key = digest.digest()
        surface = self._kept.pop(key, None)
        faces = self._faces_by_level(rules.scheme, topology.counts)
        if surface is None:
            most = min(MOST_FACES, MOST_FACES_OF_A_STAGE - self._faces)
            level = max(level for level in range(self.level + 1) if faces[level] <= most)
            self._faces += faces[level]
            surface = Surface(cage, rules, level) if level else None
        level = surface.level if surface is not None else 0
        if level < self.level:
            what = "subdivision surface that is refined less" if level else "subdivision surface"
            bound = f"{MOST_FACES} faces a mesh, {MOST_FACES_OF_A_STAGE} a stage"
            taken = f"level {level} is used" if level else "its cage is exported, with smooth normals"
            self.report.warn(path, what, f"level {self.level} has {faces[-1]} faces, the bound is {bound}; {taken}")
        if surface is None:
            return None
        self._kept[key] = surface
        while sum(len(kept.counts) for kept in self._kept.values()) > _FACES_KEPT:
            self._kept.popitem(last=False)
        return surface

    def _can_be_refined(self, path: object, scheme: str, counts: np.ndarray) -> bool:
        """Whether the scheme fits faces of so many corners; reported if not."""
        if scheme not in ("catmullClark", "loop", "bilinear"):
            self.report.warn(path, "subdivision surface", f"there is no scheme {scheme}; its cage is exported")
            return False
        if scheme == "loop" and (counts != 3).any():
            why = "loop is for triangles alone, and it has other faces; its cage is exported, with smooth normals"
            self.report.warn(path, "subdivision surface", why)
            return False
        return True

    def _faces_by_level(self, scheme: str, counts: np.ndarray) -> list[int]:
        """Refined faces of levels 0 to `level`; none at 0."""
        first = 4 * len(counts) if scheme == "loop" else int(counts.sum())
        return [0, *(first * 4**level for level in range(self.level))]

    def _sharpen(self, mesh: UsdGeom.Mesh, topology: Topology, keys: np.ndarray) -> None:
        """Creases and corners as authored; what does not fit the mesh is left out and reported."""
        code, path = self.frames.first, mesh.GetPath()
        indices = as_rows(mesh.GetCornerIndicesAttr().Get(code), 1, int)
        sharpness = as_rows(mesh.GetCornerSharpnessesAttr().Get(code), 1)
        fits = len(indices) == len(sharpness)
        if fits:
            there = (indices >= 0) & (indices < topology.vertices) & ~np.isnan(sharpness)
            topology.vertex_sharpness[indices[there]] = np.clip(sharpness[there], 0.0, INFINITE)
        if not (fits and there.all()):
            self.report.warn(path, "corners that do not fit their mesh", f"{len(indices)} cornerIndices, {len(sharpness)} sharpnesses")

        indices = as_rows(mesh.GetCreaseIndicesAttr().Get(code), 1, int)
        lengths = as_rows(mesh.GetCreaseLengthsAttr().Get(code), 1, int)
        sharpness = as_rows(mesh.GetCreaseSharpnessesAttr().Get(code), 1)
        fits = (lengths > 1).all() and lengths.sum() == len(indices)
        if fits and len(sharpness) == len(lengths):
            sharpness = np.repeat(sharpness, lengths - 1)
        fits = fits and len(sharpness) == (lengths - 1).sum()
        if fits and len(lengths):
            pairs = np.ones(max(len(indices) - 1, 0), bool)
            pairs[np.cumsum(lengths)[:-1] - 1] = False
            start, end = indices[:-1][pairs], indices[1:][pairs]
            fits = crease(topology, keys, start, end, sharpness).all()
        if not fits:
            why = f"{len(lengths)} creases of {len(indices)} points, {len(sharpness)} sharpnesses; edges that are not there are left out"
            self.report.warn(path, "creases that do not fit their mesh", why)


def _flat(points: np.ndarray, counts: np.ndarray, corners: np.ndarray) -> bool:
    """Whether all faces are triangles and parallelograms, which `bilinear` leaves as they are."""
    if not len(counts) or counts.max() > 4:
        return False
    quads = points[corners[np.repeat(counts == 4, counts)].reshape(-1, 4)]
    warp = quads[:, 0] - quads[:, 1] + quads[:, 2] - quads[:, 3]
    return bool((np.abs(warp).max(axis=1, initial=0) <= 1e-6 * np.ptp(quads, axis=1).max(axis=1, initial=0)).all())


def _open_faces(topology: Topology) -> np.ndarray:
    """(f,) which faces `interpolateBoundary = none` leaves out: those that touch a boundary edge which no
    crease has made sharp (OpenSubdiv, Far::TopologyRefinerFactory, `makeBoundaryFacesHoles`)."""
    soft = boundaries(topology) & ~topology.creased
    touched = topology.incident(soft) > 0
    return np.maximum.reduceat(touched[topology.corners], topology.starts)
