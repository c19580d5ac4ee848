"""PointInstancers: where their instances stand, and which prototype each one is, over time.

An instance is who it is by its id, or by its place in the arrays where there are no ids (usdGeom/schema.usda), or none that are
one for each instance at all times. One that
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

MOST_PLACES = 1 << 24
"""Matrices of a prim over time, of 128 bytes each: as many as there are sampled times for each instance that is ever there."""
MOST_PLACES_OF_A_STAGE = 1 << 25


@dataclass
class Room:
    """What is left of a stage's matrices over time."""

    left: int = MOST_PLACES_OF_A_STAGE

    def takes(self, count: int) -> bool:
        """Whether as many more fit; they are then taken."""
        fits = count <= min(MOST_PLACES, self.left)
        self.left -= count if fits else 0
        return fits


@dataclass
class Placements:
    """Instances of one prototype that are seen at the same times: their numbers and their matrices."""

    numbers: list[str]
    matrices: np.ndarray
    """(n, 4, 4), or (times, n, 4, 4) if the instancer moves; without the prototype's own matrix."""
    seen: np.ndarray | None = None
    """(times,) when they are there; None if always."""


def read_placements(prim: Usd.Prim, frames: Frames, room: Room, report: Notebook) -> dict[int, list[Placements]]:
    """Placements of each prototype, by its index in `prototypes`; the first frame's alone if they do not fit into the room."""
    instancer = UsdGeom.PointInstancer(prim)
    moves = _moves(instancer) or instances_move(instancer, frames, report.about("animation"))
    codes = frames.codes if moves else (frames.first,)
    states, held = [], 0
    for code in codes:
        matrices, prototypes, shown, ids = _state(instancer, code)
        if len(matrices) != len(prototypes):
            why = f"{_lengths(instancer, code)} do not fit each other"
            later = f" at frame {code:g}; nothing of it is seen then" if code != frames.first else ""
            report.warn(prim.GetPath(), "PointInstancer without usable instances", why + later)
            matrices, prototypes, shown = (part[:0] for part in (matrices, prototypes, shown))
            ids = np.zeros(0, int)
        good = np.isfinite(matrices).all(axis=(-1, -2))
        if not good.all():
            report.warn(prim.GetPath(), "instances at non-finite places", "they are left out")
        states.append(_State(matrices, prototypes, shown & good, ids))
        held += len(matrices)
        if held > MOST_PLACES:
            break
    _settle_ids(prim, states, codes, report)
    is_steady = all(state.is_like(states[0]) for state in states)
    if moves:
        count = held if is_steady else len(codes) * len(_identities(states))
        if held > MOST_PLACES or not room.takes(count):
            why = f"it has more than {MOST_PLACES} places (of instances at {len(codes)} times; {MOST_PLACES_OF_A_STAGE} a stage); "
            why += "the first frame's are used. Export fewer frames at a time, or split it"
            report.about("animation").warn(prim.GetPath(), "PointInstancer too large over time", why)
            return _steady([states[frames.rest] if len(states) > frames.rest else states[0]])
    return _steady(states) if is_steady else _changing(states)


def _settle_ids(prim: Usd.Prim, states: list[_State], codes: tuple[float, ...], report: Notebook) -> None:
    """Give instances their places in the arrays for ids if these are not one for each at all times."""
    filled = [(code, state.ids is None) for code, state in zip(codes, states, strict=False) if len(state.prototypes)]
    without = [code for code, is_without in filled if is_without]
    if not without:
        return
    if len(without) < len(filled):
        why = f"at frame {without[0]:g}, and elsewhere they are; instances are told apart by their places in the arrays at all times"
        report.about("animation").warn(prim.GetPath(), "ids that are not one for each instance", why)
    for state in states:
        state.ids = np.arange(len(state.prototypes))


def _identities(states: list[_State]) -> np.ndarray:
    """(n, 2): ids and prototypes of all instances that are ever seen."""
    seen = [np.column_stack([state.ids, state.prototypes])[state.shown] for state in states]
    return np.unique(np.concatenate(seen), axis=0)


@dataclass
class _State:
    """All instances at one time: matrices (n, 4, 4), prototype indices, whether they are seen, ids if they are one for each."""

    matrices: np.ndarray
    prototypes: np.ndarray
    shown: np.ndarray
    ids: np.ndarray | None

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


def _state(instancer: UsdGeom.PointInstancer, code: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray | None]:
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
    is_one_for_each = len(ids) == len(prototypes) and len(np.unique(ids)) == len(ids)
    return stack, prototypes, shown, ids if is_one_for_each else None


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
