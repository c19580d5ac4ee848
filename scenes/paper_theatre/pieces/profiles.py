"""Photometric files (LM-63-2002, type C): a profile spot, and the wall washer at the pillars' feet."""

import math


def spot(v, h):
    """A theatre's profile spot: 5,000 candela, flat within 9 degrees, with a soft edge."""
    return 5000 / (1 + math.exp((v - 10.5) / 0.9)) + 40 * math.cos(math.radians(v)) ** 2


def washer(v, h):
    """Two lobes, as a wall washer's reflector throws them: up, and aside at 38 degrees, wider along h = 90."""
    aside = math.exp(-(((v - 38) / 13) ** 2)) * (0.25 + 0.75 * abs(math.sin(math.radians(h))))
    return 30 * math.exp(-((v / 9) ** 2)) + 20 * aside


PROFILES = {"profile_spot": (spot, 1.5, (0,)), "wall_washer": (washer, 5.0, (0, 30, 60, 90))}


def write(folder):
    for name, (candela, step, horizontal) in PROFILES.items():
        vertical = [step * i for i in range(round(90 / step) + 1)]
        lines = [
            "IESNA:LM-63-2002",
            f"[TEST] {name}",
            "[TESTLAB] none: written by scenes/paper_theatre/make.py",
            "TILT=NONE",
            f"1 -1 1 {len(vertical)} {len(horizontal)} 1 2 0 0 0",
            "1 1 0",
            *_wrapped(vertical),
            *_wrapped(horizontal),
        ]
        for h in horizontal:
            lines += _wrapped([candela(v, h) for v in vertical])
        path = folder / "profiles" / f"{name}.ies"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("\r\n".join(lines) + "\r\n", encoding="ascii", newline="")


def _wrapped(numbers, width=12):
    texts = [f"{number:.4g}" for number in numbers]
    return [" ".join(texts[i : i + width]) for i in range(0, len(texts), width)]
