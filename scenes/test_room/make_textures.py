#!/usr/bin/env python3
"""Writes the two tiny PNGs of the test room. `test_room.usda` is written by hand.

python scenes/test_room/make_textures.py
"""

import struct
import zlib
from pathlib import Path


def save(path, rows):
    """8-bit RGB; `rows` of (r, g, b) in 0..255, the top row first."""

    def chunk(tag, body):
        return struct.pack(">I", len(body)) + tag + body + struct.pack(">I", zlib.crc32(tag + body))

    data = b"".join(b"\0" + bytes(c for texel in row for c in texel) for row in rows)
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", struct.pack(">IIBBBBB", len(rows[0]), len(rows), 8, 2, 0, 0, 0))
        + chunk(b"IDAT", zlib.compress(data, 9))
        + chunk(b"IEND", b"")
    )


def panel(x, y):
    """Red, green, blue and white quarters, upper left first; the rim and the middle are black: dark texels."""
    if x in (0, 7) or y in (0, 7) or (x in (3, 4) and y in (3, 4)):
        return (0, 0, 0)
    return [[(255, 60, 40), (60, 255, 80)], [(60, 90, 255), (255, 255, 255)]][y // 4][x // 4]


def sky(x, y):
    """Blue above, dark below the horizon, one warm texel low in the middle."""
    if (x, y) == (4, 3):
        return (255, 190, 120)
    return (90, 130, 220) if y < 4 else (20, 20, 24)


if __name__ == "__main__":
    folder = Path(__file__).resolve().parent
    save(folder / "panel.png", [[panel(x, y) for x in range(8)] for y in range(8)])
    save(folder / "sky.png", [[sky(x, y) for x in range(8)] for y in range(8)])
