"""The weights of subdivision: from one level's values to the next one's, and to the limit surface.

Catmull-Clark: Catmull and Clark 1978; its limit points: Halstead, Kass, DeRose 1993. Loop: Loop 1987; its
limit points: Hoppe and others 1994. Boundaries as cubic B-spline curves: Nasri 1987. Semi-sharp creases: DeRose,
Kass, Truong 1998, blended between two levels as OpenSubdiv does (Sdc::Scheme, `ComputeVertexVertexMask`).
"""

from __future__ import annotations

import numpy as np

from .subdivision_topology import INFINITE, Topology, build, decayed, split_to_quads, split_to_triangles

SMOOTH_TRIANGLE = 0.470
"""The weight of a triangle's middle under the triangle rule `smooth` (OpenSubdiv, Sdc::Scheme<SCHEME_CATMARK>)."""


def refine(old: Topology, values: np.ndarray, triangular: bool, smooth_triangles: bool = False) -> np.ndarray:
    """The next level's values (v', k) of values (v, k), by Loop's rules if `triangular`."""
    start, end = old.ends
    edges = (values[start] + values[end]) / 2
    some = np.flatnonzero(old.edge_sharpness < 1.0)  # all of them have twins
    corner = old.lead[some]
    twin, ends = old.twin[corner], edges[some]
    if triangular:
        opposite = [values[old.corners[old.previous[c]]] for c in (corner, twin)]
        smooth = 0.75 * ends + (opposite[0] + opposite[1]) / 8
        points = [edges]
        vertices = _vertices(old, values, _loop_smooth(old, values), 1 / 8)
    else:
        faces = face_means(old, values)
        middles = (faces[old.face[corner]] + faces[old.face[twin]]) / 2
        share = np.full((len(some), 1), 0.5)
        if smooth_triangles:
            weight = np.where(old.counts == 3, SMOOTH_TRIANGLE, 0.25)
            share[:, 0] = weight[old.face[corner]] + weight[old.face[twin]]
        smooth = (1 - share) * ends + share * middles
        points = [faces, edges]
        around = _around(old, values[old.corners[old.next]] + faces[old.face])
        count = np.maximum(old.valence, 1)[:, None]
        vertices = _vertices(old, values, values * ((count - 2) / count) + around / count**2, 1 / 8)
    sharp = old.edge_sharpness[some, None]
    edges[some] = sharp * ends + (1 - sharp) * smooth
    return np.concatenate([*points, vertices])


def refine_linear(old: Topology, values: np.ndarray, triangular: bool) -> np.ndarray:
    """The same by the mean of the corners: scheme `bilinear`, and primvars that are `varying`."""
    start, end = old.ends
    faces = [] if triangular else [face_means(old, values)]
    return np.concatenate([*faces, (values[start] + values[end]) / 2, values])


def limit(level: Topology, values: np.ndarray, triangular: bool) -> np.ndarray:
    """Where the vertices of a level (quads, or triangles if `triangular`) come to lie on the limit surface."""
    found = _limit_by_masks(level, values, triangular)
    sharp = level.edge_sharpness > 0
    semi = sharp & (level.edge_sharpness < INFINITE)
    odd = (level.incident(semi) > 0) | ((level.vertex_sharpness > 0) & (level.vertex_sharpness < INFINITE))
    dart = (level.incident(sharp) == 1) & (level.vertex_sharpness == 0)
    some = np.flatnonzero((odd | dart) & (level.valence > 0))
    if len(some):
        left = [level.edge_sharpness[semi].max(initial=0), *(level.vertex_sharpness[some] % INFINITE)]
        found[some] = _limit_near(level, values, triangular, some, _ROUNDS if dart.any() else int(np.ceil(max(left))))
    return found


_ROUNDS = 12
"""Local refinements at a dart, whose limit has no mask: each takes three quarters of the error."""


def _limit_near(level: Topology, values: np.ndarray, triangular: bool, some: np.ndarray, rounds: int) -> np.ndarray:
    """The limit of the vertices `some`, about which the rules are not yet, or never, those of the masks.

    A vertex's faces alone decide its next faces, so they alone are refined, until what is semi-sharp has decayed.
    """
    for _ in range(rounds):
        near = np.zeros(level.vertices, bool)
        near[some] = True
        faces = np.logical_or.reduceat(near[level.corners], level.starts)
        corners = np.flatnonzero(np.repeat(faces, level.counts))
        kept, renumbered = np.unique(level.corners[corners], return_inverse=True)
        part, _ = build(len(kept), level.counts[faces], renumbered.reshape(-1))
        own = level.edge_sharpness[level.edge[corners[part.lead]]]
        part.edge_sharpness = np.where(part.twin[part.lead] < 0, INFINITE, own)
        part.vertex_sharpness = level.vertex_sharpness[kept]
        values = refine(part, values[kept], triangular)
        level = split_to_triangles(part) if triangular else split_to_quads(part)
        some = level.vertices - part.vertices + np.searchsorted(kept, some)
    return _limit_by_masks(level, values, triangular)[some]


def _limit_by_masks(level: Topology, values: np.ndarray, triangular: bool) -> np.ndarray:
    count = np.maximum(level.valence, 1)[:, None]
    following = values[level.corners[level.next]]
    if triangular:
        share = 1 / (count + 3 / (8 * _loop_share(level)))
        smooth = values * (1 - count * share) + _around(level, following) * share
    else:
        across = values[level.corners[level.next[level.next]]]
        smooth = (values * count**2 + _around(level, 4 * following + across)) / (count * (count + 5))
    return _vertices(level, values, np.where(count > 2, smooth, values), 1 / 6)


def face_means(level: Topology, values: np.ndarray) -> np.ndarray:
    """(f, k): the mean of each face's corners."""
    if len(level.counts) and (level.counts == 4).all():
        return values[level.corners.reshape(-1, 4)].mean(axis=1)
    return np.add.reduceat(values[level.corners], level.starts, axis=0) / level.counts[:, None]


def kinds(level: Topology, edges: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """How many sharp edges count at each vertex: 2 makes a crease, 3 a corner, fewer a smooth vertex
    (one is a dart); `edges` and `vertices` are masks of what is sharp. What no two faces surround stays too."""
    count = np.minimum(level.incident(edges), 3)
    count[vertices | ((level.valence < 2) & (count < 2))] = 3
    return count


def _loop_share(level: Topology) -> np.ndarray:
    """(v, 1): each neighbour's share in the next level's smooth vertex, by Loop's rule."""
    count = np.maximum(level.valence, 1)[:, None]
    return (0.625 - (0.375 + 0.25 * np.cos(2 * np.pi / count)) ** 2) / count


def _loop_smooth(old: Topology, values: np.ndarray) -> np.ndarray:
    share = _loop_share(old)
    around = _around(old, values[old.corners[old.next]])
    return values * (1 - old.valence[:, None] * share) + share * around


def _around(level: Topology, per_corner: np.ndarray) -> np.ndarray:
    """(v, k): the sum over the corners at each vertex."""
    sums = [np.bincount(level.corners, column, level.vertices) for column in per_corner.T]
    return np.stack(sums, axis=1) if sums else np.zeros((level.vertices, 0))


def _vertices(level: Topology, values: np.ndarray, smooth: np.ndarray, side: float) -> np.ndarray:
    """Values of the vertices: `smooth`, that of a crease (`side` of either neighbour), or their own; where
    sharpness ends before the next level, some of each."""
    now = level.edge_sharpness, level.vertex_sharpness
    if not now[0].any() and not now[1].any():
        return np.where((level.valence > 1)[:, None], smooth, values)
    then = decayed(now[0]), decayed(now[1])
    before = _by_kind(level, values, smooth, now[0] > 0, now[1] > 0, side)
    semi = (now[0] > 0) & (now[0] < INFINITE), (now[1] > 0) & (now[1] < INFINITE)
    if not semi[0].any() and not semi[1].any():
        return before
    after = _by_kind(level, values, smooth, then[0] > 0, then[1] > 0, side)
    # The share of the sharper rule is the mean of what sharpness ends here (`ComputeFractionalWeightAtVertex`).
    ending = semi[0] & (then[0] <= 0), semi[1] & (then[1] <= 0)
    total = np.where(ending[1], now[1], 0.0)
    for end in level.ends:
        total += np.bincount(end[ending[0]], now[0][ending[0]], level.vertices)
    number = level.incident(ending[0]) + ending[1]
    share = np.where(number > 0, np.minimum(total / np.maximum(number, 1), 1.0), 1.0)[:, None]
    return share * before + (1 - share) * after


def _by_kind(level, values, smooth, edges: np.ndarray, vertices: np.ndarray, side: float) -> np.ndarray:
    kind = kinds(level, edges, vertices)
    found = np.where(kind[:, None] > 2, values, smooth)
    crease = kind == 2
    if crease.any():
        start, end = (end[edges] for end in level.ends)
        sums = np.zeros_like(values)
        for here, there in ((start, end), (end, start)):
            for axis in range(values.shape[1]):
                sums[:, axis] += np.bincount(here, values[there, axis], level.vertices)
        found[crease] = (1 - 2 * side) * values[crease] + side * sums[crease]
    return found
