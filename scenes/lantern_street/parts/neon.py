"""Neon: letters and outlines bent from glass tube, thousands of triangles that are all light."""

from .windows import TO_STREET
from .shapes import box, resample, tube
from .strokes import candelabra, letter, word
from .usda import Layer, Mesh, light, place, vec


def glass(layer, name, strokes, radius, step, color, nits, y=-9, closed=False, sides=6):
    """One colour of tube as one mesh light. Strokes lie in the plane of the sign, (x, z)."""
    mesh = Mesh()
    for stroke in strokes:
        path = [(px, y, pz) for px, pz in resample(stroke + stroke[:1] if closed else stroke, step)]
        tube(mesh, path[:-1] if closed else path, radius, sides, "Tube", closed=closed)
    mesh.write(
        layer, name, body=[f"color3f inputs:color = {vec(color)}", f"float inputs:intensity = {nits}"], light=True
    )
    return mesh.triangles()


PINK, GOLD, WHITE, FLAME = (1, 0.045, 0.13), (1, 0.42, 0.06), (0.8, 0.9, 1.0), (1, 0.22, 0.02)
CYAN, GREEN, BLUE = (0.03, 0.70, 1.0), (0.10, 1.0, 0.25), (0.08, 0.22, 1.0)
WIDE, TALL = 136, 540


def blade(folder):
    """One face of the house sign; X runs across it, it looks along -Y."""
    layer = Layer("assets/neon_candelabra.usda", "The neon of the house sign, one face. Written by make.py.")
    with layer.root("NeonCandelabra"):
        stand, candles, flames = candelabra(0, TALL - 140, 124)
        count = glass(layer, "Stand", stand, 1.6, 4.0, GOLD, 8)
        count += glass(layer, "Candles", candles, 1.3, 5.0, WHITE, 6)
        count += glass(layer, "Flames", flames, 1.3, 2.4, FLAME, 9, closed=True)
        strokes, pitch, size = [], 37.0, 29.5
        for k, name in enumerate("CANDELABRA"):
            strokes += letter(name, -size / 3, TALL - 190 - k * pitch, size)
        count += glass(layer, "Letters", [[(2.3 * x, z) for x, z in s] for s in strokes], 2.2, 3.4, PINK, 11)
        w, r = WIDE / 2 - 5, 14
        frame = [
            (-w + r, 5),
            (w - r, 5),
            (w, 5 + r),
            (w, TALL - 5 - r),
            (w - r, TALL - 5),
            (-w + r, TALL - 5),
            (-w, TALL - 5 - r),
            (-w, 5 + r),
        ]
        count += glass(layer, "Frame", [frame], 1.4, 8.0, CYAN, 6, closed=True)
    layer.save(folder)
    return count


def small(layer, name, text, height, color, nits, at, turn, upright=False, frame=None):
    """A word on a dark board; `upright` stacks the letters."""
    with layer.prim("Xform", name, body=place(at, turn)):
        if upright:
            strokes = [
                s for k, c in enumerate(text) for s in letter(c, -height / 3, -(k + 1) * height * 1.28, height)
            ]
            board = ((-height * 0.62, -len(text) * height * 1.28 - height * 0.35), (height * 0.62, height * 0.1))
        else:
            strokes, wide = word(text, 0, 0, height)
            strokes = [[(x - wide / 2, z) for x, z in s] for s in strokes]
            board = ((-wide / 2 - height * 0.4, -height * 0.35), (wide / 2 + height * 0.4, height * 1.35))
        (x0, z0), (x1, z1) = board
        mesh = Mesh()
        box(mesh, (x0, -4, z0), (x1, 4, z1), "Board")
        mesh.write(layer, "Board")
        count = glass(layer, "Letters", strokes, 1.8, 5.0, color, nits)
        if frame:
            edge = [(x0 + 3, z0 + 3), (x1 - 3, z0 + 3), (x1 - 3, z1 - 3), (x0 + 3, z1 - 3)]
            count += glass(layer, "Frame", [edge], 1.2, 8.0, frame, nits * 0.7, closed=True)
    return count


def write(folder):
    count = 2 * blade(folder)
    layer = Layer("layers/signs.usda", "Neon and lit signs. Written by make.py.")
    with layer.root("Signs", "group"):
        with layer.prim("Xform", "HouseSign", body=place((432, 1480, 318))):
            mesh = Mesh()
            box(mesh, (-WIDE / 2, -6, 0), (WIDE / 2, 6, TALL), "Board")
            for z in (60, TALL - 60):
                box(mesh, (WIDE / 2, -2, z - 3), (95, 2, z + 3), "Iron", "x-x+")
            mesh.write(layer, "Board")
            for face, turn in (("Front", 0), ("Back", 180)):
                with layer.prim(
                    "Xform",
                    face,
                    ["instanceable = true", "prepend references = @../assets/neon_candelabra.usda@"],
                    place(None, turn),
                ):
                    pass
        count += small(layer, "Hotel", "HOTEL", 34, CYAN, 9, (-446, 2260, 640), 0, True, BLUE)
        count += small(layer, "Bar", "BAR", 34, GREEN, 9, (455, 2450, 430), 0, True, None)
        count += small(layer, "Noodles", "SOUP", 30, GOLD, 9, (-452, 3150, 560), 0, True, PINK)
        count += small(layer, "Cinema", "CINEMA", 36, PINK, 8, (440, 3560, 690), 0, True, GOLD)
        count += small(layer, "Open", "OPEN", 15, BLUE, 10, (-512, 250, 300), 90, False, PINK)
        # The billboard: one mesh light with a textured emission, its rim black.
        with layer.prim("Xform", "HouseBillboard", body=place((-498, 1480, 520), 62)):
            mesh = Mesh()
            mesh.face(
                [(-150, -9, 0), (150, -9, 0), (150, -9, 131), (-150, -9, 131)],
                "HouseSignGlow",
                uv=[(0, 0), (1, 0), (1, 1), (0, 1)],
            )
            mesh.write(layer, "Poster", body=["float inputs:intensity = 2.4"], light=True)
            mesh = Mesh()
            box(mesh, (-156, -8, -6), (156, 4, 137), "Iron")
            mesh.write(layer, "Back")
        # The tea house: the same idea as a textured rect light.
        with layer.prim("Xform", "TeaSign", body=place((452, 520, 312), 0)):
            mesh = Mesh()
            box(mesh, (-40, -5, -3), (40, 5, 137), "Board")
            box(mesh, (40, -2, 108), (70, 2, 114), "Iron", "x-x+")
            mesh.write(layer, "Case")
            light(
                layer,
                "RectLight",
                "Face",
                (0, -5.6, 67),
                TO_STREET,
                width=76,
                height=133,
                intensity=3.2,
                texture="../textures/tea_sign.png",
            )
    layer.save(folder)
    return count
