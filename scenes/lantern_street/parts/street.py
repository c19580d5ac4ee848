"""The roadway with its puddles, rails, pavements and lamps."""

import math

from .shapes import box, hanging, tube, turned
from .usda import Dice, Layer, Mesh, array, light, noise, vec

START, END, KERB, FRONT = -700, 6690, 370, 520
RAILS = (-200, -100)  # the tram's track
WATER = -1.55  # the level of the puddles


def depth(x, y):
    """Height of the roadway: worn hollows along wheel tracks and gutters."""
    hollow = (
        noise(x / 95 + 40, y / 210 + 3, 1) * 0.62
        + noise(x / 38, y / 70, 2) * 0.25
        + noise(x / 15, y / 22, 3) * 0.13
    )
    gutter = math.exp(-(((abs(x) - 345) / 45) ** 2))
    worn = math.exp(-(((x - 160) / 90) ** 2))
    return 1.0 + 1.0 * (1 - abs(x) / KERB) - 5.2 * hollow - 0.9 * gutter - 0.6 * worn


def roadway(layer):
    xs = [-KERB + 2 * KERB * i / 42 for i in range(43)]
    ys, y = [START], START
    while y < END:  # finest where the camera looks: its picture begins at y = 300
        y += 120 if y < 200 else 14 + max(0, y - 800) * 0.045
        ys.append(min(y, END))
    mesh, normals, uvs = Mesh(digits=2), [], []
    for y in ys:
        for x in xs:
            mesh.vertex((x, y, depth(x, y)))
            slope = [(depth(x + dx, y + dy) - depth(x - dx, y - dy)) / 16 for dx, dy in ((8, 0), (0, 8))]
            normals.append((round(-slope[0], 2), round(-slope[1], 2), 1))
            uvs.append((x / 190, y / 190))
    n = len(xs)
    for j in range(len(ys) - 1):
        for i in range(n - 1):
            k = j * n + i
            mesh.faces.append(([k, k + 1, k + n + 1, k + n], "SettsDry", False))
    mesh.uvs = [[]] * len(mesh.faces)
    mesh.write(layer, "Roadway", normals=normals, vertex_uv=uvs)
    water = Mesh()
    for a, b in zip(range(START, END, 1000), [*range(START + 1000, END, 1000), END]):
        water.face([(-KERB, a, WATER), (KERB, a, WATER), (KERB, b, WATER), (-KERB, b, WATER)], "Water")
    water.write(layer, "Puddles")


def pavements(layer):
    mesh, dice = Mesh(), Dice(5)
    for side in (-1, 1):
        lo, hi = sorted((side * KERB, side * (KERB + 16)))
        y = START
        while y < END:  # kerb stones
            step = 110 if y < 1500 else 400
            box(mesh, (lo, y + 0.6, -6), (hi, min(y + step, END), 12 + dice(-0.5, 0.5)), "Stone", "z-")
            y += step
        lo, hi = sorted((side * (KERB + 16), side * (FRONT + 40)))
        y = START
        while y < END:  # slabs, each a hair out of level
            step = 78 if y < 1300 else 240
            for k in range(3):
                a, b = lo + (hi - lo) * k / 3, lo + (hi - lo) * (k + 1) / 3
                z = 12 + dice(-0.35, 0.35)
                tip = [z + dice(-0.25, 0.25) for _ in range(4)]
                mesh.face(
                    [
                        (a + 0.5, y + 0.5, tip[0]),
                        (b - 0.5, y + 0.5, tip[1]),
                        (b - 0.5, y + step - 0.5, tip[2]),
                        (a + 0.5, y + step - 0.5, tip[3]),
                    ],
                    "Flags",
                )
            y += step
        mesh.face([(lo, START, 11.2), (hi, START, 11.2), (hi, END, 11.2), (lo, END, 11.2)], "DarkStone")
    mesh.face(
        [(-1100, END - 10, -4), (1100, END - 10, -4), (1100, END + 900, -4), (-1100, END + 900, -4)], "DarkStone"
    )
    mesh.write(layer, "Pavements")
    rails = Mesh()
    for x in RAILS:
        box(rails, (x - 5.5, START, -6), (x + 1.5, END, 1.6), "Steel", "z-y-y+")
        box(rails, (x + 4, START, -6), (x + 6, END, 1.4), "Steel", "z-y-y+")
    rails.write(layer, "Rails")


def wires(layer):
    mesh = Mesh()
    track = sum(RAILS) / 2
    for y in range(300, 6300, 1200):
        mesh_path = hanging((-515, y, 610), (515, y, 600), 32, 10)
        tube(mesh, mesh_path, 0.7, 3, "Iron", caps=False)
    for y in range(-900, 6300, 1200):
        tube(mesh, hanging((track, y, 500), (track, y + 1200, 500), 9, 4), 0.8, 3, "Iron", caps=False)
        if y >= 300:
            tube(mesh, [(track, y, 570), (track, y, 500)], 0.6, 3, "Iron", caps=False)
    mesh.write(layer, "TramWires")


def lamp(folder):
    layer = Layer("assets/street_lamp.usda", "A street lamp: post, glass, and a disk light under the hat.")
    with layer.root("StreetLamp"):
        mesh = Mesh()
        turned(
            mesh,
            [
                (17, 0),
                (17, 10),
                (11, 22),
                (9, 60),
                (11, 64),
                (7, 72),
                (5, 100),
                (4, 300),
                (6.5, 304),
                (4, 312),
                (3.5, 345),
            ],
            10,
            "Iron",
        )
        turned(mesh, [(8, 343), (15, 350), (16, 353)], 10, "Iron")
        turned(mesh, [(30, 392), (31, 396), (17, 412), (5, 420), (3, 430), (0, 434)], 12, "Iron")
        turned(mesh, [(0, 391), (30, 392)], 12, "WhitePaint")
        for k in range(4):
            t = math.radians(45 + 90 * k)
            tube(
                mesh,
                [(15 * math.cos(t), 15 * math.sin(t), 352), (20 * math.cos(t), 20 * math.sin(t), 393)],
                0.9,
                4,
                "Iron",
            )
        tube(mesh, [(-38, 0, 300), (38, 0, 300)], 1.4, 5, "Iron")
        mesh.write(layer, "Post")
        light(layer, "SphereLight", "Mantle", (0, 0, 372), None, 2700, radius=11, intensity=16)
        light(
            layer, "DiskLight", "Reflector", (0, 0, 389), None, 3000, (74, 0.35), radius=19, intensity=2, exposure=7
        )
    layer.save(folder)


def lamps(layer):
    spots = [(396, y) for y in range(-320, 6600, 1010)] + [(-396, y) for y in range(-820, 6600, 1010)]
    with layer.prim("PointInstancer", "StreetLamps"):
        layer.put("rel prototypes = <Prototypes/StreetLamp>")
        layer.put("int[] protoIndices = " + array([0] * len(spots), str))
        layer.put("point3f[] positions = " + array([(x, y, 12) for x, y in spots], vec))
        with layer.prim("Scope", "Prototypes"):
            with layer.prim("Xform", "StreetLamp", ["prepend references = @../assets/street_lamp.usda@"]):
                pass


def write(folder):
    lamp(folder)
    layer = Layer("layers/street.usda", "Roadway, puddles, rails, pavements, lamps, wires. Written by make.py.")
    with layer.root("Street", "group"):
        roadway(layer)
        pavements(layer)
        wires(layer)
        lamps(layer)
        layer.used |= {"SettsWet"}
    layer.save(folder)
