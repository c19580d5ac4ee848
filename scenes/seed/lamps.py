"""A hall lit by 10, 100 or 1,000 lamps of mixed kind: "Our method in production" of the seed.

Panels, globes, spots and candles, among columns and galleries that hide many of them from one another, over glossy and matt
things. However many there are, all lamps together give the same power, and panels and globes have the same area.
"""

import numpy as np
from kit import Stage, aimed, ball, blend, lathe, spread

HALF, BACK, FRONT, TALL = 7.0, 26.0, -5.0, 6.6
COLUMN, EVERY = 3.7, 4.0  # rows of columns at x = -3.7 and 3.7, one every 4 m
GALLERY = 3.2
PANEL_W, GLOBE_W, SPOT_W, CANDLE_W = 900, 900, 500, 300  # each kind's share of the power
PANEL_M2, GLOBE_M2 = 3.0, 2.0  # and of the area
WARM = [(1, 0.60, 0.30), (1, 0.76, 0.52), (1, 0.88, 0.74)]


def write(path, lights):
    stage = Stage(f"A hall with {lights} lamps. Written by scenes/seed/lamps.py")
    hall(stage)
    furniture(stage)
    with stage.prim("Scope", "Lamps"):
        panels(stage, lights * 2 // 10)
        globes(stage, lights * 3 // 10)
        spots(stage, lights * 2 // 10)
        candles = candlelight(stage, lights - lights * 7 // 10)
    wax = stage.material("wax", (0.8, 0.75, 0.65), 0.6)
    sticks = {"stick": lambda: stage.shape("Cylinder", "stick", wax, radius=0.03, height=0.2)}
    stage.scatter("Sticks", candles - (0, 0, 0.13), sticks, [0] * len(candles))
    stage.camera((1.1, -3.6, 1.75), (-0.35, 12, 2.25), 62)
    stage.save(path)


def panels(stage, count):
    """Half under the ceiling, half under the galleries; they face down."""
    side = (PANEL_M2 / count) ** 0.5
    nits = PANEL_W / (np.pi * PANEL_M2)
    nave = spread(count, (-2.6, 1), (2.6, 24))
    aisle = spread(count, (4.2, 1), (6.4, 24), 0.3)
    for i in range(count):
        (x, y), z = (nave[i], TALL - 0.06) if i % 2 == 0 else (aisle[i] * ((-1) ** (i // 2), 1), GALLERY - 0.36)
        stage.light("RectLight", f"panel_{i}", (x, y, z), (0.80, 0.90, 1.0), nits, width=side, height=side)


def globes(stage, count):
    """Paper globes hung at all heights over the nave, all but the way the camera looks along."""
    radius = (GLOBE_M2 / count / (4 * np.pi)) ** 0.5
    nits = GLOBE_W / (np.pi * GLOBE_M2)
    places = spread(count, (-3.0, 2.0, 3.0), (3.0, 25, 5.6), 0.2)
    for i, (at, color) in enumerate(zip(places, blend(WARM, spread(count, [0], [1])[:, 0]), strict=True)):
        stage.light("SphereLight", f"globe_{i}", at, color, nits, radius=radius)


def spots(stage, count):
    """On the columns, some aimed at the floor, some at the walls behind, some across."""
    candela = SPOT_W / count / (2 * np.pi * (1 - np.cos(np.radians(25))))
    tints = [(1, 0.82, 0.60), (0.65, 0.80, 1.0), (1, 0.55, 0.62)]
    places = spread(count, (2.6, 0), (4.6, 1), 0.4)
    for i, (z, t) in enumerate(places):
        side, y = (-1) ** i, 3 + EVERY * (int(t * 6) % 6)
        eye = np.array((side * (COLUMN - 0.5), y + 0.6 * (t * 6 % 1 - 0.5), z))
        target = [(side * 0.4, y + 1.5, 0), (-side * 3, y + 2, 1.0), (side * 0.8, y - 2, 0)][i % 3]
        stage.point(f"spot_{i}", aimed(eye, target), tints[i % 3], candela, (25, 0.3))


def candlelight(stage, count):
    """Points over tables, along the galleries' edges and on the floor by the walls; returns where."""
    candela = CANDLE_W / count / (4 * np.pi)
    table = np.column_stack([spread(count, (-0.45, 4.1), (0.45, 17.9), 0.1), np.full(count, 1.07)])
    edge = np.column_stack([np.full(count, COLUMN + 0.12), spread(count, [2], [25])[:, 0], np.full(count, GALLERY + 0.3)])
    floor = np.column_stack([spread(count, (5.2, 1), (6.6, 25), 0.7), np.full(count, 0.25)])
    places = np.stack([(table, edge, floor)[i % 3][i] for i in range(count)])
    sides = np.array([1 if i % 3 == 0 else (-1) ** (i // 3) for i in range(count)])
    places[:, 0] *= sides
    for i, (at, color) in enumerate(zip(places, blend(WARM[:2], spread(count, [0], [1])[:, 0]), strict=True)):
        stage.point(f"candle_{i}", at, color, candela)
    return places


def hall(stage):
    plaster = stage.material("plaster", (0.55, 0.52, 0.48), ior=1)
    stone = stage.material("stone", (0.50, 0.47, 0.42), 0.7)
    wood = stage.material("wood", (0.16, 0.09, 0.05), 0.45)
    tiles = stage.material("tile_dark", (0.05, 0.055, 0.06), 0.16), stage.material("tile_light", (0.32, 0.30, 0.27), 0.22)
    with stage.prim("Scope", "Hall"):
        for name, low, high in (
            ("left", (-HALF - 0.2, FRONT, 0), (-HALF, BACK, TALL)),
            ("right", (HALF, FRONT, 0), (HALF + 0.2, BACK, TALL)),
            ("back", (-HALF, BACK, 0), (HALF, BACK + 0.2, TALL)),
            ("front", (-HALF, FRONT - 0.2, 0), (HALF, FRONT, TALL)),
            ("ceiling", (-HALF, FRONT, TALL), (HALF, BACK, TALL + 0.2)),
        ):
            stage.box(name, plaster, low, high)
        stage.box("apse", wood, (-1.6, BACK - 0.15, 0), (1.6, BACK, 3.6))
        for side, name in ((-1, "left"), (1, "right")):
            ends = sorted((side * (COLUMN - 0.1), side * HALF))
            stage.box(f"gallery_{name}", wood, (ends[0], 1, GALLERY - 0.3), (ends[1], BACK, GALLERY))
            rail = sorted((side * (COLUMN - 0.1), side * (COLUMN - 0.02)))
            stage.box(f"rail_{name}", wood, (rail[0], 1, GALLERY + 0.85), (rail[1], BACK, GALLERY + 0.95))
            for i in range(6):
                at = (side * COLUMN, 3 + EVERY * i)
                stage.shape("Cylinder", f"column_{name}_{i}", stone, (*at, TALL / 2), radius=0.27, height=TALL)
                stage.shape("Cube", f"foot_{name}_{i}", stone, (*at, 0.2), (0.8, 0.8, 0.4))
        for i in range(7):
            y = 1 + EVERY * i
            stage.box(f"beam_{i}", wood, (-HALF, y - 0.15, TALL - 0.45), (HALF, y + 0.15, TALL))
    cells = [(x, y) for x in range(14) for y in range(31)]
    at = np.array([(x - 6.5, y + FRONT + 0.5, 0) for x, y in cells])
    pieces = {name: _tile(stage, name) for name in tiles}
    stage.scatter("Tiles", at, pieces, [(x + y) % 2 for x, y in cells])


def _tile(stage, material):
    return lambda: stage.shape("Plane", material, material, width=1, length=1)


def furniture(stage):
    """Tables under cloth, plinths with balls of metal and glaze, vases, crates."""
    cloth = stage.material("cloth", (0.40, 0.07, 0.06), ior=1)
    gold = stage.material("gold", (0.95, 0.68, 0.30), 0.22, 1)
    steel = stage.material("steel", (0.75, 0.76, 0.78), 0.10, 1)
    glaze = stage.material("glaze", (0.04, 0.16, 0.24), 0.08)
    clay = stage.material("clay", (0.52, 0.25, 0.14), 0.9)
    marble = stage.material("marble", (0.70, 0.68, 0.64), 0.3)
    profile = [(0.02, 0), (0.22, 0), (0.36, 0.18), (0.40, 0.36), (0.32, 0.62), (0.16, 0.82), (0.13, 0.95), (0.2, 1.05)]
    vase, ball_of = lathe(profile), ball(3)
    with stage.prim("Scope", "Furniture"):
        for i in range(4):
            y = 4 + 3.8 * i
            stage.box(f"table_{i}", cloth, (-0.6, y, 0), (0.6, y + 2.5, 0.84))
        for i in range(12):
            side, y = (-1) ** i, 1.6 + 1.95 * i
            x = side * (2.35 + 0.35 * (i % 3 == 0))
            if i % 3 == 2:
                stage.mesh(f"vase_{i}", vase[0] * 1.25 + (x, y, 0), vase[1], (glaze, clay)[i // 3 % 2], smooth=True)
                continue
            stage.shape("Cube", f"plinth_{i}", marble, (x, y, 0.4), (0.55, 0.55, 0.8), 20 * i)
            metal = (gold, steel, glaze)[i % 3 if i % 2 else (i // 2) % 3]
            stage.mesh(f"ball_{i}", ball_of[0] * 0.36 + (x, y, 1.15), ball_of[1], metal, smooth=True)
        dice = np.random.default_rng(12)
        for i in range(40):
            side, size = (-1) ** i, dice.uniform(0.35, 0.9)
            at = (side * dice.uniform(4.6, 6.4), dice.uniform(1, 25), size / 2)
            stage.shape("Cube", f"crate_{i}", (clay, marble)[i % 3 == 0], at, (size,) * 3, dice.uniform(0, 90))
