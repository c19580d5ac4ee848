"""A ribbon of twenty thousand emissive triangles in a spiral, over a plane with posts: "Results" of the seed.

The ribbon shines from its outer, lower side alone and winds up like the peel of an apple, so from any point most of its
triangles are far away or face elsewhere: distance and orientation both matter.
"""

import numpy as np
from kit import Stage

STEPS = 5_000  # each of four triangles
TURNS = 3.5
WIDTH = 0.34


def write(path):
    stage = Stage("A mesh light of 20,000 triangles in a spiral. Written by scenes/seed/spiral_mesh.py")
    ground = stage.material("ground", (0.42, 0.43, 0.45), ior=1)
    post = stage.material("post", (0.60, 0.56, 0.50), ior=1)
    black = stage.material("black", (0, 0, 0), ior=1)
    stage.shape("Plane", "Ground", ground, width=80, length=80)
    with stage.prim("Scope", "Posts"):
        for i in range(16):
            turn, far, tall = 2 * np.pi * (i + 0.3) / 16, (4.1, 5.3)[i % 2], (1.7, 0.8)[i % 2]
            at = (far * np.cos(turn), far * np.sin(turn), tall / 2)
            stage.shape("Cube", f"post_{i}", post, at, (0.32, 0.32, tall), np.degrees(turn))
    points, triangles = ribbon()
    stage.mesh("Ribbon", points, triangles, black, glow=((1, 0.86, 0.7), 4))
    stage.camera((0, -11.6, 6.2), (0, -0.3, 1.15), 47)
    stage.save(path)


def ribbon():
    """Three rows of points along the spiral; the middle row makes the triangles smaller, not the ribbon."""
    t = np.arange(STEPS + 1) / STEPS
    turn = 2 * np.pi * TURNS * t
    radius = 3.3 * (1 - t) + 0.25
    center = np.stack([radius * np.cos(turn), radius * np.sin(turn), 1.1 + 2.6 * t], axis=1)
    # Across the ribbon: upwards and outwards, so that its outer side looks somewhat down.
    across = np.stack([0.3 * np.cos(turn), 0.3 * np.sin(turn), np.full_like(t, 0.95)], axis=1) * WIDTH
    rows = np.stack([center - across / 2, center, center + across / 2], axis=1)
    first = np.arange(STEPS)[:, None] * 3
    low = np.concatenate([first + [0, 3, 4], first + [0, 4, 1]])
    return rows.reshape(-1, 3), np.concatenate([low, low + 1])
