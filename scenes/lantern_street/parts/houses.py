"""House fronts. In a house's own space X runs along the front, Y into the house, Z up; the front is Y = 0."""

import math

from .shapes import arc, box, room, tube, turned
from .usda import Dice, Layer, Mesh, light, place
from .windows import OPENING, TO_STREET, pane

GROUND = 380  # height of the ground floor


def wall(mesh, x0, z0, x1, z1, openings, material):
    """A grid of quads over the front; the openings (x0, z0, x1, z1) are marked as holes, not cut out."""
    xs = sorted({x0, x1, *(o[0] for o in openings), *(o[2] for o in openings)})
    zs = sorted({z0, z1, *(o[1] for o in openings), *(o[3] for o in openings)})
    for a, b in zip(xs, xs[1:]):
        for c, d in zip(zs, zs[1:]):
            hole = any(o[0] <= a and b <= o[2] and o[1] <= c and d <= o[3] for o in openings)
            mesh.face([(a, 0, c), (b, 0, c), (b, 0, d), (a, 0, d)], material, hole)


def arch(mesh, x0, x1, pier, spring, top, material, deep=42):
    """One bay of an arcade: a single concave polygon around the arch, and its soffit."""
    radius = (x1 - x0) / 2 - pier
    middle = (x0 + x1) / 2
    curve = arc(middle, spring, radius, 0, 180, 14)
    inner = [(x1 - pier, 0), *curve, (x0 + pier, 0)]
    outline = [(x0, top), (x0, 0), *inner[::-1], (x1, 0), (x1, top)]
    mesh.face([(x, 0, z) for x, z in outline], material)
    for (ax, az), (bx, bz) in zip(inner, inner[1:]):
        mesh.face([(ax, 0, az), (ax, deep, az), (bx, deep, bz), (bx, 0, bz)], material)
    mesh.face([(x, deep, z) for x, z in outline[::-1]], material)


def shop(layer, mesh, dice, x0, x1, name, style, stocked):
    """A shop window with shelves and ceiling lights, a sign board with spots, perhaps an awning."""
    paint = style["paint"]
    top = 272
    room(mesh, (x0, 0, 40), (x1, 20, top), paint, "y-y+")
    room(mesh, (x0 - 20, 20, 0), (x1 + 20, 270, 300), "Interior", "y-", floor="Timber")
    mesh.face([(x1 + 20, 20, top), (x1 + 20, 20, 300), (x0 - 20, 20, 300), (x0 - 20, 20, top)], "Interior")
    count = max(2, round((x1 - x0) / 130))
    for k in range(count + 1):
        x = x0 + (x1 - x0) * k / count
        box(mesh, (x - 4, 6, 40), (x + 4, 16, top), paint, "z-z+")
    box(mesh, (x0, 7, 222), (x1, 15, 229), paint, "x-x+")
    box(mesh, (x0 - 10, -8, 30), (x1 + 10, 0, 40), paint, "y+")
    wares = ["ColourA", "ColourB", "ColourC", "ClothCream", "ClothRed", "Brass"]
    for z in (95, 150, 205) if stocked else ():
        box(mesh, (x0, 232, z), (x1, 266, z + 4), "Timber", "y+")
        x = x0 + 8
        while x < x1 - 24:
            wide, tall = dice(8, 20), dice(14, 40)
            box(mesh, (x, 238, z + 4), (x + wide, 258, z + 4 + tall), dice.pick(wares), "z-y+")
            x += wide + dice(3, 16)
        for wall_x, side in ((x0 - 20, 1), (x1 + 20, -1)):  # the side walls, which a passer-by sees first
            a, b = sorted((wall_x, wall_x + side * 30))
            box(mesh, (a, 60, z), (b, 228, z + 4), "Timber")
            y = 66
            while y < 205:
                deep, tall = dice(9, 20), dice(14, 40)
                box(mesh, (a + 3, y, z + 4), (b - 3, y + deep, z + 4 + tall), dice.pick(wares), "z-")
                y += deep + dice(3, 14)
    box(mesh, (x0 + 20, 110, 0), (x1 - 30, 160, 92), "Timber", "z-")
    x = x0 + 6
    while stocked and x < x1 - 30:  # the display behind the glass
        wide, tall = dice(14, 30), dice(16, 60)
        box(
            mesh,
            (x, 26, 40),
            (x + wide, 52, 40 + tall),
            dice.pick(["ColourA", "ColourB", "ColourC", "ClothCream", "Timber"]),
            "z-",
        )
        x += wide + dice(8, 40)
    for k in range(count):
        x = x0 + (x1 - x0) * (k + 0.5) / count
        light(
            layer,
            "RectLight",
            f"{name}_Ceiling{k}",
            (x, 120, 297),
            (0, 0, 0),
            style["kelvin"],
            width=90,
            height=36,
            intensity=style["nits"],
        )
    box(mesh, (x0, -7, 312), (x1, 0, 360), style["board"], "y+")
    for k in range(count):
        x = x0 + (x1 - x0) * (k + 0.5) / count
        tube(mesh, [(x, 0, 385), (x, -42, 392), (x, -50, 384)], 1.3, 4, "Iron")
        light(
            layer,
            "SphereLight",
            f"{name}_Spot{k}",
            (x, -52, 381),
            (48, 0, 0),
            3000,
            (52, 0.6),
            radius=3,
            intensity=1500,
            treatAsPoint=True,
        )
    if style["awning"]:
        stripes = round((x1 - x0 + 20) / 26)
        cloth = Mesh()
        for k in range(stripes):
            a, b = (x0 - 10 + (x1 - x0 + 20) * t / stripes for t in (k, k + 1))
            material = (style["awning"], "ClothCream")[k % 2]
            cloth.face([(a, -2, 308), (a, -125, 256), (b, -125, 256), (b, -2, 308)], material)
            cloth.face([(a, -2, 307), (b, -2, 307), (b, -125, 255), (a, -125, 255)], material)
            middle = (a + b) / 2
            cloth.face(
                [(a, -125.5, 256), (a, -125.5, 240), (middle, -125.5, 232), (b, -125.5, 240), (b, -125.5, 256)],
                material,
            )
        cloth.write(layer, f"{name}_Awning", body=["uniform bool doubleSided = 1"], left_handed=True)


def arcade(layer, mesh, dice, width, bays, material):
    bay = width / bays
    for k in range(bays):
        arch(mesh, k * bay, (k + 1) * bay, 21, 205, GROUND, material)
        box(mesh, (k * bay - 24 if k else 0, -5, 0), (k * bay + 24, 0, 24), "Stone", "y+")
        box(mesh, (k * bay - 24 if k else 0, -4, 200), (k * bay + 24, 0, 210), "Stone", "y+")
        light(
            layer,
            "CylinderLight",
            f"Tube{k}",
            ((k + 0.5) * bay, 150, 322),
            (0, 0, 0),
            3400 if k % 2 else 2700,
            length=bay * 0.5,
            radius=2.2,
            intensity=38,
        )
    room(mesh, (0, 42, 0), (width, 260, 335), "Interior", "y-", floor="Flags")
    for k in range(bays):
        x = (k + 0.5) * bay
        if k % 3 == 1:
            box(mesh, (x - 48, 254, 0), (x + 48, 259, 225), "GreenPaint", "y+z-")
        else:
            box(mesh, (x - 62, 252, 60), (x + 62, 259, 230), "Timber", "y+")
            mesh.face([(x - 55, 251, 66), (x + 55, 251, 66), (x + 55, 251, 224), (x - 55, 251, 224)], "Glass")


def door(layer, mesh, x, name, paint):
    room(mesh, (x - 48, 0, 0), (x + 48, 24, 250), "Stone", "y-y+")
    mesh.face([(x - 48, 24, 0), (x + 48, 24, 0), (x + 48, 24, 250), (x - 48, 24, 250)], paint)
    for z0, z1 in ((20, 90), (105, 190)):
        for s in (-1, 1):
            box(mesh, (x + s * 23 - 15, 20, z0), (x + s * 23 + 15, 24, z1), paint, "y+")
    mesh.face([(x - 42, 23, 205), (x + 42, 23, 205), (x + 42, 23, 244), (x - 42, 23, 244)], "Glass")
    box(mesh, (x - 62, -40, 0), (x + 62, 0, 12), "Stone", "y+z-")
    tube(mesh, [(x, 0, 292), (x, -24, 300), (x, -24, 287)], 1.5, 4, "Iron")
    turned(mesh, [(15, 280), (4, 289), (0, 290)], 8, "Iron", (x, -24, 0))
    light(layer, "SphereLight", f"{name}_Lamp", (x, -24, 273), None, 2700, radius=8, intensity=26)


def roof(mesh, width, height, depth, rise, material, chimneys, body):
    for x, flip in ((0, False), (width, True)):
        gable = [(x, 0, 0), (x, 0, height), (x, depth / 2, height + rise), (x, depth, height), (x, depth, 0)]
        mesh.face(gable[::-1] if flip else gable, body)
    mesh.face([(width, depth, 0), (0, depth, 0), (0, depth, height), (width, depth, height)], body)
    eaves = rise * 36 / (depth / 2)
    mesh.face(
        [
            (-4, -36, height - eaves),
            (width + 4, -36, height - eaves),
            (width + 4, depth / 2, height + rise),
            (-4, depth / 2, height + rise),
        ],
        material,
    )
    mesh.face(
        [
            (width + 4, depth, height),
            (-4, depth, height),
            (-4, depth / 2, height + rise),
            (width + 4, depth / 2, height + rise),
        ],
        material,
    )
    mesh.face(
        [
            (-4, -36, height - eaves - 8),
            (-4, 0, height - eaves - 8),
            (width + 4, 0, height - eaves - 8),
            (width + 4, -36, height - eaves - 8),
        ],
        "Timber",
    )
    mesh.face(
        [
            (-4, -36, height - eaves - 8),
            (width + 4, -36, height - eaves - 8),
            (width + 4, -36, height - eaves),
            (-4, -36, height - eaves),
        ],
        "Timber",
    )
    for x in chimneys:
        base = height + rise * 0.55
        box(mesh, (x - 32, depth * 0.25, base - 60), (x + 32, depth * 0.25 + 55, height + rise + 90), "Brick", "z-")
        for s in (-15, 15):
            turned(mesh, [(9, 0), (7, 30)], 7, "Terracotta", (x + s, depth * 0.25 + 27, height + rise + 90))


LIT = [
    "CurtainAmber",
    "CurtainCream",
    "RoomWarm",
    "CurtainRose",
    "RoomStudy",
    "CurtainAmber",
    "RoomWarm",
    "CurtainDim",
    "RoomTelevision",
    "CurtainCream",
]


def house(layer, name, at, turn, seed, bays, floors, ground, plaster, style, stocked=False):
    """Returns its width. Only a `stocked` shop has wares; `style` is one of SHOPS."""
    dice = Dice(seed)
    bay = round(dice(168, 186))
    width, height = bays * bay, GROUND + floors * 300 + 30
    with layer.prim("Xform", name, body=place(at(width), turn)):
        mesh = Mesh(uv_size=420 if plaster != "Brick" else 190, digits=1)
        openings, panes = [], []
        for floor in range(floors):
            for k in range(bays):
                x, z = (k + 0.5) * bay, GROUND + 75 + floor * 300
                openings.append((x - OPENING[0], z, x + OPENING[0], z + OPENING[1]))
                panes.append((k, floor, x, z))
        wall(mesh, 0, GROUND, width, height, openings, plaster)
        if ground == "shop":
            side = bay * 0.95
            x0, x1 = (34, width - side) if dice() < 0.5 else (side, width - 34)
            d = (x1 + width) / 2 - 4 if x0 < 50 else x0 / 2 + 4
            wall(mesh, 0, 0, width, GROUND, [(x0, 40, x1, 272), (d - 48, 0, d + 48, 250)], style["front"])
            shop(layer, mesh, dice, x0, x1, "Shop", style, stocked)
            door(layer, mesh, d, "Door", style["paint"])
        elif ground == "arcade":
            arcade(layer, mesh, dice, width, bays, "Stone")
        else:
            d = (dice.pick(range(bays)) + 0.5) * bay
            holes = [(d - 48, 0, d + 48, 250)]
            for k in range(bays):
                x = (k + 0.5) * bay
                if abs(x - d) > 1:
                    holes.append((x - OPENING[0], 115, x + OPENING[0], 280))
                    panes.append((k, -1, x, 115))
            wall(mesh, 0, 0, width, GROUND, holes, plaster)
            door(layer, mesh, d, "Door", style["paint"])
        if ground != "arcade":
            box(mesh, (0, -3, 0), (width, 0, 26), "DarkStone", "y+z-x-x+")
        box(mesh, (0, -9, GROUND - 12), (width, 0, GROUND + 8), "Stone", "y+")
        box(mesh, (0, -16, height - 26), (width, 0, height - 6), "Stone", "y+")
        stacks = [60 + dice() * 60, width - 60 - dice() * 90][: 1 + (bays > 3)]
        roof(mesh, width, height, 700, dice(200, 330), "Slate" if seed % 3 else "Tile", stacks, plaster)
        box(mesh, (width - 7, -9, 12), (width + 2, -1, height - 20), "Iron", "z-z+")  # downpipe
        walls, trim = mesh.split(lambda m: m.startswith("Plaster") or m == "Brick")
        walls.write(layer, "Walls")
        trim.write(layer, "Trim")
        for k, floor, x, z in panes:
            lit = dice() < 0.66
            kind = dice.pick(LIT) if lit else dice.pick(["Dark", "Shuttered", "Dark"])
            pane(layer, kind, f"Window_{floor + 1}_{k + 1}", (x, 0, z))
            if floor == 0 and k % 2 == seed % 2 and bays > 2:
                pane(layer, "Balcony", f"Balcony_{k + 1}", (x, 0, z))
    return width


SHOPS = [
    dict(paint="GreenPaint", board="GreenPaint", awning="ClothGreen", front="DarkStone", kelvin=3000, nits=15),
    dict(paint="RedPaint", board="Board", awning="ClothRed", front="Stone", kelvin=3300, nits=17),
    dict(paint="BluePaint", board="BluePaint", awning=None, front="DarkStone", kelvin=4600, nits=14),
    dict(paint="Timber", board="Timber", awning="ClothRed", front="Brick", kelvin=2700, nits=16),
]
# bays, floors, ground floor, front; from the camera to the end of the street
LEFT = [
    (3, 3, "plain", "PlasterIvory"),
    (3, 3, "shop", "PlasterRose"),
    (4, 2, "arcade", "PlasterOchre"),
    (3, 3, "shop", "PlasterBlue"),
    (3, 3, "plain", "Brick"),
    (4, 2, "arcade", "PlasterIvory"),
    (3, 3, "shop", "PlasterSage"),
    (3, 3, "plain", "PlasterOxide"),
    (4, 3, "shop", "PlasterGrey"),
    (3, 2, "arcade", "PlasterRose"),
    (3, 3, "plain", "PlasterOchre"),
    (4, 3, "shop", "PlasterIvory"),
]
RIGHT = [
    (3, 3, "plain", "PlasterGrey"),
    (4, 3, "shop", "PlasterOchre"),
    (3, 3, "shop", "Brick"),
    (3, 2, "plain", "PlasterSage"),
    (4, 3, "arcade", "PlasterRose"),
    (3, 3, "shop", "PlasterIvory"),
    (3, 3, "shop", "PlasterBlue"),
    (4, 2, "plain", "PlasterOchre"),
    (3, 3, "arcade", "PlasterGrey"),
    (3, 3, "shop", "PlasterRose"),
    (4, 3, "plain", "PlasterOxide"),
    (3, 3, "shop", "PlasterOchre"),
]


def write(folder):
    layer = Layer("layers/houses.usda", "The house fronts of the street. Written by make.py.")
    with layer.root("Houses", "group"):
        for side, row in (("Left", LEFT), ("Right", RIGHT)):
            y = -620.0 if side == "Left" else -560.0
            for i, (bays, floors, ground, plaster) in enumerate(row):
                spot = (lambda w, y=y: (-520, y, 0)) if side == "Left" else (lambda w, y=y: (520, y + w, 0))
                y += house(
                    layer,
                    f"{side}_{i + 1:02}",
                    spot,
                    90 if side == "Left" else -90,
                    i * 2 + (side == "Right") + 11,
                    bays,
                    floors,
                    ground,
                    plaster,
                    SHOPS[(i * 3 + len(side)) % 4],
                    i < 5,
                )
        for i, (x, bays, plaster) in enumerate(
            ((-1000, 3, "PlasterIvory"), (-470, 3, "PlasterRose"), (70, 2, "PlasterOchre"), (430, 3, "PlasterGrey"))
        ):
            house(
                layer,
                f"End_{i + 1:02}",
                lambda w, x=x: (x, 6700, 0),
                0,
                91 + i,
                bays,
                3,
                "arcade" if i == 1 else "plain",
                plaster,
                SHOPS[i],
            )
        tower(layer)
    layer.save(folder)


def tower(layer):
    """A clock tower that closes the view; its dials are normalised disk lights."""
    with layer.prim("Xform", "Tower", body=place((-120, 7700, 0))):
        mesh = Mesh(uv_size=400)
        box(mesh, (-260, -260, 0), (260, 260, 2300), "PlasterIvory", "z-")
        for z in (1500, 1880, 2280):
            box(mesh, (-285, -285, z), (285, 285, z + 26), "Stone")
        for a, b in (
            ((-300, -300), (300, -300)),
            ((300, -300), (300, 300)),
            ((300, 300), (-300, 300)),
            ((-300, 300), (-300, -300)),
        ):
            mesh.face([(*a, 2300), (*b, 2300), (0, 0, 3500)], "Slate")
        turned(mesh, [(0, 3490), (5, 3491), (2, 3640), (0, 3641)], 6, "Brass")
        for k in range(12):
            t = math.radians(30 * k)
            x, z = 118 * math.sin(t), 2080 + 118 * math.cos(t)
            box(mesh, (x - 5, -292, z - 9), (x + 5, -280, z + 9), "Board")
        tube(mesh, [(0, -292, 2080), (52, -292, 2120)], 6, 4, "Board")
        tube(mesh, [(0, -292, 2080), (-18, -292, 2180)], 4, 4, "Board")
        mesh.write(layer, "Stones")
        light(
            layer,
            "DiskLight",
            "Dial",
            (0, -270, 2080),
            TO_STREET,
            4300,
            radius=140,
            normalize=True,
            intensity=140000,
        )
