"""Points and instances that move by their velocities, as usd-core computes them
(UsdGeomPointBased::ComputePointsAtTime, UsdGeomPointInstancer::ComputeInstanceTransformsAtTime).

UsdGeom has `velocities` (units of the prim's space for each second) and `accelerations` beside `points`, for the
motion blur of what has other points in each sample. They are used for a mesh whose points have one time sample:

    points(t) = points + v dt + a dt^2 / 2,    dt = (t - sample) / timeCodesPerSecond.

Between several samples points are linear, as without velocities. usd-core uses velocities only if their time samples are
those of what they move, and as many as that.
"""

from __future__ import annotations

import math

import numpy as np
from pxr import Usd, UsdGeom

from .primvars import as_rows
from .report import Notebook
from .stage import Frames


def points_at(prim: Usd.Prim, code: float) -> np.ndarray:
    """Points (v, 3) of a mesh at a time code."""
    attribute = prim.GetAttribute("points")
    if _mesh_fault(prim) == "":
        return as_rows(UsdGeom.PointBased(prim).ComputePointsAtTime(code, code), 3)
    return as_rows(attribute.Get(code) if attribute else None, 3)


def points_move(prim: Usd.Prim, frames: Frames, report: Notebook | None = None) -> bool:
    """Whether velocities move the points of a mesh at some sampled time. `report` is told of those that cannot be used."""
    return _moves("velocities", _mesh_fault(prim), prim, frames, report)


def instances_move(instancer: UsdGeom.PointInstancer, frames: Frames, report: Notebook) -> bool:
    """The same for the instances of a PointInstancer that has no further samples."""
    prim = instancer.GetPrim()
    places, turns = instancer.GetPositionsAttr(), instancer.GetOrientationsfAttr()
    turns = turns if turns.HasAuthoredValue() else instancer.GetOrientationsAttr()
    linear = _fault(places, instancer.GetVelocitiesAttr(), instancer.GetAccelerationsAttr())
    angular = _fault(turns, instancer.GetAngularVelocitiesAttr())
    found = [_moves("velocities", linear, prim, frames, report), _moves("angularVelocities", angular, prim, frames, report)]
    return any(found)


def _moves(name: str, fault: str | None, prim: Usd.Prim, frames: Frames, report: Notebook | None) -> bool:
    if fault is None or len(frames.codes) < 2:
        return False
    if fault and report is not None:
        report.warn(prim.GetPath(), f"{name} without effect", f"{fault}; what they should move stands still")
    return not fault


def _mesh_fault(prim: Usd.Prim) -> str | None:
    mesh = UsdGeom.PointBased(prim)
    return _fault(mesh.GetPointsAttr(), mesh.GetVelocitiesAttr(), mesh.GetAccelerationsAttr())


def _fault(values: Usd.Attribute, velocities: Usd.Attribute, accelerations: Usd.Attribute | None = None) -> str | None:
    """Why usd-core does not move `values` by `velocities`; empty if it does, None if these would not move them, or
    there are further samples."""
    if not (values and velocities and velocities.HasAuthoredValue()) or values.GetNumTimeSamples() > 1:
        return None
    samples = values.GetTimeSamples()
    at = Usd.TimeCode(samples[0]) if samples else Usd.TimeCode.EarliestTime()
    given = as_rows(velocities.Get(at), 3)
    if not given.any() and not (accelerations and as_rows(accelerations.Get(at), 3).any()):
        return None
    if not has_seconds(values.GetStage()):
        return "timeCodesPerSecond is not positive"
    if not samples or velocities.GetTimeSamples() != samples:
        theirs, others = _named(velocities.GetTimeSamples()), _named(samples)
        return f"they are sampled at {theirs}, {values.GetName()} at {others}; USD uses them only where both are sampled at the same time codes"
    count = len(values.Get(at) or ())
    return "" if len(given) == count else f"they are {len(given)}, but {values.GetName()} are {count}"


def has_seconds(stage: Usd.Stage) -> bool:
    """Whether time codes are so many a second. Else usd-core divides by 0, and puts what has velocities nowhere."""
    return math.isfinite(stage.GetTimeCodesPerSecond()) and stage.GetTimeCodesPerSecond() > 0


def _named(samples: list[float]) -> str:
    shown = ", ".join(f"{code:g}" for code in samples[:3])
    shown += ", ..." if len(samples) > 3 else ""
    return f"time code {shown}" if shown else "no time code"
