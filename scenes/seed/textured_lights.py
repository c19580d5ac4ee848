"""A thousand textured mesh lights: screens and signs of a hundred triangles each, in a hall.

Fifty pictures of 1024 x 512 texels are shown; every screen shows its own cut of one of them, at its own strength.
A build integrates the picture over every triangle. The scene is for timing what is before the first pixel.
"""

import struct
import zlib

import numpy as np
from kit import Glb

PICTURES, WIDE, TALL = 50, 1024, 512
SCREENS, COLUMNS, ROWS = 1000, 10, 5


def write(path):
    scene = Glb(["KHR_materials_emissive_strength", "KHR_materials_specular"])
    chance = np.random.default_rng(11)
    document = scene.document
    document |= {"images": [], "textures": [], "samplers": [{"wrapS": 10497, "wrapT": 10497}]}
    for picture in range(PICTURES):
        document["images"].append({"bufferView": _bytes(scene, png(content(picture))), "mimeType": "image/png"})
        document["textures"].append({"source": picture, "sampler": 0})
    floor = np.array([(-60, -60, 0), (60, -60, 0), (60, 60, 0), (-60, 60, 0)], float)
    scene.mesh("Floor", floor, [(0, 1, 2), (0, 2, 3)], (0.5, 0.5, 0.5))
    for number in range(SCREENS):
        _screen(scene, number, chance)
    scene.camera((0, -50, 18), (0, 0, 4), 60)
    scene.save(path)


def _screen(scene, number, chance):
    """A bent grid of 10 x 5 cells in two triangles each."""
    s, t = (a.ravel() for a in np.meshgrid(np.linspace(0, 1, COLUMNS + 1), np.linspace(0, 1, ROWS + 1)))
    wide, turn = chance.uniform(0.8, 3), chance.uniform(0, 2 * np.pi)
    flat = np.stack([(s - 0.5) * wide, 0.3 * wide * (s - 0.5) ** 2, (1 - t) * wide / 2], axis=1)
    at = (*chance.uniform(-45, 45, 2), chance.uniform(0.5, 10))
    cos, sin = np.cos(turn), np.sin(turn)
    points = flat @ np.array([(cos, sin, 0), (-sin, cos, 0), (0, 0, 1)]) + at
    low = chance.uniform(0, 0.4, 2)
    uvs = low + np.stack([s, t], axis=1) * chance.uniform(0.5, 1, 2)
    cell = np.arange(COLUMNS * ROWS)
    a = cell // COLUMNS * (COLUMNS + 1) + cell % COLUMNS
    b, c, d = a + COLUMNS + 1, a + COLUMNS + 2, a + 1
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    scene.mesh(f"Screen_{number}", points, triangles, (0, 0, 0), nits=float(chance.uniform(50, 400)))
    primitive = scene.document["meshes"][-1]["primitives"][0]
    primitive["attributes"]["TEXCOORD_0"] = scene._accessor(uvs, "<f4", "VEC2")
    scene.document["materials"][-1]["emissiveTexture"] = {"index": number % PICTURES}


def content(number):
    """A picture: glowing shapes on black, as signs and screens have them. 8 bits, sRGB."""
    chance = np.random.default_rng(number)
    y, x = np.mgrid[0:TALL, 0:WIDE]
    picture = np.zeros((TALL, WIDE, 3))
    for _ in range(12):
        left, top = chance.integers(0, WIDE), chance.integers(0, TALL)
        wide, tall = chance.integers(20, 300), chance.integers(10, 120)
        inside = (abs(x - left) < wide / 2) & (abs(y - top) < tall / 2)
        shade = 0.6 + 0.4 * np.sin(x * chance.uniform(0.01, 0.2) + y * chance.uniform(0.01, 0.2))
        picture[inside] = (shade[..., None] * chance.uniform(0.1, 1, 3))[inside]
    return np.round(picture * 255).astype(np.uint8)


def png(pixels):
    tall, wide, _ = pixels.shape
    rows = b"".join(b"\0" + row.tobytes() for row in pixels)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", wide, tall, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows, 6)) + chunk(b"IEND", b"")


def _bytes(scene, data):
    """A view of some bytes, which end at a multiple of 4."""
    view = {"buffer": 0, "byteOffset": len(scene.binary), "byteLength": len(data)}
    scene.binary += data + bytes(-len(data) % 4)
    scene.document["bufferViews"].append(view)
    return len(scene.document["bufferViews"]) - 1
