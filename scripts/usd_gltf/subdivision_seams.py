"""Face-varying values on a subdivision surface: a topology of their own, torn open along seams.

Each distinct value at a vertex becomes a vertex, so seams become boundaries, and the rules of the mesh itself
do the rest. What `faceVaryingLinearInterpolation` makes sharp besides is OpenSubdiv's
(Vtr::internal::FVarLevel, `completeTopologyFromFaceValues`).
"""

from __future__ import annotations

import numpy as np

from .subdivision_topology import INFINITE, Topology, boundaries, build


def torn(mesh: Topology, values: np.ndarray, rule: str) -> tuple[Topology, np.ndarray]:
    """The topology of values, numbered by `values` (c,) for each corner of a mesh, and for each of
    its vertices one corner that shows its value. `rule` is a token of UsdGeom other than `all`."""
    key = mesh.corners * (int(values.max(initial=0)) + 1) + values
    _, shown, corners = np.unique(key, return_index=True, return_inverse=True)
    seams, _ = build(len(shown), mesh.counts, corners.reshape(-1))
    inside = seams.twin[seams.lead] >= 0
    seams.edge_sharpness[inside] = mesh.edge_sharpness[mesh.edge[seams.lead[inside]]]
    vertex = mesh.corners[shown]
    seams.vertex_sharpness = mesh.vertex_sharpness[vertex].copy()
    if rule in ("cornersPlus1", "cornersPlus2"):
        seams.vertex_sharpness = np.maximum(seams.vertex_sharpness, _beside(mesh, seams, vertex))
    seams.vertex_sharpness[_fixed(mesh, seams, vertex, rule)] = INFINITE
    return seams, shown


def _on_seam(mesh: Topology, seams: Topology) -> np.ndarray:
    """(v,) whether a seam runs through or to each vertex of the mesh."""
    split = np.flatnonzero((mesh.twin >= 0) & (seams.twin < 0))
    seam = np.zeros(mesh.vertices, bool)
    seam[mesh.corners[split]] = seam[mesh.corners[mesh.next[split]]] = True
    return seam


def _beside(mesh: Topology, seams: Topology, vertex: np.ndarray) -> np.ndarray:
    """The sharpness that each value takes over: of two regions that meet at a vertex, one without semi-sharp
    edges is as sharp as those that run into the other."""
    inner = np.zeros(len(vertex))
    semi = (seams.edge_sharpness > 0) & (seams.edge_sharpness < INFINITE)
    for end in seams.ends:
        np.maximum.at(inner, end[semi], seams.edge_sharpness[semi])
    other = np.bincount(vertex, inner, mesh.vertices)[vertex] - inner
    two = _on_seam(mesh, seams) & (np.bincount(vertex, minlength=mesh.vertices) == 2)
    return np.where(two[vertex] & (inner == 0), other, 0.0)


def _fixed(mesh: Topology, seams: Topology, vertex: np.ndarray, rule: str) -> np.ndarray:
    """Which values are fixed; `vertex` is the mesh's vertex of each."""
    alone = seams.valence == 1
    sharp = alone & (rule != "none")
    seam = _on_seam(mesh, seams)
    border = mesh.incident(boundaries(mesh)) > 0
    values = np.bincount(vertex, minlength=mesh.vertices)
    if rule == "boundaries":
        return sharp | (seam | border)[vertex]
    if rule in ("cornersPlus1", "cornersPlus2"):
        # Junctions of three and more regions; of two, if an infinitely sharp edge or another piece of the
        # seam runs through one of them.
        open_edges = seams.twin[seams.lead] < 0
        broken = (seams.incident(~open_edges & (seams.edge_sharpness >= INFINITE)) > 0) | (seams.incident(open_edges) > 2)
        if rule == "cornersPlus2":  # concave corners and darts too
            broken |= alone
            sharp |= (seam & ~border & (values == 1))[vertex]
        beside = np.bincount(vertex[broken], minlength=mesh.vertices) > 0
        sharp |= (seam & ((values > 2) | ((values == 2) & beside)))[vertex]
    return sharp
