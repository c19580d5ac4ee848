"""A lamp with an IES profile, and its light in closed form: bilinear between the file's angles."""

import math

import numpy as np

from others.booth import SIZE, TALL
from others.documents import looking

VERTICAL, HORIZONTAL = np.arange(0, 181, 5.0), np.arange(0, 361, 10.0)


def lamp_of_a_profile(booth):
    """A point whose light has no symmetry, tilted and turned: direct light. Cycles reads the same file."""
    file = booth.folder / "lamp.ies"
    lines = ["IESNA:LM-63-2002", "[TEST] beside_mitsuba", "TILT=NONE"]
    lines += [f"1 -1 1 {len(VERTICAL)} {len(HORIZONTAL)} 1 2 0 0 0", "1 1 1"]
    lines += [" ".join(f"{number:g}" for number in row) for row in (VERTICAL, HORIZONTAL, *candela())]
    file.write_text("\r\n".join(lines) + "\r\n")
    place = looking((0.2, 1.7, -0.2), (0.5, 0.0, -0.6), (0.9, 0, 0.4))
    shaping = {"coneAngle": 180, "coneSoftness": 0, "focus": 0, "focusTint": [0, 0, 0], "ies": {"file": file.name}}
    lux = {"usdLux": {"type": "SphereLight", "shaping": shaping}}
    booth.document.light("spot", (1, 1, 1), 1.0, place, lux, spot={"innerConeAngle": 0, "outerConeAngle": math.pi / 2})
    # Cycles has angle 0 along -Y and counts clockwise as seen from above.
    swapped = np.eye(4)[[1, 0, 2, 3]]
    return {"cycles": {}, "light": (file, place @ swapped), "closed": lambda: lit(booth, place), "depth": 1}


def candela():
    """By half plane and vertical angle: two lobes of unlike width, and some light above."""
    v, h = np.meshgrid(np.radians(VERTICAL), np.radians(HORIZONTAL))
    lobe = lambda at, wide: np.exp(-(((v - at) / wide) ** 2))
    aside = lobe(0.9, 0.35) * (0.55 + 0.45 * np.cos(h - 1.0)) + 0.6 * lobe(0.7, 0.2) * (np.cos(h - 3.2) > 0.3)
    return np.round(20 * (0.05 + aside + 0.2 * lobe(math.pi, 0.6)), 3)


def lit(booth, place, fine=16):
    """The booth in the light of that lamp, by `candela cos / d^2` and a bilinear table; one picture, without noise."""
    rows, columns = (np.arange(size * fine) for size in reversed(SIZE))
    across = lambda at, size: ((at + 0.5) / (size * fine) * 2 - 1) * math.tan(TALL / 2)
    x, y = np.meshgrid(across(columns, SIZE[0]), -across(rows, SIZE[1]))
    ways = np.stack([x, y, -np.ones_like(x)], axis=-1) @ booth.eye[:3, :3].T
    nearest, picture = np.full(x.shape, np.inf), np.zeros((*x.shape, 3))
    for points, _, color, _ in booth.pieces:
        corner, along, up = points[0], points[1] - points[0], points[3] - points[0]
        normal = np.cross(along, up) / np.linalg.norm(np.cross(along, up))
        reach = (corner - booth.eye[:3, 3]) @ normal / (ways @ normal)
        met = booth.eye[:3, 3] + reach[..., None] * ways
        u, v = ((met - corner) @ edge / (edge @ edge) for edge in (along, up))
        seen = (reach > 0) & (reach < nearest) & (abs(u - 0.5) <= 0.5) & (abs(v - 0.5) <= 0.5)
        nearest[seen] = reach[seen]
        away = met[seen] - place[:3, 3]
        squares = (away**2).sum(axis=-1)
        local = (away / np.sqrt(squares)[:, None]) @ place[:3, :3]
        polar, around = np.arccos(-local[:, 2]), np.arctan2(-local[:, 1], -local[:, 0]) % (2 * math.pi)
        values = bilinear(candela(), np.degrees(polar) / 5, np.degrees(around) / 10)
        irradiance = values * abs(away @ normal) / squares**1.5
        picture[seen] = irradiance[:, None] * np.array(color) / math.pi
    return picture.reshape(SIZE[1], fine, SIZE[0], fine, 3).mean(axis=(1, 3))


def bilinear(table, polar, around):
    """A table by half plane and vertical angle, at places in units of its steps."""
    i, j = (np.minimum(at.astype(int), size - 2) for at, size in zip((around, polar), table.shape, strict=True))
    f, g = around - i, polar - j
    low, high = ((1 - g) * table[i + k, j] + g * table[i + k, j + 1] for k in (0, 1))
    return (1 - f) * low + f * high
