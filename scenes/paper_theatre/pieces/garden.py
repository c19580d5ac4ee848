"""The garden: lawn, hedge, cypresses, benches with people, strings of lamps, a lantern of glass."""

import math

from parts.shapes import ball_profile, box, hanging, resample, turned
from parts.usda import Dice, Layer, Mesh, noise, place

from .theatre import bulbs


CYPRESSES = [(-560, 170, 0.98), (-700, 60, 0.78), (560, 210, 1.04), (690, 40, 0.84), (-930, 500, 1.1), (900, 420, 1.0)]
"""Where they stand, in centimetres, and how tall they are."""


def cypress(folder):
    layer = Layer("assets/cypress.usda", "A cypress. Written by make.py.")
    with layer.root("Cypress"):
        mesh, rows, sides = Mesh(), 22, 14

        def point(j, k):
            u, k = j / rows, k % sides
            radius = 62 * math.sin(math.pi * min(0.06 + 0.94 * u, 1)) ** 0.75 * (1 - 0.55 * u)
            radius *= 0.82 + 0.36 * noise(k * 0.9 + (j % 2) * 0.45, j * 0.8, 5)
            t = 2 * math.pi * (k + 0.5 * (j % 2)) / sides
            return radius * math.cos(t), radius * math.sin(t), 20 + 560 * u

        for j in range(rows):
            for k in range(sides):
                a, b, c, d = point(j, k), point(j, k + 1), point(j + 1, k + 1), point(j + 1, k)
                mesh.face([a, b, c], "Cypress")
                mesh.face([a, c, d], "Cypress")
        mesh.write(layer, "Leaves")
        mesh = Mesh()
        turned(mesh, [(9, 0), (8, 40)], 8, "PineBark")
        mesh.write(layer, "Trunk")
    layer.save(folder)


def people(folder):
    """Sitting, seen from behind."""
    layer = Layer("assets/people.usda", "People of the audience, and their bench. Written by make.py.")
    for name, coat, tall, wide, hat in (
        ("Anna", "CoatA", 1.0, 1.0, False),
        ("Bruno", "CoatB", 1.06, 1.12, True),
        ("Child", "CoatC", 0.8, 0.78, False),
    ):
        with layer.root(name):
            mesh = Mesh()
            outline = [(17, 40), (18, 60), (20, 82), (21, 94), (15, 101), (6, 104), (5.5, 108)]
            squashed = _Scaled(mesh, (wide, 0.62 * wide, tall))
            turned(squashed, outline, 14, coat)
            turned(_Scaled(mesh, (tall, tall, tall)), ball_profile(10.5, 9, 1.18), 12, "Hair", (0, 0, 119))
            if hat:
                turned(_Scaled(mesh, (tall, tall, tall)), [(19, 124), (19, 125.5), (10.5, 126), (10, 137), (0, 138)], 14, "Black")
            mesh.write(layer, "Figure")
    with layer.root("Bench"):
        mesh = Mesh()
        box(mesh, (-120, -16, 40), (120, 16, 44), "Bench")
        box(mesh, (-120, -20, 62), (120, -17, 76), "Bench")
        for x in (-100, 100):
            box(mesh, (x - 3, -20, 0), (x + 3, 14, 40), "Iron", "z-")
            box(mesh, (x - 3, -20, 40), (x + 3, -17, 76), "Iron", "z-")
        mesh.write(layer, "Bench")
    layer.save(folder)


class _Scaled:
    """A mesh into which shapes go scaled."""

    def __init__(self, mesh, by):
        self.mesh, self.by = mesh, by

    def face(self, corners, material):
        self.mesh.face([tuple(c * s for c, s in zip(p, self.by)) for p in corners], material)


def glass_lantern(folder):
    """A lamp behind four thin panes, on a post; its variant `panes` takes the glass out."""
    layer = Layer("assets/glass_lantern.usda", "A lantern of glass. Written by make.py.")
    variants = ['variants = { string panes = "glass" }', 'prepend variantSets = "panes"']
    with layer.root("GlassLantern"):
        mesh = Mesh()
        turned(mesh, [(24, 0), (24, 5), (8, 10), (3.5, 14), (3.5, 128), (16, 133), (19, 136), (0, 136)], 12, "Black")
        for x in (-1, 1):
            for y in (-1, 1):
                box(mesh, (x * 17 - 1.4, y * 17 - 1.4, 136), (x * 17 + 1.4, y * 17 + 1.4, 186), "Black")
        turned(mesh, [(0, 186), (28, 186), (24, 192), (7, 208), (3, 214), (0, 216)], 12, "Black")
        turned(mesh, [(3, 136), (3, 152), (0, 152)], 8, "Ivory")
        mesh.write(layer, "Frame")
        with layer.prim("Xform", "Lamp", variants, place((0, 0, 160))):
            layer.put('variantSet "panes" = {')
            layer.depth += 1
            layer.put('"glass" {')
            layer.depth += 1
            panes = Mesh()
            for corners in (((-16, -17), (16, -17)), ((17, -16), (17, 16)), ((16, 17), (-16, 17)), ((-17, 16), (-17, -16))):
                (x0, y0), (x1, y1) = corners
                panes.face([(x0, y0, -23), (x1, y1, -23), (x1, y1, 25), (x0, y0, 25)], "Pane")
            panes.write(layer, "Panes", body=["uniform bool doubleSided = 1"])
            layer.depth -= 1
            layer.put("}")
            layer.put('"none" {')
            layer.put("}")
            layer.depth -= 1
            layer.put("}")
            seen = ["bool inputs:visibleInPrimaryRay = true", "float inputs:radius = 5", "float inputs:intensity = 1200"]
            warm = ["bool inputs:enableColorTemperature = 1", "float inputs:colorTemperature = 2000"]
            with layer.prim("SphereLight", "Flame", body=[*seen, *warm]):
                pass
    layer.save(folder)


def instance(layer, asset, name, at, turn=0, scale=None):
    meta = ["instanceable = true", f"prepend references = @../assets/{asset}.usda@</{name.rstrip('0123456789')}>"]
    with layer.prim("Xform", name, meta, place(at, turn, scale)):
        pass


def write(folder):
    cypress(folder)
    people(folder)
    glass_lantern(folder)
    layer = Layer("layers/garden.usda", "The garden around the theatre. Written by make.py.")
    with layer.root("Garden", "group"):
        mesh = Mesh()
        mesh.face([(-4000, -2500, 0), (4000, -2500, 0), (4000, 6000, 0), (-4000, 6000, 0)], "Lawn")
        mesh.face([(-420, -1500, 0.6), (420, -1500, 0.6), (420, -20, 0.6), (-420, -20, 0.6)], "Gravel")
        box(mesh, (-2600, 640, 0), (2600, 700, 210), "Hedge", "z-")
        mesh.write(layer, "Ground")
        for k, (x, y, tall) in enumerate(CYPRESSES):
            instance(layer, "cypress", f"Cypress{k}", (x, y, 0), 77 * k, (0.9 + 0.1 * (k % 2), 0.9, tall))
        with layer.prim("Scope", "Audience"):
            dice = Dice(5)
            for row, (y, seats) in enumerate(((-330, (-196, -140, -78, 92, 150, 205)), (-480, (-205, -150, -96, 118, 170, 222)))):
                for side in (-1, 1):
                    instance(layer, "people", f"Bench{row}{side + 1}", (side * 152, y - 4, 0))
                for k, x in enumerate(seats):
                    kind = ("Anna", "Bruno", "Child", "Bruno", "Anna", "Child")[(k + 2 * row) % 6]
                    instance(layer, "people", f"{kind}{row}{k}", (x + dice(-6, 6), y + dice(-4, 4), 0), dice(-14, 14))
        with layer.prim("Xform", "Lantern", ["prepend references = @../assets/glass_lantern.usda@"], place((345, -95, 0))):
            pass
        strings(layer)
    layer.save(folder)


def strings(layer):
    """From the corners of the arch over the audience, and round two of the cypresses."""
    spots = []
    for side in (-1, 1):
        for start, stop, sag in (
            ((425, 60, 556), (640, -560, 560), 60),
            ((425, 60, 556), (900, -120, 500), 70),
            ((150, 48, 640), (330, -620, 560), 50),
        ):
            a, b = ((side * x, y, z) for x, y, z in (start, stop))
            spots += resample(hanging(a, b, sag, 16), 19)[1:]
        for x, y, tall in ((560, 170 if side < 0 else 210, 1.0), (695, 50, 0.81)):
            for k in range(120):
                u = 0.04 + 0.94 * k / 120
                radius = 66 * math.sin(math.pi * min(0.06 + 0.94 * u, 1)) ** 0.75 * (1 - 0.55 * u) + 3
                t = 2.39996 * k
                spots.append((side * x + radius * math.cos(t), y - 14 + radius * math.sin(t), tall * (20 + 560 * u)))
    bulbs(layer, "Strings", ["Fairy"], [(0, p) for p in spots])
