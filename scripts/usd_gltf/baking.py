"""Light of any range in a PNG of eight bits, with one factor for each channel.

glTF's textures are codes in [0, 1]; a factor takes the range out. Between two codes the rounding is
dithered in linear light, so that every neighbourhood keeps its mean however dark it is beside the
brightest texel, and the factor is corrected so that the picture's total is exact in each channel.
What is left is grain: the mean change of a texel, over the mean texel.
"""

from __future__ import annotations

import io
from dataclasses import dataclass

import numpy as np
from PIL import Image

from .pictures import linear_from_srgb

_LEVELS = linear_from_srgb(np.arange(256) / 255.0)
COARSE = 0.1
"""Grain above which a picture is reported as coarser than it was."""


@dataclass
class Baked:
    """PNG bytes whose decoded texels times `factor` are the light."""

    png: bytes
    factor: np.ndarray
    grain: float


def bake(light: np.ndarray) -> Baked:
    """Encode linear light, (h, w, 3), not negative."""
    light = np.asarray(light, dtype=float)
    top = light.max(axis=(0, 1))
    value = light / np.where(top > 0, top, 1.0)
    below = np.clip(np.searchsorted(_LEVELS, value, side="right") - 1, 0, 254)
    share = (value - _LEVELS[below]) / (_LEVELS[below + 1] - _LEVELS[below])
    code = below + (share > _thresholds(*light.shape[:2])[:, :, None])
    kept = _LEVELS[code]
    total, kept_total = value.sum(axis=(0, 1)), kept.sum(axis=(0, 1))
    correction = np.where(kept_total > 0, total / np.where(kept_total > 0, kept_total, 1.0), 1.0)
    change = np.abs(kept * correction - value).sum(axis=(0, 1))
    grain = float((change / np.where(total > 0, total, 1.0)).max())
    return Baked(png_bytes(code / 255.0), top * correction, grain)


def _thresholds(height: int, width: int) -> np.ndarray:
    """Numbers in (0, 1), spread evenly over every neighbourhood: Jimenez's interleaved gradient
    noise (SIGGRAPH 2014 course on Call of Duty's post-processing)."""
    y, x = np.mgrid[:height, :width]
    noise = np.mod(52.9829189 * np.mod(0.06711056 * x + 0.00583715 * y, 1.0), 1.0)
    return np.clip(noise, 1e-6, 1 - 1e-6)


def png_bytes(texels: np.ndarray) -> bytes:
    """RGB or, where it is needed, RGBA codes in [0, 1] as a PNG."""
    eight = np.round(texels * 255).astype(np.uint8)
    if eight.shape[2] == 4 and (eight[:, :, 3] == 255).all():
        eight = eight[:, :, :3]
    buffer = io.BytesIO()
    Image.fromarray(eight).save(buffer, format="PNG")
    return buffer.getvalue()
