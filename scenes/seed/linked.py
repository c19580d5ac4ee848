"""A stage on which lamps light what they are linked to: light links and shadow links of UsdLux."""

import numpy as np
from kit import Stage, aimed, ball, blend, lathe

FIGURES = 6
SPACE = 1.5  # metres between them
HUES = [(1.0, 0.25, 0.15), (1.0, 0.8, 0.2), (0.3, 1.0, 0.35), (0.2, 0.8, 1.0), (0.35, 0.35, 1.0), (1.0, 0.3, 0.85)]


def write(path):
    """Six white figures in a row. Each has a lamp of its own, linked to it alone: no colour gets onto its neighbours,
    the floor or the wall. A white lamp lights all but the last figure. A key lamp from the left lights everything and
    casts the shadows of every second figure only. A sphere above lights the floor alone."""
    stage = Stage("Lamps that light what they are linked to. Written by scenes/seed/linked.py")
    plaster = stage.material("plaster", (0.5, 0.5, 0.5), ior=1)
    floor = stage.material("floor", (0.3, 0.28, 0.26), ior=1)
    clay = stage.material("clay", (0.75, 0.75, 0.75), 0.4)
    middle = (FIGURES - 1) / 2
    place = [np.array((SPACE * (i - middle), 0.0, 0.0)) for i in range(FIGURES)]
    with stage.prim("Scope", "Stage"):
        stage.box("floor", floor, (-7, -5, -0.1), (7, 3, 0))
        stage.box("wall", plaster, (-7, 2, 0), (7, 2.1, 4))
    body, rings = lathe([(0.32, 0.0), (0.34, 0.05), (0.2, 0.35), (0.24, 0.7), (0.12, 0.95), (0.0, 1.0)])
    head, faces = ball(3)
    with stage.prim("Scope", "Figures"):
        for i, at in enumerate(place):
            with stage.prim("Xform", f"figure_{i}"):
                stage.mesh("body", body + at, rings, clay, smooth=True)
                stage.mesh("head", head * 0.2 + at + (0, 0, 1.15), faces, clay, smooth=True)
    with stage.prim("Scope", "Lamps"):
        for i, (at, hue) in enumerate(zip(place, blend(HUES, np.linspace(0, 1, FIGURES)), strict=True)):
            frame = aimed(at + (0.9, -1.2, 2.0), at + (0, 0, 0.6))
            stage.light("RectLight", f"own_{i}", frame, hue, 25, None, only(f"Figures/figure_{i}"), width=0.3, height=0.3)
        last = f"Figures/figure_{FIGURES - 1}"
        frame = aimed((0, -3.5, 3.8), (0, 0, 0.5))
        stage.light("RectLight", "white", frame, (1, 1, 1), 1.2, None, but(last), width=2.0, height=0.6)
        hidden = (f"Figures/figure_{i}" for i in range(1, FIGURES, 2))
        frame = aimed((-6, -2.5, 3.0), (0, 0, 0.3))
        stage.light(
            "DiskLight", "key", frame, (1, 0.9, 0.75), 70, None, but(*hidden, link="shadowLink"), radius=0.15
        )
        stage.light("SphereLight", "pool", (0, -2.2, 1.6), (0.4, 0.6, 1), 12, None, only("Stage/floor"), radius=0.2)
    stage.camera((0, -8.2, 2.3), (0, 0, 0.75), 62)
    stage.save(path)


def only(*prims, link="lightLink"):
    """The lines of a collection of some prims below /World."""
    return [f"uniform bool collection:{link}:includeRoot = 0", _relationship(link, "includes", prims)]


def but(*prims, link="lightLink"):
    """The lines of a collection of everything but these."""
    return [_relationship(link, "excludes", prims)]


def _relationship(link, name, prims):
    return f"rel collection:{link}:{name} = [{', '.join(f'</World/{prim}>' for prim in prims)}]"
