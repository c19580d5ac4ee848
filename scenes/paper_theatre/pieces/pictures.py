"""The textures: boards, the dragon's scales, the painted sky of the stage, the sky above the garden."""

import numpy as np
from parts.textures import clouds, encode, grain, save


def mixed(a, b, t):
    """Colours from a to b by t (h, w) or (h, 1)."""
    t = np.clip(t, 0, 1)[..., None]
    return np.asarray(a) * (1 - t) + np.asarray(b) * t


def boards(size=96, planks=6):
    """Planks along v, each of its own tone; linear reflectance."""
    y, x = np.mgrid[0:size, 0:size] / size
    plank = np.floor(x * planks).astype(int)
    tone = 0.7 + 0.5 * grain(1, planks, 11)[0][plank]
    streaks = clouds(size, size, 3, 21)[:: max(1, size // 12)].repeat(max(1, size // 12), 0)[:size]
    joint = np.clip(np.abs(x * planks % 1 - 0.5) * 24 - 11.2, 0, 1)
    return encode(np.clip(mixed((0.21, 0.085, 0.035), (0.34, 0.16, 0.07), streaks) * (tone * (1 - 0.8 * joint))[..., None], 0, 1))


def scales(size=64, rows=4):
    """Overlapping scales of oiled paper, lit from the middle of each drum: what they let through. u runs about the body, v along it."""
    y, x = np.mgrid[0:size, 0:size] / size
    best = np.full((size, size), -1.0)
    edge = np.zeros((size, size))
    for row in range(-1, rows + 2):
        for column in range(-1, 9):
            cx, cy = (column + 0.5 * (row % 2)) / 8, row / rows
            r = np.hypot((x - cx) * 8 / 1.25, (y - cy) * rows / 1.6)
            inside = (r < 0.5) & (row > best)
            best = np.where(inside, row, best)
            edge = np.where(inside, r / 0.5, edge)
    belly = np.exp(-(((np.abs(x - 0.5) - 0.5) / 0.16) ** 2))[..., None]
    paper = mixed((1.0, 0.10, 0.02), (0.5, 0.022, 0.008), edge**2)
    rim = np.clip((edge - 0.78) * 9, 0, 1) * np.clip((1.0 - edge) * 12, 0, 1)
    paper = mixed(paper, (1.0, 0.42, 0.07), rim)
    paper = paper * (1 - belly) + np.array((1.0, 0.36, 0.07)) * belly
    return encode(np.clip(paper * (0.16 + 0.84 * np.sin(np.pi * y) ** 1.5)[..., None], 0, 1))


def painted_sky(width=160, height=80):
    """The lit cloth behind the waves: night above, the last light at the horizon, bands of cloud."""
    y, x = np.mgrid[0:height, 0:width]
    up = 1 - (y + 0.5) / height
    sky = mixed((1.0, 0.40, 0.16), (0.34, 0.24, 0.34), up / 0.32)
    sky = np.where((up > 0.32)[..., None], mixed((0.34, 0.24, 0.34), (0.03, 0.075, 0.24), (up - 0.32) / 0.36), sky)
    sky = np.where((up > 0.68)[..., None], mixed((0.03, 0.075, 0.24), (0.012, 0.022, 0.10), (up - 0.68) / 0.32), sky)
    u = x / width
    for middle, thick, phase, tone in (
        (0.50, 0.034, 0.4, (0.10, 0.10, 0.24)),
        (0.42, 0.040, 2.1, (0.20, 0.13, 0.24)),
        (0.33, 0.030, 4.0, (0.46, 0.20, 0.22)),
    ):
        puff = 0.6 + 0.4 * np.abs(np.sin(9 * np.pi * u + phase))
        body = thick * puff * np.clip(np.sin(2.2 * np.pi * u + phase) + 0.35, 0, 1)
        inside = (up > middle) & (up < middle + body)
        sky = np.where(inside[..., None], np.asarray(tone), sky)
    return encode(np.clip(sky, 0, 1))


def dusk(width=64, height=32):
    """The sky above the garden, latitude-longitude; the stage lies at u = 0, where the sun has set."""
    y, x = np.mgrid[0:height, 0:width]
    up = 1 - 2 * (y + 0.5) / height
    toward = 0.5 + 0.5 * np.cos(2 * np.pi * (x + 0.5) / width)
    high = mixed((0.24, 0.40, 0.66), (0.045, 0.11, 0.32), np.clip(up, 0, 1) ** 0.6)
    glow = (np.exp(-np.clip(up, 0, 1) / 0.16) * toward**2)[..., None]
    sky = high * (0.55 + 0.45 * toward[..., None]) + glow * np.array((0.62, 0.30, 0.12))
    return encode(np.clip(np.where((up > 0)[..., None], sky, np.array((0.015, 0.02, 0.02))), 0, 1))


def write(folder):
    for name, picture in (("boards", boards), ("scales", scales), ("painted_sky", painted_sky), ("dusk", dusk)):
        save(folder / "textures" / f"{name}.png", picture())
