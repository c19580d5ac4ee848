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
    seams.vertex_sharpness[_sharp(mesh, seams, vertex, rule)] = INFINITE
    return seams, shown


def _sharp(mesh: Topology, seams: Topology, vertex: np.ndarray, rule: str) -> np.ndarray:
    """Which values are fixed; `vertex` is the mesh's vertex of each."""
    alone = seams.valence == 1
    sharp = alone & (rule != "none")
    split = np.flatnonzero((mesh.twin >= 0) & (seams.twin < 0))
    seam = np.zeros(mesh.vertices, bool)
    seam[mesh.corners[split]] = seam[mesh.corners[mesh.next[split]]] = True
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
        # Of two regions one is as sharp as the semi-sharp edges that run into the other.
        inner = np.zeros(len(vertex))
        semi = (seams.edge_sharpness > 0) & (seams.edge_sharpness < INFINITE)
        for end in seams.ends:
            np.maximum.at(inner, end[semi], seams.edge_sharpness[semi])
        other = np.bincount(vertex, inner, mesh.vertices)[vertex] - inner
        some = (seam & (values == 2))[vertex] & (inner == 0)
        seams.vertex_sharpness[some] = np.maximum(seams.vertex_sharpness, other)[some]
    return sharp
