"""What hangs over the street: paper lanterns and strings of bulbs, all by PointInstancer."""

import math

from .shapes import hanging, resample, tube, turned
from .usda import Dice, Layer, Mesh, array, light, vec


def lanterns(folder):
    """Prototypes hang from their origin."""
    layer = Layer("assets/lanterns.usda", "Paper lanterns. Written by make.py.")

    def fittings(mesh, top, bottom, radius):
        tube(mesh, [(0, 0, 0), (0, 0, top)], 0.5, 3, "Iron", caps=False)
        turned(mesh, [(radius, top - 2), (radius, top + 2), (0, top + 3)], 8, "Board")
        turned(mesh, [(0, bottom - 3), (radius, bottom - 2), (radius, bottom + 2)], 8, "Board")
        turned(mesh, [(0.4, bottom - 26), (2.2, bottom - 22), (0.8, bottom - 3)], 5, "ClothRed")

    for name, color, nits, radius in (
        ("RedBall", (1, 0.045, 0.012), 3.6, 17),
        ("AmberBall", (1, 0.30, 0.05), 2.8, 15),
        ("PearlBall", (1, 0.66, 0.33), 1.7, 18),
    ):
        with layer.root(name):
            mesh = Mesh()
            fittings(mesh, -18, -18 - 2 * radius, radius * 0.5)
            mesh.write(layer, "Fittings")
            light(
                layer,
                "SphereLight",
                "Paper",
                (0, 0, -18 - radius),
                None,
                color=color,
                radius=radius,
                intensity=nits,
            )
    for name, color, nits, squash in (
        ("RedPaper", (1, 0.055, 0.015), 5.5, 0.82),
        ("GoldPaper", (1, 0.36, 0.08), 3.0, 1.15),
    ):
        with layer.root(name):
            r = 21
            mesh = Mesh()
            fittings(mesh, -18, -18 - 2 * r * squash, r * 0.42)
            mesh.write(layer, "Fittings")
            mesh, sides, rows = Mesh(), 14, 7
            profile = [
                (r * math.sin(t), -r * squash * math.cos(t))
                for t in (math.radians(24 + (156 - 24) * i / rows) for i in range(rows + 1))
            ]
            for j, ((r0, z0), (r1, z1)) in enumerate(zip(profile, profile[1:])):
                for k in range(sides):
                    a, b = 2 * math.pi * k / sides, 2 * math.pi * (k + 1) / sides
                    mesh.face(
                        [
                            (rr * math.cos(t), rr * math.sin(t), zz - 18 - r * squash)
                            for rr, t, zz in ((r0, a, z0), (r0, b, z0), (r1, b, z1), (r1, a, z1))
                        ],
                        "PaperGlow",
                        uv=[(u / sides, v / rows) for u, v in ((k, j), (k + 1, j), (k + 1, j + 1), (k, j + 1))],
                    )
            mesh.write(
                layer,
                "Paper",
                body=[f"color3f inputs:color = {vec(color)}", f"float inputs:intensity = {nits}"],
                light=True,
            )
    with layer.root("TallTube"):
        mesh = Mesh()
        fittings(mesh, -18, -76, 10)
        mesh.write(layer, "Fittings")
        light(
            layer,
            "CylinderLight",
            "Paper",
            (0, 0, -47),
            (0, 90, 0),
            color=(1, 0.20, 0.05),
            length=56,
            radius=12,
            intensity=2.6,
        )
    layer.save(folder)


KINDS = ["RedBall", "AmberBall", "PearlBall", "RedPaper", "GoldPaper", "TallTube"]
ROWS = [
    (3, 3, 0, 3, 3),
    (4, 1, 4, 1, 4),
    (0, 3, 0, 3, 0),
    (5, 4, 1, 4, 5),
    (3, 0, 3, 0, 3),
    (2, 4, 2, 1, 2),
    (0, 3, 3, 0, 3),
]


def instancer(layer, name, asset, kinds, items, turns=None):
    """`items` are (kind, position)."""
    with layer.prim("PointInstancer", name):
        layer.put("rel prototypes = [" + ", ".join(f"<Prototypes/{k}>" for k in kinds) + "]")
        layer.put("int[] protoIndices = " + array((k for k, _ in items), str))
        layer.put("point3f[] positions = " + array((p for _, p in items), vec))
        if turns:
            layer.put(
                "quath[] orientations = " + array(((math.cos(t / 2), 0, 0, math.sin(t / 2)) for t in turns), vec)
            )
        with layer.prim("Scope", "Prototypes"):
            for k in kinds:
                with layer.prim("Xform", k, [f"prepend references = @../assets/{asset}.usda@</{k}>"]):
                    pass


def lantern_rows(layer):
    dice, items, turns, cables = Dice(8), [], [], Mesh()
    row, y = 0, 470.0
    while y < 6300:
        a, b = (-516, y + dice(-60, 60), 610 + dice(-40, 50)), (516, y + dice(-60, 60), 610 + dice(-40, 50))
        path = hanging(a, b, dice(60, 105), 12)
        tube(cables, path, 0.7, 3, "Iron", caps=False)
        beads = resample(path, 104 if y < 3000 else 150)[1:-1]
        for k, (x, yy, z) in enumerate(beads):
            if x > 300 and 550 < y < 1500:  # leave the view of the house sign free
                continue
            items.append((ROWS[row % len(ROWS)][k % 5], (x, yy, z - dice(0, 14))))
            turns.append(dice(0, 6.28))
        row += 1
        y += 235 if y < 3000 else 330
    for side in (-1, 1):  # under the eaves of shops and arcades, low and warm
        for start, stop in ((300, 1500), (1900, 2800), (3300, 4300)):
            y = start + (0 if side < 0 else 260)
            while y < stop:
                items.append(((3, 0, 5)[len(items) % 3], (side * 488, y, 372 + dice(-6, 6))))
                turns.append(dice(0, 6.28))
                y += 115
    instancer(layer, "Lanterns", "lanterns", KINDS, items, turns)
    cables.write(layer, "LanternCables")
    return len(items)


def bulbs(folder):
    layer = Layer(
        "assets/bulb.usda", "A festoon bulb: a glass that glows, and under it the point light that works."
    )
    with layer.root("Bulb"):
        mesh = Mesh()
        turned(mesh, [(0, -10.5), (3.1, -7), (0, -3)], 4, "BulbGlass")
        mesh.write(layer, "Glass")
        mesh = Mesh()
        turned(mesh, [(1.2, -4), (1.2, 0.5)], 4, "Rubber")
        mesh.write(layer, "Socket")
        light(
            layer, "SphereLight", "Filament", (0, 0, -12.5), None, 2400, radius=2, intensity=120, treatAsPoint=True
        )
    layer.save(folder)


def festoons(layer):
    dice, spots, cables = Dice(31), [], Mesh()

    def string(a, b, sag, step):
        path = hanging(a, b, sag, 10)
        tube(cables, path, 0.6, 3, "Rubber", caps=False)
        spots.extend(resample(path, step)[1:-1])

    for side in (-1, 1):  # along the fronts
        y = 150.0
        while y < 6300:
            span = 330 if y < 3600 else 500
            z = 470 + 20 * side
            string((side * 455, y, z), (side * 455, y + span, z), 38, 30 if y < 3600 else 60)
            y += span
    y, side = 600.0, 1
    while y < 6000:  # zigzag above the lanterns
        step = 260 if y < 3500 else 420
        string(
            (side * 512, y, 800 + dice(-20, 40)),
            (-side * 512, y + step, 800 + dice(-20, 40)),
            95,
            36 if y < 3500 else 70,
        )
        y, side = y + step, -side
    instancer(layer, "Festoons", "bulb", ["Bulb"], [(0, s) for s in spots])
    cables.write(layer, "FestoonCables")
    return len(spots)


def write(folder):
    lanterns(folder)
    bulbs(folder)
    layer = Layer("layers/strings.usda", "Lanterns and festoons over the street. Written by make.py.")
    with layer.root("Strings", "group"):
        counts = lantern_rows(layer), festoons(layer)
    layer.save(folder)
    return counts
