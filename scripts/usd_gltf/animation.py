"""What varies over time as keys, and only where something varies.

Values are sampled at the time codes of `Frames.codes`: at each frame, and where a camera has a shutter, when it
opens and closes, and at quarters of a frame in between. A frame between the first and the last change has a key. Other time codes have one only
where what they show is not what is between their neighbours: authored samples between frames, turns of
half a circle and more, motion before the first frame and after the last.
"""

from __future__ import annotations

import numpy as np

from .gltf_document import Document, numbers
from .stage import Frames
from .transforms import continuous, slerp

_WIDTHS = {"translation": 3, "rotation": 4, "scale": 3}
NOISE = 1e-6
"""Single precision's, relative to the values that it is about."""
_NOTHING = 1e-12
"""The same where these are 0."""


def varies(values: np.ndarray) -> bool:
    """Whether rows of `values` differ by more than single precision's noise."""
    return len(values) > 1 and not np.allclose(values, values[0], rtol=NOISE, atol=1e-9)


def needed(frames: Frames, values: np.ndarray, turns: bool = False) -> np.ndarray:
    """Rows of `values`, one for each time code of `frames`, that must be keys for linear interpolation to
    show all rows: those of all frames, and others. `turns` says that they are unit quaternions."""
    kept = frames.is_number.copy()
    if kept.all():
        return np.arange(len(values))
    fixed = kept.copy()
    fixed[[0, -1]] = True
    at = np.flatnonzero(fixed)
    span = np.minimum(np.searchsorted(at, np.arange(len(values)), side="right"), len(at) - 1)
    before, after = at[span - 1], at[span]
    codes = np.array(frames.codes)
    share = ((codes - codes[before]) / (codes[after] - codes[before]))[:, None]
    if turns:
        shown = slerp(values[before], values[after], share)
        shown *= np.where(np.einsum("ni,ni->n", shown, values) < 0, -1.0, 1.0)[:, None]
    else:
        shown = values[before] + share * (values[after] - values[before])
    size = np.abs(values).max(axis=1)
    noise = NOISE * np.maximum(size[before], size[after]) + _NOTHING
    kept |= np.isin(span, span[np.abs(shown - values).max(axis=1) > noise])
    # What comes before the first frame and after the last is held there.
    for end, inner in ((0, at[1]), (-1, at[-2])):
        held = values[: inner + 1] if end == 0 else values[inner:]
        kept[end] |= np.abs(held - values[inner]).max() > noise[end]
    return np.flatnonzero(kept)


def strength_keys(
    frames: Frames, rgb: np.ndarray, between: dict[float, np.ndarray] | None = None, is_mostly_dark: bool = False
) -> dict:
    """`extras.usdLux.values`: strengths (n, 3), one for each time code of `frames`, and those at codes `between`. Of a
    light that `is_mostly_dark` keys at which it is dark amid others are left out."""
    keys = needed(frames, rgb)
    if is_mostly_dark:
        dark = np.concatenate([[True], ~rgb[keys].any(axis=1), [True]])
        keys = keys[~(dark[:-2] & dark[1:-1] & dark[2:])]
    rows = {frames.codes[key]: rgb[key] for key in keys}
    # The sampled ones are kept where 32 bits cannot tell times apart.
    seconds = {np.float32(frames.seconds_at(code)): row for code, row in [*(between or {}).items(), *rows.items()]}
    times = sorted(seconds)
    return {"times": numbers(times), "rgb": [numbers(seconds[time]) for time in times]}


def animate(document: Document, node: int, frames: Frames, tracks: dict[str, np.ndarray]) -> int:
    """Add LINEAR channels to `node` for the tracks (one row for each time code of `frames`) that vary.

    Keys go from the last one before the first change to the first one after the last; outside glTF holds the ends.
    Returns how many channels were added.
    """
    added = 0
    for path, values in tracks.items():
        if not varies(values):
            continue
        keys = needed(frames, values, turns=path == "rotation")
        values = continuous(values[keys]) if path == "rotation" else values[keys]
        moving = np.flatnonzero(np.any(values[1:] != values[:-1], axis=1))
        used = slice(moving[0], moving[-1] + 2)
        sampler = {
            "input": document.accessor(frames.seconds[keys[used]].astype(np.float32), bounds=True),
            "interpolation": "LINEAR",
            "output": document.accessor(values[used].astype(np.float32).reshape(-1, _WIDTHS[path])),
        }
        document.animation["samplers"].append(sampler)
        index = len(document.animation["samplers"]) - 1
        document.animation["channels"].append({"sampler": index, "target": {"node": node, "path": path}})
        added += 1
    return added
