"""The house: stage, gilded arch, curtains, the sea of cardboard, the lit sky and its stars, bulbs, neon, revolving lantern."""

import math

from parts.shapes import arc, box, prism, resample, rounded, tube, turned
from parts.strokes import word
from parts.usda import Dice, Layer, Mesh, array, light, place, vec

from .cages import block, cage

TO_HOUSE = (90, 0, 180)  # turns a rect light, which looks down -Z, to look along -Y, upright
FLOOR, OPENING, TOP = 90, 320, 450  # heights of the boards and of the arch, and half its width
FRAMES = range(1001, 1025)


def stage(layer):
    mesh = Mesh()
    box(mesh, (-430, 4, 0), (430, 520, FLOOR - 4), "Black", "z-z+")
    for k in range(8):  # panels of the front
        x = -424 + 106 * k
        box(mesh, (x + 8, -1, 12), (x + 98, 4, FLOOR - 14), "Lacquer", "y+")
    box(mesh, (-430, 0, 0), (430, 4, FLOOR - 4), "Blue", "y+z-")
    box(mesh, (-436, -8, FLOOR - 8), (436, 4, FLOOR - 1), "CardGold", "y+")
    box(mesh, (-436, -6, 0), (436, 4, 8), "CardGold", "y+z-")
    mesh.write(layer, "Front")
    mesh = Mesh(uv_size=160)
    mesh.face([(-430, -4, FLOOR), (430, -4, FLOOR), (430, 520, FLOOR), (-430, 520, FLOOR)], "Boards")
    mesh.write(layer, "Floor")
    mesh = Mesh()  # masking: nothing is seen beside the scenery, or above it
    for side in (-1, 1):
        box(mesh, (side * 420 - 4, 90, FLOOR), (side * 420 + 4, 520, 520), "Black", "z-")
    box(mesh, (-430, 500, FLOOR), (430, 520, 520), "Black", "z-")
    box(mesh, (-430, 60, 500), (430, 520, 520), "Black")
    mesh.write(layer, "Masking")


def arch(layer):
    """Blue walls with gilded pillars whose edges are creases, a beam, and a round pediment."""
    mesh = Mesh()
    for side in (-1, 1):
        lo, hi = sorted((side * (OPENING + 5), side * 430))
        box(mesh, (lo, 52, FLOOR), (hi, 70, TOP), "Blue", "z-z+")
    box(mesh, (-430, 48, TOP), (430, 76, 545), "Blue")
    crown = arc(0, 0, 150, 0, 180, 24, 0.8)
    prism(_Upright(mesh, 50, 545), crown, 0, 24, "Blue")
    mesh.write(layer, "Wall")
    mesh = Mesh()
    for low, high in (((-440, 40, 545), (440, 80, 555)), ((-436, 43, TOP - 6), (436, 60, TOP + 4))):
        box(mesh, low, high, "Gilt")
    rim = [(x, 46, 555 + z) for x, z in arc(0, 0, 150, 0, 180, 24, 0.8)]
    tube(mesh, rim, 6, 8, "Gilt")
    mesh.write(layer, "Mouldings")
    for side, name in ((-1, "Left"), (1, "Right")):
        with layer.prim("Xform", f"Pillar{name}", body=place((side * 348, 44, FLOOR))):
            for part, low, high, sharp in (
                ("Base", (-34, -20, 0), (34, 20, 34), 3),
                ("Shaft", (-22, -12, 30), (22, 12, 330), 1.5),
                ("Capital", (-32, -20, 326), (32, 20, 362), 3),
            ):
                points, faces = block(low, high)
                chain = [0, 1, 2, 3, 0], [4, 5, 6, 7, 4]
                uprights = [((k, k + 4), sharp) for k in range(4)] if part == "Shaft" else []
                rings = [] if part == "Shaft" else [(ring, sharp) for ring in chain]
                ends = [(k, 4) for k in range(8)] if part == "Shaft" else []
                cage(layer, part, points, faces, "Gilt", rings + uprights, ends)


class _Upright:
    """A mesh into which a shape of the plane (x, z) is pulled along y."""

    def __init__(self, mesh, y, z=0):
        self.mesh, self.y, self.z = mesh, y, z

    def face(self, corners, material):
        self.mesh.face([(x, self.y + 24 - d, self.z + up) for x, up, d in corners], material)


def curtains(layer):
    """Velvet in folds, gathered at the height of a tie; the hem's ends are corners."""
    columns, rows = 22, 12
    for side, name in ((-1, "Left"), (1, "Right")):
        points = []
        for j in range(rows + 1):
            z = FLOOR + 3 + (TOP - FLOOR) * j / rows
            up = j / rows
            tie = math.exp(-(((up - 0.36) / 0.2) ** 2))
            inner = 205 + 62 * tie + 24 * max(0, 0.36 - up) / 0.36
            for k in range(columns + 1):
                across = k / columns
                x = OPENING + 12 - (OPENING + 12 - inner) * across
                depth = 9 * (1 - 0.5 * tie) * math.sin(2 * math.pi * 5.5 * across + 0.6 * math.sin(3 * up))
                points.append((side * x, 100 + depth + 8 * tie, z))
        width = columns + 1
        faces = []
        for j in range(rows):
            for k in range(columns):
                a = j * width + k
                quad = (a, a + 1, a + width + 1, a + width)
                faces.append(quad if side < 0 else quad[::-1])
        cage(layer, f"Curtain{name}", points, faces, "Velvet", corners=[(0, 10), (columns, 10)], body=["uniform bool doubleSided = 1"])
    columns, rows, points = 84, 5, []
    for j in range(rows + 1):
        up = j / rows
        for k in range(columns + 1):
            across = k / columns
            swag = abs(math.sin(5 * math.pi * across))
            z = TOP + 6 - (1 - up) * (34 + 30 * swag)
            folds = 5 * math.sin(2 * math.pi * 24 * across) * (1.2 - up)
            points.append((-OPENING - 10 + 2 * (OPENING + 10) * across, 84 + folds - 6 * swag * (1 - up), z))
    width = columns + 1
    faces = [(a, a + 1, a + width + 1, a + width) for j in range(rows) for a in range(j * width, j * width + columns)]
    cage(layer, "Valance", points, faces, "Velvet", corners=[(0, 10), (columns, 10)], body=["uniform bool doubleSided = 1"])
    hem = [(x, y - 2, z) for x, y, z in points[:width]]
    mesh = Mesh()
    tube(mesh, hem, 2.6, 5, "CardGold")
    mesh.write(layer, "Fringe", body=['uniform token purpose = "render"'])
    mesh = Mesh()
    box(mesh, (-OPENING, 78, TOP - 60), (OPENING, 90, TOP), "Velvet")
    mesh.write(layer, "ValanceProxy", body=['uniform token purpose = "proxy"'])


CREST = [(0, 0), (0.16, 0.05), (0.32, 0.2), (0.46, 0.5), (0.56, 0.84), (0.68, 1.0), (0.84, 0.98), (0.96, 0.84), (1.0, 0.64),
         (0.93, 0.52), (0.86, 0.6), (0.90, 0.72), (0.80, 0.80), (0.71, 0.70), (0.70, 0.46), (0.78, 0.18), (0.90, 0.05)]  # fmt: skip
"""A curling wave, one wide and one high."""


def sea(layer):
    """Three rows of waves, which slide past one another. Each is a deep board with one that is a little higher behind it."""
    for name, y, level, wide, high, slide, start in (
        ("Far", 395, 138, 118, 46, -9, 4),
        ("Middle", 205, 118, 142, 56, 16, -8),
        ("Near", 135, 100, 170, 50, -22, 11),
    ):
        keys = f"{{ 1000: ({start}, 0, 0), 1025: ({start + slide}, 0, 0) }}"
        body = [f"double3 xformOp:translate.timeSamples = {keys}", 'uniform token[] xformOpOrder = ["xformOp:translate"]']
        mesh = Mesh()
        for scale, shift, material in ((1.0, 0, "Foam"), (0.9, -1.5, "SeaMid"), (0.72, -3, "SeaDeep")):
            line = []
            count = int(400 / wide) + 1
            for k in range(-count, count):
                wave = [(wide * (k + u), level + shift * 2 + high * scale * v) for u, v in CREST]
                line += wave
            end = min(wide * count, 408 - abs(start) - abs(slide))
            line = [(x, z) for x, z in rounded(line, 1) if abs(x) < end]
            outline = [(-end, FLOOR + 0.5), (end, FLOOR + 0.5), (end, line[-1][1]), *line[::-1], (-end, line[0][1])]
            mesh.face([(x, y + shift, z) for x, z in outline], material)
        with layer.prim("Xform", f"Sea{name}", body=body):
            mesh.write(layer, "Boards", body=["uniform bool doubleSided = 1"])


def sky(layer):
    body = ["bool inputs:visibleInPrimaryRay = true"]
    with layer.prim("Xform", "Sky", body=place((0, 470, 285))):
        with layer.prim("RectLight", "Cloth", body=[
            *place(None, TO_HOUSE), *body, "float inputs:width = 820", "float inputs:height = 400",
            "float inputs:intensity = 9", "asset inputs:texture:file = @../textures/painted_sky.png@",
        ]):  # fmt: skip
            pass
        dice, stars = Dice(77), []
        while len(stars) < 600:
            x, z = dice(-360, 360), dice(-20, 170)
            if dice() < ((z + 20) / 190) ** 1.3:
                stars.append((min(int(dice() ** 2 * 3), 2), (x, dice(-8, -3), z)))
        bulbs(layer, "Stars", ["StarBlue", "StarWhite", "StarGold"], stars)


def bulbs(layer, name, kinds, items):
    """Lamps of `assets/bulbs.usda`; `items` are (kind, position)."""
    with layer.prim("PointInstancer", name):
        layer.put("rel prototypes = [" + ", ".join(f"<Prototypes/{k}>" for k in kinds) + "]")
        layer.put("int[] protoIndices = " + array((k for k, _ in items), str))
        layer.put("point3f[] positions = " + array((p for _, p in items), vec))
        with layer.prim("Scope", "Prototypes"):
            for k in kinds:
                with layer.prim("Xform", k, [f"prepend references = @../assets/bulbs.usda@</{k}>"]):
                    pass


# name: (kelvin or colour, radius in cm, nits)
BULBS = {
    "StarBlue": ((0.55, 0.75, 1.0), 0.8, 75),
    "StarWhite": ((1.0, 0.95, 0.85), 1.0, 75),
    "StarGold": ((1.0, 0.72, 0.36), 1.2, 80),
    "Marquee": (2400, 2.6, 75),
    "Fairy": (2200, 2.3, 110),
}


def bulb_assets(folder):
    layer = Layer("assets/bulbs.usda", "Small lamps: a glowing glass each. Written by make.py.")
    for name, (hue, radius, nits) in BULBS.items():
        with layer.root(name):
            seen = ["bool inputs:visibleInPrimaryRay = true", f"float inputs:radius = {radius}", f"float inputs:intensity = {nits}"]
            if isinstance(hue, tuple):
                seen.append(f"color3f inputs:color = {vec(hue)}")
            else:
                seen += ["bool inputs:enableColorTemperature = 1", f"float inputs:colorTemperature = {hue}"]
            with layer.prim("SphereLight", "Glass", body=seen):
                pass
    with layer.root("Path"):
        mesh = Mesh()
        turned(mesh, [(7, 0), (7, 2), (2, 3), (2, 6), (0, 6)], 10, "Iron")
        mesh.write(layer, "Foot")
        seen = ["bool inputs:visibleInPrimaryRay = true", "float inputs:radius = 9", "float inputs:intensity = 9"]
        with layer.prim("SphereLight", "Paper", body=[*place((0, 0, 15)), *seen, "color3f inputs:color = (1, 0.3, 0.06)"]):
            pass
    with layer.root("Footlight"):
        mesh = Mesh()
        shell = [(10 * math.cos(t), 10 * math.sin(t)) for t in (math.pi + math.pi * k / 8 for k in range(9))]
        for (x0, y0), (x1, y1) in zip(shell, shell[1:]):
            mesh.face([(x0, y0, 0), (x1, y1, 0), (x1, y1, 13), (x0, y0, 13)], "Black")
        turned(mesh, [(15, 0.2), (15, 0.6), (0, 0.6)], 12, "Black")  # a tray: no hot spot on the boards
        mesh.write(layer, "Shell", body=["uniform bool doubleSided = 1"])
        light(layer, "SphereLight", "Lamp", (0, -2, 8), None, 2300, radius=3.5, intensity=1100)
    layer.save(folder)


def flood_asset(folder):
    """A flood with barn doors. UsdLux has no input for them, and light filters are read by few: these are four flaps."""
    layer = Layer("assets/flood.usda", "A flood whose barn doors are flaps. It shines along -Z. Written by make.py.")
    with layer.root("Flood"):
        wide, high, long, open_to = 13, 9, 17, math.radians(24)
        away, aside = long * math.cos(open_to), long * math.sin(open_to)
        mesh = Mesh()
        box(mesh, (-wide - 2, -high - 2, 0), (wide + 2, high + 2, 16), "Iron")
        for side in (-1, 1):
            y, x = side * high, side * wide
            shut = aside if side > 0 else -3  # the lower flap is nearly closed: no light on the pillars' feet
            mesh.face([(-wide, y, 0), (wide, y, 0), (wide + 3, y + side * shut, -away), (-wide - 3, y + side * shut, -away)], "Black")
            mesh.face([(x, -high, 0), (x, high, 0), (x + side * aside, high + 3, -away), (x + side * aside, -high - 3, -away)], "Black")
        mesh.write(layer, "Case", body=["uniform bool doubleSided = 1"])
        light(layer, "RectLight", "Lamp", (0, 0, -0.5), None, color=(0.3, 0.36, 1), width=24, height=16, intensity=15000)
    layer.save(folder)


def floods(layer):
    """Two floods on the ground light the front."""
    for side, name in ((-1, "FloodLeft"), (1, "FloodRight")):
        meta = ["instanceable = true", "prepend references = @../assets/flood.usda@"]
        with layer.prim("Xform", name, meta, place((side * 520, -260, 30), (133.6, 0, side * 50))):
            pass


def round_the_arch(layer):
    """Bulbs along the opening and the pediment."""
    outer = [(-OPENING - 8, FLOOR + 8), (-OPENING - 8, TOP + 12), (OPENING + 8, TOP + 12), (OPENING + 8, FLOOR + 8)]
    spots = [(0, (x, 30, z)) for x, z in resample(outer, 15)]
    spots += [(0, (x, 38, 555 + z)) for x, z in resample(arc(0, 0, 134, 4, 176, 40, 0.8), 13)]
    spots += [(0, (x, 34, 535)) for x in range(-420, 421, 20)]
    bulbs(layer, "Bulbs", ["Marquee"], spots)
    bulbs(layer, "PathLamps", ["Path"], [(0, (x, -34, 0)) for x in range(-265, 266, 106)])
    feet = [(0, (x, 10, FLOOR)) for x in range(-297, 298, 33)]
    bulbs(layer, "Footlights", ["Footlight"], feet)


def neon(layer, name, strokes, radius, step, color, nits, closed=False):
    mesh = Mesh()
    for stroke in strokes:
        path = [(x, 0, z) for x, z in resample(stroke + stroke[:1] if closed else stroke, step)]
        tube(mesh, path[:-1] if closed else path, radius, 6, "Tube", closed=closed)
    glow = [f"color3f inputs:color = {vec(color)}", f"float inputs:intensity = {nits}"]
    mesh.write(layer, name, body=glow, light=True)


def sign(layer):
    with layer.prim("Xform", "Neon", body=place((0, 40, 0))):
        strokes, wide = word("LUNA", 0, 478, 48, 0.7)
        neon(layer, "Letters", [[(x - wide / 2, z) for x, z in s] for s in strokes], 2.2, 5, (1, 0.06, 0.16), 46)
        outer = arc(-4, 604, 40, 62, 298, 26)
        inner = arc(12, 604, 36, 285, 75, 20)
        neon(layer, "Crescent", [outer + inner], 2.2, 5, (1, 0.62, 0.2), 46, closed=True)
        waves = []
        for side in (-1, 1):
            path = [(side * (135 + 1.8 * t), 500 + 11 * math.sin(t * 0.28)) for t in range(0, 142, 2)]
            waves.append(path)
        neon(layer, "Waves", waves, 1.9, 6, (0.03, 0.62, 1.0), 34)


def revolving_lantern(layer):
    """A drum of eight cards about a lamp, and eight coloured lamps on its rim: it turns by 30 degrees a frame."""
    mesh = Mesh()
    turned(mesh, [(26, 0), (26, 5), (8, 10), (3.5, 14), (3.5, 128), (10, 132), (0, 134)], 12, "Iron")
    with layer.prim("Xform", "Revolving", body=place((-345, -95, 0))):
        mesh.write(layer, "Stand")
        light(layer, "SphereLight", "Lamp", (0, 0, 172), None, 2700, radius=4, intensity=6500)
        keys = "{ 1000: 0, 1025: 750 }"
        body = [
            "double3 xformOp:translate = (0, 0, 140)",
            f"float xformOp:rotateZ.timeSamples = {keys}",
            'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateZ"]',
        ]
        with layer.prim("Xform", "Drum", body=body):
            mesh = Mesh()
            for k in range(8):
                a, b = math.radians(45 * k), math.radians(45 * k + 31)
                (x0, y0), (x1, y1) = ((25 * math.cos(t), 25 * math.sin(t)) for t in (a, b))
                mesh.face([(x0, y0, 2), (x1, y1, 2), (x1, y1, 62), (x0, y0, 62)], "Drum" if k % 2 else "CardGold")
            mesh.write(layer, "Cards", body=["uniform bool doubleSided = 1"])
            mesh = Mesh()
            turned(mesh, [(0, 0), (27, 0), (27, 2), (0, 2)], 24, "Iron")
            turned(mesh, [(0, 62), (27, 62), (30, 66), (9, 84), (0, 88)], 24, "Iron")
            mesh.write(layer, "Lids")
            for k, color in enumerate([(1, 0.2, 0.05), (0.1, 0.9, 0.6), (1, 0.75, 0.2), (0.2, 0.45, 1)] * 2):
                x, y = 32 * math.cos(math.pi * k / 4), 32 * math.sin(math.pi * k / 4)
                seen = ["bool inputs:visibleInPrimaryRay = true", "float inputs:radius = 3.2", "float inputs:intensity = 60"]
                with layer.prim("SphereLight", f"Bead{k}", body=[*place((x, y, 66)), *seen, f"color3f inputs:color = {vec(color)}"]):
                    pass


def write(folder):
    bulb_assets(folder)
    flood_asset(folder)
    layer = Layer("layers/theatre.usda", "The house, and what is fixed to it. Written by make.py.")
    with layer.root("Theatre", "group"):
        stage(layer)
        arch(layer)
        curtains(layer)
        sea(layer)
        sky(layer)
        round_the_arch(layer)
        sign(layer)
        revolving_lantern(layer)
        floods(layer)
    layer.save(folder)
