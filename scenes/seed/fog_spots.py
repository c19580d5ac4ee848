"""Two hundred spots and points in a row in a box of fog: "Extending to volume render" of the seed.

A hundred and fifty narrow spots hang in a row; each ten of them share a focus and part again below it, so their beams
draw crossing fans in the fog. Fifty points stand along the floor. The fog is a `UsdVol.Volume` with attributes of
Candelabra's: extinction in 1/m, albedo, anisotropy.
"""

import numpy as np
from kit import Stage, aimed, blend, vec

SPOTS, POINTS = 150, 50
FAN = 10  # spots that share a focus
LONG, WIDE, TALL = 20.0, 12.0, 5.0
ROW = 0.92 * LONG
HAZE = [(0.25, 0.55, 1.0), (0.45, 0.95, 0.95), (1.0, 0.85, 0.55), (1.0, 0.45, 0.25), (0.95, 0.30, 0.60)]


def write(path):
    stage = Stage("200 spots and points in a box of fog. Written by scenes/seed/fog_spots.py")
    box(stage)
    t = (np.arange(SPOTS) + 0.5) / SPOTS
    with stage.prim("Scope", "Lights"):
        for i, (s, color) in enumerate(zip(t, blend(HAZE, t), strict=True)):
            fan = i // FAN
            focus = ((fan + 0.5) * FAN / SPOTS - 0.5) * ROW
            eye = np.array((0, (s - 0.5) * ROW, TALL - 0.3))
            aim = (0.7 * (-1) ** fan, focus, (1.5, 2.4)[fan % 2])
            stage.point(f"spot_{i}", aimed(eye, aim), color, 5.0, (4.5, 0.6))
        for i, color in enumerate(blend(HAZE, 1 - (np.arange(POINTS) + 0.5) / POINTS)):
            at = (3.6, ((i + 0.5) / POINTS - 0.5) * ROW, 0.25)
            stage.point(f"point_{i}", at, color, 0.04)
    low, high = (-WIDE / 2, -LONG / 2, 0), (WIDE / 2, LONG / 2, TALL)
    fog = [
        f"float3[] extent = [{vec(low)}, {vec(high)}]",
        "custom float candelabra:fog:extinction = 0.06",
        "custom color3f candelabra:fog:albedo = (0.95, 0.95, 0.95)",
        "custom float candelabra:fog:anisotropy = 0.4",
    ]
    with stage.prim("Volume", "Fog", fog):
        pass
    stage.camera((-5.4, -8.8, 1.6), (0.2, -0.6, 2.15), 62)
    stage.save(path)


def box(stage):
    wall = stage.material("wall", (0.32, 0.33, 0.35), ior=1)
    floor = stage.material("floor", (0.20, 0.20, 0.21), 0.5)
    block = stage.material("block", (0.55, 0.55, 0.55), ior=1)
    x, y = WIDE / 2, LONG / 2
    with stage.prim("Scope", "Box"):
        stage.box("floor", floor, (-x, -y, -0.1), (x, y, 0))
        stage.box("ceiling", wall, (-x, -y, TALL), (x, y, TALL + 0.1))
        for name, low, high in (
            ("left", (-x - 0.1, -y, 0), (-x, y, TALL)),
            ("right", (x, -y, 0), (x + 0.1, y, TALL)),
            ("back", (-x, y, 0), (x, y + 0.1, TALL)),
            ("front", (-x, -y - 0.1, 0), (x, -y, TALL)),
        ):
            stage.box(name, wall, low, high)
        for i in range(2, SPOTS // FAN, 3):
            at = (1.2 * (-1) ** i, ((i + 0.5) * FAN / SPOTS - 0.5) * ROW)
            stage.shape("Cube", f"block_{i}", block, (*at, 0.3), (0.8, 0.8, 0.6), 20 * i)
            stage.shape("Sphere", f"ball_{i}", block, (*at, 1.0), radius=0.4)
