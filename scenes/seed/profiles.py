"""Lamps with IES profiles: how each throws its light on a wall, and a hall of many."""

import math

import numpy as np
from kit import POINT_RADIUS, Stage, aimed

SPACE = 1.7  # metres between the lamps at the wall
HALL = 600


def write(path):
    """Six lamps in front of a wall, each with a profile of its own, all of one flux: a narrow beam, two wings, up
    and down, to one side, a rectangle (type B), and rays (no symmetry)."""
    stage = Stage("Lamps with IES profiles. Written by scenes/seed/profiles.py")
    plaster = stage.material("plaster", (0.7, 0.7, 0.68), ior=1)
    floor = stage.material("floor", (0.35, 0.33, 0.3), 0.5)
    with stage.prim("Scope", "Stage"):
        stage.box("floor", floor, (-7, -5, -0.1), (7, 1, 0))
        stage.box("wall", plaster, (-7, 0.35, 0), (7, 0.5, 4.5))
    files = {name: _save(path, name, *table) for name, table in PROFILES.items()}
    with stage.prim("Scope", "Lamps"):
        for i, name in enumerate(PROFILES):
            at = np.array(((i - 2.5) * SPACE, 0.0, 2.4))
            # Hung as it was measured, or turned so that its side or its rays meet the wall.
            frame = aimed(at, at - (0, 0, 1), (0, -1, 0) if name == "side" else (1, 0, 0))
            if name in ("rectangle", "rays"):
                frame = aimed(at - (0, 0.6, 0), at + (0, 1, -0.4))
            _lamp(stage, name, frame, 7.0, files[name], normalize=True)
    stage.camera((0, -8.6, 2.1), (0, 0.35, 1.9), 64)
    stage.save(path)


def write_hall(path):
    """A hall under 600 lamps of four profiles, aimed here and there. For measuring."""
    stage = Stage("A hall of lamps with IES profiles. Written by scenes/seed/profiles.py")
    plaster = stage.material("plaster", (0.6, 0.58, 0.55), ior=1)
    floor = stage.material("floor", (0.4, 0.4, 0.4), 0.4)
    with stage.prim("Scope", "Stage"):
        stage.box("floor", floor, (-20, -20, -0.1), (20, 20, 0))
        stage.box("wall", plaster, (-20, 20, 0), (20, 20.2, 8))
        for i in range(12):
            x, y = -16 + 2.9 * i, 6 * math.sin(2.1 * i)
            stage.box(f"pillar_{i:02}", plaster, (x - 0.4, y - 0.4, 0), (x + 0.4, y + 0.4, 4))
    names = ("narrow", "wings", "updown", "side")
    files = {name: _save(path, name, *PROFILES[name]) for name in names}
    chance = np.random.default_rng(7)
    with stage.prim("Scope", "Lamps"):
        for i in range(HALL):
            at = np.array((*chance.uniform(-19, 19, 2), chance.uniform(4, 7)))
            toward = at + (*chance.uniform(-0.8, 0.8, 2), -1)
            name = names[i % 4]
            candela = 2.0 * 4.0 ** chance.uniform(-1, 1)
            _lamp(stage, f"lamp_{i:03}", aimed(at, toward, (1, 0, 0)), candela, files[name], normalize=True)
    stage.camera((0, -19, 5), (0, 2, 1), 70)
    stage.save(path)


def _lamp(stage, name, frame, candela, file, normalize):
    """A point light with a profile."""
    body = [
        "bool treatAsPoint = 1",
        f"asset inputs:shaping:ies:file = @./{file}@",
        f"bool inputs:shaping:ies:normalize = {int(normalize)}",
    ]
    nits = candela / (math.pi * POINT_RADIUS**2)
    stage.light("SphereLight", name, frame, (1, 0.93, 0.82), nits, (180, 0), body, radius=POINT_RADIUS)


def _bump(angle, middle, width):
    return math.exp(-(((angle - middle) / width) ** 2))


PROFILES = {
    "narrow": (1, (0, 90), (0, 0), lambda v, h: 3000 * _bump(v, 0, 9) + 60 * math.cos(math.radians(v))),
    "wings": (1, (0, 90), (0, 90), lambda v, h: 900 * _bump(v, 55, 16) * (1 - 0.6 * h / 90) + 80 * _bump(v, 0, 50)),
    "updown": (1, (0, 180), (0, 0), lambda v, h: 1500 * _bump(v, 0, 22) + 900 * _bump(v, 180, 35)),
    "side": (1, (0, 90), (0, 180), lambda v, h: 1400 * _bump(v, 50, 20) * _bump(h, 0, 60)),
    "rectangle": (2, (-90, 90), (0, 90), lambda v, h: 800.0 * (abs(v) <= 25 and h <= 40)),
    "rays": (
        1,
        (0, 180),
        (0, 360),
        lambda v, h: 700 * max(math.cos(math.radians(5 * h)), 0) ** 3 * _bump(v, 45, 25) * (0.3 + 0.7 * h / 360),
    ),
}
"""LM-63's photometric type, the spans of vertical and horizontal angles, and the intensity in candela."""


def _save(path, name, kind, vertical, horizontal, candela):
    """Writes an IES file beside a scene, and returns its name."""
    v = np.arange(vertical[0], vertical[1] + 1, 2.5)
    h = np.arange(horizontal[0], horizontal[1] + 1, 5.0)
    lines = [
        "IESNA:LM-63-2002",
        f"[TEST] {name}",
        "[TESTLAB] none: written by scenes/seed/profiles.py",
        "TILT=NONE",
        f"1 -1 1 {len(v)} {len(h)} {kind} 2 0 0 0",
        "1 1 1",
        *_wrapped(v),
        *_wrapped(h),
    ]
    for angle in h:
        lines += _wrapped([candela(float(own), float(angle)) for own in v])
    file = path.with_name(f"{path.stem}_{name}.ies")
    file.write_text("\r\n".join(lines) + "\r\n", encoding="ascii", newline="")
    return file.name


def _wrapped(numbers, width=12):
    texts = [f"{number:.4g}" for number in numbers]
    return [" ".join(texts[i : i + width]) for i in range(0, len(texts), width)]
