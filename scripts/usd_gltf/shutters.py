"""When the shutters of a stage's cameras are open, and which time codes that asks to be sampled."""

from __future__ import annotations

import math

import numpy as np
from pxr import Usd, UsdGeom

_LONGEST = 10_000.0
"""Frames before or after its own. What reaches further is taken for an error: each frame of it would be sampled."""

Shutter = tuple[float, float]
"""Time codes relative to the frame: when it opens and when it closes."""


def authored_shutter(camera: UsdGeom.Camera, code: float) -> Shutter | None:
    """What the stage says at a time code; None if it says nothing."""
    attributes = camera.GetShutterOpenAttr(), camera.GetShutterCloseAttr()
    if not any(attribute.HasAuthoredValue() for attribute in attributes):
        return None
    values = (attribute.Get(code) for attribute in attributes)
    opens, closes = (0.0 if value is None else float(value) for value in values)
    return opens, closes


def is_interval(shutter: Shutter) -> bool:
    """Whether the shutter is open for some time, all of it within reason."""
    opens, closes = shutter
    return math.isfinite(opens) and math.isfinite(closes) and -_LONGEST <= opens < closes <= _LONGEST


def open_codes(shutter: Shutter, frames: np.ndarray) -> np.ndarray:
    """Time codes at which a shutter around each of some successive frames opens, closes, or is open at quarters
    of a frame. (From key to key a rotation takes the short way: quarters tell turns of up to twice a frame.)"""
    opens, closes = shutter
    if closes - opens < 1:
        quarters = np.arange(math.ceil(4 * opens), math.floor(4 * closes) + 1) / 4
        return np.add.outer(frames, [opens, *quarters, closes]).reshape(-1)
    length = frames[-1] - frames[0]
    quarters = frames[0] + np.arange(math.ceil(4 * opens), math.floor(4 * (length + closes)) + 1) / 4
    return np.concatenate([frames + opens, quarters, frames + closes])


def stage_shutters(prims: Usd.PrimRange, code: float) -> tuple[Shutter, ...]:
    """The different shutters of all cameras among some prims, ascending."""
    cameras = (UsdGeom.Camera(prim) for prim in prims if prim.IsA(UsdGeom.Camera))
    found = {authored_shutter(camera, code) for camera in cameras} - {None}
    return tuple(sorted(filter(is_interval, found)))
