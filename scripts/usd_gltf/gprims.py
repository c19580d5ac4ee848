"""The intrinsic gprims Cube, Sphere, Cylinder, Cone, Capsule and Plane as polygon meshes.

Sizes and axes are usdGeom/schema.usda's. Round shapes are inscribed: their corners lie on the
surface. Each is built along Z and then turned to its axis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pxr import Usd

SIDES = 32
RINGS = 16

TYPES = ("Cube", "Sphere", "Cylinder", "Cylinder_1", "Cone", "Capsule", "Capsule_1", "Plane")

SIZES = ("size", "width", "length", "radius", "height", "radiusBottom", "radiusTop")
"""The attributes that shape them; of each type its own."""


@dataclass
class Polygons:
    """A polygon mesh with one normal for each corner; counter-clockwise seen from outside."""

    points: np.ndarray
    counts: np.ndarray
    corners: np.ndarray
    normals: np.ndarray


def build(prim: Usd.Prim, code: float) -> Polygons:
    """The polygon mesh of an intrinsic gprim at a time code."""
    kind = prim.GetTypeName()

    def get(name: str, fallback: float) -> float:
        value = prim.GetAttribute(name).Get(code)
        return float(fallback if value is None else value)

    if kind == "Cube":
        return _cube(get("size", 2.0))
    axis = str(prim.GetAttribute("axis").Get() or "Z")
    if kind == "Plane":
        sides = get("width", 2.0), get("length", 2.0)
        mesh = _plane(*(sides if axis == "Z" else sides[::-1]))
    elif kind == "Sphere":
        radius = get("radius", 1.0)
        return _revolve(*_arc(radius, radius, 0.0, 0.0))
    elif kind == "Cylinder":
        radius = get("radius", 1.0)
        mesh = _revolve(*_frustum(radius, radius, get("height", 2.0)))
    elif kind == "Cylinder_1":
        mesh = _revolve(*_frustum(get("radiusBottom", 1.0), get("radiusTop", 1.0), get("height", 2.0)))
    elif kind == "Cone":
        mesh = _revolve(*_frustum(get("radius", 1.0), 0.0, get("height", 2.0)))
    elif kind == "Capsule":
        radius, half = get("radius", 0.5), get("height", 1.0) / 2
        mesh = _revolve(*_arc(radius, radius, -half, half))
    elif kind == "Capsule_1":
        half = get("height", 1.0) / 2
        mesh = _revolve(*_arc(get("radiusBottom", 0.5), get("radiusTop", 0.5), -half, half))
    else:
        raise ValueError(kind)
    turn = {"X": [2, 0, 1], "Y": [1, 2, 0], "Z": [0, 1, 2]}[axis]
    return Polygons(mesh.points[:, turn], mesh.counts, mesh.corners, mesh.normals[:, turn])


def _cube(size: float) -> Polygons:
    half = size / 2
    points = np.array([[x, y, z] for x in (-half, half) for y in (-half, half) for z in (-half, half)])
    faces = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    normals = np.array([[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1]], dtype=float)
    return Polygons(points, np.full(6, 4), faces.reshape(-1), np.repeat(normals, 4, axis=0))


def _plane(width: float, length: float) -> Polygons:
    """Facing +Z, width along X and length along Y (usdGeom's Plane with axis Z; for the other axes
    the turn that follows exchanges the two)."""
    x, y = width / 2, length / 2
    points = np.array([[-x, -y, 0], [x, -y, 0], [x, y, 0], [-x, y, 0]])
    return Polygons(points, np.array([4]), np.arange(4), np.tile([0.0, 0.0, 1.0], (4, 1)))


def _arc(bottom: float, top: float, low: float, high: float) -> tuple[np.ndarray, np.ndarray]:
    """Profile segments (k, 2, 2) and their normals of two half spheres joined by a wall."""
    angle = np.linspace(-np.pi / 2, 0, RINGS // 2 + 1)
    lower = np.stack([bottom * np.cos(angle), low + bottom * np.sin(angle)], axis=1)
    upper = np.stack([top * np.cos(-angle[::-1]), high + top * np.sin(-angle[::-1])], axis=1)
    directions = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    rising = np.stack([np.cos(-angle[::-1]), np.sin(-angle[::-1])], axis=1)
    line = np.concatenate([lower, upper])
    normal = np.concatenate([directions, rising])
    segments = np.stack([line[:-1], line[1:]], axis=1)
    normals = np.stack([normal[:-1], normal[1:]], axis=1)
    real = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1) > 0
    return segments[real], normals[real]


def _frustum(bottom: float, top: float, height: float) -> tuple[np.ndarray, np.ndarray]:
    """Profile segments and normals of a capped cylinder or cone."""
    half = height / 2
    slope = np.array([height, bottom - top])
    slope = slope / max(np.linalg.norm(slope), 1e-300)
    segments = np.array(
        [[[0, -half], [bottom, -half]], [[bottom, -half], [top, half]], [[top, half], [0, half]]]
    )
    normals = np.array([[[0, -1], [0, -1]], [slope, slope], [[0, 1], [0, 1]]], dtype=float)
    real = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1) > 0
    return segments[real], normals[real]


def _revolve(segments: np.ndarray, normals: np.ndarray) -> Polygons:
    """Turn profile segments (radius, height) about Z; zero radii make triangles."""
    angle = np.arange(SIDES) * (2 * np.pi / SIDES)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    there = (np.arange(SIDES) + 1) % SIDES
    points, counts, corners, corner_normals = [], [], [], []
    offset = 0

    def lift(profile: np.ndarray, at: np.ndarray) -> np.ndarray:
        return np.concatenate([circle[at] * profile[0], np.full((SIDES, 1), profile[1])], axis=1)

    here = np.arange(SIDES)
    for segment, normal in zip(segments, normals, strict=True):
        points += [lift(segment[0], here), lift(segment[1], here)]
        low, high = offset + here, offset + SIDES + here
        faces = [low, low[there], high[there], high]
        facing = [lift(normal[0], here), lift(normal[0], there), lift(normal[1], there), lift(normal[1], here)]
        if segment[1][0] == 0:
            del faces[2], facing[2]
        elif segment[0][0] == 0:
            del faces[1], facing[1]
        counts.append(np.full(SIDES, len(faces)))
        corners.append(np.stack(faces, axis=1).reshape(-1))
        corner_normals.append(np.stack(facing, axis=1).reshape(-1, 3))
        offset += 2 * SIDES
    if not points:
        return Polygons(np.zeros((0, 3)), np.zeros(0, int), np.zeros(0, int), np.zeros((0, 3)))
    return Polygons(
        np.concatenate(points), np.concatenate(counts), np.concatenate(corners), np.concatenate(corner_normals)
    )
