"""UsdGeomBasisCurves: where curves run, how wide they are, and what their primvars are along them.

A curve is sampled at the ends of its spans and, if it is cubic, in between. All that is interpolated, points and values of
`vertex` primvars alike, is a weighted mean of four control vertices; `varying` values are linear along a span
(usdGeom/schema.usda, "Cubic Vertex Interpolation", "Primvar Interpolation"). `pinned` curves get its phantom points.

    basis        vstep   spans of n vertices: nonperiodic, periodic, pinned
    linear       1       n - 1               n              n - 1
    bezier       3       (n - 4) // 3 + 1    n // 3         as nonperiodic
    bspline      1       n - 3               n              n - 1
    catmullRom   1       n - 3               n              n - 1

`tubes` makes surfaces of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pxr import Usd, UsdGeom

from .primvars import CornerValues, as_rows, finite, read_normals, spread
from .report import Notebook

TYPE = "BasisCurves"

ATTRIBUTES = ("points", "curveVertexCounts", "widths", "primvars:widths", "normals", "primvars:normals")
"""What shapes them over time."""

DEFAULT_WIDTH = 1.0
"""In the curves' own space, where none is authored. USD has no default."""

_MATRICES = {
    "linear": [[0, 0, 0, 0], [0, 0, 0, 0], [-1, 1, 0, 0], [1, 0, 0, 0]],
    "bezier": [[-1, 3, -3, 1], [3, -6, 3, 0], [-3, 3, 0, 0], [1, 0, 0, 0]],
    "bspline": [[-1 / 6, 1 / 2, -1 / 2, 1 / 6], [1 / 2, -1, 1 / 2, 0], [-1 / 2, 0, 1 / 2, 0], [1 / 6, 2 / 3, 1 / 6, 0]],
    "catmullRom": [[-1 / 2, 3 / 2, -3 / 2, 1 / 2], [1, -5 / 2, 2, -1 / 2], [-1 / 2, 0, 1 / 2, 0], [0, 1, 0, 0]],
}
"""Rows for t^3, t^2, t and 1."""


@dataclass
class Layout:
    """How a prim's control vertices make curves, whatever they are at some time."""

    counts: np.ndarray
    """(curves,) control vertices of each."""
    basis: str
    wrap: str

    @property
    def vstep(self) -> int:
        """Control vertices from one span to the next."""
        return 3 if self.basis == "bezier" else 1

    @property
    def is_closed(self) -> bool:
        """Whether each curve ends where it begins."""
        return self.wrap == "periodic"

    @property
    def is_pinned(self) -> bool:
        """Whether the curves have phantom points; of linear and bezier ones nothing is to be pinned."""
        return self.wrap == "pinned" and self.basis in ("bspline", "catmullRom")

    @property
    def spans(self) -> np.ndarray:
        """(curves,) spans of each; 0 where there are too few vertices."""
        if self.is_closed:
            return np.where(self.counts > 2, self.counts // self.vstep, 0)
        if self.basis == "linear" or self.is_pinned:
            return np.maximum(self.counts - 1, 0)
        return np.maximum((self.counts - 4) // self.vstep + 1, 0)

    @property
    def varying(self) -> np.ndarray:
        """(curves,) how many values a `varying` primvar has for each."""
        spans = self.spans
        return spans if self.is_closed else np.where(spans > 0, spans + 1, 0)

    @property
    def left_over(self) -> int:
        """Control vertices that no span uses, or curves are short of."""
        if self.is_closed:
            used = self.counts - self.counts % self.vstep
        else:
            used = self.counts if self.vstep == 1 else (self.counts - 1) // 3 * 3 + 1
        return int((self.counts - np.where(self.spans > 0, used, 0)).sum())


class Samples:
    """The places along the curves of a layout where they are looked at: `pieces` to a span of a cubic curve.

    `curve` (s,) is the curve of each sample, `starts` (curves,) and `lengths` (curves,) where each curve's samples are; a closed
    one has none for its end, which is its first.
    """

    def __init__(self, layout: Layout, pieces: int) -> None:
        self.layout = layout
        pieces = 1 if layout.basis == "linear" else pieces
        spans, first = layout.spans, np.cumsum(layout.counts) - layout.counts
        self.lengths = np.where(spans > 0, spans * pieces + (0 if layout.is_closed else 1), 0)
        self.starts = np.cumsum(self.lengths) - self.lengths
        self.curve = np.repeat(np.arange(len(spans)), self.lengths)
        number = np.arange(len(self.curve)) - self.starts[self.curve]
        many = spans[self.curve]
        # The span that begins at a sample or holds it, and the one that ends at it or holds it.
        after, before = number // pieces, (number + pieces - 1) // pieces - 1
        at_start, at_end = number % pieces / pieces, ((number - 1) % pieces + 1) / pieces
        if layout.is_closed:
            before %= many
        else:
            last, start = after == many, before < 0
            after, at_start = np.where(last, many - 1, after), np.where(last, 1.0, at_start)
            before, at_end = np.where(start, 0, before), np.where(start, 0.0, at_end)
        self._vertex = self._vertices(after, first)
        self._weight = _powers(at_start) @ self._matrix
        self._slopes = (self._vertex, _slopes(at_start) @ self._matrix), (self._vertices(before, first), _slopes(at_end) @ self._matrix)
        begin = np.cumsum(layout.varying) - layout.varying
        following = (after + 1) % np.maximum(layout.varying[self.curve], 1) if layout.is_closed else after + 1
        self._ends, self._share = (begin[self.curve] + after, begin[self.curve] + following), at_start

    @property
    def _matrix(self) -> np.ndarray:
        return np.array(_MATRICES[self.layout.basis])

    def _vertices(self, span: np.ndarray, first: np.ndarray) -> np.ndarray:
        """(s, 4) the control vertices, phantom ones included, of a span of each sample's curve."""
        layout, start = self.layout, first[self.curve][:, None]
        number = span[:, None] * layout.vstep + np.arange(4)
        count = layout.counts[self.curve][:, None]
        if layout.is_closed:
            return start + number % count
        if layout.basis == "linear":
            return start + np.minimum(number, count - 1)  # two of the four have no weight
        if not layout.is_pinned:
            return start + number
        phantoms = layout.counts.sum() + 2 * self.curve[:, None]
        return np.where(number == 0, phantoms, np.where(number > count, phantoms + 1, start + number - 1))

    def _extended(self, values: np.ndarray) -> np.ndarray:
        """Values (v, n) of control vertices, and of the phantom ones: two of each curve, at its ends."""
        if not self.layout.is_pinned:
            return values
        counts = self.layout.counts
        first = np.cumsum(counts) - counts
        ends = np.stack([first, first + counts - 1], axis=1).reshape(-1)
        next_to = np.stack([first + 1, first + counts - 2], axis=1).reshape(-1)
        ends, next_to = (np.clip(index, 0, len(values) - 1) for index in (ends, next_to))
        return np.concatenate([values, 2 * values[ends] - values[next_to]])

    def vertex(self, values: np.ndarray) -> np.ndarray:
        """(s, n) values (v, n) of control vertices, by the basis."""
        return np.einsum("sk,skn->sn", self._weight, self._extended(values)[self._vertex])

    def slopes(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(s, n) and (s, n): how the same change with the parameter, just before and just after each sample."""
        values = self._extended(values)
        after, before = (np.einsum("sk,skn->sn", weight, values[vertex]) for vertex, weight in self._slopes)
        return before, after

    def varying(self, values: np.ndarray) -> np.ndarray:
        """(s, n) values of the ends of spans, linear along them."""
        low, high = self._ends
        share = self._share[:, None]
        return values[low] * (1 - share) + values[high] * share

    def varying_slopes(self, values: np.ndarray) -> np.ndarray:
        """(s, n) how the same change with the parameter, just after each sample, or before the last one."""
        low, high = self._ends
        return values[high] - values[low]

    def carry(self, found: CornerValues) -> np.ndarray:
        """(s, n) a primvar that was spread over control vertices, or over the ends of spans."""
        if found.interpolation == "varying" and len(found.index) == self.layout.varying.sum():
            return self.varying(found.values[found.index])
        if found.interpolation in ("constant", "uniform"):
            first = np.cumsum(self.layout.counts) - self.layout.counts
            return found.values[found.index[first[self.curve]]]
        return self.vertex(found.values[found.index])


def _powers(t: np.ndarray) -> np.ndarray:
    return np.stack([t**3, t**2, t, np.ones_like(t)], axis=1)


def _slopes(t: np.ndarray) -> np.ndarray:
    return np.stack([3 * t**2, 2 * t, np.ones_like(t), np.zeros_like(t)], axis=1)


def read_layout(prim: Usd.Prim, code: float, points: int, report: Notebook) -> Layout | None:
    """How a prim's curves are laid out; None (reported) if they are none."""
    path, curves = prim.GetPath(), UsdGeom.BasisCurves(prim)
    counts = as_rows(curves.GetCurveVertexCountsAttr().Get(code), 1, int)
    basis = "linear" if curves.GetTypeAttr().Get() == UsdGeom.Tokens.linear else str(curves.GetBasisAttr().Get())
    wrap = str(curves.GetWrapAttr().Get())
    if not len(counts) or not points:
        report.warn(path, "curves without vertices", "they are left out")
        return None
    if (counts < 0).any() or counts.sum() != points:
        why = f"curveVertexCounts sum to {counts.sum()}, points are {points}; they are left out"
        report.warn(path, "curves with a broken topology", why)
        return None
    if basis not in _MATRICES or wrap not in ("nonperiodic", "periodic", "pinned"):
        report.warn(path, "curves of an unknown kind", f"basis {basis}, wrap {wrap}; they are left out")
        return None
    layout = Layout(counts, basis, wrap)
    if not layout.spans.any():
        why = f"{wrap} {basis} curves of {counts.min()} to {counts.max()} vertices have no span; they are left out"
        report.warn(path, "curves of too few vertices", why)
        return None
    if layout.left_over:
        why = f"{layout.left_over} vertices do not fit {wrap} {basis} curves, and are left out: a span has {2 if basis == 'linear' else 4} " \
            f"vertices, and the next one begins {layout.vstep} further"  # fmt: skip
        report.warn(path, "curves with vertices left over", why)
    return layout


def read_widths(prim: Usd.Prim, code: float, layout: Layout, report: Notebook) -> CornerValues | None:
    """The authored widths (n, 1) over control vertices, or ends of spans; None if there are none that fit (reported)."""
    curves = UsdGeom.BasisCurves(prim)
    primvar = UsdGeom.PrimvarsAPI(prim).GetPrimvar("widths")
    if primvar and primvar.HasAuthoredValue():
        flat, interpolation = primvar.ComputeFlattened(code), str(primvar.GetInterpolation())
    else:
        flat, interpolation = curves.GetWidthsAttr().Get(code), str(curves.GetWidthsInterpolation())
    values = as_rows(flat, 1)[:, None]
    if not len(values):
        why = f"a tube of {DEFAULT_WIDTH:g} unit is drawn; usdrecord draws lines of one pixel. Author widths"
        report.warn(prim.GetPath(), "curves without widths", why)
        return None
    sizes = {"constant": 1, "uniform": len(layout.counts), "varying": int(layout.varying.sum()), "vertex": int(layout.counts.sum())}
    if len(values) != sizes.get(interpolation):
        fitting = [name for name, size in sizes.items() if size == len(values)]
        if not fitting:
            why = f"{len(values)} {interpolation} values, not {sizes.get(interpolation, 0)}; {DEFAULT_WIDTH:g} unit is used"
            report.warn(prim.GetPath(), "widths do not fit their curves", why)
            return None
        interpolation = fitting[0]
    vertices = np.arange(layout.counts.sum())
    return finite(spread(values, interpolation, None, layout.counts, vertices, int(layout.varying.sum())))


def read_directions(prim: Usd.Prim, code: float, layout: Layout, report: Notebook) -> CornerValues | None:
    """The normals (n, 3) of ribbons; None if the curves have none that fit (reported), and are tubes."""
    vertices = np.arange(layout.counts.sum())
    return read_normals(prim, code, layout.counts, vertices, report, varying=int(layout.varying.sum()))
