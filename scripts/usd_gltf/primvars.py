"""Primvars and normals as values for each face corner, whatever their interpolation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pxr import Usd, UsdGeom

from .report import Report


@dataclass
class CornerValues:
    """`values[index[c]]` belongs to face corner `c`."""

    values: np.ndarray
    index: np.ndarray
    constant: bool = False


def spread(
    values: np.ndarray, interpolation: str, indices: np.ndarray | None, counts: np.ndarray, corners: np.ndarray
) -> CornerValues | None:
    """Spread values over face corners; None if there are too few of them."""
    if interpolation == "constant":
        index = np.zeros(len(corners), int)
    elif interpolation == "uniform":
        index = np.repeat(np.arange(len(counts)), counts)
    elif interpolation == "faceVarying":
        index = np.arange(len(corners))
    else:
        index = corners
    if indices is not None:
        if len(index) and index.max() >= len(indices):
            return None
        index = indices[index]
    if len(index) and (index.max() >= len(values) or index.min() < 0):
        return None
    return CornerValues(values, index, interpolation == "constant")


def read_primvar(
    prim: Usd.Prim, name: str, width: int, code: float, counts: np.ndarray, corners: np.ndarray, report: Report
) -> CornerValues | None:
    """The primvar `name` (inherited ones too) with `width` numbers a value; None if there is none."""
    primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(name)
    if not primvar or not primvar.HasValue():
        return None
    if primvar.ValueMightBeTimeVarying() and primvar.GetAttr().GetNumTimeSamples() > 1:
        report.warn(prim.GetPath(), f"animated primvars:{name}", "the first frame's values are used")
    raw = primvar.Get(code)
    interpolation = primvar.GetInterpolation()
    try:
        values = np.array(raw, dtype=float).reshape(-1, width)
    except (TypeError, ValueError):
        report.warn(prim.GetPath(), f"primvars:{name} of an unexpected type", f"{primvar.GetTypeName()}; left out")
        return None
    indices = np.array(primvar.GetIndices(code), dtype=int) if primvar.IsIndexed() else None
    found = spread(values, interpolation, indices, counts, corners)
    if found is None:
        report.warn(prim.GetPath(), f"primvars:{name} does not fit its mesh", f"too few {interpolation} values; left out")
        return None
    return finite(found)


def read_normals(
    prim: Usd.Prim, code: float, counts: np.ndarray, corners: np.ndarray, report: Report
) -> CornerValues | None:
    """`primvars:normals`, else the `normals` attribute of a point-based prim."""
    found = read_primvar(prim, "normals", 3, code, counts, corners, report)
    if found is not None:
        return found
    attribute = prim.GetAttribute("normals")
    raw = attribute.Get(code) if attribute else None
    if raw is None or len(raw) == 0:
        return None
    interpolation = UsdGeom.PointBased(prim).GetNormalsInterpolation()
    found = spread(np.array(raw, dtype=float).reshape(-1, 3), interpolation, None, counts, corners)
    if found is None:
        report.warn(prim.GetPath(), "normals do not fit their mesh", f"too few {interpolation} values; left out")
        return None
    return finite(found)


def finite(found: CornerValues) -> CornerValues:
    """The same with 0 for what is not finite (or overflows single precision)."""
    good = np.isfinite(found.values) & (np.abs(found.values) < 3e38)
    return CornerValues(np.where(good, found.values, 0.0), found.index, found.constant)
