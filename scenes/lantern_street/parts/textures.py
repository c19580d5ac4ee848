"""The small PNG textures, computed with numpy and written by hand so that their bytes repeat."""

import struct
import zlib

import numpy as np

from .strokes import candelabra, word


def save(path, image):
    """8 bits; `image` holds encoded values in 0..1, grey or RGB."""
    data = np.clip(np.round(np.asarray(image) * 255), 0, 255).astype(np.uint8)
    height, width = data.shape[:2]
    kind = 0 if data.ndim == 2 else 2
    rows = data.reshape(height, -1).astype(np.int16)
    left = np.zeros_like(rows)
    step = 1 if kind == 0 else 3
    left[:, step:] = rows[:, :-step]
    filtered = np.hstack([np.ones((height, 1)), (rows - left) % 256]).astype(np.uint8)  # PNG filter 1

    def chunk(tag, body):
        return struct.pack(">I", len(body)) + tag + body + struct.pack(">I", zlib.crc32(tag + body))

    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, kind, 0, 0, 0))
        + chunk(b"IDAT", zlib.compress(filtered.tobytes(), 9))
        + chunk(b"IEND", b"")
    )


def encode(linear):
    linear = np.clip(linear, 0, 1)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def grain(height, width, seed):
    """White noise from an integer hash."""
    y, x = np.mgrid[0:height, 0:width].astype(np.uint64)
    h = (x * np.uint64(374761393) + y * np.uint64(668265263) + np.uint64(seed * 974711)) & np.uint64(0xFFFFFFFF)
    h = ((h ^ (h >> np.uint64(13))) * np.uint64(1274126177)) & np.uint64(0xFFFFFFFF)
    return ((h ^ (h >> np.uint64(16))) & np.uint64(0xFFFF)).astype(float) / 65535


def clouds(height, width, cells, seed):
    """Noise that repeats over the image: bilinear value noise in a few octaves."""
    total, weight = np.zeros((height, width)), 0.0
    for octave in range(4):
        n = cells * 2**octave
        knots = grain(n, n, seed + octave)
        y = np.arange(height)[:, None] * n / height
        x = np.arange(width)[None, :] * n / width
        i, j = y.astype(int), x.astype(int)
        a, b = y - i, x - j
        a, b = a * a * (3 - 2 * a), b * b * (3 - 2 * b)
        i2, j2 = (i + 1) % n, (j + 1) % n
        total += 0.5**octave * (
            (knots[i, j] * (1 - b) + knots[i, j2] * b) * (1 - a) + (knots[i2, j] * (1 - b) + knots[i2, j2] * b) * a
        )
        weight += 0.5**octave
    return total / weight


def setts(size=320, rows=12, columns=8, joint=0.055):
    """Rows of cut stones, half a stone staggered: height, a number per stone, and the joint mask."""
    y, x = np.mgrid[0:size, 0:size] / size
    wobble = 0.012 * (clouds(size, size, 6, 5) - 0.5)
    row = np.floor((y + wobble) * rows) % rows
    shift = (row % 2) * 0.5 + 0.23 * grain(1, rows, 9)[0][row.astype(int) % rows]
    u = (x + wobble) * columns + shift
    column = np.floor(u) % columns
    fx, fy = u % 1 - 0.5, (y + wobble) * rows % 1 - 0.5
    stone = grain(rows, columns, 3)[row.astype(int), column.astype(int)]
    dx = np.maximum(np.abs(fx) - 0.5 + 0.22, 0) / columns
    dy = np.maximum(np.abs(fy) - 0.5 + 0.26, 0) / rows
    edge = np.sqrt(dx * dx + dy * dy) / (0.24 / rows)
    dome = np.clip(1.05 - edge**2.2, 0, 1)
    mask = np.clip((dome - joint) * 4, 0, 1)
    tilt = (stone - 0.5) * fx * 0.5 + (
        grain(rows, columns, 4)[row.astype(int), column.astype(int)] - 0.5
    ) * fy * 0.5
    height = dome * (0.8 + 0.25 * stone + tilt) + 0.10 * clouds(size, size, 20, 8) * mask
    return height, stone, mask


def normals(height, strength):
    dx = (np.roll(height, -1, 1) - np.roll(height, 1, 1)) * strength
    dy = (np.roll(height, 1, 0) - np.roll(height, -1, 0)) * strength  # rows run down, v runs up
    n = np.dstack([-dx, -dy, np.ones_like(height)])
    return n / np.linalg.norm(n, axis=2, keepdims=True) * 0.5 + 0.5


def drawn(strokes, width, height, scale, pen):
    """How far each pixel lies inside a pen stroke, 0..1; strokes are in units with v upward."""
    y, x = np.mgrid[0:height, 0:width]
    x, y = (x + 0.5) / scale, (height - y - 0.5) / scale
    near = np.full((height, width), 1e9)
    for stroke in strokes:
        for (ax, ay), (bx, by) in zip(stroke, stroke[1:]):
            length = (bx - ax) ** 2 + (by - ay) ** 2 or 1e-9
            t = np.clip(((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length, 0, 1)
            near = np.minimum(near, np.hypot(x - ax - t * (bx - ax), y - ay - t * (by - ay)))
    return np.clip((pen - near) * scale + 0.5, 0, 1)


def paint(base, mask, color):
    return base * (1 - mask[..., None]) + np.asarray(color) * mask[..., None]


def tea_sign(width=128, height=224):
    """The lit sign of the tea house: black ground (dark texels), a cup, steam, letters."""
    base = np.zeros((height, width, 3))
    frame = [[(6, 6), (122, 6), (122, 218), (6, 218), (6, 6)]]
    base = paint(base, drawn(frame, width, height, 1, 1.6), (0.9, 0.5, 0.08))
    letters, wide = word("TEA", 0, 0, 34)
    x0 = (width - wide) / 2
    base = paint(
        base, drawn([[(x + x0, y + 22) for x, y in s] for s in letters], width, height, 1, 4.0), (0.95, 0.75, 0.35)
    )
    y, x = np.mgrid[0:height, 0:width]
    y = height - y
    bowl = ((np.abs(x - 60) < 34 - ((96 - y).clip(0) / 22) ** 2 * 8) & (y > 84) & (y < 128)).astype(float)
    base = paint(base, bowl, (0.95, 0.2, 0.05))
    base = paint(
        base, drawn([[(94, 118), (108, 114), (108, 102), (92, 96)]], width, height, 1, 3.4), (0.95, 0.2, 0.05)
    )
    for k in (-18, 0, 18):
        steam = [[(60 + k + 5 * np.sin(t / 7.0), 136 + t) for t in range(0, 52, 3)]]
        base = paint(base, drawn(steam, width, height, 1, 2.6), (0.15, 0.65, 0.7))
    return encode(base)


def house_sign(width=256, height=112):
    """The billboard: a gold candelabra, a moon and stripes of a poster."""
    y, x = np.mgrid[0:height, 0:width]
    base = np.zeros((height, width, 3))
    sky = np.clip(1 - y / height, 0, 1)[..., None]
    base += sky * (0.02, 0.10, 0.30) + (1 - sky) * (0.55, 0.06, 0.12)
    base = paint(base, np.clip(17 - np.hypot(x - 40, y - 36), 0, 1), (0.95, 0.85, 0.6))
    base = paint(base, np.clip(14 - np.hypot(x - 47, y - 32), 0, 1), (0.05, 0.10, 0.26))
    stand, candles, flames = candelabra(206, 10, 92)
    base = paint(base, drawn(stand, width, height, 1, 2.2), (0.95, 0.62, 0.10))
    base = paint(base, drawn(candles, width, height, 1, 2.0), (0.95, 0.85, 0.65))
    base = paint(base, drawn([f + f[:1] for f in flames], width, height, 1, 3.0), (1.0, 0.80, 0.2))
    letters, wide = word("LUX TREE", 0, 0, 19)
    base = paint(
        base,
        drawn([[(px + 18, py + 20) for px, py in s] for s in letters], width, height, 1, 2.3),
        (0.98, 0.9, 0.7),
    )
    base[:5] = base[-5:] = 0
    base[:, :5] = base[:, -5:] = 0
    return encode(base)


def tram_sign(width=160, height=40):
    """Line and destination, amber on black."""
    letters, _ = word("28", 8, 8, 24, 0.35)
    more, _ = word("PORT", 72, 10, 20, 0.35)
    return encode(
        paint(np.zeros((height, width, 3)), drawn(letters + more, width, height, 1, 2.0), (1.0, 0.62, 0.12))
    )


def curtain(width=48, height=80, seed=1):
    """A lit curtain: folds, a brighter middle, a gap, a darker hem."""
    y, x = np.mgrid[0:height, 0:width] / np.array([height, width]).reshape(2, 1, 1)
    folds = 0.75 + 0.25 * np.sin(x * 40 + 2.2 * np.sin(x * 9 + seed) + 0.6 * np.sin(y * 3))
    glow = 0.35 + 0.65 * np.exp(-((x - 0.42 - 0.1 * seed) ** 2) * 7 - (y - 0.42) ** 2 * 4)
    gap = np.exp(-(((x - 0.5 - 0.025 * np.sin(y * 4)) / 0.04) ** 2)) * (seed != 2)
    level = folds * glow * (1 - 0.35 * y) + 0.55 * gap * glow
    warm = np.dstack([level, level**1.15, level**1.4])
    return encode(warm / warm.max())


def paper(width=96, height=64):
    """A paper lantern around its height: ribs of wire, a brighter belly, a brush mark."""
    y, x = np.mgrid[0:height, 0:width] / np.array([height, width]).reshape(2, 1, 1)
    ribs = 1 - 0.45 * np.clip(np.cos(y * 2 * np.pi * 11), 0, 1) ** 6
    belly = 0.30 + 0.70 * np.sin(np.pi * np.clip(y * 0.94 + 0.05, 0, 1)) ** 1.3
    level = ribs * belly * (0.94 + 0.06 * np.cos(x * 2 * np.pi * 3))
    image = np.dstack([level, level**1.25, level**1.5])
    mark = drawn(
        [[(16, 44), (32, 44)], [(24, 52), (24, 14)], [(17, 30), (31, 30)], [(18, 14), (24, 30), (30, 14)]],
        width,
        height,
        1,
        1.9,
    ) + drawn(
        [[(64, 46), (80, 46), (80, 20), (64, 20), (64, 46)], [(72, 52), (72, 12)], [(64, 33), (80, 33)]],
        width,
        height,
        1,
        1.9,
    )
    return encode(paint(image, np.clip(mark, 0, 1) * 0.85, (0.02, 0.0, 0.0)))


def sky(width=64, height=32):
    """Blue hour: deep zenith, a paler band with a rest of dusk low at u = 0, the street's end."""
    v = (np.arange(height) + 0.5) / height * np.pi  # from the zenith
    u = (np.arange(width) + 0.5) / width
    up = np.cos(v)[:, None]
    dusk = np.exp(-((up.clip(0) / 0.30) ** 2)) * (0.55 + 0.45 * np.cos(u[None, :] * 2 * np.pi))
    zenith, band, low = np.array([0.09, 0.17, 0.45]), np.array([0.26, 0.42, 0.85]), np.array([0.95, 0.60, 0.52])
    t = np.clip(up, 0, 1)[..., None] ** 0.6
    image = zenith * t + band * (1 - t) + 0.35 * low * (dusk**2)[..., None]
    image = np.where(up[..., None] < -0.02, 0.02 * band, image)
    return encode(image / image.max())


def plaster(size=192):
    """Weathered plaster: cloudy, with streaks that run down, patches, and a fine grain."""
    low = clouds(size, size, 4, 40)
    streaks = clouds(size, size, 12, 50)[:1] * 0.6 + 0.4 * clouds(size, size, 3, 60)
    patches = np.clip((clouds(size, size, 5, 70) - 0.60) * 9, 0, 1)
    level = 0.66 + 0.55 * (low - 0.5) + 0.40 * (streaks - 0.5) + 0.08 * grain(size, size, 41)
    return np.clip(level * (1 - 0.32 * patches), 0, 1)


def write_all(folder):
    height, stone, mask = setts()
    dirt = clouds(*height.shape, 5, 21)
    tone = (0.55 + 0.45 * stone) * (0.75 + 0.5 * dirt) * (0.35 + 0.65 * mask)
    tint = np.dstack([0.30 + 0.05 * stone, 0.28 + 0.01 * stone, 0.27 - 0.02 * stone])
    save(folder / "setts_color.png", encode(tint * tone[..., None]))
    save(folder / "setts_normal.png", normals(height, 2.6))
    save(
        folder / "setts_wet.png",
        np.clip(0.20 + 0.30 * clouds(*height.shape, 9, 30) * mask + 0.16 * (1 - mask), 0, 1),
    )
    save(folder / "plaster.png", encode(plaster()))
    height, stone, mask = setts(192, 24, 8, 0.2)
    brick = (0.6 + 0.5 * stone)[..., None] * np.array([0.36, 0.13, 0.08])
    mortar = np.array([0.30, 0.27, 0.23])
    save(folder / "brick.png", encode(brick * mask[..., None] + mortar * (1 - mask[..., None])))
    save(folder / "tea_sign.png", tea_sign())
    save(folder / "house_sign.png", house_sign())
    save(folder / "tram_sign.png", tram_sign())
    save(folder / "curtain_1.png", curtain(seed=1))
    save(folder / "curtain_2.png", curtain(seed=2))
    save(folder / "paper.png", paper())
    save(folder / "sky.png", sky())
