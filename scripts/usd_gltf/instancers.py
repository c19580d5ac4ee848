"""PointInstancers: where their instances stand, and which prototype each one is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pxr import Gf, Usd, UsdGeom

from .primvars import as_rows
from .report import Notebook
from .stage import Frames
from .transforms import column
from .velocities import has_seconds, instances_move


@dataclass
class Placements:
    """The visible instances of one prototype: their numbers and their matrices."""

    numbers: np.ndarray
    matrices: np.ndarray
    """(n, 4, 4), or (times, n, 4, 4) if the instancer moves; without the prototype's own matrix."""


def read_placements(prim: Usd.Prim, frames: Frames, report: Notebook) -> dict[int, Placements]:
    """Placements of each prototype, by its index in `prototypes`."""
    instancer = UsdGeom.PointInstancer(prim)
    path = prim.GetPath()
    matrices, prototypes, shown = _state(instancer, frames.first)
    if len(prototypes) == 0:
        return {}
    if len(matrices) != len(prototypes):
        why = "positions, orientations, scales and protoIndices have different lengths"
        report.warn(path, "PointInstancer without usable instances", why)
        return {}
    moves = _moves(instancer) or instances_move(instancer, frames, report.about("animation"))
    states = [_state(instancer, code) for code in frames.codes] if moves else []
    if len(states) > 1:
        if all(len(m) == len(matrices) and np.array_equal(p, prototypes) and np.array_equal(s, shown)
               for m, p, s in states):  # fmt: skip
            matrices = np.stack([m for m, _, _ in states])
        else:
            why = "instances that appear, vanish or change prototype have no carrier; the first frame is used"
            report.about("animation").warn(path, "PointInstancer whose instances change", why)
    if not np.isfinite(matrices).all():
        good = np.isfinite(matrices).all(axis=(-1, -2))
        shown = shown & (good.all(axis=0) if good.ndim == 2 else good)
        report.warn(path, "instances at non-finite places", "they are left out")
    placed = {}
    for prototype in np.unique(prototypes[shown]):
        which = np.flatnonzero((prototypes == prototype) & shown)
        placed[int(prototype)] = Placements(which, matrices[..., which, :, :])
    return placed


def _moves(instancer: UsdGeom.PointInstancer) -> bool:
    attributes = (
        instancer.GetPositionsAttr(), instancer.GetOrientationsAttr(), instancer.GetOrientationsfAttr(),
        instancer.GetScalesAttr(), instancer.GetProtoIndicesAttr(), instancer.GetInvisibleIdsAttr(),
        instancer.GetVelocitiesAttr(), instancer.GetAngularVelocitiesAttr(),
    )  # fmt: skip
    return any(attribute.ValueMightBeTimeVarying() for attribute in attributes)


def _state(instancer: UsdGeom.PointInstancer, code: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Matrices, prototype indices and visibility of all instances at a time code."""
    time = Usd.TimeCode(code)
    kind = UsdGeom.PointInstancer
    if has_seconds(instancer.GetPrim().GetStage()):
        matrices = instancer.ComputeInstanceTransformsAtTime(time, time, kind.ExcludeProtoXform, kind.IgnoreMask)
    else:
        matrices = _without_velocities(instancer, time)
    prototypes = as_rows(instancer.GetProtoIndicesAttr().Get(time), 1, int)
    mask = instancer.ComputeMaskAtTime(time)
    shown = np.array(mask, dtype=bool) if len(mask) == len(prototypes) else np.ones(len(prototypes), bool)
    stack = column(np.array(matrices, dtype=float).reshape(-1, 4, 4))
    return stack, prototypes, shown


def _without_velocities(instancer: UsdGeom.PointInstancer, time: Usd.TimeCode) -> list[Gf.Matrix4d]:
    """The matrices of instances whose velocities say nothing; none for arrays of different lengths."""
    positions = as_rows(instancer.GetPositionsAttr().Get(time), 3)
    sizes = as_rows(instancer.GetScalesAttr().Get(time), 3)
    turns = instancer.GetOrientationsfAttr().Get(time) or instancer.GetOrientationsAttr().Get(time) or ()
    if any(len(given) not in (0, len(positions)) for given in (sizes, turns)):
        return []
    found = []
    for number, position in enumerate(positions):
        size = Gf.Matrix4d().SetScale(Gf.Vec3d(*sizes[number])) if len(sizes) else Gf.Matrix4d(1)
        turn = Gf.Matrix4d().SetRotate(Gf.Quatd(turns[number])) if len(turns) else Gf.Matrix4d(1)
        found.append(size * turn * Gf.Matrix4d().SetTranslate(Gf.Vec3d(*position)))
    return found
