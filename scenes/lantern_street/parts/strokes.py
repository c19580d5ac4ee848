"""A stroke alphabet: each letter is a few polylines in a cell 1 wide and 1.5 high. Bent into neon, drawn on signs."""

from .shapes import arc, rounded

LETTERS = {
    "A": [[(0, 0), (0.5, 1.5), (1, 0)], [(0.2, 0.55), (0.8, 0.55)]],
    "B": [
        [(0, 0), (0, 1.5), (0.55, 1.5), (0.88, 1.3), (0.88, 1.0), (0.55, 0.8), (0, 0.8)],
        [(0.55, 0.8), (1, 0.6), (1, 0.2), (0.6, 0), (0, 0)],
    ],
    "C": [[(1, 1.2), (0.75, 1.5), (0.3, 1.5), (0, 1.2), (0, 0.3), (0.3, 0), (0.75, 0), (1, 0.3)]],
    "D": [[(0, 0), (0, 1.5), (0.55, 1.5), (1, 1.15), (1, 0.35), (0.55, 0), (0, 0)]],
    "E": [[(1, 1.5), (0, 1.5), (0, 0), (1, 0)], [(0, 0.78), (0.8, 0.78)]],
    "F": [[(1, 1.5), (0, 1.5), (0, 0)], [(0, 0.78), (0.8, 0.78)]],
    "H": [[(0, 0), (0, 1.5)], [(1, 0), (1, 1.5)], [(0, 0.78), (1, 0.78)]],
    "I": [[(0.5, 0), (0.5, 1.5)]],
    "K": [[(0, 0), (0, 1.5)], [(1, 1.5), (0.05, 0.72), (1, 0)]],
    "L": [[(0, 1.5), (0, 0), (0.95, 0)]],
    "M": [[(0, 0), (0, 1.5), (0.5, 0.6), (1, 1.5), (1, 0)]],
    "N": [[(0, 0), (0, 1.5), (1, 0), (1, 1.5)]],
    "O": [[(0.3, 0), (0, 0.3), (0, 1.2), (0.3, 1.5), (0.7, 1.5), (1, 1.2), (1, 0.3), (0.7, 0), (0.3, 0)]],
    "P": [[(0, 0), (0, 1.5), (0.6, 1.5), (1, 1.3), (1, 0.95), (0.6, 0.72), (0, 0.72)]],
    "R": [[(0, 0), (0, 1.5), (0.6, 1.5), (1, 1.3), (1, 0.95), (0.6, 0.72), (0, 0.72)], [(0.5, 0.72), (1, 0)]],
    "S": [
        [
            (1, 1.25),
            (0.75, 1.5),
            (0.25, 1.5),
            (0, 1.25),
            (0, 1.0),
            (0.25, 0.8),
            (0.75, 0.7),
            (1, 0.5),
            (1, 0.25),
            (0.75, 0),
            (0.25, 0),
            (0, 0.25),
        ]
    ],
    "T": [[(0, 1.5), (1, 1.5)], [(0.5, 1.5), (0.5, 0)]],
    "U": [[(0, 1.5), (0, 0.35), (0.3, 0), (0.7, 0), (1, 0.35), (1, 1.5)]],
    "X": [[(0, 0), (1, 1.5)], [(0, 1.5), (1, 0)]],
    "2": [[(0, 1.2), (0.25, 1.5), (0.75, 1.5), (1, 1.2), (1, 1.0), (0, 0), (1, 0)]],
    "8": [
        [
            (0.5, 0.8),
            (0.1, 1.0),
            (0.1, 1.3),
            (0.3, 1.5),
            (0.7, 1.5),
            (0.9, 1.3),
            (0.9, 1.0),
            (0.5, 0.8),
            (0, 0.5),
            (0, 0.2),
            (0.25, 0),
            (0.75, 0),
            (1, 0.2),
            (1, 0.5),
            (0.5, 0.8),
        ]
    ],
    " ": [],
}


def letter(name, x, y, height):
    """Its strokes with the lower left corner at (x, y)."""
    s = height / 1.5
    return [
        [(x + s * px, y + s * py) for px, py in (rounded(stroke) if len(stroke) > 2 else stroke)]
        for stroke in LETTERS[name]
    ]


def word(text, x, y, height, gap=0.45):
    """Letters side by side, beginning at x; returns the strokes and the width."""
    s, out = height / 1.5, []
    for i, name in enumerate(text):
        out += letter(name, x + i * s * (1 + gap), y, height)
    return out, s * (len(text) * (1 + gap) - gap)


def candelabra(x, y, size):
    """The five-armed stand of the house sign: (stand, candles, flames) around x, from y upward, `size` high."""
    s = size / 100
    stand = [[(x - 16 * s, y), (x + 16 * s, y)], [(x, y), (x, y + 58 * s)]]
    for reach, drop in ((17, 20), (34, 30)):
        for side in (-1, 1):
            bowl = arc(
                x + side * reach * s / 2,
                y + (55 - drop * 0.45) * s,
                reach * s / 2,
                180 if side > 0 else 0,
                360 if side > 0 else -180,
                14,
                drop * 0.9 / reach,
            )
            stand.append(bowl + [(x + side * reach * s, y + 58 * s)])
    candles, flames = [], []
    for k in (-2, -1, 0, 1, 2):
        cx, foot = x + 17 * k * s, y + 58 * s
        top = foot + (18 if k else 24) * s
        stand.append([(cx - 4.5 * s, foot), (cx + 4.5 * s, foot)])
        candles.append(
            [(cx - 2.2 * s, foot + 3 * s), (cx - 2.2 * s, top), (cx + 2.2 * s, top), (cx + 2.2 * s, foot + 3 * s)]
        )
        flame = rounded(
            [(cx, top + 3 * s), (cx + 3.2 * s, top + 7 * s), (cx, top + 15 * s), (cx - 3.2 * s, top + 7 * s)],
            3,
            closed=True,
        )
        flames.append(flame)
    return stand, candles, flames
