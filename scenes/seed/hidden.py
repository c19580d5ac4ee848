"""Scenes whose strongest light is behind something: two rooms with a door, the same with a door that opens over the
frames, and a sun behind a house."""

import numpy as np
from kit import Stage, aimed, ball

ROOM = 6.0  # metres, square; 3 m high
TALL = 3.0


def write_rooms(path):
    """The camera stands in a room with twenty small lamps. A lamp 10,000 times as bright as one of them
    hangs in the room next door, whose door is open: it lights a wedge of floor here, and no more."""
    rooms(Stage("Two rooms, one door, a strong lamp behind the wall. Written by scenes/seed/hidden.py")).save(path)


def write_opening_door(path):
    """The same, and the door slides open from frame 1 to frame 25."""
    stage = rooms(Stage("Two rooms, a door that opens, a strong lamp behind. Written by scenes/seed/hidden.py"))
    door = stage.material("door", (0.4, 0.3, 0.2), ior=1)
    stage.sliding_box("door", door, (-0.04, 3.5, 0), (0.04, 4.5, 2.1), by=(0, 1, 0), frames=25)
    stage.save(path)


def rooms(stage):
    plaster = stage.material("plaster", (0.6, 0.58, 0.54), ior=1)
    floor = stage.material("floor", (0.35, 0.28, 0.2), ior=1)
    clay = stage.material("clay", (0.5, 0.3, 0.2), ior=1)
    with stage.prim("Scope", "Rooms"):
        # The wall between them is at x = 0; the door is a metre wide.
        for name, low, high in (
            ("floor", (-ROOM, 0, -0.2), (ROOM, ROOM, 0)),
            ("ceiling", (-ROOM, 0, TALL), (ROOM, ROOM, TALL + 0.2)),
            ("left", (-ROOM - 0.2, 0, 0), (-ROOM, ROOM, TALL)),
            ("right", (ROOM, 0, 0), (ROOM + 0.2, ROOM, TALL)),
            ("front", (-ROOM, -0.2, 0), (ROOM, 0, TALL)),
            ("back", (-ROOM, ROOM, 0), (ROOM, ROOM + 0.2, TALL)),
            ("wall_low", (-0.1, 0, 0), (0.1, 3.5, TALL)),
            ("wall_high", (-0.1, 4.5, 0), (0.1, ROOM, TALL)),
            ("lintel", (-0.1, 3.5, 2.1), (0.1, 4.5, TALL)),
        ):
            stage.box(name, floor if name == "floor" else plaster, low, high)
        points, triangles = ball(3)
        for i in range(6):
            at = (-1.2 - 0.8 * i, 1.5 + (i * 2.1) % 3.6, 0.35)
            stage.mesh(f"ball_{i}", points * 0.35 + at, triangles, clay, smooth=True)
    with stage.prim("Scope", "Lamps"):
        for i in range(20):
            at = (-0.5 - i % 5 * 1.2, 0.6 + i // 5 * 1.6, 2.2 + 0.1 * (i % 3))
            stage.point(f"lamp_{i}", at, (1, 0.8, 0.6), 1)
        stage.light("SphereLight", "strong", (3.5, 1.2, 1.5), (0.8, 0.9, 1), 1e4 / (np.pi * 0.05**2), radius=0.05)
    stage.camera((-5.6, 0.4, 1.7), (-1.8, 4.2, 0.9), 75)
    return stage


def write_house(path):
    """The camera stands in the shade of a house, under forty lanterns; the sun is behind the house and
    lights the far end of the yard."""
    stage = Stage("A sun behind a house. Written by scenes/seed/hidden.py")
    plaster = stage.material("plaster", (0.6, 0.58, 0.54), ior=1)
    ground = stage.material("ground", (0.3, 0.28, 0.22), ior=1)
    wood = stage.material("wood", (0.3, 0.2, 0.12), ior=1)
    with stage.prim("Scope", "Yard"):
        stage.box("ground", ground, (-40, -40, -0.2), (40, 40, 0))
        stage.box("house", plaster, (-14, 8, 0), (14, 16, 9))
        for i in range(10):
            at = (-9 + 2 * i, 2.5 + (i * 2.7) % 4)
            stage.box(f"table_{i}", wood, (*at, 0), (at[0] + 0.9, at[1] + 0.6, 0.8))
    with stage.prim("Scope", "Lanterns"):
        for i in range(40):
            at = (-9 + i % 10 * 2, 1.5 + i // 10 * 1.6, 2.4 + 0.2 * (i % 3))
            stage.light("SphereLight", f"lantern_{i}", at, (1, 0.7, 0.4), 400 / (np.pi * 0.1**2), radius=0.1)
    # 100,000 lux.
    sun = aimed((0, 30, 30), (0, 0, 0))
    sun[3, :3] = 0
    stage.light("DistantLight", "sun", sun, (1, 0.95, 0.9), 1e5 / (np.pi * np.sin(np.radians(0.265)) ** 2), angle=0.53)
    stage.camera((0, -9, 2.2), (0, 6, 1.6), 60)
    stage.save(path)
