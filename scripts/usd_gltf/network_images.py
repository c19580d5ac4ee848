"""Images that a network reads: MaterialX's `image`, Arnold's `image`, and how their coordinates are mapped."""

from __future__ import annotations

import math
from collections import OrderedDict
from dataclasses import replace
from weakref import WeakValueDictionary

import numpy as np
from pxr import Usd

from . import pictures
from .asset_files import place_of
from .color_spaces import is_known, texture_space, to_rec709
from .pictures import linear_from_srgb
from .quantities import Channel, Coordinate, Lost, Part, Picture, Quantity
from .report import Notebook
from .textures import CHANNELS, TextureRead, Textures

_WRAPS = {
    "periodic": "repeat", "mirror": "mirror", "clamp": "clamp", "constant": "black", "black": "black", "repeat": "repeat",
    "useMetadata": "repeat", "file": "repeat",
}  # fmt: skip
"""UsdUVTexture's wrap modes by MaterialX's and Arnold's."""
_MOST_BYTES = 1 << 28
"""Bytes of files and texels that are kept: those of one picture of 4096 x 4096 pixels."""
_STRAIGHT = 1e-5
"""How far, relative to their scale, the axes of texture coordinates may be from square ones."""


class NetworkImages:
    """Reads the images of a stage's networks: each once while it is in use, and while its bytes are among the last
    `_MOST_BYTES`."""

    def __init__(self, textures: Textures) -> None:
        self.textures = textures
        self.kept = Kept(_MOST_BYTES)
        self._used: WeakValueDictionary[tuple, Picture] = WeakValueDictionary()
        self._lost: set[tuple] = set()

    def read(
        self,
        owner: str,
        attribute: Usd.Attribute,
        code: float,
        space: str,
        mapping: tuple,
        wraps: tuple[str, str],
        report: Notebook,
    ) -> Picture | None:
        """The image that an attribute names; None (reported) if it cannot be read. `space` is a colour space, `mapping` the
        primvar and the transform of `straight`."""
        named = texture_space(space)
        if named is None and not is_known(space):
            report.warn(
                owner,
                f"color space {space}",
                f"{attribute.Get(code).path} is read by the rule for files that name none",
            )
            named = "auto"
        plan = TextureRead(
            name="", data=b"", existing=None, channel="rgb", scale=(1.0,) * 4, bias=(0.0,) * 4,
            color_space=named or "raw", wraps=tuple(_WRAPS.get(wrap, "repeat") for wrap in wraps),
            uv_name=mapping[0], transform=mapping[1],
        )  # fmt: skip
        place = place_of(attribute, self.textures.code)
        key = (place, named or space, plan.uv_name, plan.transform, plan.wraps)
        # What is wrong with a file is reported for every material that reads it.
        asked = (owner, attribute.GetPath(), *key)
        if asked in self._lost:
            return None
        picture = self._used.get(key)
        if picture is None:
            read = self._read(owner, attribute, plan, "" if named else space, report)
            if read is None:
                self._lost.add(asked)
                return None
            picture = self._used[key] = self._picture(read, place)
        decoded = picture.read.picture
        self.kept.put(key, picture, len(picture.read.data) + (decoded.texels.nbytes if decoded is not None else 0))
        return picture

    def _read(
        self, owner: str, attribute: Usd.Attribute, plan: TextureRead, space: str, report: Notebook
    ) -> TextureRead | None:
        """The file as `plan` says, converted from `space` if that is not empty."""
        read = self.textures.read(owner, attribute, plan, report)
        if read is None:
            return None
        if read.color_space == "auto":  # files of light, and of one channel, are raw by now
            read = replace(read, color_space="raw" if read.picture is not None and read.picture.linear else "sRGB")
        return _converted(read, space) if space else read

    def _picture(self, read: TextureRead, place: str) -> Picture:
        def values(index: int) -> np.ndarray:
            decoded = read.picture or self._decoded(read.data, place)
            plane = decoded.texels[:, :, index]
            coded = read.color_space == "sRGB" and index < 3 and not decoded.linear
            return linear_from_srgb(plane) if coded else plane

        return Picture(read, values)

    def _decoded(self, data: bytes, place: str) -> pictures.Picture:
        key = (place,)
        picture = self.kept.get(key)
        if picture is None:
            picture = pictures.decode(data)
            self.kept.put(key, picture, picture.texels.nbytes)
        return picture


class Kept:
    """The things that were used last, as many as fit in `limit` bytes, and at least one."""

    def __init__(self, limit: int) -> None:
        self.limit, self.bytes = limit, 0
        self._items: OrderedDict[tuple, tuple[object, int]] = OrderedDict()

    def get(self, key: tuple) -> object | None:
        """The thing, which is the last used now; None if it is not kept."""
        if key not in self._items:
            return None
        self._items.move_to_end(key)
        return self._items[key][0]

    def put(self, key: tuple, item: object, size: int) -> None:
        """Keep a thing of `size` bytes as the last used one."""
        _, before = self._items.pop(key, (None, 0))
        self._items[key] = item, size
        self.bytes += size - before
        while self.bytes > self.limit and len(self._items) > 1:
            _, (_, gone) = self._items.popitem(last=False)
            self.bytes -= gone


def _converted(read: TextureRead, space: str) -> TextureRead:
    """The same image in linear Rec. 709, where glTF has no name for its space. A file that names its primaries is there already."""
    picture = read.picture or pictures.decode(read.data)
    if picture.named:
        return read
    texels = picture.texels.astype(np.float32).copy()
    texels[:, :, :3] = np.moveaxis(to_rec709(space, np.moveaxis(texels[:, :, :3], -1, 0)), 0, -1)
    converted = pictures.Picture(texels, linear=True, srgb=False)
    return replace(read, picture=converted, data=read.data + space.encode(), existing=None, color_space="raw")


def channels(picture: Picture, width: int) -> Quantity:
    """The first channels of an image."""
    return Quantity([Part(0.0, {Channel(picture, index): 1.0}) for index in range(width)])


def straight(coordinates: Quantity) -> tuple[str, tuple[float, float, float, float, float] | None]:
    """Texture coordinates as a primvar and a UsdTransform2d (rotation in degrees, scale, translation; None if it does
    nothing), which are the ones that glTF has: no shear, no second primvar, nothing that bends."""
    parts = coordinates.wide(2).parts
    names = {basis.uv_name for part in parts for basis in part.terms if isinstance(basis, Coordinate)}
    if any(not isinstance(basis, Coordinate) for part in parts for basis in part.terms):
        raise Lost("its texture coordinates are computed of other things than texture coordinates")
    if len(names) > 1:
        raise Lost("it reads two sets of texture coordinates at once")
    name = names.pop() if names else "st"
    (a, b), (d, e) = ([part.terms.get(Coordinate(name, axis), 0.0) for axis in (0, 1)] for part in parts)
    along = math.hypot(a, d)
    angle = math.atan2(d, a) if along > 0 else math.atan2(-b, e)
    across = e * math.cos(angle) - b * math.sin(angle)
    slant = b * math.cos(angle) + e * math.sin(angle)
    if not all(map(math.isfinite, (a, b, d, e, parts[0].constant, parts[1].constant))):
        raise Lost("its texture coordinates are not finite")
    if abs(slant) > _STRAIGHT * max(abs(across), along):
        raise Lost("its texture coordinates are sheared")
    degrees = math.degrees(angle)
    if abs(degrees) < 1e-9:
        degrees = 0.0
    transform = (degrees, along, across, parts[0].constant, parts[1].constant)
    return name, None if transform == (0.0, 1.0, 1.0, 0.0, 0.0) else transform


def flattened(name: str, planes: np.ndarray, mapping) -> TextureRead:
    """Texels that were computed, (k, h, w), as a read of an image of light: of `rgb` if there are three, else of `r`."""
    texels = np.ones((*planes.shape[1:], 4), np.float32)
    for index in range(4):
        if index < len(planes):
            texels[:, :, index] = planes[index]
        elif index < 3:
            texels[:, :, index] = planes[0]
    return TextureRead(
        name=name + ".png", data=texels.tobytes(), existing=None, channel="rgb" if len(planes) == 3 else "r",
        scale=(1.0,) * 4, bias=(0.0,) * 4, color_space="raw", wraps=mapping.wraps, uv_name=mapping.uv_name,
        transform=mapping.transform, picture=pictures.Picture(texels, linear=True, srgb=False),
    )  # fmt: skip


def single_read(value: Quantity) -> TextureRead | None:
    """The read of one image that a quantity is: three channels of it in their order, or one channel; None if it is neither."""
    taken = []
    for part in value.parts:
        if len(part.terms) != 1:
            return None
        ((basis, weight),) = part.terms.items()
        if not isinstance(basis, Channel):
            return None
        taken.append((basis.picture, basis.index, weight, part.constant))
    picture = taken[0][0]
    if any(other is not picture for other, _, _, _ in taken):
        return None
    indices = [index for _, index, _, _ in taken]
    scale, bias = [1.0] * 4, [0.0] * 4
    for _, index, weight, constant in taken:
        scale[index], bias[index] = weight, constant
    if indices == [0, 1, 2]:
        return replace(picture.read, channel="rgb", scale=tuple(scale), bias=tuple(bias))
    if len({one[1:] for one in taken}) == 1:
        return replace(picture.read, channel=CHANNELS[indices[0]], scale=tuple(scale), bias=tuple(bias))
    return None
