"""PointInstancers: where their instances stand, and which prototype each one is, over time.

An instance is who it is by its id, or by its place in the arrays where there are no ids (usdGeom/schema.usda). One that
appears, vanishes or is masked for a while is seen at some of the sampled times; one that changes its prototype is as many as it
has prototypes, each seen in its time.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
from pxr import Gf, Usd, UsdGeom

from .primvars import as_rows
from .report import Notebook
from .stage import Frames
from .transforms import column
from .velocities import has_seconds, instances_move

Key = tuple[int, int]
"""The id of an instance, and its prototype."""


@dataclass
class Placements:
    """Instances of one prototype that are seen at the same times: their numbers and their matrices."""

    numbers: list[str]
    matrices: np.ndarray
    """(n, 4, 4), or (times, n, 4, 4) if the instancer moves; without the prototype's own matrix."""
    seen: np.ndarray | None = None
    """(times,) when they are there; None if always."""


def read_placements(prim: Usd.Prim, frames: Frames, report: Notebook) -> dict[int, list[Placements]]:
    """Placements of each prototype, by its index in `prototypes`."""
    instancer = UsdGeom.PointInstancer(prim)
    moves = _moves(instancer) or instances_move(instancer, frames, report.about("animation"))
    codes = frames.codes if moves else (frames.first,)
    states = []
    for code in codes:
        matrices, prototypes, shown, ids = _state(instancer, code)
        if len(matrices) != len(prototypes):
            why = f"{_lengths(instancer, code)} do not fit each other"
            later = f" at frame {code:g}; nothing of it is seen then" if code != frames.first else ""
            report.warn(prim.GetPath(), "PointInstancer without usable instances", why + later)
            matrices, prototypes, shown, ids = (part[:0] for part in (matrices, prototypes, shown, ids))
        good = np.isfinite(matrices).all(axis=(-1, -2))
        if not good.all():
            report.warn(prim.GetPath(), "instances at non-finite places", "they are left out")
        states.append(_State(matrices, prototypes, shown & good, ids))
    if all(state.is_like(states[0]) for state in states):
        return _steady(states)
    return _changing(states)


@dataclass
class _State:
    """All instances at one time: matrices (n, 4, 4), prototype indices, whether they are seen, ids."""

    matrices: np.ndarray
    prototypes: np.ndarray
    shown: np.ndarray
    ids: np.ndarray

    def is_like(self, other: _State) -> bool:
        """Whether the same instances are there."""
        mine, theirs = (self.prototypes, self.shown, self.ids), (other.prototypes, other.shown, other.ids)
        return all(np.array_equal(a, b) for a, b in zip(mine, theirs, strict=True))


def _steady(states: list[_State]) -> dict[int, list[Placements]]:
    """Placements of instances that are there at all times, or at none."""
    first = states[0]
    matrices = first.matrices if len(states) == 1 else np.stack([state.matrices for state in states])
    placed = {}
    for prototype in np.unique(first.prototypes[first.shown]):
        which = np.flatnonzero((first.prototypes == prototype) & first.shown)
        placed[int(prototype)] = [Placements([str(number) for number in which], matrices[..., which, :, :])]
    return placed


def _changing(states: list[_State]) -> dict[int, list[Placements]]:
    """Placements where instances come and go. While one is not there it stays where it was, or will be, for what is
    between two times is linear."""
    times, found = len(states), {}
    for time, state in enumerate(states):
        for number in np.flatnonzero(state.shown).tolist():
            key = (int(state.ids[number]), int(state.prototypes[number]))
            seen, matrices = found.setdefault(key, (np.zeros(times, bool), np.empty((times, 4, 4))))
            seen[time], matrices[time] = True, state.matrices[number]
    groups: dict[tuple[int, bytes], list[Key]] = {}
    for key in sorted(found):
        groups.setdefault((key[1], found[key][0].tobytes()), []).append(key)
    prototypes_of = Counter(identity for identity, _ in found)
    placed: dict[int, list[Placements]] = {}
    for (prototype, _), keys in groups.items():
        seen = found[keys[0]][0]
        there = np.flatnonzero(seen)
        last = np.maximum.accumulate(np.where(seen, np.arange(times), -1))
        held = np.where(last < 0, there[0], last)
        matrices = np.stack([found[key][1][held] for key in keys], axis=1)
        numbers = [f"{identity} of prototype {prototype}" if prototypes_of[identity] > 1 else str(identity) for identity, _ in keys]
        placed.setdefault(prototype, []).append(Placements(numbers, matrices, None if seen.all() else seen))
    return placed


def _moves(instancer: UsdGeom.PointInstancer) -> bool:
    attributes = (
        instancer.GetPositionsAttr(), instancer.GetOrientationsAttr(), instancer.GetOrientationsfAttr(),
        instancer.GetScalesAttr(), instancer.GetProtoIndicesAttr(), instancer.GetInvisibleIdsAttr(),
        instancer.GetVelocitiesAttr(), instancer.GetAngularVelocitiesAttr(), instancer.GetIdsAttr(),
    )  # fmt: skip
    return any(attribute.ValueMightBeTimeVarying() for attribute in attributes)


def _state(instancer: UsdGeom.PointInstancer, code: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Matrices, prototype indices, visibility and ids of all instances at a time code. Ids that are not one for each instance are none."""
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
    ids = as_rows(instancer.GetIdsAttr().Get(time), 1, int)
    if len(ids) != len(prototypes) or len(np.unique(ids)) != len(ids):
        ids = np.arange(len(prototypes))
    return stack, prototypes, shown, ids


def _lengths(instancer: UsdGeom.PointInstancer, code: float) -> str:
    """How many of all it has, for a message; what may be left out and is, is not named."""
    turns = instancer.GetOrientationsfAttr()
    turns = turns if turns.HasAuthoredValue() else instancer.GetOrientationsAttr()
    others = (attribute for attribute in (turns, instancer.GetScalesAttr()) if attribute.HasAuthoredValue())
    counts = [f"{len(attribute.Get(code) or ())} {attribute.GetName()}" for attribute in (instancer.GetPositionsAttr(), *others)]
    return f"{', '.join(counts)} and {len(instancer.GetProtoIndicesAttr().Get(code) or ())} protoIndices"


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
