"""A small test scene that is written as glTF and built for Mitsuba, and for Cycles, at once; and simple shapes."""

import math
import subprocess

import numpy as np

from others import mitsuba_side as theirs
from others.documents import Document, looking, matt
from others.pictures import read_exr

SIZE = (64, 64)
TALL = math.radians(44)
DEPTH = 10
GREY, RED = (0.5, 0.5, 0.5), (0.6, 0.25, 0.2)


class Booth:
    """A floor, a back wall and a red wall on the left, before a camera; what is put into it is put into both scenes."""

    def __init__(self, folder):
        self.folder, self.document, self.shapes, self.pieces = folder, Document(), {}, []
        self.eye = looking((0.5, 1.5, 4.6), (0, 0.95, 0))
        self.document.camera(self.eye, TALL, 1)
        self.put(quad((0, 0, 0), (2, 0, 0), (0, 0, -2)), GREY)
        self.put(quad((0, 1.5, -2), (2, 0, 0), (0, 1.5, 0)), GREY)
        self.put(quad((-2, 1.5, 0), (0, 0, -2), (0, 1.5, 0)), RED)

    def put(self, shape, color=(0, 0, 0), material=None, bsdf=None, glow=(0, 0, 0), normals=None, **more):
        """A mesh that is matt, or has a glTF material and the BSDF for Mitsuba that should be the same."""
        material = material or matt(color, glow, two_sided=not any(glow))
        points, triangles = shape[:2]
        uv = shape[2] if len(shape) > 2 else None
        number = self.document.add("materials", material)
        self.document.node(mesh=self.document.mesh(points, triangles, number, uv, normals))
        name = f"shape_{len(self.shapes)}"
        self.pieces.append((points, triangles, color, glow))
        bsdf = bsdf or theirs.diffuse(color)
        file = self.folder / f"{name}.ply"
        self.shapes[name] = theirs.shape(file, points, triangles, bsdf, glow, uv, normals, **more)

    def lamp(self, middle, along, up, radiance):
        self.put(quad(middle, along, up), glow=np.full(3, radiance))

    def loaded(self, integrator="path", depth=DEPTH, shapes=None):
        row = {"type": "scene", "integrator": {"type": integrator, "max_depth": depth + 1, "rr_depth": 1000}}
        return theirs.mi.load_dict(row | {"sensor": theirs.camera(self.eye, TALL, SIZE)} | self.shapes | (shapes or {}))

    def by_cycles(self, surfaces, samples, runs, depth=DEPTH, light=None):
        """Pictures by Cycles; `surfaces` are the principled ones by piece, `light` a profile and its place."""
        from others import cycles_side as cycles

        scene = cycles.empty(SIZE, depth, 2)
        for i, (points, triangles, color, glow) in enumerate(self.pieces):
            surface = cycles.principled(**surfaces[i]) if i in surfaces else cycles.matt(color, glow, not any(glow))
            cycles.place(cycles.mesh(points, triangles, surface))
        if light:
            cycles.place(cycles.photometric(light[0]), light[1])
        cycles.camera(self.eye, TALL)
        return np.stack([cycles.picture(scene, samples, seed) for seed in range(runs)])

    def ours(self, program, samples, runs, depth=DEPTH):
        """Independent pictures by Candelabra."""
        scene, picture = self.folder / "scene.glb", self.folder / "ours.exr"
        if not scene.exists():
            self.document.save(scene)
        stack = []
        size = f"{SIZE[0]}x{SIZE[1]}"
        for seed in range(runs):
            command = [program, scene, "-o", picture, "--res", size, "--spp", samples, "--seed", seed, "--float"]
            command += ["--depth", depth, "--progress", "none", "--strict"]
            subprocess.run([str(word) for word in command], check=True, stdout=subprocess.DEVNULL)
            stack.append(read_exr(picture))
        return np.stack(stack)


def quad(middle, along, up):
    """A rectangle from its middle to its edges, its front where `along x up` points; with texture coordinates."""
    middle, along, up = (np.array(v, float) for v in (middle, along, up))
    points = np.array([middle + a * along + b * up for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    return points, np.array([(0, 1, 2), (0, 2, 3)]), np.array([(0, 1), (1, 1), (1, 0), (0, 0)], float)


def box(low, high):
    """A closed box, its front outside."""
    corners = np.array([[(low, high)[(i >> axis) & 1][axis] for axis in range(3)] for i in range(8)], float)
    faces = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]
    return corners, np.array([t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))])


def ball(middle, radius, rings=24):
    """A closed ball of flat triangles, its front outside."""
    sides = 2 * rings
    points = [(0, 1, 0)]
    for ring in range(1, rings):
        polar = math.pi * ring / rings
        turns = [2 * math.pi * i / sides for i in range(sides)]
        points += [(math.sin(polar) * math.sin(t), math.cos(polar), math.sin(polar) * math.cos(t)) for t in turns]
    points.append((0, -1, 0))
    at = lambda ring, i: 1 + (ring - 1) * sides + i % sides
    triangles = [(0, at(1, i), at(1, i + 1)) for i in range(sides)]
    for ring in range(1, rings - 1):
        for i in range(sides):
            a, b, c, d = at(ring, i), at(ring + 1, i), at(ring + 1, i + 1), at(ring, i + 1)
            triangles += [(a, b, c), (a, c, d)]
    triangles += [(at(rings - 1, i), len(points) - 1, at(rings - 1, i + 1)) for i in range(sides)]
    return np.array(points) * radius + middle, np.array(triangles)
