"""Homogeneous fog (`src/ingest/carriers.md`, `extras.usdFog`): a Volume prim whose own attributes
say how thick it is. Density fields have no carrier.

`candelabra:fog:extinction` is per metre whatever the stage's unit; the box is in the prim's own
space, where the node hierarchy carries units and axes.
"""

from __future__ import annotations

import numpy as np
from pxr import Usd

from .gltf_document import number, numbers
from .report import Notebook
from .stage import Frames, changes

_LARGEST = float(np.finfo(np.float32).max)
_STEEPEST = 0.9999
"""Nearest to 1 that an anisotropy is written."""


def is_fog(prim: Usd.Prim) -> bool:
    """Whether a prim may be fog."""
    return prim.GetTypeName() == "Volume" and prim.HasAttribute("candelabra:fog:extinction")


def read_fog(prim: Usd.Prim, frames: Frames, report: Notebook) -> dict | None:
    """`extras.usdFog` of a Volume; None if it has no authored extinction, or (reported) no sense."""
    reader = _Reader(prim, frames, report)
    extinction = reader.value("extinction")
    if extinction is None:
        return None
    if not ((extinction >= 0) & (extinction <= _LARGEST)).all():
        why = f"it is {extinction.tolist()} per metre; the volume is left out"
        report.warn(prim.GetPath(), "fog extinction is negative or not finite", why)
        return None
    fog: dict = {
        "extinction": numbers(extinction),
        "albedo": numbers(reader.inside("albedo", 1.0, 0.0, 1.0)),
        "anisotropy": number(reader.inside("anisotropy", 0.0, -_STEEPEST, _STEEPEST)[0]),
    }
    extent = prim.GetAttribute("extent")
    if extent and extent.HasAuthoredValue():
        box = reader.first(extent)
        corners = np.array(box if box is not None else [], dtype=np.float32)
        if corners.shape != (2, 3) or not np.isfinite(corners).all() or not (corners[0] < corners[1]).all():
            why = f"it is {corners.tolist()}; the volume is left out"
            report.warn(prim.GetPath(), "fog extent is no box", why)
            return None
        fog["min"], fog["max"] = numbers(corners[0]), numbers(corners[1])
    for field in prim.GetAuthoredPropertiesInNamespace("field"):
        if isinstance(field, Usd.Relationship) and field.GetTargets():
            why = "it has no carrier; the volume is exported as the homogeneous fog of its attributes"
            report.warn(prim.GetPath(), "density field", why)
    report.count("fog")
    return fog


class _Reader:
    """Reads attributes at the first frame; bad numbers are reported and made harmless."""

    def __init__(self, prim: Usd.Prim, frames: Frames, report: Notebook) -> None:
        self.prim, self.frames, self.report = prim, frames, report

    def first(self, attribute: Usd.Attribute):
        """Value at the first frame; one that varies is reported."""
        if changes(attribute, self.frames):
            what = f"animated {attribute.GetName()}"
            self.report.warn(self.prim.GetPath(), what, "the first frame's value is used")
        return attribute.Get(self.frames.first)

    def value(self, name: str) -> np.ndarray | None:
        """An authored number or colour, as three numbers."""
        attribute = self.prim.GetAttribute(f"candelabra:fog:{name}")
        value = self.first(attribute) if attribute and attribute.HasAuthoredValue() else None
        if value is None:
            return None
        try:
            return np.broadcast_to(np.array(value, dtype=float), 3)
        except (TypeError, ValueError):
            why = f"its type is {attribute.GetTypeName()}; it is ignored"
            self.report.warn(self.prim.GetPath(), f"candelabra:fog:{name} is no number or colour", why)
            return None

    def inside(self, name: str, fallback: float, low: float, high: float) -> np.ndarray:
        """The same, moved into a range."""
        value = self.value(name)
        if value is None:
            return np.full(3, fallback)
        inside = np.clip(np.nan_to_num(value, nan=fallback), low, high)
        if not np.array_equal(inside, value):
            why = f"{value.tolist()} is not in [{low:g}, {high:g}]; {inside.tolist()} is used"
            self.report.warn(self.prim.GetPath(), f"candelabra:fog:{name} out of range", why)
        return inside
