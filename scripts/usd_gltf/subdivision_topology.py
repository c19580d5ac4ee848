"""How the faces of a subdivision surface meet, level by level.

A *corner* is one vertex of one face. Corner `c` also stands for the edge that runs from it to the next
corner of its face, so an edge between two faces has two corners, its *twins*. An edge without twins
is a boundary, or no manifold: more than two faces, two faces that run along it the same way, or
both ends at one vertex. Such edges are infinitely sharp, and so are vertices of several fans of faces, as in
OpenSubdiv (Far::TopologyRefinerFactory, `prepareComponentTagsAndSharpness`).

A level's topology follows from the last one's by arithmetic alone: nothing is searched for.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

INFINITE = 10.0
"""A sharpness that does not decay (OpenSubdiv's Sdc::Crease::SHARPNESS_INFINITE)."""


@dataclass
class Topology:
    """One level: `f` faces, `c` corners, `e` edges, `v` vertices."""

    vertices: int
    counts: np.ndarray
    """(f,) corners of each face."""
    corners: np.ndarray
    """(c,) the vertex of each corner."""
    edge: np.ndarray
    """(c,) the edge from each corner to the next."""
    twin: np.ndarray
    """(c,) the corner of the same edge in the other face, or -1."""
    lead: np.ndarray
    """(e,) one corner of each edge; the edge's direction is this corner's."""
    edge_sharpness: np.ndarray
    vertex_sharpness: np.ndarray
    creased: np.ndarray | None = None
    """(e,) at the first level, whether an infinite sharpness was authored."""

    @cached_property
    def starts(self) -> np.ndarray:
        """(f,) the first corner of each face."""
        return np.cumsum(self.counts) - self.counts

    @cached_property
    def face(self) -> np.ndarray:
        """(c,) the face of each corner."""
        return np.repeat(np.arange(len(self.counts)), self.counts)

    @cached_property
    def next(self) -> np.ndarray:
        """(c,) the next corner of the same face."""
        following = np.arange(1, len(self.corners) + 1)
        following[self.starts + self.counts - 1] = self.starts
        return following

    @cached_property
    def previous(self) -> np.ndarray:
        """(c,) the corner before in the same face."""
        before = np.arange(-1, len(self.corners) - 1)
        before[self.starts] = self.starts + self.counts - 1
        return before

    @cached_property
    def valence(self) -> np.ndarray:
        """(v,) faces around each vertex."""
        return np.bincount(self.corners, minlength=self.vertices)

    @cached_property
    def ends(self) -> tuple[np.ndarray, np.ndarray]:
        """(e,) and (e,): the two vertices of each edge."""
        return self.corners[self.lead], self.corners[self.next[self.lead]]

    def incident(self, edges: np.ndarray) -> np.ndarray:
        """(v,) how many of `edges`, a mask (e,), end at each vertex."""
        return sum(np.bincount(end[edges], minlength=self.vertices) for end in self.ends)


def build(vertices: int, counts: np.ndarray, corners: np.ndarray) -> tuple[Topology, np.ndarray]:
    """The topology of faces of three and more corners, and its edges' keys, ascending: `low vertex *
    vertices + high vertex`. Edges without twins are infinitely sharp, nothing else is sharp yet."""
    topology = Topology(vertices, counts, corners, corners, corners, corners, np.zeros(0), np.zeros(vertices))
    start, end = corners, corners[topology.next]
    key = np.minimum(start, end) * vertices + np.maximum(start, end)
    keys, lead, edge, uses = np.unique(key, return_index=True, return_inverse=True, return_counts=True)
    topology.edge, topology.lead = edge.reshape(-1), lead
    first = np.cumsum(uses) - uses
    order = np.argsort(topology.edge, kind="stable")
    pairs = first[uses == 2]
    one, other = order[pairs], order[pairs + 1]
    manifold = (start[one] != start[other]) & (topology.face[one] != topology.face[other])
    one, other = one[manifold], other[manifold]
    topology.twin = np.full(len(corners), -1)
    topology.twin[one], topology.twin[other] = other, one
    topology.edge_sharpness = np.where(topology.twin[lead] < 0, INFINITE, 0.0)
    topology.creased = np.zeros(len(lead), bool)
    return topology, keys


def crease(topology: Topology, keys: np.ndarray, start: np.ndarray, end: np.ndarray, sharpness: np.ndarray) -> np.ndarray:
    """Make the edges from `start` to `end` sharp; the later one counts of two that are alike. `keys` are
    those of `build`. Returns which of the edges there are (and have a sharpness that is a number)."""
    low, high = np.minimum(start, end), np.maximum(start, end)
    key = np.where((low >= 0) & (high < topology.vertices), low * topology.vertices + high, -1)
    edge = np.minimum(np.searchsorted(keys, key), len(keys) - 1)
    there = (keys[edge] == key) & ~np.isnan(sharpness)
    edge, sharp = edge[there], np.clip(sharpness[there], 0.0, INFINITE)
    topology.edge_sharpness[edge] = np.where(topology.twin[topology.lead[edge]] < 0, INFINITE, sharp)
    topology.creased[edge] = sharp >= INFINITE
    return there


def boundaries(topology: Topology) -> np.ndarray:
    """(e,) whether each edge has one face alone."""
    start, end = topology.ends
    return (np.bincount(topology.edge, minlength=len(topology.lead)) == 1) & (start != end)


def sharpen_vertices(topology: Topology, corners_too: bool) -> None:
    """Make what is no manifold infinitely sharp, and with `corners_too` every vertex of one face."""
    boundary = boundaries(topology)
    odd = (topology.twin[topology.lead] < 0) & ~boundary
    edges = topology.incident(np.ones(len(topology.lead), bool))
    if corners_too:
        topology.vertex_sharpness[(topology.valence == 1) & (edges == 2)] = INFINITE
    odd_edges, boundary_edges = topology.incident(odd), topology.incident(boundary)
    last = fans(topology, topology.twin[topology.previous])[0]
    several = np.bincount(topology.corners[np.unique(last)], minlength=topology.vertices) > 1
    # Two opposite edges of three and more faces each are a crease, along which fins meet a surface.
    fins = (odd_edges == 2) & (boundary_edges == 0) & (topology.valence > edges)
    topology.vertex_sharpness[(several | (odd_edges > 0)) & ~fins] = INFINITE


def fans(topology: Topology, after: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Runs of faces around vertices, where `after` (c,) is the next corner at the same vertex, or -1.

    Returns for each corner its run's last corner, which names the run; its place in the run, from 0;
    and whether the run goes all the way round (it then begins after its smallest corner).
    By pointer jumping, in as many passes as the logarithm of the largest valence.
    """
    here = np.arange(len(after))
    valence = topology.valence[topology.corners]
    lowest, reach = here.copy(), np.where(after < 0, here, after)
    span, some = 1, np.flatnonzero(valence > 1)
    while len(some):
        there = reach[some]
        lowest[some], reach[some] = np.minimum(lowest[some], lowest[there]), reach[there]
        span *= 2
        some = some[valence[some] > span]
    closed = after[reach] >= 0
    after = after.copy()
    after[closed & (here == lowest)] = -1

    steps, reach = (after >= 0).astype(int), np.where(after < 0, here, after)
    span, some = 1, np.flatnonzero(valence > 1)
    while len(some):
        there = reach[some]
        steps[some], reach[some] = steps[some] + steps[there], reach[there]
        span *= 2
        some = some[valence[some] > span]
    size = np.bincount(reach, minlength=len(after))
    return reach, size[reach] - 1 - steps, closed


def split_to_quads(old: Topology) -> Topology:
    """The next level of a quadrilateral scheme: one face for each corner. Its vertices are the old
    faces' points, the old edges', the old vertices', in this order."""
    faces, edges = len(old.counts), len(old.lead)
    spoke = 2 * edges + np.arange(len(old.corners))
    same = old.corners == old.corners[old.lead][old.edge]
    before, twin = old.previous, old.twin
    corners = [faces + edges + old.corners, faces + old.edge, old.face, faces + old.edge[before]]
    edge = [2 * old.edge + ~same, spoke, spoke[before], (2 * old.edge + same)[before]]
    along = np.where(twin >= 0, 4 * old.next[twin] + 3, -1)
    back = np.where(twin >= 0, 4 * twin, -1)[before]
    sharpness = decayed(old.edge_sharpness)
    return Topology(
        faces + edges + old.vertices,
        np.full(len(old.corners), 4),
        np.stack(corners, axis=1).reshape(-1),
        np.stack(edge, axis=1).reshape(-1),
        np.stack([along, 4 * old.next + 2, 4 * before + 1, back], axis=1).reshape(-1),
        np.concatenate([_halves(4 * old.lead, 4 * old.next[old.lead] + 3), 4 * np.arange(len(old.corners)) + 1]),
        np.concatenate([np.repeat(sharpness, 2), np.zeros(len(old.corners))]),
        np.concatenate([np.zeros(faces + edges), decayed(old.vertex_sharpness)]),
    )


def split_to_triangles(old: Topology) -> Topology:
    """The next level of a triangular scheme: four faces for each. Its vertices are the old edges'
    points and the old vertices', in this order."""
    edges, faces = len(old.lead), len(old.counts)
    same = old.corners == old.corners[old.lead][old.edge]
    before, twin = old.previous, old.twin
    tip = 12 * old.face + 3 * (np.arange(len(old.corners)) % 3)  # the first corner of the triangle at each old corner
    spoke = 2 * edges + np.arange(len(old.corners))
    middle = (12 * np.arange(faces)[:, None] + 9 + np.arange(3)).reshape(-1)
    points = [edges + old.corners, old.edge, old.edge[before]]
    sides = [2 * old.edge + ~same, spoke, (2 * old.edge + same)[before]]
    along = np.where(twin >= 0, tip[old.next[twin]] + 2, -1)
    back = np.where(twin >= 0, tip[twin], -1)[before]
    twins = [along, middle[before], back]

    def placed(outer: list[np.ndarray], inner: np.ndarray) -> np.ndarray:
        tips = np.stack(outer, axis=1).reshape(faces, 9)
        return np.concatenate([tips, inner.reshape(faces, 3)], axis=1).reshape(-1)

    sharpness = decayed(old.edge_sharpness)
    return Topology(
        edges + old.vertices,
        np.full(4 * faces, 3),
        placed(points, old.edge),
        placed(sides, spoke[old.next]),
        placed(twins, (tip + 1)[old.next]),
        np.concatenate([_halves(tip[old.lead], tip[old.next[old.lead]] + 2), tip + 1]),
        np.concatenate([np.repeat(sharpness, 2), np.zeros(len(old.corners))]),
        np.concatenate([np.zeros(edges), decayed(old.vertex_sharpness)]),
    )


def _halves(near: np.ndarray, far: np.ndarray) -> np.ndarray:
    return np.stack([near, far], axis=1).reshape(-1)


def decayed(sharpness: np.ndarray) -> np.ndarray:
    """The sharpness of the next level: one less (DeRose, Kass, Truong 1998), unless it is infinite."""
    return np.where(sharpness >= INFINITE, INFINITE, np.maximum(sharpness - 1.0, 0.0))

