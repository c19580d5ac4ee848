"""Images that a network reads: MaterialX's `image`, Arnold's `image`, and how their coordinates are mapped."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from pxr import Usd

from . import pictures
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
_STRAIGHT = 1e-5
"""How far, relative to their scale, the axes of texture coordinates may be from square ones."""


class NetworkImages:
    """Reads each image of a stage's networks once."""

    def __init__(self, textures: Textures) -> None:
        self.textures = textures
        self._known: dict[tuple, Picture | None] = {}

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
        uv_name, transform = mapping
        key = (attribute.GetPath(), code, space, uv_name, transform, wraps)
        if key not in self._known:
            self._known[key] = self._read(owner, attribute, code, space, mapping, wraps, report)
        return self._known[key]

    def _read(self, owner, attribute, code, space, mapping, wraps, report) -> Picture | None:
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
        read = self.textures.read(owner, attribute, plan, report)
        if read is None:
            return None
        if read.color_space == "auto":  # files of light, and of one channel, are raw by now
            read = replace(read, color_space="raw" if read.picture is not None and read.picture.linear else "sRGB")
        if named is None:
            read = _converted(read, space)
        return _picture(read)


def _picture(read: TextureRead) -> Picture:
    decoded: list[pictures.Picture] = []

    def values(index: int) -> np.ndarray:
        if not decoded:
            decoded.append(read.picture or pictures.decode(read.data))
        plane = decoded[0].texels[:, :, index]
        coded = read.color_space == "sRGB" and index < 3 and not decoded[0].linear
        return linear_from_srgb(plane) if coded else plane

    return Picture(read, values)


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
