"""Texture files into glTF images, and packing of channels that glTF wants in one image.

glTF takes PNG and JPEG of eight bits. A file that says what glTF expects is passed on byte for byte;
other formats that can be decoded become PNG, and whatever needs another channel order, colour space,
scale or bias is computed into one. Emission of any range is baked (`baking`). UDIM tiles become one
image with all tiles side by side.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from PIL import Image
from pxr import Usd

from . import pictures
from .asset_files import UDIM, AssetFiles
from .baking import COARSE, bake, png_bytes
from .gltf_document import Document, number, numbers
from .pictures import Picture, PictureError, linear_from_srgb, srgb_from_linear
from .report import Notebook
from .source_hash import Dependencies

_LONGEST_ATLAS = 4096
"""Pixels on the longer side of an image of UDIM tiles; larger tiles are averaged down."""
_FALLBACK = "the texture's fallback colour is used"
_WRAPS = {"repeat": 10497, "mirror": 33648, "clamp": 33071, "black": 33071, "useMetadata": 10497}
CHANNELS = "rgba"


@dataclass(frozen=True)
class TextureRead:
    """One read of a UsdUVTexture: the file and how its texels become values."""

    name: str
    data: bytes
    existing: Path | None
    channel: str
    """`r`, `g`, `b`, `a` or `rgb`."""
    scale: tuple[float, float, float, float]
    bias: tuple[float, float, float, float]
    color_space: str
    """`sRGB`, `raw` or `auto`."""
    wraps: tuple[str, str]
    uv_name: str
    transform: tuple[float, float, float, float, float] | None
    """UsdTransform2d: rotation in degrees, scale, translation."""
    picture: Picture | None = None
    """The decoded texels, where the bytes are not what glTF takes."""

    def is_plain(self, channels: str, srgb: bool) -> bool:
        """Whether the file's own texels in `channels` are what glTF is to read."""
        if self.picture is not None and self.picture.linear:
            return False
        space = self.color_space == "auto" or (self.color_space == "sRGB") == srgb
        used = [CHANNELS.index(c) for c in channels]
        return space and self.channel == channels and all(self.bias[i] == 0 for i in used)


class Textures:
    """Finds, converts and stores the textures of materials."""

    def __init__(self, document: Document, dependencies: Dependencies, code: float, report: Notebook) -> None:
        self.document, self.code, self.report = document, code, report
        self.files = AssetFiles(dependencies)

    # -- files -----------------------------------------------------------------------------------

    def read(
        self, owner: object, attribute: Usd.Attribute, plan: TextureRead, report: Notebook
    ) -> TextureRead | None:
        """`plan`, which says how the texels are used, with the file that the attribute names; None
        (reported) if it cannot be read."""
        asset = attribute.Get(self.code)
        name = os.path.basename(asset.path) if asset is not None else ""
        try:
            if UDIM in name:
                return self._tiled(owner, attribute, plan, report)
            file = self.files.read(owner, attribute, self.code, _FALLBACK, report)
            if file is None:
                return None
            read = replace(plan, name=file.name, data=file.data, existing=file.existing)
            if pictures.kind(file.data) in ("PNG", "JPEG"):
                srgb = pictures.is_srgb(file.data)
            else:
                read = replace(read, picture=pictures.decode(file.data))
                srgb = read.picture.srgb
                if read.picture.cube:
                    raise PictureError("it is a cube map")
            return replace(read, color_space="raw") if plan.color_space == "auto" and not srgb else read
        except PictureError as error:
            report.warn(owner, "texture that cannot be read", f"{name}: {error}; {_FALLBACK}")
            return None

    def _tiled(
        self, owner: object, attribute: Usd.Attribute, plan: TextureRead, report: Notebook
    ) -> TextureRead | None:
        """All UDIM tiles as one picture; what no tile covers is black and clear."""
        path = attribute.Get(self.code).path
        tiles = {place: pictures.decode(file.data) for place, file in self.files.tiles(attribute, self.code).items()}
        if not tiles or plan.transform is not None:
            why = "there is no tile" if not tiles else "tiles under a UsdTransform2d have no carrier"
            report.warn(owner, "UDIM texture" if tiles else "missing texture", f"{path}: {why}; {_FALLBACK}")
            return None
        left, right = min(u for u, _ in tiles), max(u for u, _ in tiles)
        low, high = min(v for _, v in tiles), max(v for _, v in tiles)
        columns, rows = right - left + 1, high - low + 1
        full = max(max(tile.texels.shape[:2]) for tile in tiles.values())
        side = min(full, _LONGEST_ATLAS // max(columns, rows))
        texels = np.zeros((rows * side, columns * side, 4), np.float32)
        for (u, v), tile in tiles.items():
            top, start = (high - v) * side, (u - left) * side
            planes = [resized(tile.texels[:, :, c], side, side) for c in range(4)]
            texels[top : top + side, start : start + side] = np.stack(planes, axis=2)
        what = f"{path}: {len(tiles)} tiles become one image"
        if side < full:
            report.warn(owner, "UDIM texture reduced", f"{what}; each is averaged from {full} to {side} pixels")
        else:
            report.note(owner, "UDIM texture", what)
        one = next(iter(tiles.values()))
        return replace(
            plan,
            name=os.path.basename(path.replace(UDIM, "tiles")),
            data=path.encode(),
            picture=Picture(texels, one.linear, one.srgb),
            color_space="raw" if plan.color_space == "auto" and not one.srgb else plan.color_space,
            wraps=("clamp", "clamp"),
            transform=(0.0, 1 / columns, 1 / rows, -left / columns, -low / rows),
        )

    def _image(self, read: TextureRead) -> int:
        """A glTF image of a file, converted to PNG if need be."""
        stem = os.path.splitext(read.name)[0]
        if read.picture is not None:
            return self.document.image(stem + ".png", png_bytes(np.clip(read.picture.texels, 0.0, 1.0)))
        suffix = ".png" if pictures.kind(read.data) == "PNG" else ".jpg"
        fitting = os.path.splitext(read.name)[1].lower() in ((".png",) if suffix == ".png" else (".jpg", ".jpeg"))
        name = read.name if fitting else stem + suffix
        return self.document.image(name, read.data, read.existing if fitting else None)

    def _values(self, read: TextureRead, channel: str, srgb: bool) -> np.ndarray:
        """What a channel reads: linear, scaled and biased."""
        picture = read.picture or pictures.decode(read.data)
        at = CHANNELS.index(channel)
        value = picture.texels[:, :, at]
        coded = read.color_space == "sRGB" or (read.color_space == "auto" and srgb)
        if at < 3 and coded:
            value = linear_from_srgb(value)
        return value * read.scale[at] + read.bias[at]

    # -- textures --------------------------------------------------------------------------------

    def _texture(self, image: int, sampler: dict) -> int:
        return self.document.shared(
            "textures", {"source": image, "sampler": self.document.shared("samplers", sampler)}
        )

    def info(self, owner: object, read: TextureRead, image: int, uv_names: list[str]) -> dict:
        """Texture info (index, texCoord, transform) of an image read the way `read` says."""
        if "black" in read.wraps:
            self.report.warn(owner, "wrap mode black", "glTF has no border colour; clamped")
        sampler = {"wrapS": _WRAPS.get(read.wraps[0], 10497), "wrapT": _WRAPS.get(read.wraps[1], 10497)}
        if read.uv_name not in uv_names:
            uv_names.append(read.uv_name)
        info: dict = {"index": self._texture(image, sampler)}
        texcoord = uv_names.index(read.uv_name)
        if texcoord:
            info["texCoord"] = texcoord
        if read.transform is not None:
            extension = self.document.use("KHR_texture_transform")
            info["extensions"] = {extension: flipped_transform(*read.transform)}
        return info

    def plain(self, read: TextureRead) -> int:
        """The image of the file as it is."""
        return self._image(read)

    def packed(self, name: str, planes: list[tuple[TextureRead, str] | float], srgb: bool) -> int:
        """A PNG whose R, G, B, A are reads of channels or constants; RGB encoded as sRGB on request."""
        image = np.clip(self._stacked(planes, srgb), 0.0, 1.0)
        if srgb:
            image[:, :, :3] = srgb_from_linear(image[:, :, :3])
        return self.document.image(name + ".png", png_bytes(image))

    def baked(self, owner: object, name: str, planes: list[tuple[TextureRead, str]]) -> tuple[int, np.ndarray]:
        """A PNG of emission in R, G, B, and the factor of each."""
        light = np.clip(self._stacked(planes, srgb=True), 0.0, None)
        wraps = planes[0][0].wraps
        if wraps[0] == "black":
            light[:, [0, -1]] = 0.0  # clamped, they are what lies outside
        if wraps[1] == "black":
            light[[0, -1], :] = 0.0
        baked = bake(light)
        if baked.grain > COARSE:
            why = f"{name} becomes a PNG of eight bits and a factor; its total is kept, its grain is {baked.grain:.1%}"
            self.report.about("lights").warn(owner, "emissive texture baked coarsely", why)
        return self.document.image(name + ".png", baked.png), baked.factor

    def _stacked(self, planes: list[tuple[TextureRead, str] | float], srgb: bool) -> np.ndarray:
        values = [plane if isinstance(plane, float) else self._values(*plane, srgb) for plane in planes]
        shapes = [v.shape for v in values if isinstance(v, np.ndarray)]
        height, width = max(s[0] for s in shapes), max(s[1] for s in shapes)
        return np.stack([resized(v, height, width) for v in values], axis=2)


def flipped_transform(rotation_deg: float, sx: float, sy: float, tx: float, ty: float) -> dict:
    """UsdTransform2d, which acts where v runs up, as KHR_texture_transform, where v runs down.

    USD: (u', v') = R(angle) (sx u, sy v) + t. With v = 1 - v_gltf on both sides the angle and scale
    stay and the offset takes up the rest.
    """
    angle = math.radians(rotation_deg)
    offset = [tx - math.sin(angle) * sy, 1 - math.cos(angle) * sy - ty]
    return {"offset": numbers(offset), "rotation": number(angle), "scale": numbers((sx, sy))}


def resized(plane: np.ndarray | float, height: int, width: int) -> np.ndarray:
    """A plane at the common size, or a constant plane. Smaller sizes average, so light is kept."""
    if isinstance(plane, float):
        return np.full((height, width), plane)
    if plane.shape == (height, width):
        return plane
    image = Image.fromarray(plane.astype(np.float32))
    return np.asarray(image.resize((width, height), Image.Resampling.BOX if height < plane.shape[0] else Image.Resampling.BILINEAR), dtype=float)
