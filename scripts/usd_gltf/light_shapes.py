"""The intrinsic UsdLux shapes: world-space areas, and meshes with exactly the light's area.

Areas are UsdLux's `worldSpaceSurfaceArea`, "including any scaling applied to the light by its
transform stack": the integral of |cof(M) n| over the local surface, where M is the linear part of
the light's transform; exact for flat shapes, and to ten digits for spheres that became ellipsoids.

Flat shapes face -Z, cylinders run along X without caps, spheres and cylinders face outward
(usdLux/schema.usda).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

SIDES = 32
"""Sides of a disk, a cylinder, and of a sphere's equator."""
RINGS = 16
"""Bands of a sphere from pole to pole."""


@dataclass(frozen=True)
class Tessellation:
    """Triangles in the light's local space; counter-clockwise seen from where it emits."""

    positions: np.ndarray
    normals: np.ndarray
    uvs: np.ndarray | None
    triangles: np.ndarray


def world_area(kind: str, size: dict[str, float], linear: np.ndarray) -> float:
    """Area in the units of `linear`'s target space of the light's shape under `linear` (3x3)."""
    # The area depends on M only through G = M^T M, since |cof(M) n|^2 = n^T cof(G) n. Pulling the
    # overall scale out leaves few different shapes however many instances there are.
    gram = linear.T @ linear
    scale = float(np.trace(gram)) / 3
    if not scale > 0.0:
        return 0.0
    shape = tuple(round(g, 12) for g in (gram / scale).reshape(-1).tolist())
    return _unit_area(kind, tuple(sorted(size.items())), shape) * scale


@lru_cache(maxsize=100_000)
def _unit_area(kind: str, sizes: tuple[tuple[str, float], ...], shape: tuple[float, ...]) -> float:
    """Area of the light under any transform M with M^T M = `shape`."""
    size = dict(sizes)
    a, b, c = np.array(shape).reshape(3, 3)
    stretch = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)])
    if kind == "RectLight":
        return size["width"] * size["height"] * float(np.sqrt(max(stretch[2, 2], 0.0)))
    if kind == "DiskLight":
        return np.pi * size["radius"] ** 2 * float(np.sqrt(max(stretch[2, 2], 0.0)))
    if kind == "CylinderLight":
        angle = np.arange(256) * (2 * np.pi / 256)
        normals = np.stack([np.zeros_like(angle), np.cos(angle), np.sin(angle)], axis=1)
        return 2 * np.pi * size["radius"] * size["length"] * float(_stretched(normals, stretch).mean())
    if kind == "SphereLight":
        height, weight = np.polynomial.legendre.leggauss(64)
        angle = np.arange(128) * (2 * np.pi / 128)
        ring = np.sqrt(1 - height**2)
        normals = np.stack(
            [np.outer(ring, np.cos(angle)), np.outer(ring, np.sin(angle)), np.outer(height, np.ones_like(angle))],
            axis=2,
        )
        return 2 * np.pi * size["radius"] ** 2 * float(_stretched(normals, stretch).mean(axis=1) @ weight)
    raise ValueError(kind)


def _stretched(normals: np.ndarray, stretch: np.ndarray) -> np.ndarray:
    """|cof(M) n| for each normal, from cof(M^T M)."""
    return np.sqrt(np.maximum(np.einsum("...i,ij,...j->...", normals, stretch, normals), 0.0))


def tessellate(kind: str, size: dict[str, float]) -> Tessellation:
    """A mesh of the light's shape with the light's exact local area."""
    if kind == "RectLight":
        return _rect(size["width"], size["height"])
    if kind == "DiskLight":
        return _disk(size["radius"])
    if kind == "CylinderLight":
        return _cylinder(size["radius"], size["length"])
    if kind == "SphereLight":
        return _sphere(size["radius"])
    raise ValueError(kind)


def _rect(width: float, height: float) -> Tessellation:
    """Two triangles facing -Z. The texture's first pixel is at (+X, +Y): upright and unmirrored
    for an eye in front of the light."""
    x, y = width / 2, height / 2
    positions = np.array([[x, y, 0], [-x, y, 0], [-x, -y, 0], [x, -y, 0]], dtype=float)
    uvs = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=float)
    triangles = np.array([[0, 2, 1], [0, 3, 2]])
    return _facing_back(positions, uvs, triangles)


def _disk(radius: float) -> Tessellation:
    """A fan facing -Z around the centre, its corners just outside the circle."""
    outer = radius * np.sqrt(2 * np.pi / SIDES / np.sin(2 * np.pi / SIDES))
    angle = np.arange(SIDES) * (2 * np.pi / SIDES)
    rim = np.stack([outer * np.cos(angle), outer * np.sin(angle), np.zeros(SIDES)], axis=1)
    positions = np.concatenate([np.zeros((1, 3)), rim])
    here = np.arange(SIDES)
    triangles = np.stack([np.zeros(SIDES, int), 1 + (here + 1) % SIDES, 1 + here], axis=1)
    return _facing_back(positions, None, triangles)


def _facing_back(positions: np.ndarray, uvs: np.ndarray | None, triangles: np.ndarray) -> Tessellation:
    """A flat tessellation whose normals are all -Z."""
    normals = np.tile([0.0, 0.0, -1.0], (len(positions), 1))
    return Tessellation(positions, normals, uvs, triangles)


def _cylinder(radius: float, length: float) -> Tessellation:
    """A prism along X, open at both ends."""
    outer = radius * np.pi / SIDES / np.sin(np.pi / SIDES)
    angle = np.arange(SIDES) * (2 * np.pi / SIDES)
    normals = np.stack([np.zeros(SIDES), np.cos(angle), np.sin(angle)], axis=1)
    left = outer * normals - [length / 2, 0, 0]
    right = outer * normals + [length / 2, 0, 0]
    here, there = np.arange(SIDES), (np.arange(SIDES) + 1) % SIDES
    triangles = np.concatenate(
        [
            np.stack([here, here + SIDES, there + SIDES], axis=1),
            np.stack([here, there + SIDES, there], axis=1),
        ]
    )[:, ::-1]
    return Tessellation(np.concatenate([left, right]), np.concatenate([normals, normals]), None, triangles)


def _sphere(radius: float) -> Tessellation:
    """Rings of latitude about Z, scaled so that the triangles' area is 4 pi r^2."""
    polar = np.arange(1, RINGS) * (np.pi / RINGS)
    angle = np.arange(SIDES) * (2 * np.pi / SIDES)
    rings = np.stack(
        [
            np.outer(np.sin(polar), np.cos(angle)),
            np.outer(np.sin(polar), np.sin(angle)),
            np.outer(np.cos(polar), np.ones(SIDES)),
        ],
        axis=2,
    ).reshape(-1, 3)
    unit = np.concatenate([[[0, 0, 1.0]], rings, [[0, 0, -1.0]]])
    here, there = np.arange(SIDES), (np.arange(SIDES) + 1) % SIDES
    last = len(unit) - 1
    triangles = [np.stack([np.zeros(SIDES, int), 1 + here, 1 + there], axis=1)]
    for ring in range(RINGS - 2):
        up, down = 1 + ring * SIDES, 1 + (ring + 1) * SIDES
        triangles.append(np.stack([up + here, down + here, down + there], axis=1))
        triangles.append(np.stack([up + here, down + there, up + there], axis=1))
    bottom = 1 + (RINGS - 2) * SIDES
    triangles.append(np.stack([bottom + here, np.full(SIDES, last), bottom + there], axis=1))
    triangles = np.concatenate(triangles)
    corners = unit[triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    return Tessellation(unit * (radius * np.sqrt(4 * np.pi / area)), unit, None, triangles)
