"""Pictures as arrays, and how far one lies from another."""

import math
import struct
import zlib
from pathlib import Path

import numpy as np

WEIGHTS = np.array((0.2126, 0.7152, 0.0722))
BLOCK = 8


def luminance(picture):
    return picture @ WEIGHTS


def read_exr(path):
    """Red, green and blue of an EXR, height x width x 3. Wants mitsuba."""
    import mitsuba

    bitmap = mitsuba.Bitmap(str(path))
    names = [field.name for field in bitmap.struct_()]
    rows = np.array(bitmap, dtype=np.float64)
    return np.stack([rows[..., names.index(part)] for part in "RGB"], axis=-1)


def write_png(path, rows):
    """Eight bits, height x width x 4."""
    height, width, _ = rows.shape
    lines = b"".join(b"\0" + np.ascontiguousarray(row, "u1").tobytes() for row in rows)
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    head = struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)
    Path(path).write_bytes(
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(lines)) + chunk(b"IEND", b"")
    )


def blocks(picture):
    """Means over blocks of 8x8 pixels."""
    height, width = (size - size % BLOCK for size in picture.shape[:2])
    cut = picture[:height, :width]
    return cut.reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK, -1).mean(axis=(1, 3))


def compared(ours, theirs):
    """Two stacks of independent pictures of the same thing, runs x height x width x 3.

    `ratio` is that of the means and `error` its standard error, `channels` the ratios of red, green and blue,
    `rms` what differs beyond noise as a share of the light (the root of relMSE less what both pictures' noise adds
    to it; 0 if the noise explains all), `z` the root mean square of the blocks' differences over their standard
    errors (1 where both agree), `worst` the largest, `worst_ratio` the ratio of the means of that block.
    """
    ours, theirs = np.asarray(ours, float), np.asarray(theirs, float)
    light = [luminance(stack) for stack in (ours, theirs)]
    means = [stack.mean(axis=(1, 2)) for stack in light]
    ratio = means[0].mean() / means[1].mean()
    relative = sum(one.var(ddof=1) / len(one) / one.mean() ** 2 for one in means)
    a, b = (stack.mean(axis=0) for stack in light)
    noise = sum(stack.var(axis=0, ddof=1) / len(stack) for stack in light)
    scale = b**2 + (0.01 * b.mean()) ** 2
    beyond = np.mean(((a - b) ** 2 - noise) / scale)
    tiles = [np.stack([blocks(one)[..., 0] for one in stack]) for stack in light]
    spread = sum(tile.var(axis=0, ddof=1) / len(tile) for tile in tiles)
    is_lit = spread > 0
    away = (tiles[0].mean(axis=0) - tiles[1].mean(axis=0))[is_lit] / np.sqrt(spread[is_lit])
    at = np.abs(away).argmax()
    pair = [tile.mean(axis=0)[is_lit][at] for tile in tiles]
    channels = ours.mean(axis=(0, 1, 2)) / theirs.mean(axis=(0, 1, 2))
    return {
        "ratio": float(ratio),
        "error": float(ratio * math.sqrt(relative)),
        "channels": channels.tolist(),
        "rms": math.sqrt(max(0.0, float(beyond))),
        "z": float(np.sqrt(np.mean(away**2))),
        "worst": float(away[at]),
        "worst_ratio": float(pair[0] / pair[1]),
    }
