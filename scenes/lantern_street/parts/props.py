"""What stands in the street: people, a kiosk, café tables, crates, bicycles, a traffic light."""

import math

from .windows import leaves
from .shapes import arc, ball_profile, box, prism, tube, turned
from .strings import instancer
from .usda import Dice, Layer, Mesh, light, place


def person(layer, name, coat, umbrella, lean, bag):
    with layer.root(name):
        mesh = Mesh()
        for x, step in ((-9, lean), (9, -lean)):
            tube(mesh, [(x, step, 0), (x * 0.9, step * 0.3, 46), (x * 0.8, 0, 88)], 7.5, 6, "ClothDark")
            box(mesh, (x - 5, step - 14, 0), (x + 5, step + 10, 8), "Rubber", "z-")
        turned(mesh, [(27, 52), (25, 80), (20, 108), (24, 138), (17, 150), (6, 154)], 9, coat)
        turned(mesh, ball_profile(10.5, 7, 1.2), 9, "Skin", (0, 0, 166))
        turned(mesh, [(11.2, 166), (10.5, 174), (7, 180), (0, 181)], 9, "ClothDark")
        tube(mesh, [(-22, 0, 140), (-29, -6, 112), (-24, -22, 96)], 5.5, 6, coat)
        if umbrella:
            tube(mesh, [(22, 0, 140), (28, -10, 118), (20, -24, 132)], 5.5, 6, coat)
            tube(mesh, [(20, -24, 118), (12, -12, 226)], 0.9, 4, "Iron")
            turned(mesh, [(66, 196), (58, 205), (42, 216), (22, 223), (0, 226)], 8, umbrella, (10, -10, 0))
            turned(mesh, [(0, 225), (22, 222), (42, 215), (58, 204), (66, 195.5)], 8, umbrella, (10, -10, 0))
        else:
            tube(mesh, [(22, 0, 140), (29, 4, 112), (26, -4, 90)], 5.5, 6, coat)
        if bag:
            box(mesh, (24, -18, 58), (34, 14, 86), "Timber")
        mesh.write(layer, "Body")


def walkers(folder):
    layer = Layer("assets/walkers.usda", "People, as silhouettes. Written by make.py.")
    person(layer, "WithUmbrella", "ClothDark", "ClothDark", 18, False)
    person(layer, "WithRedUmbrella", "BluePaint", "ClothRed", 22, True)
    person(layer, "InGreen", "GreenPaint", None, 14, True)
    layer.save(folder)


CROWD = [  # kind, x, y, heading in degrees
    (0, 210, 1180, 10),
    (1, 262, 1215, 0),
    (0, -20, 2060, 160),
    (2, 440, 905, 80),
    (2, 455, 1500, -100),
    (1, -430, 1420, 180),
    (0, 120, 2500, 20),
    (2, 60, 3120, 0),
    (1, 150, 3180, 8),
    (0, -440, 2300, 0),
    (2, -452, 1890, 70),
    (0, 430, 2840, 180),
    (1, 330, 4100, 0),
    (0, 300, 4160, 0),
    (2, -30, 4700, 180),
]


def kiosk(layer):
    """A newspaper kiosk: six sides, tube lights inside."""
    with layer.prim("Xform", "Kiosk", body=place((-452, 1010, 12), 15)):
        mesh, dice = Mesh(), Dice(3)

        def hexagon(r):
            return [(r * math.cos(math.radians(60 * k)), r * math.sin(math.radians(60 * k))) for k in range(6)]

        prism(mesh, hexagon(72), 0, 12, "DarkStone")
        prism(mesh, hexagon(66), 12, 95, "GreenPaint", True, lid="Timber")
        prism(mesh, hexagon(70), 92, 98, "Brass", True)
        prism(mesh, hexagon(88), 226, 240, "GreenPaint", True, lid="WhitePaint")
        for k in range(6):
            (x0, y0), (x1, y1) = hexagon(64)[k], hexagon(64)[(k + 1) % 6]
            tube(mesh, [(x0, y0, 98), (x0, y0, 226)], 3, 5, "GreenPaint", caps=False)
            for j in range(3):  # papers on the counter rail
                t0, t1 = 0.1 + j * 0.29, 0.1 + j * 0.29 + 0.24
                a, b = [(x0 + (x1 - x0) * t, y0 + (y1 - y0) * t) for t in (t0, t1)]
                z = 60 + dice(0, 6)
                s = 1.06
                mesh.face(
                    [
                        (a[0] * s, a[1] * s, z - 34),
                        (b[0] * s, b[1] * s, z - 34),
                        (b[0] * s * 0.99, b[1] * s * 0.99, z),
                        (a[0] * s * 0.99, a[1] * s * 0.99, z),
                    ],
                    dice.pick(["ClothCream", "ColourA", "ColourB", "ColourC"]),
                )
        turned(mesh, [(88, 240), (70, 262), (34, 282), (12, 292), (10, 306), (0, 322)], 6, "GreenPaint")
        tube(mesh, [(0, 0, 12), (0, 0, 226)], 16, 6, "Timber", caps=False)
        turned(mesh, [(20, 98), (24, 140), (8, 152)], 8, "ClothDark", (26, -22, 0))
        turned(mesh, ball_profile(10.5, 6, 1.2), 8, "Skin", (26, -22, 166))
        mesh.write(layer, "Shell")
        for k in range(6):
            t = math.radians(60 * k + 30)
            light(
                layer,
                "CylinderLight",
                f"Tube_{k + 1}",
                (46 * math.cos(t), 46 * math.sin(t), 221),
                (0, 0, 60 * k + 120),
                4600,
                length=54,
                radius=1.6,
                intensity=60,
            )


def traffic_light(layer):
    with layer.prim("Xform", "TrafficLight", body=place((-388, 640, 12))):
        mesh = Mesh()
        turned(mesh, [(9, 0), (7, 20), (5, 30), (4.5, 330), (0, 332)], 8, "Iron")
        box(mesh, (-15, -26, 232), (15, -4, 328), "Board")
        for z in (250, 280, 310):
            turned(mesh, [(12.5, -0.1), (12.5, 0)], 3, "Iron", (0, -27, z))
            hood = [
                (13 * math.cos(math.radians(a)), -26, z + 13 * math.sin(math.radians(a))) for a in range(0, 181, 30)
            ]
            for p, q in zip(hood, hood[1:]):
                mesh.face([p, q, (q[0], -44, q[2]), (p[0], -44, p[2])], "Board")
        mesh.write(layer, "Post", body=["uniform bool doubleSided = 1"])
        for z, color, nits in (
            (250, (0.05, 1, 0.35), 0.02),
            (280, (1, 0.45, 0.02), 0.03),
            (310, (1, 0.03, 0.015), 14),
        ):
            light(
                layer,
                "DiskLight",
                {250: "Green", 280: "Amber", 310: "Red"}[z],
                (0, -27.2, z),
                (90, 0, 180),
                color=color,
                radius=10.5,
                intensity=nits,
            )


def bicycle(layer, name, at, turn):
    """Leaning on a wall: X is its length."""
    with layer.prim("Xform", name, body=place(at, (0, 8, turn))):
        mesh = Mesh()
        for x in (-52, 52):
            tube(mesh, [(x + c, 0, 34 + s) for c, s in arc(0, 0, 32, 0, 342, 19)], 1.6, 4, "Rubber", closed=True)
            for k in range(6):
                t = math.radians(30 * k)
                tube(
                    mesh,
                    [
                        (x - 31 * math.cos(t), 0, 34 - 31 * math.sin(t)),
                        (x + 31 * math.cos(t), 0, 34 + 31 * math.sin(t)),
                    ],
                    0.3,
                    3,
                    "Steel",
                )
        for path in (
            [(-52, 34), (-6, 32), (36, 80), (-18, 82), (-6, 32)],
            [(-52, 34), (-18, 82), (-21, 94)],
            [(52, 34), (36, 80), (33, 98), (24, 102)],
        ):
            tube(mesh, [(x, 0, z) for x, z in path], 1.6, 5, "RedPaint")
        tube(mesh, [(24, -24, 103), (33, 0, 99), (24, 24, 103)], 1.2, 4, "Steel")
        box(mesh, (-34, -7, 93), (-10, 7, 97), "Timber")
        mesh.write(layer, "Frame")


def cafe(layer, name, at):
    with layer.prim("Xform", name, body=place(at)):
        mesh = Mesh()
        turned(mesh, [(20, 0), (18, 3), (2.5, 6), (2.5, 72), (34, 72), (34, 75), (0, 75)], 12, "Iron")
        for t in (40, 165, 280):
            x, y = 58 * math.cos(math.radians(t)), 58 * math.sin(math.radians(t))
            box(mesh, (x - 18, y - 18, 42), (x + 18, y + 18, 46), "Timber")
            for dx in (-16, 16):
                for dy in (-16, 16):
                    tube(mesh, [(x + dx, y + dy, 0), (x + dx, y + dy, 42)], 1.3, 4, "Iron", caps=False)
            bx, by = x * 1.3, y * 1.3
            tube(mesh, [(bx - 14, by, 44), (bx - 14, by, 86), (bx + 14, by, 86), (bx + 14, by, 44)], 1.4, 4, "Iron")
        turned(mesh, [(4, 75), (4.5, 86)], 8, "Brass")
        mesh.write(layer, "Iron")
        light(layer, "SphereLight", "Candle", (0, 0, 92), None, 1900, radius=2.5, intensity=120)


def clutter(layer):
    mesh, dice = Mesh(), Dice(12)
    for x, y, z in (
        (474, 330, 12),
        (470, 382, 12),
        (476, 352, 50),
        (-478, 470, 12),
        (-476, 520, 12),
        (486, 2010, 12),
        (-480, 1660, 12),
    ):
        turn = dice(-4, 4)
        for k in range(4):
            box(mesh, (x - 28 + turn, y - 22, z + k * 9.5), (x + 28 + turn, y + 22, z + k * 9.5 + 7.5), "Timber")
        box(mesh, (x - 25 + turn, y - 20, z), (x + 25 + turn, y + 20, z + 33), "ColourC", "z-")
        for _ in range(7):
            turned(
                mesh,
                ball_profile(6.5, 4),
                6,
                dice.pick(["ColourA", "ClothRed", "ColourC"]),
                (x + turn + dice(-17, 17), y + dice(-13, 13), z + 37),
            )
    for x, y in ((484, 640), (484, 1010), (-486, 330), (-484, 880), (486, 1560), (-484, 1990), (484, 2300)):
        turned(mesh, [(17, 0), (25, 40), (27, 44), (23, 44), (22, 38), (0, 38)], 10, "Terracotta", (x, y, 12))
        leaves(mesh, dice, (x - 26, y - 26, 52), (x + 26, y + 26, 118), 60, 11)
    mesh.write(layer, "Clutter", body=["uniform bool doubleSided = 1"])
    hidden = Mesh()  # builders' scaffold, switched off
    for x in (380, 520):
        for y in (300, 600, 900):
            box(hidden, (x - 5, y - 5, 0), (x + 5, y + 5, 900), "Steel")
    hidden.write(layer, "Scaffold", body=['token visibility = "invisible"'])


def write(folder):
    walkers(folder)
    layer = Layer("layers/props.usda", "People and things in the street. Written by make.py.")
    with layer.root("Props", "group"):
        instancer(
            layer,
            "Walkers",
            "walkers",
            ["WithUmbrella", "WithRedUmbrella", "InGreen"],
            [(k, (x, y, 12 if abs(x) > 370 else 1)) for k, x, y, _ in CROWD],
            [math.radians(t) for *_, t in CROWD],
        )
        kiosk(layer)
        traffic_light(layer)
        bicycle(layer, "Bicycle_1", (497, 860, 12), -90)
        bicycle(layer, "Bicycle_2", (-498, 1760, 12), 90)
        for k, (x, y) in enumerate(((-450, 560), (-446, 760), (446, 1340), (446, 1660))):
            cafe(layer, f"Cafe_{k + 1}", (x, y, 12))
        clutter(layer)
    layer.save(folder)
