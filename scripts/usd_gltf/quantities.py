"""What a shader network computes, kept as symbolic as it can be.

A `Quantity` has one to four parts. A part is a constant plus a weighted sum of bases: channels of images, coordinates,
primvars, or planes of texels that were computed already. Sums, products with constants, swizzles and mixes by constants stay
symbolic, so a file whose texels glTF can read as they are is passed on untouched. Anything else is computed texel by
texel (`Canvas.apply`), which needs all its images to be read with the same coordinates.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np

from .textures import TextureRead, resized

_MOST_TEXELS = 1 << 28
"""Values that the planes of one canvas may have together."""
_SIDE = 1024
"""Pixels on a side of a plane that is computed of texture coordinates alone."""


class Lost(Exception):
    """What a network computes has no counterpart. The message says why, without a full stop."""

    is_placed = False
    """Whether the message says which node it is about."""

    def placed(self, node: str) -> Lost:
        """The same about a node, unless one nearer to the cause is named already."""
        if self.is_placed:
            return self
        lost = Lost(f"{self} ({node})")
        lost.is_placed = True
        return lost


@dataclass(frozen=True)
class Mapping:
    """How an image is laid on a surface."""

    uv_name: str
    transform: tuple[float, float, float, float, float] | None
    wraps: tuple[str, str]


@dataclass(eq=False)
class Picture:
    """An image that a network reads: all its four channels, linear."""

    read: TextureRead
    values: Callable[[int], np.ndarray]
    """The plane of a channel, (h, w)."""

    @property
    def mapping(self) -> Mapping:
        return Mapping(self.read.uv_name, self.read.transform, self.read.wraps)


@dataclass(frozen=True)
class Channel:
    """A channel of an image, 0 to 3."""

    picture: Picture
    index: int


@dataclass(frozen=True)
class Coordinate:
    """Coordinate 0 or 1 of a set of texture coordinates."""

    uv_name: str
    axis: int


@dataclass(frozen=True)
class Primvar:
    """A part of another primvar, or of a property of the geometry such as `Nworld`."""

    name: str
    index: int
    default: tuple[float, ...] = ()
    """What stands in on meshes without it."""


@dataclass(eq=False)
class Plane:
    """Texels that were computed, (h, w), and how they lie on the surface."""

    texels: np.ndarray
    mapping: Mapping


Basis = Channel | Coordinate | Primvar | Plane


@dataclass
class Part:
    """A constant and a weighted sum of bases."""

    constant: float = 0.0
    terms: dict[Basis, float] = field(default_factory=dict)

    def scaled(self, factor: float) -> Part:
        """This part times a number."""
        if factor == 0.0:
            return Part()
        return Part(self.constant * factor, {basis: weight * factor for basis, weight in self.terms.items()})

    def plus(self, other: Part) -> Part:
        """The sum of two parts."""
        terms = dict(self.terms)
        for basis, weight in other.terms.items():
            terms[basis] = terms.get(basis, 0.0) + weight
        return Part(self.constant + other.constant, {basis: weight for basis, weight in terms.items() if weight != 0.0})


@dataclass
class Quantity:
    """One to four parts."""

    parts: list[Part]

    @staticmethod
    def of(values: float | Iterable[float]) -> Quantity:
        """Constants."""
        return Quantity([Part(float(value)) for value in np.atleast_1d(np.asarray(values, dtype=float)).ravel()])

    @property
    def is_constant(self) -> bool:
        return not any(part.terms for part in self.parts)

    @property
    def constant(self) -> np.ndarray:
        """The constants, (k,)."""
        return np.array([part.constant for part in self.parts])

    def bases(self) -> list[Basis]:
        """All bases, each once, in order."""
        return list(dict.fromkeys(basis for part in self.parts for basis in part.terms))

    def wide(self, width: int) -> Quantity:
        """With `width` parts: a single one is repeated, missing ones are 0 (a fourth is 1)."""
        if len(self.parts) == 1:
            return Quantity(self.parts * width)
        missing = [Part(1.0 if index == 3 else 0.0) for index in range(len(self.parts), width)]
        return Quantity([*self.parts, *missing][:width])


def add(a: Quantity, b: Quantity, weight: float = 1.0) -> Quantity:
    """`a + weight * b`."""
    a, b = _same_width(a, b)
    return Quantity([x.plus(y.scaled(weight)) for x, y in zip(a.parts, b.parts, strict=True)])


def combined(parts: Iterable[Quantity]) -> Quantity:
    """The first parts of several quantities as one."""
    return Quantity([quantity.parts[0] for quantity in parts])


def total(value: Quantity) -> Quantity:
    """The sum of all parts."""
    result = Part()
    for part in value.parts:
        result = result.plus(part)
    return Quantity([result])


def _same_width(*quantities: Quantity) -> list[Quantity]:
    width = max(len(quantity.parts) for quantity in quantities)
    return [quantity.wide(width) for quantity in quantities]


class Canvas:
    """Where quantities are computed texel by texel.

    `tile` shifts the texture coordinates by whole numbers: what repeats looks alike on every tile.
    """

    def __init__(self, tile: tuple[int, int] = (0, 0)) -> None:
        self.tile = tile
        self.depends_on_coordinates = False
        self._texels = 0
        self._sources: dict[tuple, np.ndarray] = {}

    def multiply(self, a: Quantity, b: Quantity) -> Quantity:
        """The product of each two parts."""
        a, b = _same_width(a, b)
        for x, y in ((a, b), (b, a)):
            if x.is_constant:
                return Quantity([part.scaled(factor) for part, factor in zip(y.parts, x.constant, strict=True)])
        return self.apply(np.multiply, a, b)

    def mix(self, background: Quantity, foreground: Quantity, weight: Quantity) -> Quantity:
        """`background` where `weight` is 0, `foreground` where it is 1."""
        if weight.is_constant:
            if not weight.constant.any():
                return background
            if (weight.constant == 1.0).all():
                return foreground
        return add(background, self.multiply(add(foreground, background, -1.0), weight))

    def apply(self, function: Callable[..., np.ndarray], *quantities: Quantity) -> Quantity:
        """A function of arrays (k, ...) that gives an array (n, ...), of quantities of one width or of one part."""
        if all(quantity.is_constant for quantity in quantities):
            with np.errstate(all="ignore"):
                return Quantity.of(_finite(function(*(quantity.constant for quantity in quantities))))
        mapping, height, width = self._place(quantities)
        arrays = [self._array(quantity, height, width) for quantity in quantities]
        with np.errstate(all="ignore"):
            result = np.asarray(_finite(function(*arrays)))
        parts = []
        for plane in result:
            if plane.shape == (1, 1):
                parts.append(Part(float(plane[0, 0])))
            else:
                self._texels += plane.size
                parts.append(Part(0.0, {Plane(np.broadcast_to(plane, (height, width)), mapping): 1.0}))
        return Quantity(parts)

    def planes(self, quantity: Quantity) -> tuple[np.ndarray, Mapping]:
        """All parts as texels, (k, h, w), and how they lie on the surface."""
        mapping, height, width = self._place([quantity])
        return np.broadcast_to(self._array(quantity, height, width), (len(quantity.parts), height, width)), mapping

    def _place(self, quantities: Iterable[Quantity]) -> tuple[Mapping, int, int]:
        """The coordinates and the resolution that all bases are read with."""
        mappings: dict[Mapping, None] = {}
        height = width = 1
        for basis in dict.fromkeys(basis for quantity in quantities for basis in quantity.bases()):
            if isinstance(basis, Primvar):
                raise Lost(f"it depends on {basis.name}, which no texture can hold")
            if isinstance(basis, Coordinate):
                self.depends_on_coordinates = True
                mappings[Mapping(basis.uv_name, None, ("repeat", "repeat"))] = None
                shape = (_SIDE, _SIDE)
            elif isinstance(basis, Channel):
                mappings[basis.picture.mapping] = None
                shape = self._source(basis).shape
            else:
                mappings[basis.mapping] = None
                shape = basis.texels.shape
            height, width = max(height, shape[0]), max(width, shape[1])
        if len(mappings) > 1:
            raise Lost("it combines images that are read with different coordinates, or wrapped differently")
        if self._texels + height * width > _MOST_TEXELS:
            raise Lost("it takes too much memory to compute")
        return next(iter(mappings)), height, width

    def _array(self, quantity: Quantity, height: int, width: int) -> np.ndarray:
        parts = []
        for part in quantity.parts:
            values = np.full((1, 1), part.constant, np.float32)
            for basis, weight in part.terms.items():
                values = values + np.float32(weight) * self._values(basis, height, width)
            parts.append(values)
        full = any(part.shape != (1, 1) for part in parts)
        return np.stack([np.broadcast_to(part, (height, width)) if full else part for part in parts])

    def _values(self, basis: Basis, height: int, width: int) -> np.ndarray:
        if isinstance(basis, Coordinate):
            # The first row of texels is on top, where v is 1.
            count = (width, height)[basis.axis]
            at = (np.arange(count, dtype=np.float32) + 0.5) / np.float32(count)
            at = (at if basis.axis == 0 else 1 - at) + np.float32(self.tile[basis.axis])
            return np.broadcast_to(at[None, :] if basis.axis == 0 else at[:, None], (height, width))
        plane = self._source(basis) if isinstance(basis, Channel) else basis.texels
        return resized(plane, height, width)

    def _source(self, basis: Channel) -> np.ndarray:
        key = (basis.picture, basis.index)
        if key not in self._sources:
            self._sources[key] = np.asarray(basis.picture.values(basis.index), dtype=np.float32)
            self._texels += self._sources[key].size
        return self._sources[key]


def _finite(values: np.ndarray) -> np.ndarray:
    """What divides by zero is as large as a half float gets; what is no number is zero."""
    return np.nan_to_num(values, nan=0.0, posinf=65504.0, neginf=-65504.0)
