"""Time-sampled transforms as glTF animation channels, and only where something moves."""

from __future__ import annotations

import numpy as np

from .gltf_document import Document
from .transforms import continuous

_WIDTHS = {"translation": 3, "rotation": 4, "scale": 3}


def varies(values: np.ndarray) -> bool:
    """Whether rows of `values` differ by more than single precision's noise."""
    return len(values) > 1 and not np.allclose(values, values[0], rtol=1e-6, atol=1e-9)


def animate(document: Document, node: int, seconds: np.ndarray, tracks: dict[str, np.ndarray]) -> int:
    """Add LINEAR channels to `node` for the tracks (one row for each frame) that vary.

    One key for each frame between the first and the last change; outside glTF holds the ends.
    Returns how many channels were added.
    """
    added = 0
    for path, values in tracks.items():
        if not varies(values):
            continue
        if path == "rotation":
            values = continuous(values)
        moving = np.flatnonzero(np.any(values[1:] != values[:-1], axis=1))
        keys = slice(moving[0], moving[-1] + 2)
        sampler = {
            "input": document.accessor(seconds[keys].astype(np.float32), bounds=True),
            "interpolation": "LINEAR",
            "output": document.accessor(values[keys].astype(np.float32).reshape(-1, _WIDTHS[path])),
        }
        document.animation["samplers"].append(sampler)
        index = len(document.animation["samplers"]) - 1
        document.animation["channels"].append({"sampler": index, "target": {"node": node, "path": path}})
        added += 1
    return added
