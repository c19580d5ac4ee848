"""Where Arnold's own parameters put a camera or a light that has no transform ops.

Arnold's cameras and lights stand at `position` and look at `look_at` with `up` up, or shine along `direction`, and then
their matrix moves them. arnold-usd writes these parameters, and reads them (`ReadArnoldParameters`); a stage that was
converted from Arnold's own format has nothing else. Like all of Arnold's parameters they count where USD's
own attributes say nothing: here where there is no op.
"""

from __future__ import annotations

import numpy as np
from pxr import Gf, Usd, UsdGeom

from .light_attributes import arnold_names
from .primvars import as_rows
from .report import Notebook
from .transforms import column

_PARAMETERS = {
    "Camera": ("position", "look_at", "up"), "SphereLight": ("position", "look_at", "up"), "DistantLight": ("direction",),
}  # fmt: skip
_DEFAULTS = {"position": (0.0, 0.0, 0.0), "look_at": (0.0, 0.0, -1.0), "direction": (0.0, 0.0, -1.0), "up": (0.0, 1.0, 0.0)}


def placement_names(prim: Usd.Prim) -> set[str]:
    """The attributes that `placement` reads of a prim."""
    if UsdGeom.Xformable(prim).GetOrderedXformOps():
        return set()
    return {name for parameter in _PARAMETERS.get(str(prim.GetTypeName()), ()) for name in arnold_names(parameter)}


def placement(prim: Usd.Prim, code: float, report: Notebook) -> np.ndarray | None:
    """The matrix (4, 4) of the parameters; None if they are not authored, do not count, or are none (reported)."""
    names = placement_names(prim)
    said = {p: _vector(prim, p, code) for p in _PARAMETERS.get(str(prim.GetTypeName()), ()) if names}
    if all(value is None or value == _DEFAULTS[p] for p, value in said.items()):
        return None
    at = {name: Gf.Vec3d(*(said.get(name) or default)) for name, default in _DEFAULTS.items()}
    ahead = at["direction"] if "direction" in said else at["look_at"] - at["position"]
    what = f"Arnold's {', '.join(p for p, value in said.items() if value is not None)}"
    # Of a distant light nothing is up.
    up = min((at["up"], Gf.Vec3d(0, 0, 1)), key=lambda v: abs(v * ahead)) if "direction" in said else at["up"]
    if not ahead.GetLength() > 0 or not Gf.Cross(ahead, up).GetLength() > 1e-9 * ahead.GetLength() * up.GetLength():
        report.warn(prim.GetPath(), what, f"along {ahead} with {up} up there is no view; they are ignored")
        return None
    report.note(prim.GetPath(), what, "they place it, for it has no transform of its own")
    view = Gf.Matrix4d().SetLookAt(at["position"], at["position"] + ahead, up)
    return column(view.GetInverse())


def _vector(prim: Usd.Prim, parameter: str, code: float) -> tuple[float, float, float] | None:
    for name in arnold_names(parameter):
        attribute = prim.GetAttribute(name)
        value = attribute.Get(code) if attribute and attribute.HasAuthoredValue() else None
        rows = as_rows(value, 3) if value is not None else np.zeros((0, 3))
        if len(rows) == 1 and np.isfinite(rows).all():
            return tuple(map(float, rows[0]))
    return None
