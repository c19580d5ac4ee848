"""How strong a normalized light is between two keys, if it grows or shrinks there.

Its power is even, so its radiance goes as one over its area. A straight line between the radiance of two keys
is far above that: a lamp that grows to twice its radius would have 1.4 times its power half-way, and one that grows from
nothing any power at all. It shows while a shutter is open.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from .stage import Frames
from .transforms import between

_STEP = 1.1
"""The growth in radius from key to key: its power is less than 1 % too large in between."""


def keys_of_growth(
    frames: Frames, normalize: np.ndarray, world: np.ndarray, area_of: Callable[[np.ndarray], float], nits: np.ndarray
) -> dict[float, np.ndarray]:
    """Radiance at time codes between those that are sampled, for a light at `world` (times, 4, 4) of radiance
    `nits` (times, 3), where `normalize`, () or (times,), says so. `area_of` is the area under a linear map (3, 3)."""
    if not (frames.shutters and np.any(normalize)) or world.ndim == 2 or nits.ndim == 1:
        return {}
    found = {}
    areas = np.array([area_of(matrix[:3, :3]) for matrix in world])
    divided = np.broadcast_to(normalize, len(areas)) & (areas > 0)
    for at in np.flatnonzero(divided[1:] & divided[:-1]):
        start, end = np.sqrt(areas[at : at + 2])
        steps = math.ceil(abs(math.log(end / start)) / math.log(_STEP))
        radius = start * (end / start) ** (np.arange(1, steps) / max(steps, 1))
        share = (radius - start) / (end - start) if steps > 1 else radius
        ways = (np.repeat(world[[at + side]], len(share), axis=0) for side in (0, 1))
        power = nits[at : at + 2] * areas[at : at + 2, None]
        for part, matrix in zip(share, between(*ways, share), strict=True):
            code = frames.codes[at] + part * (frames.codes[at + 1] - frames.codes[at])
            found[code] = (power[0] + part * (power[1] - power[0])) / area_of(matrix[:3, :3])
    return found
