"""When the shutters of a stage's cameras are open, and which time codes that asks to be sampled."""

from __future__ import annotations

import math

from pxr import Usd, UsdGeom

_LONGEST = 10_000.0
"""Frames. What is open longer is taken for an error: each frame of it would be sampled."""

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


def stage_shutters(prims: Usd.PrimRange, code: float) -> tuple[Shutter, ...]:
    """The different shutters of all cameras among some prims, ascending."""
    cameras = (UsdGeom.Camera(prim) for prim in prims if prim.IsA(UsdGeom.Camera))
    found = {authored_shutter(camera, code) for camera in cameras} - {None}
    return tuple(sorted(filter(is_interval, found)))
