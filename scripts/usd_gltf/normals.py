"""Normals of meshes: unit ones, smooth ones, and which corners of a mesh share one."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from .primvars import CornerValues


def area_normals(points: np.ndarray, corners: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """For each point the sum of the area vectors around it."""
    index = corners[triangles]
    corner = points[index]
    area = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    total = np.zeros((len(points), 3))
    for axis in range(3):
        total[:, axis] = np.bincount(index.reshape(-1), np.repeat(area[:, axis], 3), minlength=len(points))
    return total


def smooth_normals(points: np.ndarray, corners: np.ndarray, triangles: np.ndarray) -> CornerValues:
    """Vertex normals weighted by area."""
    return CornerValues(area_normals(points, corners, triangles), corners)


def unit_normals(normals: CornerValues, points: np.ndarray, corners: np.ndarray, triangles: np.ndarray) -> CornerValues:
    """Unit normals. Where one is zero, the geometric one at its point, and at worst +Z."""
    length = np.linalg.norm(normals.values, axis=1, keepdims=True)
    if (length > 0).all():
        return replace(normals, values=normals.values / length)
    if normals.exact:
        place = np.zeros(len(length), int)
        place[normals.index] = corners
        geometric = np.where(length > 0, normals.values, area_normals(points, corners, triangles)[place])
        length = np.linalg.norm(geometric, axis=1, keepdims=True)
        return replace(normals, values=np.where(length > 0, geometric / np.where(length > 0, length, 1.0), [0.0, 0.0, 1.0]))
    spread = normals.values[normals.index]
    geometric = area_normals(points, corners, triangles)[corners]
    spread = np.where(np.linalg.norm(spread, axis=1, keepdims=True) > 0, spread, geometric)
    length = np.linalg.norm(spread, axis=1, keepdims=True)
    spread = np.where(length > 0, spread / np.where(length > 0, length, 1.0), [0.0, 0.0, 1.0])
    return CornerValues(spread, np.arange(len(corners)))


def refined(key: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Keys that tell apart what `key` does and, besides, different rows."""
    _, key = np.unique(key, return_inverse=True)
    for column in rows.T + np.float32(0):
        bits = np.ascontiguousarray(column).view(np.uint32).astype(np.uint64)
        _, key = np.unique((key.astype(np.uint64) << np.uint64(32)) | bits, return_inverse=True)
    return key


@dataclass
class Split:
    """Which corners of a mesh have one normal at all times."""

    index: np.ndarray
    """(c,) the group of each corner."""
    corner: np.ndarray
    """(g,) one corner of each group; any one where a point has none."""
    by_point: bool

    @classmethod
    def of(cls, corners: np.ndarray, points: int, authored: Iterable[CornerValues]) -> Split:
        """The corners of a point are one if what is `authored` for them is equal at each time. Poses keep that:
        what they make of a normal depends on it and its point alone."""
        key, by_point = corners, True
        for normals in authored:
            if normals.interpolation not in ("vertex", "varying", "constant"):
                key, by_point = refined(key, normals.values.astype(np.float32)[normals.index]), False
        if by_point:
            corner = np.zeros(points, int)
            corner[corners] = np.arange(len(corners))
            return cls(corners, corner, True)
        _, corner, index = np.unique(key, return_index=True, return_inverse=True)
        return cls(index.reshape(-1), corner, False)

    def gather(self, normals: CornerValues) -> CornerValues:
        """The normals of a time, one for each group."""
        values = normals.values[normals.index[self.corner]]
        kind = "vertex" if self.by_point else "faceVarying"
        return CornerValues(values, self.index, interpolation=kind, indexed=True, exact=True)
