"""Ten thousand point lights in a spiral over stones: "Split effect" of the seed.

The rim of the spiral runs a hand's breadth above the pebbles, its inner end hangs high over them, so every
pebble has a few lights at close quarters and thousands afar: some clusters of lights are to be split, most are not.
"""

import numpy as np
from kit import Stage, ball, blend, unit

LIGHTS = 10_000
TURNS = 3
RIM, INNER = 5.4, 0.5
LOW, HIGH = 0.38, 1.6
RAMP = [(1.0, 0.56, 0.22), (1.0, 0.42, 0.26), (0.84, 0.38, 0.66), (0.36, 0.50, 1.0), (0.30, 0.80, 1.0)]
FIELD = 8.5
TONES = [(0.30, 0.28, 0.26), (0.46, 0.43, 0.39), (0.16, 0.16, 0.17), (0.38, 0.31, 0.25), (0.62, 0.60, 0.56)]


def write(path):
    stage = Stage("10,000 point lights in a spiral over stones. Written by scenes/seed/spiral_points.py")
    dice = np.random.default_rng(2017)
    stones(stage, dice)
    t = (np.arange(LIGHTS) + 0.5) / LIGHTS
    # As many lights to the metre everywhere: the square root undoes that outer turns are longer.
    radius = np.sqrt(RIM**2 + (INNER**2 - RIM**2) * t)
    turn = 2 * np.pi * TURNS * (RIM - radius) / (RIM - INNER)
    height = LOW + (HIGH - LOW) * ((RIM - radius) / (RIM - INNER)) ** 5
    places = np.stack([radius * np.cos(turn), radius * np.sin(turn), height], axis=1)
    places += dice.normal(0, 0.015, places.shape)
    with stage.prim("Scope", "Lights"):
        for i, (at, color) in enumerate(zip(places, blend(RAMP, t), strict=True)):
            stage.point(f"light_{i:04}", at, color, 0.002)
    stage.camera((0, -9.0, 4.6), (0, -0.75, 0.0), 50)
    stage.save(path)


def stones(stage, dice):
    """Pebbles of a few shapes, large ones first and small ones into the gaps, over bare earth."""
    earth = stage.material("earth", (0.10, 0.09, 0.08), ior=1)
    stage.shape("Plane", "Earth", earth, (0, 0, 0), width=200, length=200)
    tones = [stage.material(f"stone_{i}", tone, ior=1) for i, tone in enumerate(TONES)]
    shapes = {}
    for i in range(10):
        points, triangles = ball(3)
        name = f"pebble_{i}"
        shapes[name] = _later(stage, name, pebble(points, dice), triangles, tones[i % len(tones)])
    places, sizes = pack(dice)
    count = len(places)
    flat = dice.uniform(0.55, 0.8, count)
    scales = sizes[:, None] * np.stack([np.ones(count), dice.uniform(0.75, 1, count), flat], axis=1)
    at = np.column_stack([places, 0.55 * sizes * flat * dice.uniform(0.7, 1.3, count)])
    stage.scatter("Stones", at, shapes, dice.integers(0, len(shapes), count), dice.uniform(0, 360, count), scales)


def _later(stage, name, points, triangles, tone):
    return lambda: stage.mesh(name, points, triangles, tone, smooth=True)


def pebble(points, dice):
    """A unit sphere, planed on some sides and waved on all."""
    radius = np.ones(len(points))
    for axis in unit(dice.normal(size=(7, 3))):
        cut = dice.uniform(0.80, 0.95)
        along = points @ axis
        radius = np.minimum(radius, cut / np.maximum(along, 1e-3) * 0.35 + 0.65)
    for axis, wave in zip(unit(dice.normal(size=(6, 3))), (1.5, 2, 2.5, 3, 5, 7), strict=True):
        radius += 0.05 / wave * np.sin(wave * points @ axis + dice.uniform(0, 6.3))
    return points * radius[:, None]


def pack(dice):
    """Places and radii of pebbles that hardly overlap."""
    cell, grid, places, sizes = 0.35, {}, [], []
    for tries, low, high in ((150, 0.22, 0.32), (1500, 0.13, 0.22), (9000, 0.08, 0.13), (30000, 0.05, 0.08)):
        for x, y, size in dice.uniform((-FIELD, -FIELD, low), (FIELD, FIELD + 4, high), (tries, 3)):
            i, j = int(x // cell), int(y // cell)
            near = [n for a in (-2, -1, 0, 1, 2) for b in (-2, -1, 0, 1, 2) for n in grid.get((i + a, j + b), ())]
            if all((places[n][0] - x) ** 2 + (places[n][1] - y) ** 2 > (0.86 * (sizes[n] + size)) ** 2 for n in near):
                grid.setdefault((i, j), []).append(len(places))
                places.append((x, y))
                sizes.append(size)
    return np.array(places), np.array(sizes)
