"""Normals of the limit surface, from its tangents.

Within the surface these are Halstead's, Kass's and DeRose's (1993) for Catmull-Clark, Hoppe's and others' (1994)
for Loop. Along creases of irregular valence the published weights (Biermann, Levin, Zorin 2000, which OpenSubdiv
uses) belong to rules that were modified for them; here they are calculated for the rules that are used.
A vertex has one normal for each run of faces between sharp edges.
"""

from __future__ import annotations

import numpy as np

from .subdivision_masks import kinds
from .subdivision_topology import Topology, fans


class LimitNormals:
    """The runs of faces of a level, whose normals are asked for as often as its points move.

    Faces are quads, or triangles if `triangular`. Edges of sharpness 1 and more are creases.
    """

    def __init__(self, level: Topology, triangular: bool) -> None:
        self._level, self._triangular = level, triangular
        cut = level.edge_sharpness >= 1.0
        after = np.where(cut[level.edge[level.previous]], -1, level.twin[level.previous])
        last, place, closed = fans(level, after)
        is_run = np.bincount(last, minlength=len(last)) > 0
        runs, run = np.flatnonzero(is_run), (np.cumsum(is_run) - 1)[last]
        size, vertex = place[runs] + 1, level.corners[runs]
        kind = kinds(level, cut, level.vertex_sharpness >= 1.0)[vertex]
        # Around a dart the faces go from the sharp edge to itself: the surface is smooth there.
        smooth = (closed[runs] | (level.incident(cut)[vertex] == 1)) & (kind < 2) & (size > 2)
        crease = (kind == 2) & ~closed[runs]
        shape = np.select([smooth, crease], [1, 2], 0)

        first = np.cumsum(size) - size
        in_order = np.empty(len(level.corners), int)
        in_order[first[run] + place] = np.arange(len(level.corners))
        codes = size * 3 + shape
        alike = np.argsort(codes, kind="stable")
        self._count, self._groups = len(runs), []
        for some in np.split(alike, np.flatnonzero(np.diff(codes[alike])) + 1):
            corners = in_order[first[some][:, None] + np.arange(size[some[0]])]
            self._groups.append((some, corners, (_of_corners, _of_smooth, _of_creases)[shape[some[0]]]))
        self._vertex = vertex if len(runs) == np.count_nonzero(level.valence) else None
        self.index = run if self._vertex is None else level.corners
        """(c,) the normal of each corner."""

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Normals (n, 3) of any length. `points` (v, 3) are the level's own, not those of the limit."""
        normals = np.empty((self._count, 3))
        for some, corners, rule in self._groups:
            normals[some] = rule(self._level, points, corners, self._triangular)
        if self._vertex is None:
            return normals
        spread = np.tile([0.0, 0.0, 1.0], (self._level.vertices, 1))
        spread[self._vertex] = normals
        return spread


def _of_corners(level: Topology, points: np.ndarray, corners: np.ndarray, triangular: bool) -> np.ndarray:
    """The normals (r, 3) of runs `corners` (r, n), counter-clockwise, at corners, and at what has no tangents:
    weighted by the area of the faces. Exact for one face."""
    del triangular
    here = points[level.corners[corners]]
    ahead, back = points[level.corners[level.next[corners]]], points[level.corners[level.previous[corners]]]
    return np.cross(ahead - here, back - here).sum(axis=1)


def _of_smooth(level: Topology, points: np.ndarray, corners: np.ndarray, triangular: bool) -> np.ndarray:
    """The same within the surface, and around darts."""
    count = corners.shape[1]
    angle = 2 * np.pi / count
    waves = np.stack([wave(angle * np.arange(count + 1)) for wave in (np.cos, np.sin)])
    tangents = waves[:, :-1] @ points[level.corners[level.next[corners]]]
    if not triangular:
        across = points[level.corners[level.next[level.next[corners]]]]
        tangents = 4 * tangents + (waves[:, :-1] + waves[:, 1:]) / (4 * _subdominant(angle) - 1) @ across
    return np.cross(tangents[:, 0], tangents[:, 1])


def _of_creases(level: Topology, points: np.ndarray, corners: np.ndarray, triangular: bool) -> np.ndarray:
    """The same at one side of a crease: from its first edge, and inward.

    Inward is the eigenvector that vanishes along the crease, of the matrix that takes a vertex and its neighbours
    to the next level's: sines about the vertex, as within the surface, and weights of the crease's own
    three points that follow from them. For two quads or three triangles these are the B-spline's.
    """
    count = corners.shape[1]
    middle = points[level.corners[corners[:, 0]]]
    ahead = points[level.corners[level.next[corners]]]
    start, end, inner = ahead[:, 0], points[level.corners[level.previous[corners[:, -1]]]], ahead[:, 1:]
    if count == 1:
        return np.cross(start - end, start + end - 2 * middle)
    angle = np.pi / count
    edge = np.sin(angle * np.arange(1, count))
    if triangular:
        value = 0.375 + np.cos(angle) / 4
        inward, side, own = edge @ inner, edge[0] / 8, edge.sum() * 0.375
    else:
        value = _subdominant(angle)
        sine = np.sin(angle * np.arange(count + 1))
        edge, face = 4 * edge, (sine[:-1] + sine[1:]) / (4 * value - 1)
        inward = edge @ inner + face @ points[level.corners[level.next[level.next[corners]]]]
        side, own = edge[0] / 16 + face[0] / 4, edge.sum() * 0.375 + face.sum() / 4
    neighbour, vertex = np.linalg.solve([[value - 0.5, -0.125], [-1.0, value - 0.75]], [side, own])
    return np.cross(start - end, inward + vertex * middle + neighbour * (start + end))


def _subdominant(angle: float) -> float:
    """The eigenvalue of Catmull-Clark's rules about a vertex for waves of `angle` a face."""
    cosine = np.cos(angle)
    return (5 + cosine + np.cos(angle / 2) * np.sqrt(2 * (9 + cosine))) / 16
