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
from .stage import Frames, changes
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


def placement(prim: Usd.Prim, frames: Frames, report: Notebook) -> np.ndarray | None:
    """The matrix (4, 4) of the parameters, or (times, 4, 4), one for each of `Frames.codes`, if they change; None if
    they are not authored, do not count, or are none (reported)."""
    names = placement_names(prim)
    parameters = _PARAMETERS.get(str(prim.GetTypeName()), ()) if names else ()
    moves = any(changes(prim.GetAttribute(name), frames) for name in names)
    codes = frames.codes if moves else (frames.first,)
    said = [{parameter: _vector(prim, parameter, code, report) for parameter in parameters} for code in codes]
    if all(value is None or value == _DEFAULTS[p] for values in said for p, value in values.items()):
        return None
    what = f"Arnold's {', '.join(p for p in parameters if any(values[p] is not None for values in said))}"
    found = []
    for values in said:
        at = {name: Gf.Vec3d(*(values.get(name) or default)) for name, default in _DEFAULTS.items()}
        ahead = at["direction"] if "direction" in values else at["look_at"] - at["position"]
        # Of a distant light nothing is up.
        up = min((at["up"], Gf.Vec3d(0, 0, 1)), key=lambda v: abs(v * ahead)) if "direction" in values else at["up"]
        if not ahead.GetLength() > 0 or not Gf.Cross(ahead, up).GetLength() > 1e-9 * ahead.GetLength() * up.GetLength():
            report.warn(prim.GetPath(), what, f"along {ahead} with {up} up there is no view; they are ignored")
            return None
        found.append(column(Gf.Matrix4d().SetLookAt(at["position"], at["position"] + ahead, up).GetInverse()))
    report.note(prim.GetPath(), what, "they place it, for it has no transform of its own")
    return np.array(found) if moves else found[0]


def _vector(prim: Usd.Prim, parameter: str, code: float, report: Notebook) -> tuple[float, float, float] | None:
    for name in arnold_names(parameter):
        attribute = prim.GetAttribute(name)
        value = attribute.Get(code) if attribute and attribute.HasAuthoredValue() else None
        rows = as_rows(value, 3) if value is not None else np.zeros((0, 3))
        if len(rows) and np.isfinite(rows).all():
            if (rows != rows[0]).any():
                why = f"it has {len(rows)} motion keys, which have no carrier; the first is used"
                report.warn(prim.GetPath(), f"{name} with motion keys", why)
            return tuple(map(float, rows[0]))
        if value is not None and not (hasattr(value, "__len__") and len(value) == 0):
            report.warn(prim.GetPath(), f"{name} is no vector", "it must be three finite numbers; it is ignored")
    return None
