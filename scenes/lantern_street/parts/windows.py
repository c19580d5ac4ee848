"""Windows and balconies: small assets, referenced instanceable, with their lights inside."""

import math

from .shapes import box, room, tube, turned
from .usda import Dice, Layer, Mesh, light, place

TO_STREET = (90, 0, 180)  # turns a rect light, which looks down -Z, to look along -Y, upright
OPENING = (50, 165)  # half width and height of a window


def window_frame(mesh, bars=(55, 110), paint="WhitePaint", stone="Stone"):
    w, h = OPENING
    room(mesh, (-w, 0, 0), (w, 11, h), stone, "y-y+")
    for lo, hi in (
        ((-w - 12, -5, -3), (-w, 0, h + 14)),
        ((w, -5, -3), (w + 12, 0, h + 14)),
        ((-w, -5, h), (w, 0, h + 14)),
    ):
        box(mesh, lo, hi, stone, "y+")
    box(mesh, (-w - 16, -14, -10), (w + 16, 0, -3), stone, "y+")
    for x in (-w + 3, 0, w - 3):
        box(mesh, (x - 3, 4, 0), (x + 3, 9, h), paint, "z-z+y+")
    for z in (3, *bars, h - 3):
        box(mesh, (-w, 4.5, z - 2.5), (w, 8.5, z + 2.5), paint, "x-x+y+")


def write(folder):
    layer = Layer("assets/windows.usda", "Window prototypes, referenced instanceable. Written by make.py.")
    w, h = OPENING
    curtains = {
        "CurtainAmber": (1, 2600, 1.9),
        "CurtainCream": (2, 3300, 1.5),
        "CurtainRose": (2, 2100, 1.1),
        "CurtainDim": (1, 2300, 0.5),
    }
    for name, (drape, kelvin, nits) in curtains.items():
        with layer.root(name):
            mesh = Mesh()
            window_frame(mesh)
            mesh.write(layer, "Frame")
            light(
                layer,
                "RectLight",
                "Curtain",
                (0, 10.5, h / 2),
                TO_STREET,
                kelvin,
                width=2 * w,
                height=h,
                intensity=nits,
                texture=f"../textures/curtain_{drape}.png",
            )
    rooms = {
        "RoomWarm": (2700, "Interior", 6.0),
        "RoomTelevision": (9000, "PlasterBlue", 2.6),
        "RoomStudy": (3000, "PlasterOxide", 7.0),
    }
    for name, (kelvin, walls, exposure) in rooms.items():
        with layer.root(name):
            mesh = Mesh(uv_size=300)
            window_frame(mesh, (110,))
            room(mesh, (-95, 11, -40), (95, 190, 215), walls, "y-", floor="Timber")
            for x, wide, top in ((-70, 44, 120), (30, 55, 70)):
                box(mesh, (x, 155, -40), (x + wide, 188, top), "Timber", "z-")
            box(mesh, (-20, 186, 95), (22, 189, 150), "Brass")
            box(mesh, (-w - 2, 11.5, 0), (-w + 18, 15, h), "ClothCream")
            box(mesh, (w - 18, 11.5, 0), (w + 2, 15, h), "ClothCream")
            tube(mesh, [(12, 95, 215), (12, 95, 158)], 0.8, 3, "Iron")
            turned(mesh, [(20, 142), (6, 158)], 10, "ClothCream", (12, 95, 0))
            mesh.write(layer, "Room")
            light(
                layer,
                "SphereLight",
                "Pendant",
                (12, 95, 138),
                None,
                kelvin,
                radius=8,
                intensity=1,
                exposure=exposure,
            )
    with layer.root("Dark"):
        mesh = Mesh()
        window_frame(mesh)
        mesh.face([(-w, 7, 0), (w, 7, 0), (w, 7, h), (-w, 7, h)], "Glass")
        mesh.write(layer, "Frame")
    with layer.root("Shuttered"):
        mesh = Mesh()
        window_frame(mesh)
        mesh.face([(-w, 7, 0), (w, 7, 0), (w, 7, h), (-w, 7, h)], "Glass")
        for side in (-1, 1):
            x = side * (w + 27)
            box(mesh, (x - 26, -5, 0), (x + 26, -1, h), "GreenPaint")
            for k in range(11):
                z = 10 + k * 14
                box(mesh, (x - 20, -8, z), (x + 20, -5, z + 8), "GreenPaint", "y+")
        mesh.write(layer, "Frame")
    with layer.root("Balcony"):
        mesh, dice = Mesh(), Dice(77)
        box(mesh, (-78, -55, -14), (78, 0, -4), "Stone", "y+")
        for z in (6, 74):
            tube(mesh, [(-76, 0, z), (-76, -52, z), (76, -52, z), (76, 0, z)], 1.6, 4, "Iron")
        for k in range(17):
            x = -76 + 9.5 * k
            box(mesh, (x - 0.8, -53, 6), (x + 0.8, -51.4, 74), "Iron", "z-z+")
        for k in range(4):
            for x in (-76, 76):
                box(mesh, (x - 0.8, -12 * k - 10, 6), (x + 0.8, -12 * k - 8.4, 74), "Iron", "z-z+")
        box(mesh, (-60, -68, 50), (60, -55, 70), "Terracotta")
        leaves(mesh, dice, (-60, -72, 66), (60, -50, 92), 46)
        mesh.write(layer, "Ironwork")
    layer.save(folder)


def leaves(mesh, dice, lo, hi, count, size=9, material="Leaf", flower="ClothRed"):
    for k in range(count):
        c = [dice(a, b) for a, b in zip(lo, hi)]
        turn, lean, s = dice(0, 2 * math.pi), dice(-0.9, 0.9), size * dice(0.7, 1.3)
        a = (math.cos(turn) * s, math.sin(turn) * s, lean * s)
        b = (-math.sin(turn) * s * 0.5, math.cos(turn) * s * 0.5, dice(0.2, 0.8) * s)
        mesh.face(
            [
                tuple(c[i] - a[i] for i in range(3)),
                tuple(c[i] - b[i] for i in range(3)),
                tuple(c[i] + a[i] for i in range(3)),
                tuple(c[i] + b[i] for i in range(3)),
            ],
            flower if k % 6 == 5 else material,
        )


def pane(layer, kind, name, at):
    with layer.prim(
        "Xform", name, ["instanceable = true", f"prepend references = @../assets/windows.usda@</{kind}>"], place(at)
    ):
        pass
