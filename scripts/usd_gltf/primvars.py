"""Primvars and normals as values for each face corner, whatever their interpolation."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from pxr import Usd, UsdGeom

from .report import Notebook
from .stage import Frames, changes


@dataclass
class CornerValues:
    """`values[index[c]]` belongs to face corner `c`."""

    values: np.ndarray
    index: np.ndarray
    constant: bool = False
    interpolation: str = ""
    indexed: bool = False
    """Whether the author gave indices, which then say where face-varying values are one."""
    exact: bool = False
    """Whether equal values have equal indices, so that indices alone tell vertices apart."""


def as_rows(value, width: int, kind: type = float) -> np.ndarray:
    """A USD array as rows of `width` numbers (a plain vector for width 1); empty if it is no such
    thing, which a layer may author against the schema."""
    try:
        found = np.array(value if value is not None else [], dtype=kind).reshape(-1, width)
    except (TypeError, ValueError, OverflowError):
        found = np.zeros((0, width), kind)
    return found[:, 0] if width == 1 else found


def spread(
    values: np.ndarray,
    interpolation: str,
    indices: np.ndarray | None,
    counts: np.ndarray,
    corners: np.ndarray,
    varying: int | None = None,
) -> CornerValues | None:
    """Spread values over face corners; None if there are too few of them. Of curves, corners are control vertices, faces whole curves,
    and there are so many `varying` values, which are left by themselves."""
    if interpolation == "constant":
        index = np.zeros(len(corners), int)
    elif interpolation == "uniform":
        index = np.repeat(np.arange(len(counts)), counts)
    elif interpolation == "faceVarying":
        index = np.arange(len(corners))
    elif interpolation == "varying" and varying is not None:
        index = np.arange(varying)
    else:
        index = corners
    if indices is not None:
        if len(index) and index.max() >= len(indices):
            return None
        index = indices[index]
    if len(index) and (index.max() >= len(values) or index.min() < 0):
        return None
    return CornerValues(values, index, interpolation == "constant", interpolation, indices is not None)


def read_primvar(
    prim: Usd.Prim,
    name: str,
    width: int,
    code: float,
    counts: np.ndarray,
    corners: np.ndarray,
    report: Notebook,
    frames: Frames | None = None,
    varying: int | None = None,
) -> CornerValues | None:
    """The primvar `name` (inherited ones too) with `width` numbers a value; None if there is none. It is reported if
    it differs between two of the `frames`, which are left out where it is read at each of them."""
    primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(name)
    if not primvar or not primvar.HasValue():
        return None
    if frames is not None and (changes(primvar.GetAttr(), frames) or changes(primvar.GetIndicesAttr(), frames)):
        report.about("animation").warn(prim.GetPath(), f"animated primvars:{name}", "the first frame's values are used")
    interpolation = primvar.GetInterpolation()
    values = as_rows(primvar.Get(code), width).reshape(-1, width)
    indices = as_rows(primvar.GetIndices(code), 1, int) if primvar.IsIndexed() else None
    found = spread(values, interpolation, indices, counts, corners, varying)
    if found is None:
        why = f"{primvar.GetTypeName()} with too few {interpolation} values; left out"
        report.warn(prim.GetPath(), f"primvars:{name} does not fit its mesh", why)
        return None
    return finite(found)


def normals_may_vary(prim: Usd.Prim) -> bool:
    """Whether what `read_normals` finds may depend on the time."""
    primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance("normals")
    if primvar and primvar.HasValue():
        return primvar.ValueMightBeTimeVarying()
    attribute = prim.GetAttribute("normals")
    return bool(attribute) and attribute.ValueMightBeTimeVarying()


def normals_vary(prim: Usd.Prim, frames: Frames) -> bool:
    """Whether what `read_normals` finds differs between two of the frames."""
    if not normals_may_vary(prim):
        return False
    primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance("normals")
    if primvar and primvar.HasValue():
        return changes(primvar.GetAttr(), frames) or changes(primvar.GetIndicesAttr(), frames)
    return changes(prim.GetAttribute("normals"), frames)


def read_normals(
    prim: Usd.Prim,
    code: float,
    counts: np.ndarray,
    corners: np.ndarray,
    report: Notebook,
    frames: Frames | None = None,
    varying: int | None = None,
) -> CornerValues | None:
    """`primvars:normals`, else the `normals` attribute of a point-based prim."""
    found = read_primvar(prim, "normals", 3, code, counts, corners, report, frames, varying)
    if found is not None:
        return found
    attribute = prim.GetAttribute("normals")
    values = as_rows(attribute.Get(code) if attribute else None, 3)
    if not len(values):
        return None
    interpolation = UsdGeom.PointBased(prim).GetNormalsInterpolation()
    found = spread(values, interpolation, None, counts, corners, varying)
    if found is None:
        report.warn(prim.GetPath(), "normals do not fit their mesh", f"too few {interpolation} values; left out")
        return None
    return finite(found)


def finite(found: CornerValues) -> CornerValues:
    """The same with 0 for what is not finite (or overflows single precision)."""
    good = np.isfinite(found.values) & (np.abs(found.values) < 3e38)
    return replace(found, values=np.where(good, found.values, 0.0))
