"""Polygons into triangles: triangles, quads and convex faces all at once, the rest by ear clipping.

Every face with n corners gives n - 2 triangles, degenerate ones included, so that the area of a
face is kept and no T-junction appears at collinear corners.
"""

from __future__ import annotations

import numpy as np

_FLAT = 1e-9
"""Relative to a face's area: a triangle below it is degenerate."""


def triangulate(points: np.ndarray, counts: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (t, 3) as indices into `corners`, and the face (t,) that each belongs to.

    `counts` are corners per face, `corners` the point index of every corner. Winding is kept.
    Faces of fewer than three corners give nothing.
    """
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]]) if len(counts) else np.zeros(0, int)
    triangles, faces = [], []
    for size in np.unique(counts):
        if size < 3:
            continue
        which = np.flatnonzero(counts == size)
        first = starts[which][:, None]
        if size == 3:
            local = np.tile(np.arange(3), (len(which), 1, 1))
        elif size == 4:
            local = _quads(points[corners[first + np.arange(4)]])
        else:
            local = _polygons(points[corners[first + np.arange(size)]])
        triangles.append((local + first[:, :, None]).reshape(-1, 3))
        faces.append(np.repeat(which, size - 2))
    if not triangles:
        return np.zeros((0, 3), int), np.zeros(0, int)
    triangles, faces = np.concatenate(triangles), np.concatenate(faces)
    order = np.argsort(faces, kind="stable")
    return triangles[order], faces[order]


def newell(polygons: np.ndarray) -> np.ndarray:
    """Area vectors (f, 3) of polygons (f, n, 3)."""
    relative = polygons - polygons[:, :1]
    return np.cross(relative, np.roll(relative, -1, axis=1)).sum(axis=1) / 2


def _heights(polygons: np.ndarray, triangles: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Signed areas (f, t) of local triangles (t, 3) against the faces' normals."""
    corner = polygons[:, triangles]
    area = np.cross(corner[:, :, 1] - corner[:, :, 0], corner[:, :, 2] - corner[:, :, 0]) / 2
    return np.einsum("ftk,fk->ft", area, normals)


def _quads(polygons: np.ndarray) -> np.ndarray:
    """Two triangles each, along the diagonal that keeps both facing the face's own way."""
    a = np.array([[0, 1, 2], [0, 2, 3]])
    b = np.array([[0, 1, 3], [1, 2, 3]])
    normals = newell(polygons)
    worst_a = _heights(polygons, a, normals).min(axis=1)
    worst_b = _heights(polygons, b, normals).min(axis=1)
    flat = _FLAT * np.einsum("fk,fk->f", normals, normals)
    other = (worst_a <= flat) & (worst_b > worst_a)
    return np.where(other[:, None, None], b, a)


def _polygons(polygons: np.ndarray) -> np.ndarray:
    """Faces of five and more corners: a fan where the face is convex, else ears."""
    size = polygons.shape[1]
    here = np.arange(size)
    fan = np.stack([np.zeros(size - 2, int), here[1:-1], here[2:]], axis=1)
    turns = np.stack([here - 1, here, np.roll(here, -1)], axis=1)
    normals = newell(polygons)
    flat = _FLAT * np.einsum("fk,fk->f", normals, normals)
    convex = (_heights(polygons, fan, normals) > flat[:, None]).all(axis=1)
    convex &= (_heights(polygons, turns, normals) >= -flat[:, None]).all(axis=1)
    convex |= flat == 0
    local = np.tile(fan, (len(polygons), 1, 1))
    for face in np.flatnonzero(~convex):
        local[face] = clip_ears(_flatten(polygons[face], normals[face]))
    return local


def _flatten(polygon: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """The polygon in its own plane, counter-clockwise."""
    normal = normal / np.linalg.norm(normal)
    helper = np.eye(3)[np.argmin(np.abs(normal))]
    x = np.cross(helper, normal)
    x /= np.linalg.norm(x)
    y = np.cross(normal, x)
    relative = polygon - polygon.mean(axis=0)
    flat = np.stack([relative @ x, relative @ y], axis=1)
    return flat / max(np.abs(flat).max(), 1e-300)


def clip_ears(polygon: np.ndarray) -> np.ndarray:
    """n - 2 triangles of a counter-clockwise polygon (n, 2) without crossings.

    Ears are clipped fattest first among the strictly convex ones that hold no other corner; where
    none is left (collinear or damaged remains) the flattest corner goes.
    """
    ring = list(range(len(polygon)))
    triangles = []
    while len(ring) > 3:
        points = polygon[ring]
        before, after = np.roll(points, 1, axis=0), np.roll(points, -1, axis=0)
        turn = _cross(points - before, after - points)
        ear = -1
        for candidate in np.argsort(-turn, kind="stable"):
            if turn[candidate] <= 1e-14:
                break
            if not _holds(before[candidate], points[candidate], after[candidate], points[turn <= 1e-14]):
                ear = int(candidate)
                break
        if ear < 0:
            ear = int(np.argmin(np.abs(turn)))
        triangles.append([ring[ear - 1], ring[ear], ring[(ear + 1) % len(ring)]])
        del ring[ear]
    triangles.append(ring)
    return np.array(triangles)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _holds(a: np.ndarray, b: np.ndarray, c: np.ndarray, others: np.ndarray) -> bool:
    """Whether the triangle, its rim included, holds a point other than its own corners."""
    inside = (_cross(b - a, others - a) >= 0) & (_cross(c - b, others - b) >= 0) & (_cross(a - c, others - c) >= 0)
    for corner in (a, b, c):
        inside &= (others != corner).any(axis=1)
    return bool(inside.any())
