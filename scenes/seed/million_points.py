"""A million tiny point lights on a rectangle, or one area light in their place: "Global lights" of the seed.

The rectangle of 2 x 1 m hangs over a floor with things on it. Together the points send as much straight down as the area
light. They send as much to every side, the area light less by the cosine: so the two pictures nearly agree below it,
and the points' whole flux is four times the area light's.
"""

import numpy as np
from kit import Glb, ball, brick, lathe

COLUMNS, ROWS = 1250, 800
WIDE, DEEP, HEIGHT = 2.0, 1.0, 3.6
NITS = 20.0


def write_points(path):
    scene = Glb(["KHR_lights_punctual", "KHR_materials_specular"])
    things(scene)
    candela = NITS * WIDE * DEEP / (COLUMNS * ROWS)
    scene.document["extensions"] = {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": candela}]}}
    first = len(scene.nodes) + 1
    scene.node(translation=[0, HEIGHT, 0], children=list(range(first, first + COLUMNS * ROWS)))
    light = {"KHR_lights_punctual": {"light": 0}}
    for x in (np.arange(COLUMNS) + 0.5) * WIDE / COLUMNS - WIDE / 2:
        for z in (np.arange(ROWS) + 0.5) * DEEP / ROWS - DEEP / 2:
            scene.nodes.append({"translation": [round(x, 6), 0, round(z, 6)], "extensions": light})
    scene.save(path)


def write_area(path):
    scene = Glb(["KHR_materials_emissive_strength", "KHR_materials_specular"])
    things(scene)
    x, y = WIDE / 2, DEEP / 2
    corners = np.array([(-x, -y, HEIGHT), (-x, y, HEIGHT), (x, y, HEIGHT), (x, -y, HEIGHT)])
    scene.mesh("Area", corners, [(0, 1, 2), (0, 2, 3)], (0, 0, 0), nits=NITS)
    scene.save(path)


def things(scene):
    """A floor, and on it what casts soft shadows."""
    floor = np.array([(-20, -20, 0), (20, -20, 0), (20, 20, 0), (-20, 20, 0)], float)
    scene.mesh("Floor", floor, [(0, 1, 2), (0, 2, 3)], (0.55, 0.55, 0.55))
    points, triangles = ball(4)
    for name, at, radius, color in (
        ("Large", (0.1, 0.1, 0.42), 0.42, (0.75, 0.72, 0.68)),
        ("Red", (-0.72, -0.42, 0.2), 0.2, (0.70, 0.16, 0.10)),
        ("Blue", (0.62, -0.55, 0.14), 0.14, (0.12, 0.28, 0.62)),
    ):
        scene.mesh(name, points * radius + at, triangles, color, smooth=True)
    scene.mesh("Plinth", *brick((-1.15, 0.25, 0), (-0.6, 0.75, 0.75)), (0.5, 0.52, 0.48))
    scene.mesh("Slab", *brick((0.75, 0.1, 0), (1.3, 0.6, 0.3)), (0.62, 0.52, 0.30))
    vase = [(0, 0), (0.11, 0), (0.19, 0.10), (0.20, 0.20), (0.14, 0.34), (0.07, 0.44), (0.06, 0.5), (0.09, 0.55)]
    points, triangles = lathe(vase)
    scene.mesh("Vase", points + (1.02, 0.35, 0.3), triangles, (0.25, 0.5, 0.42), smooth=True)
    scene.camera((0, -4.2, 2.0), (0.05, 0, 0.42), 38)
