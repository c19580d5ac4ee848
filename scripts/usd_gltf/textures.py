"""Texture files into glTF images, and packing of channels that glTF wants in one image.

glTF takes PNG and JPEG. Other 8-bit formats that Pillow reads become PNG; OpenEXR and Radiance have
no carrier on a material and are reported. A file that says what glTF expects is passed on byte for
byte; whatever needs another channel order, colour space, scale or bias is computed into a PNG.
"""

from __future__ import annotations

import io
import math
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, UnidentifiedImageError
from pxr import Ar, Sdf, Usd

from .gltf_document import Document, number, numbers
from .report import Report
from .source_hash import read_asset

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

    def is_plain(self, channels: str, srgb: bool) -> bool:
        """Whether the file's own texels in `channels` are what glTF is to read."""
        space = self.color_space == "auto" or (self.color_space == "sRGB") == srgb
        used = [CHANNELS.index(c) for c in channels]
        return space and self.channel == channels and all(self.bias[i] == 0 for i in used)


class Textures:
    """Finds, converts and stores textures."""

    def __init__(self, document: Document, code: float, report: Report) -> None:
        self.document, self.code, self.report = document, code, report

    # -- files -----------------------------------------------------------------------------------

    def read(self, owner: object, attribute: Usd.Attribute) -> tuple[str, bytes, Path | None] | None:
        """Name, bytes and (outside packages) path of the file an asset attribute names."""
        asset = attribute.Get(self.code)
        if asset is None or not asset.path:
            return None
        resolved = asset.resolvedPath
        if "<UDIM>" in asset.path:
            why = f"{asset.path}: tiles have no carrier; tile 1001 is used for all"
            self.report.warn(owner, "UDIM texture", why)
            layer = attribute.GetPropertyStack(self.code)[0].layer
            first = Sdf.ComputeAssetPathRelativeToLayer(layer, asset.path.replace("<UDIM>", "1001"))
            resolved = str(Ar.GetResolver().Resolve(first))
        data = read_asset(resolved) if resolved else None
        if data is None:
            self.report.warn(owner, "missing texture", f"{asset.path} cannot be found")
            return None
        if Ar.IsPackageRelativePath(resolved):
            inner = Ar.SplitPackageRelativePathInner(resolved)[1]
            return os.path.basename(inner), data, None
        return os.path.basename(resolved), data, Path(resolved)

    def light_texture(self, owner: object, attribute: Usd.Attribute) -> dict | None:
        """Texture info of a light's colour map, read with the light's own coordinates."""
        found = self.read(owner, attribute)
        if found is None:
            return None
        image = self._image(owner, *found)
        if image is None:
            return None
        sampler = {"wrapS": 33071, "wrapT": 33071}
        return {"index": self._texture(image, sampler)}

    def usable(self, owner: object, read: TextureRead) -> bool:
        """Whether the file can be decoded; reported if not."""
        return _kind(read.data) in ("PNG", "JPEG") or self._decode(owner, read.name, read.data) is not None

    def _image(self, owner: object, name: str, data: bytes, existing: Path | None) -> int | None:
        """A glTF image of a file, converted to PNG if need be."""
        kind = _kind(data)
        stem = os.path.splitext(name)[0]
        if kind in ("PNG", "JPEG"):
            suffix = ".png" if kind == "PNG" else ".jpg"
            fitting = os.path.splitext(name)[1].lower() in ((".png",) if kind == "PNG" else (".jpg", ".jpeg"))
            return self.document.image(name if fitting else stem + suffix, data, existing if fitting else None)
        decoded = self._decode(owner, name, data)
        if decoded is None:
            return None
        return self.document.image(stem + ".png", _png(decoded))

    def _decode(self, owner: object, name: str, data: bytes) -> np.ndarray | None:
        """RGBA texels in [0, 1], (h, w, 4)."""
        try:
            with Image.open(io.BytesIO(data)) as image:
                if image.mode.startswith("I"):
                    grey = np.asarray(image, dtype=float) / 65535.0
                    return np.stack([grey, grey, grey, np.ones_like(grey)], axis=2)
                return np.asarray(image.convert("RGBA"), dtype=float) / 255.0
        except (UnidentifiedImageError, OSError, ValueError, Image.DecompressionBombError) as error:
            suffix = os.path.splitext(name)[1].lower()
            high = suffix in (".exr", ".hdr", ".tx", ".ptex", ".tex")
            why = f"{name}: glTF carries PNG and JPEG; convert it" if high else f"{name}: {error}"
            self.report.warn(owner, "texture's format", why)
            return None

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

    def plain(self, owner: object, read: TextureRead) -> int | None:
        """The image of the file as it is."""
        return self._image(owner, read.name, read.data, read.existing)

    def packed(self, owner: object, name: str, planes: list[tuple[TextureRead, str] | float], srgb: bool) -> int | None:
        """A PNG whose R, G, B, A are reads of channels or constants; RGB encoded as sRGB on request."""
        texels: list[np.ndarray | float] = []
        for plane in planes:
            if isinstance(plane, float):
                texels.append(plane)
                continue
            read, channel = plane
            decoded = self._decode(owner, read.name, read.data)
            if decoded is None:
                return None
            at = CHANNELS.index(channel)
            value = decoded[:, :, at]
            if at < 3 and (read.color_space == "sRGB" or (read.color_space == "auto" and srgb)):
                value = linear_from_srgb(value)
            texels.append(value * read.scale[at] + read.bias[at])
        shapes = [t.shape for t in texels if isinstance(t, np.ndarray)]
        height, width = max(s[0] for s in shapes), max(s[1] for s in shapes)
        image = np.stack([_resized(t, height, width) for t in texels], axis=2)
        image = np.clip(image, 0.0, 1.0)
        if srgb:
            image[:, :, :3] = srgb_from_linear(image[:, :, :3])
        return self.document.image(name + ".png", _png(image))


def flipped_transform(rotation_deg: float, sx: float, sy: float, tx: float, ty: float) -> dict:
    """UsdTransform2d, which acts where v runs up, as KHR_texture_transform, where v runs down.

    USD: (u', v') = R(angle) (sx u, sy v) + t. With v = 1 - v_gltf on both sides the angle and scale
    stay and the offset takes up the rest.
    """
    angle = math.radians(rotation_deg)
    offset = [tx - math.sin(angle) * sy, 1 - math.cos(angle) * sy - ty]
    return {"offset": numbers(offset), "rotation": number(angle), "scale": numbers((sx, sy))}


def linear_from_srgb(value: np.ndarray) -> np.ndarray:
    """IEC 61966-2-1, decoding."""
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def srgb_from_linear(value: np.ndarray) -> np.ndarray:
    """IEC 61966-2-1, encoding."""
    return np.where(value <= 0.0031308, value * 12.92, 1.055 * np.maximum(value, 0) ** (1 / 2.4) - 0.055)


def _kind(data: bytes) -> str | None:
    if data.startswith(b"\x89PNG\r\n\x1a\n"):
        return "PNG"
    return "JPEG" if data.startswith(b"\xff\xd8\xff") else None


def _png(texels: np.ndarray) -> bytes:
    """RGB or, where it is needed, RGBA bytes."""
    eight = np.round(texels * 255).astype(np.uint8)
    opaque = (eight[:, :, 3] == 255).all()
    buffer = io.BytesIO()
    Image.fromarray(eight[:, :, :3] if opaque else eight).save(buffer, format="PNG")
    return buffer.getvalue()


def _resized(plane: np.ndarray | float, height: int, width: int) -> np.ndarray:
    """A plane at the common size (bilinear), or a constant plane."""
    if isinstance(plane, float):
        return np.full((height, width), plane)
    if plane.shape == (height, width):
        return plane
    image = Image.fromarray(plane.astype(np.float32))
    return np.asarray(image.resize((width, height), Image.Resampling.BILINEAR), dtype=float)
