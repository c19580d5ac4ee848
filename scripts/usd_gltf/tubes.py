"""Curves as surfaces: tubes around them, or ribbons along them where normals are authored (usdGeom/schema.usda, "Tubes and
Ribbons").

A tube is a regular prism along each piece, mitred where pieces meet. Its sides are as wide as its perimeter is the
circle's; then by Cauchy's formula its mean width, seen from all around, is the circle's diameter, so that hair of any level
covers as much of a picture, and a curve that glows has its area. Its ends are closed. Normals are those of the round tube, tilted
where it tapers.

The level is that of subdivision surfaces:

    level                     0   1   2   3
    pieces of a cubic span    1   2   4   8
    sides of a tube           4   6   8  12
    strips of a ribbon        1   2   4   8     (1 if its normals are constant)
"""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np
from pxr import Usd

from .curves import DEFAULT_WIDTH, Layout, Samples, read_directions, read_widths
from .primvars import CornerValues
from .report import Notebook
from .subdivision import LEVELS, MOST_FACES, MOST_FACES_OF_A_STAGE

PIECES, SIDES = (1, 2, 4, 8), (4, 6, 8, 12)
"""By level."""

_LEAST_MITRE = 0.25
"""The cosine of half the angle between two pieces beyond which a mitre becomes no longer."""


class Strands:
    """A prim's curves as a surface, as `subdivision.Surface` is of a mesh: `points` (v, 3), `counts` (f,), `corners` (c,) are its
    polygons, `parents` (f,) the curve that each is part of, `hidden` (f,) none, `normals` those of the round tubes."""

    def __init__(
        self, prim: Usd.Prim, layout: Layout, level: int, points: np.ndarray, deforms: bool, code: float, report: Notebook
    ) -> None:
        self.prim, self.layout, self.level, self.report = prim, layout, level, report
        self.samples = Samples(layout, PIECES[level])
        self._deforms = deforms
        directions = read_directions(prim, code, layout, report)
        self._is_ribbon = directions is not None
        self._first: tuple[np.ndarray, np.ndarray] | None = None
        # Two triangles across a strip that twists have too large an area, however short they are.
        self._ring = SIDES[level] if directions is None else 2 if directions.constant else 1 + PIECES[level]
        self._capped = np.zeros(0, int)
        self._connect()
        self.points, self.normals = self.shape(points, code)

    def _connect(self) -> None:
        """The faces: a quad for each side of each piece, and a polygon at each end of a tube."""
        samples, ring = self.samples, self._ring
        here = np.arange(len(samples.curve))
        there = here + 1
        last = samples.starts[samples.curve] + samples.lengths[samples.curve] - 1
        if self.layout.is_closed:
            there = np.where(here == last, samples.starts[samples.curve], there)
        else:
            here, there = here[here != last], there[here != last]
        side = np.arange(ring - self._is_ribbon)
        low, high = (ring * at[:, None] for at in (here, there))
        following = (side + 1) % ring
        quads = np.stack([low + side, low + following, high + following, high + side], axis=2).reshape(-1, 4)
        self._of = np.repeat(np.arange(len(samples.curve)), ring)
        self.counts, self.corners = np.full(len(quads), 4), quads.reshape(-1)
        self.parents = np.repeat(samples.curve[here], len(side))
        if not self._is_ribbon and not self.layout.is_closed:
            some = samples.lengths > 0
            first, end = samples.starts[some], (samples.starts + samples.lengths - 1)[some]
            self._capped = np.concatenate([first, end])
            caps = np.concatenate([ring * first[:, None] + np.arange(ring)[::-1], ring * end[:, None] + np.arange(ring)])
            self.counts = np.concatenate([self.counts, np.full(len(caps), ring)])
            self.corners = np.concatenate([self.corners, caps.reshape(-1)])
            self.parents = np.concatenate([self.parents, samples.curve[self._capped]])
        self.hidden = np.zeros(len(self.counts), bool)

    def shape(self, points: np.ndarray, code: float) -> tuple[np.ndarray, CornerValues]:
        """Points (v, 3) and normals of the surface, of control points at a time."""
        samples = self.samples
        widths = read_widths(self.prim, code, self.layout, self.report)
        middle = samples.vertex(points)
        if widths is None:
            radius, tapers = np.full(len(middle), DEFAULT_WIDTH / 2), np.zeros(len(middle))
        else:
            radius, tapers = self._radii(widths)
        slopes = samples.slopes(points)
        before, after = self._ways(middle, slopes)
        along = _unit(before + after)
        along = np.where(np.abs(along).sum(axis=1, keepdims=True) > 0, along, after)
        speed = np.linalg.norm(slopes[0] + slopes[1], axis=1) / 2
        slant = np.divide(tapers, speed, out=np.zeros_like(speed), where=speed > 0)
        if self._is_ribbon:
            return self._ribbons(code, middle, radius, along, before, after)
        return self._tubes(middle, radius, slant, along, before, after)

    def _radii(self, widths: CornerValues) -> tuple[np.ndarray, np.ndarray]:
        """(s,) radii, and how they change with the curve's parameter. A width below 0 is none."""
        radius = self.samples.carry(widths)[:, 0] / 2
        tapers = np.zeros_like(radius)
        if widths.interpolation == "vertex" or (widths.interpolation == "varying" and self.layout.basis == "linear"):
            before, after = self.samples.slopes(widths.values[widths.index])
            tapers = (before + after)[:, 0] / 4
        elif widths.interpolation == "varying":
            tapers = self.samples.varying_slopes(widths.values[widths.index])[:, 0] / 2
        return np.maximum(radius, 0.0), np.where(radius >= 0, tapers, 0.0)

    def _ways(self, middle: np.ndarray, slopes: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """Unit directions (s, 3) just before and after each sample. Where a curve stands still, control vertices being one, it goes as the
        piece before or after, or as its neighbours do."""
        starts, lengths, curve = self.samples.starts, self.samples.lengths, self.samples.curve
        number = np.arange(len(curve))
        last, first = starts[curve] + lengths[curve] - 1, starts[curve]
        if self.layout.is_closed:
            following, previous = np.where(number == last, first, number + 1), np.where(number == first, last, number - 1)
        else:
            following, previous = np.minimum(number + 1, last), np.maximum(number - 1, first)
        chord = middle[following] - middle, middle - middle[previous]
        size = np.maximum(np.linalg.norm(chord[0], axis=1), np.linalg.norm(chord[1], axis=1))[:, None]
        before, after = (np.where(np.linalg.norm(slope, axis=1, keepdims=True) > 1e-6 * size, slope, 0.0) for slope in slopes)
        before, after = _first_of(before, chord[1], after, chord[0]), _first_of(after, chord[0], before, chord[1])
        still = ~after.any(axis=1)
        if still.any():
            # Of the last sample before on the same curve that goes anywhere, else the first one after.
            known = np.where(still, -1, number)
            upto = np.maximum.accumulate(known)
            since = np.minimum.accumulate(np.where(still, len(curve), number)[::-1])[::-1]
            good = np.where(upto >= first, upto, np.where(since <= last, since, number))
            before, after = np.where(still[:, None], before[good], before), np.where(still[:, None], after[good], after)
            nowhere = ~after.any(axis=1)
            before[nowhere], after[nowhere] = (0.0, 1.0, 0.0), (0.0, 1.0, 0.0)
        return before, after

    def _across(self, along: np.ndarray, before: np.ndarray, after: np.ndarray) -> np.ndarray:
        """Unit vectors (s, 3) across the curves that turn about them as little as can be: transported along each, from one piece to the
        next. Around a closed curve what is left of a turn is shared out."""
        starts, lengths = self.samples.starts, self.samples.lengths
        order = np.argsort(-lengths, kind="stable")
        order = order[lengths[order] > 0]
        across = np.zeros_like(along)
        across[starts[order]] = self._start(along[starts[order]])
        sorted_lengths = lengths[order]
        for step in range(1, int(sorted_lengths[0])):
            now = starts[order[: np.searchsorted(-sorted_lengths, -step, side="left")]] + step
            across[now] = _transport(across[now - 1], along[now - 1], after[now - 1], before[now], along[now])
        if not self.layout.is_closed:
            return across
        first, end = starts[order], starts[order] + sorted_lengths - 1
        back = _transport(across[end], along[end], after[end], before[first], along[first])
        up = np.cross(along[first], across[first])
        left = np.arctan2((back * up).sum(axis=1), (back * across[first]).sum(axis=1))
        turn = np.zeros(len(lengths))
        turn[order] = left
        number = np.arange(len(along)) - starts[self.samples.curve]
        angle = -(turn[self.samples.curve] * number / lengths[self.samples.curve])[:, None]
        return across * np.cos(angle) + np.cross(along, across) * np.sin(angle)

    def _start(self, along: np.ndarray) -> np.ndarray:
        """A unit vector across the start of each curve; at later times the first one turned with the curve, so that no tube spins."""
        if self._first is None:
            axis = np.eye(3)[np.argmin(np.abs(along), axis=1)]
            self._first = along, _unit(axis - along * (axis * along).sum(axis=1, keepdims=True))
        return _turned(self._first[1], self._first[0], along)

    def _tubes(self, middle, radius, slant, along, before, after) -> tuple[np.ndarray, CornerValues]:
        """Rings of corners, joined."""
        ring, across = self._ring, self._across(along, before, after)
        angle = (np.arange(ring) + 0.5) * (2 * math.pi / ring)
        up = np.cross(along, across)
        out = across[:, None] * np.cos(angle)[:, None] + up[:, None] * np.sin(angle)[:, None]
        wide = radius * (math.pi / ring) / math.sin(math.pi / ring)
        points = middle[:, None] + _mitred(out, before, after) * wide[:, None, None]
        normals = _unit((out - along[:, None] * slant[:, None, None]).reshape(-1, 3))
        index = self.corners
        if len(self._capped):
            half = len(self._capped) // 2
            ends = along[self._capped] * np.repeat([-1.0, 1.0], half)[:, None]
            of_caps = np.repeat(len(normals) + np.arange(len(ends)), ring)
            index = np.concatenate([index[: len(index) - len(of_caps)], of_caps])
            normals = np.concatenate([normals, ends])
        return points.reshape(-1, 3), CornerValues(normals, index, exact=True)

    def _ribbons(self, code, middle, radius, along, before, after) -> tuple[np.ndarray, CornerValues]:
        """Flat strips that face along the normals, as near as they can across the curve."""
        directions = read_directions(self.prim, code, self.layout, self.report)
        facing = np.zeros_like(along) if directions is None else self.samples.carry(directions)
        facing = _unit(facing - along * (facing * along).sum(axis=1, keepdims=True))
        lost = ~facing.any(axis=1)
        if lost.any():
            facing[lost] = self._across(along, before, after)[lost]
        side = _mitred(np.cross(along, facing)[:, None], before, after)[:, 0] * radius[:, None]
        points = middle[:, None] + side[:, None] * np.linspace(-1, 1, self._ring)[:, None]
        return points.reshape(-1, 3), CornerValues(np.repeat(facing, self._ring, axis=0), self.corners, exact=True)

    def carry(self, found: CornerValues) -> CornerValues:
        """A primvar of the curves on the surface."""
        if found.constant:
            return CornerValues(found.values, np.full(len(self.corners), found.index[0]), True)
        return CornerValues(self.samples.carry(found), self._of[self.corners])

    @cached_property
    def triangles(self) -> tuple[np.ndarray, np.ndarray]:
        """Triangles (t, 3) as indices into `corners`, and the face (t,) of each."""
        starts = np.cumsum(self.counts) - self.counts
        quads = self.counts[: len(self.counts) - len(self._capped)]
        halves = starts[: len(quads)][:, None, None] + np.array([[0, 1, 2], [0, 2, 3]])
        fan = np.stack([np.zeros(self._ring - 2, int), np.arange(1, self._ring - 1), np.arange(2, self._ring)], axis=1)
        caps = starts[len(quads) :][:, None, None] + fan
        triangles = np.concatenate([halves.reshape(-1, 3), caps.reshape(-1, 3)])
        faces = np.concatenate([np.repeat(np.arange(len(quads)), 2), np.repeat(len(quads) + np.arange(len(self._capped)), len(fan))])
        if self._deforms:
            return triangles, faces
        # Tips, and places where a curve stands still.
        corner = self.points[self.corners[triangles]]
        real = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]).any(axis=1)
        return triangles[real], faces[real]


class Strander:
    """Makes surfaces of a stage's curves at the level of a complexity."""

    def __init__(self, complexity: str, report: Notebook) -> None:
        self.level, self.report = LEVELS[complexity], report
        self._faces = 0

    def surface(self, prim: Usd.Prim, layout: Layout, points: np.ndarray, deforms: bool, code: float) -> Strands:
        """The curves as a surface. With too many faces they are made of fewer pieces and sides (reported)."""
        most, level = min(MOST_FACES, MOST_FACES_OF_A_STAGE - self._faces), self.level
        while level and _faces(layout, level) > most:
            level -= 1
        if level < self.level:
            bound = f"{MOST_FACES} faces a prim, {MOST_FACES_OF_A_STAGE} a stage"
            why = f"level {self.level} has {_faces(layout, self.level)} faces, the bound is {bound}; level {level} is used"
            self.report.warn(prim.GetPath(), "curves that are refined less", why)
        self._faces += _faces(layout, level)
        self.report.count("curves", int((layout.spans > 0).sum()))
        return Strands(prim, layout, level, points, deforms, code, self.report)


def _faces(layout: Layout, level: int) -> int:
    pieces = 1 if layout.basis == "linear" else PIECES[level]
    return int(layout.spans.sum()) * pieces * SIDES[level]


def _unit(vectors: np.ndarray) -> np.ndarray:
    """Unit vectors; zero where there is no direction."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)


def _mitred(out: np.ndarray, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Vectors (s, n, 3) across the bisectors of two pieces, stretched until they end on the prisms along both."""
    cosine = np.sqrt(np.maximum((1 + (before * after).sum(axis=1)) / 2, 0.0))
    longer = (1 / np.maximum(cosine, _LEAST_MITRE) - 1)[:, None, None]
    axis = _unit(before - after)[:, None]
    return out + axis * (out * axis).sum(axis=2, keepdims=True) * longer


def _first_of(*choices: np.ndarray) -> np.ndarray:
    """The first of several vectors (n, 3) that is not zero, as a unit vector."""
    found = choices[0]
    for other in choices[1:]:
        found = np.where(np.abs(found).sum(axis=1, keepdims=True) > 0, found, other)
    return _unit(found)


def _turned(vectors: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Vectors across `start` under the shortest turn of `start` to `end`, unit vectors (n, 3)."""
    cosine = (start * end).sum(axis=1, keepdims=True)
    whole = 1 + cosine
    share = np.divide((vectors * end).sum(axis=1, keepdims=True), whole, out=np.zeros_like(whole), where=whole > 1e-9)
    turned = vectors - (start + end) * share
    return _unit(turned - end * (turned * end).sum(axis=1, keepdims=True))


def _transport(vectors: np.ndarray, *ways: np.ndarray) -> np.ndarray:
    for start, end in zip(ways, ways[1:], strict=False):
        vectors = _turned(vectors, start, end)
    return vectors
