"""Meshes that deform, as morph targets whose weights are animated.

A glTF mesh has the shape of the first frame, and a target for each further key: what is to be added to points and
normals. At its key a target's weight is 1 and all others are 0, so that shapes between keys are linear
in time, as UsdGeom's points are between samples. Keys are those sampled times that linear interpolation of the
others does not show; with too many bytes, not nearly. Equal shapes have one target, that of the first frame none.

Shapes are read one time after another. Held are some eight of them, 24 bytes a vertex each, and the targets.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from .animation import NOISE
from .gltf_document import ARRAY_BUFFER, Document
from .report import Notebook
from .stage import Frames

MOST_BYTES = 1 << 30
"""Displacements and weights of one mesh."""

MOST_BYTES_OF_A_STAGE = 2 << 30
"""The same of all meshes of a stage: a .glb holds 4 GiB."""

_NEAR = ((NOISE, 1e-3), (10 * NOISE, 3e-3), (100 * NOISE, 1e-2))
"""How far off the shape may be where a key is left out: points, relative to the largest coordinate, and normals, in
radians. The first is what single precision tells apart; the others are for meshes of too many bytes."""


@dataclass
class Motion:
    """The weights of a mesh's targets over time."""

    seconds: np.ndarray
    weights: np.ndarray
    """(keys, targets)"""
    names: list[str]
    """Of each target, the time code that it shows."""
    near: float
    """How far off points may be between keys, relative to the largest coordinate."""
    sampler: int | None = None

    def animate(self, document: Document, node: int) -> None:
        """Let a node's mesh deform; all nodes of a mesh have one sampler."""
        if self.sampler is None:
            sampler = {
                "input": document.accessor(self.seconds.astype(np.float32), bounds=True),
                "interpolation": "LINEAR",
                "output": document.accessor(self.weights.reshape(-1)),
            }
            document.animation["samplers"].append(sampler)
            self.sampler = len(document.animation["samplers"]) - 1
        document.animation["channels"].append({"sampler": self.sampler, "target": {"node": node, "path": "weights"}})


@dataclass
class Part:
    """A primitive of a mesh, and the face corner (n,) that each of its vertices is."""

    primitive: dict
    corner: np.ndarray


class TooMuch(Exception):
    """The targets of a mesh would be more bytes than are allowed."""


class Deformer:
    """Writes the targets of meshes."""

    def __init__(self, document: Document, frames: Frames, report: Notebook) -> None:
        self.document, self.frames, self.report = document, frames, report
        self._bytes = 0

    def carry(self, parts: list[Part], shape: Callable[[float], np.ndarray]) -> Motion | None:
        """Give the parts of a mesh their targets; None if it stays as it is.

        `shape(code)` are the rows, points (3) and normals (3) if there are any, of the vertices of all parts in
        order, float32. Raises TooMuch, and what `shape` raises.
        """
        for near in _NEAR:
            try:
                return self._carry(parts, shape, *near)
            except TooMuch as error:
                why = error
        raise why

    def _carry(
        self, parts: list[Part], shape: Callable[[float], np.ndarray], points: float, normals: float
    ) -> Motion | None:
        """The same with keys left out where that is so far off."""
        frames = self.frames
        base = shape(frames.first)
        near = np.full(base.shape[1], normals, np.float32)
        near[:3] = points * np.abs(base[:, :3]).max(initial=0.0)
        moved = ((code, shape(code) - base if code != frames.first else np.zeros_like(base)) for code in frames.codes)
        most = min(MOST_BYTES, MOST_BYTES_OF_A_STAGE - self._bytes)
        codes, shown, names = [], [], []
        targets: list[np.ndarray | None] = []
        known: dict[bytes, int] = {}
        for code, by in needed_shapes(moved, near, frames.first):
            target = -1
            if (np.abs(by) > near).any():
                digest = hashlib.blake2b(by.tobytes(), digest_size=16).digest()
                target = known.setdefault(digest, len(targets))
                if target == len(targets):
                    targets.append(by)
                    names.append(f"{code:.9g}")
            codes.append(code)
            shown.append(target)
            if len(targets) * by.nbytes + 4 * len(codes) * len(targets) > most:
                raise TooMuch(f"its targets would take more than {most} bytes ({MOST_BYTES} a mesh, {MOST_BYTES_OF_A_STAGE} a stage)")
        # glTF holds what the first and the last key show.
        while len(shown) > 1 and shown[0] == shown[1]:
            del shown[0], codes[0]
        while len(shown) > 1 and shown[-1] == shown[-2]:
            del shown[-1], codes[-1]
        if not targets:
            return None
        weights = np.zeros((len(shown), len(targets)), np.float32)
        for key, target in enumerate(shown):
            if target >= 0:
                weights[key, target] = 1.0
        self._bytes += len(targets) * base.nbytes + weights.nbytes
        self._write(parts, targets)
        self.report.count("deforming meshes")
        self.report.count("morph targets", len(targets))
        return Motion(frames.seconds_at(codes), weights, names, points)

    def _write(self, parts: list[Part], targets: list[np.ndarray | None]) -> None:
        for number, by in enumerate(targets):
            start = 0
            for part in parts:
                rows = by[start : start + len(part.corner)]
                start += len(part.corner)
                target = {"POSITION": self.document.accessor(rows[:, :3], ARRAY_BUFFER, bounds=True)}
                if rows.shape[1] > 3:
                    target["NORMAL"] = self.document.accessor(rows[:, 3:], ARRAY_BUFFER)
                part.primitive.setdefault("targets", []).append(target)
            targets[number] = None  # the document has it


def needed_shapes(
    shapes: Iterator[tuple[float, np.ndarray]], near: np.ndarray, first: float
) -> Iterator[tuple[float, np.ndarray]]:
    """Those of `shapes`, (time code, array) ascending, between which linear interpolation shows all others to within
    `near`, which is one number for each column; the one at `first` is always among them.

    From the last one that is kept, the slopes that pass every later one near enough are known; one whose
    slope is none of them makes its predecessor a key.
    """
    start, at = next(shapes)
    yield start, at
    last, low, high = None, None, None
    for code, now in shapes:
        step = np.float32(code - start)
        if last is not None:
            slope = (now - at) / step
            if (slope < low).any() or (slope > high).any():
                yield last
                (start, at), low = last, None
                step = np.float32(code - start)
        if code == first:
            yield code, now
            start, at, last, low = code, now, None, None
            continue
        slope, wide = (now - at) / step, near / step
        if low is None:
            low, high = slope - wide, slope + wide
        else:
            low, high = np.maximum(low, slope - wide), np.minimum(high, slope + wide)
        last = code, now
    if last is not None:
        yield last
