"""A pine of the scenery, built straight and bent by its skeleton: soft skinning, two joints to each point, in a pose that stays."""

import math

from parts.shapes import turned
from parts.usda import Layer, Mesh, array, num, vec

from .cages import lofted, turn

JOINTS = ["root", "root/low", "root/low/high", "root/low/high/top"]
SPACING, ROWS, SIDES = 62.0, 13, 9
BEND = [(4, 0), (-17, 8), (26, -6), (-38, 10)]
"""Degrees about Y and X by which each joint turns against the one below."""


def quaternion(about_y, about_x):
    a, b = math.radians(about_y) / 2, math.radians(about_x) / 2
    q = (math.cos(a) * math.cos(b), math.cos(a) * math.sin(b), math.sin(a) * math.cos(b), -math.sin(a) * math.sin(b))
    return "(" + ", ".join(f"{v:.6f}" for v in q) + ")"


def matrices(steps):
    return array((f"((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, {num(z)}, 1))" for z in steps), str)


def skinned(layer, mesh, name, weigh):
    """`weigh(z)` gives ((joint, weight), (joint, weight)) of a point."""
    pairs = [weigh(p[2]) for p in mesh.points]
    indices = array((j for pair in pairs for j, _ in pair), str)
    weights = array((w for pair in pairs for _, w in pair), num)
    mesh.write(layer, name, ['append apiSchemas = ["SkelBindingAPI"]'], [
        f'int[] primvars:skel:jointIndices = {indices} (elementSize = 2; interpolation = "vertex")',
        f'float[] primvars:skel:jointWeights = {weights} (elementSize = 2; interpolation = "vertex")',
        "rel skel:skeleton = </Pine/Tree/Skeleton>",
    ])  # fmt: skip


def between(z):
    u = min(max(z / SPACING, 0), len(JOINTS) - 1.001)
    low = int(u)
    return (low, round(1 - (u - low), 3)), (low + 1, round(u - low, 3))


def write(folder):
    layer = Layer("layers/pine.usda", "A pine bent by the wind. Written by make.py.")
    with layer.root("Pine"), layer.prim("SkelRoot", "Tree", ['prepend apiSchemas = ["SkelBindingAPI"]']):
        names = array((f'"{j}"' for j in JOINTS), str)
        body = [
            "rel skel:animationSource = </Pine/Tree/Wind>",
            f"uniform token[] joints = {names}",
            f"uniform matrix4d[] bindTransforms = {matrices(SPACING * k for k in range(len(JOINTS)))}",
            f"uniform matrix4d[] restTransforms = {matrices([0] + [SPACING] * (len(JOINTS) - 1))}",
        ]
        with layer.prim("Skeleton", "Skeleton", ['prepend apiSchemas = ["SkelBindingAPI"]'], body):
            pass
        body = [
            f"uniform token[] joints = {names}",
            f"half3[] scales = {array([(1, 1, 1)] * len(JOINTS), vec)}",
            f"quatf[] rotations = {array((quaternion(*b) for b in BEND), str)}",
            f"float3[] translations = {array([(0, 0, SPACING if k else 0) for k in range(len(JOINTS))], vec)}",
        ]
        with layer.prim("SkelAnimation", "Wind", body=body):
            pass
        rings = []
        for j in range(ROWS):
            z, radius = 19.0 * j, 9.5 * (1 - 0.62 * j / ROWS)
            rings.append([(*turn(360 * k / SIDES, radius * (1 + 0.12 * math.sin(3 * k + j))), z) for k in range(SIDES)])
        points, faces = lofted(rings)
        trunk = Mesh()
        for face in faces:
            trunk.face([points[i] for i in face], "PineBark")
        skinned(layer, trunk, "Trunk", between)
        crown = Mesh()
        for x, y, z, radius in ((-34, -6, 118, 36), (30, 4, 152, 42), (-26, 2, 190, 46), (22, -4, 218, 38), (-6, 0, 246, 40)):
            pad = [(0, -5), (0.9, -5), (1, 0), (0.75, 8), (0.3, 13), (0, 14)]
            turned(crown, [(radius * r, up) for r, up in pad], 16, "PineLeaf", (x, y, z))
        skinned(layer, crown, "Crown", between)
    layer.save(folder)
