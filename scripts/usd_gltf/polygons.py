"""The polygons of meshes and intrinsic gprims, and the control points of curves, as they are posed, at the first frame and at other times."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from pxr import Usd, UsdGeom

from . import curves, gprims
from .animation import NOISE
from .normals import Split
from .primvars import CornerValues, as_rows, normals_may_vary, normals_vary, read_normals
from .report import Notebook
from .skinning import Skinning
from .stage import Frames, changes
from .velocities import points_at, points_move

_TOPOLOGY = ("faceVertexCounts", "faceVertexIndices", "curveVertexCounts")


class Unlike(Exception):
    """Why a mesh's shape at some time is no displacement of the first frame's."""


@dataclass
class Polygons:
    """A mesh posed at the first frame: `points` (v, 3), `counts` (f,) and `corners` (c,) of its faces. Of curves, points are control
    vertices, and faces whole curves."""

    points: np.ndarray
    counts: np.ndarray
    corners: np.ndarray
    normals: CornerValues | None = None
    changed: list[str] = field(default_factory=list)
    """What deforms it, in the report's words."""
    deforms: bool = False
    """Whether it moves otherwise than as a whole, and nothing is in the way of carrying that."""
    split: Split | None = None
    """Which corners share a normal, if it deforms and has normals."""
    layout: curves.Layout | None = None
    """How the control vertices make curves."""


class PolygonReader:
    """Reads the polygons of prims."""

    def __init__(self, skinning: Skinning, frames: Frames, report: Notebook) -> None:
        self.skinning, self.frames, self.report = skinning, frames, report

    def first(self, prim: Usd.Prim) -> Polygons | None:
        """The polygons at the first frame; None (reported) if they make no mesh."""
        code, is_gprim = self.frames.first, prim.GetTypeName() in gprims.TYPES
        is_curves = prim.GetTypeName() == curves.TYPE
        found = self._gprim(prim, code) if is_gprim else self._curves(prim) if is_curves else self._mesh(prim)
        if found is None:
            return None
        names = gprims.SIZES if is_gprim else curves.ATTRIBUTES if is_curves else ("points", *_TOPOLOGY)
        changed = [name for name in names if changes(prim.GetAttribute(name), self.frames)]
        found.changed = [f"animated {name}" for name in changed]
        if not is_gprim and points_move(prim, self.frames, self.report.about("animation")):
            found.changed.append("animated points (velocities)")
        authored, corners = found.points, found.corners
        if not is_gprim and self.skinning.may_deform(prim):
            found.changed.append("skinned mesh that deforms")
        # A subdivision surface has normals of its own.
        turns = not is_gprim and _is_polygonal(prim) and normals_vary(prim, self.frames)
        turns |= is_curves and any(name not in ("points", *_TOPOLOGY) for name in changed)
        if turns and not found.changed:
            found.changed.append("animated normals")
        if found.changed:
            found.points, _ = self._pose(prim, authored, corners, None)
            found.deforms = self._is_carried(prim, found, changed, turns)
        normals = self._normals(prim, code, found)
        found.points, found.normals = self._pose(prim, authored, corners, normals)
        if found.deforms and normals is not None:
            codes = self.frames.codes if is_gprim or normals_may_vary(prim) else ()
            try:
                found.split = Split.of(corners, len(authored), [normals, *(self._like(prim, c, found) for c in codes)])
                found.normals = found.split.gather(found.normals)
            except Unlike as why:
                self.lose(prim, found, why)
        return found

    def at(self, prim: Usd.Prim, code: float, first: Polygons) -> tuple[np.ndarray, CornerValues | None]:
        """Points (v, 3) of a mesh that deforms, and normals if `first` has any, at another time. Raises Unlike."""
        normals = self._like(prim, code, first) if first.normals is not None else None
        points, normals = self._posed(prim, code, first, normals)
        good = np.abs(points) < 3e38
        if not good[np.isfinite(first.points)].all():
            why = f"at frame {code:g}; where they are at the first frame is used"
            self.report.warn(prim.GetPath(), "points that are not finite over time", why)
        return np.where(good, points, first.points), None if normals is None else first.split.gather(normals)

    def lose(self, prim: Usd.Prim, found: Polygons, why: object) -> None:
        """Report that a mesh stays as it is at the first frame."""
        found.deforms = False
        for what in found.changed:
            shape = "the pose" if what.startswith("skinned") else "the shape"
            kept = f"{why}; {shape} of frame {self.frames.first:g} is used"
            self.report.about("animation").warn(prim.GetPath(), what, kept)

    def _is_carried(self, prim: Usd.Prim, found: Polygons, changed: list[str], turns: bool) -> bool:
        """Whether a mesh that may deform does, or its normals turn, and that can be carried; reported if it cannot."""
        try:
            if any(name in _TOPOLOGY for name in changed):
                raise Unlike("topology that changes has no carrier")
            return turns or any(self._moves(prim, code, found) for code in self.frames.codes)
        except Unlike as why:
            self.lose(prim, found, why)
            return False

    def _moves(self, prim: Usd.Prim, code: float, found: Polygons) -> bool:
        """Whether points of faces are elsewhere than at the first frame, by more than rounding."""
        if not any(what.startswith("animated") for what in found.changed) and not self.skinning.differs(prim, code):
            return False
        points, _ = self._posed(prim, code, found, None)
        used = np.zeros(len(points), bool)
        used[found.corners] = True
        size = np.abs(found.points[used])
        with np.errstate(invalid="ignore", over="ignore"):
            near = NOISE * size[size < 3e38].max(initial=0.0)
            return bool((np.abs(points[used] - found.points[used]) > near).any())

    def _posed(self, prim: Usd.Prim, code: float, first: Polygons, normals: CornerValues | None):
        """Points and normals at a time; the normals are what is authored there."""
        if prim.GetTypeName() in gprims.TYPES:
            shape = self._gprim(prim, code)
            if not np.array_equal(shape.counts, first.counts):
                raise Unlike(f"it has other faces at frame {code:g}")
            return shape.points, normals
        points = points_at(prim, code)
        if len(points) != len(first.points):
            raise Unlike(f"it has {len(first.points)} points at the first frame, {len(points)} at frame {code:g}")
        try:
            return self.skinning.posed(prim, points, first.corners, normals, code)
        except (ValueError, np.linalg.LinAlgError) as error:
            raise Unlike(f"it cannot be posed at frame {code:g} ({error})") from None

    def _like(self, prim: Usd.Prim, code: float, first: Polygons) -> CornerValues:
        """The normals authored at a time, which are there at the first frame."""
        normals = self._normals(prim, code, first)
        if normals is None or len(normals.index) != len(first.corners):
            raise Unlike(f"its normals do not fit it at frame {code:g}")
        return normals

    def _normals(self, prim: Usd.Prim, code: float, found: Polygons) -> CornerValues | None:
        """The normals authored at a time."""
        if found.layout is not None:
            return None
        if prim.GetTypeName() in gprims.TYPES:
            return self._gprim(prim, code).normals
        return read_normals(prim, code, found.counts, found.corners, self.report, None if found.deforms else self.frames)

    def _pose(self, prim: Usd.Prim, points: np.ndarray, corners: np.ndarray, normals: CornerValues | None):
        """Points and normals in the pose of the first frame; no joint bends an intrinsic gprim."""
        if prim.GetTypeName() in gprims.TYPES:
            return points, normals
        return self.skinning.pose(prim, points, corners, normals)

    @staticmethod
    def _gprim(prim: Usd.Prim, code: float) -> Polygons:
        shape = gprims.build(prim, code)
        normals = CornerValues(shape.normals, np.arange(len(shape.corners)))
        return Polygons(shape.points, shape.counts, shape.corners, normals)

    def _curves(self, prim: Usd.Prim) -> Polygons | None:
        """The same of BasisCurves."""
        points = points_at(prim, self.frames.first)
        layout = curves.read_layout(prim, self.frames.first, len(points), self.report)
        if layout is None:
            return None
        if self.skinning.bends(prim) and curves.read_directions(prim, self.frames.first, layout, self.report) is not None:
            self.report.warn(prim.GetPath(), "ribbons that a skeleton bends", "their normals are as authored, and do not turn with it")
        return Polygons(points, layout.counts, np.arange(len(points)), layout=layout)

    def _mesh(self, prim: Usd.Prim) -> Polygons | None:
        """What a Mesh is at the first frame, not yet posed; None (reported) if that is no mesh."""
        path, mesh, code = prim.GetPath(), UsdGeom.Mesh(prim), self.frames.first
        points = points_at(prim, code)
        counts = as_rows(mesh.GetFaceVertexCountsAttr().Get(code), 1, int)
        corners = as_rows(mesh.GetFaceVertexIndicesAttr().Get(code), 1, int)
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
        return Polygons(points, counts, corners)


def _is_polygonal(prim: Usd.Prim) -> bool:
    """Whether normals mean something: not of subdivision surfaces. Those of curves say how ribbons lie."""
    return prim.IsA(UsdGeom.Mesh) and UsdGeom.Mesh(prim).GetSubdivisionSchemeAttr().Get() == UsdGeom.Tokens.none
