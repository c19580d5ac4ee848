"""Picture files into arrays of numbers: PNG, JPEG, TIFF and what else Pillow reads, OpenEXR, Radiance.

What cannot be read as it is meant (a cube map, several layers without a plain RGB, chroma of another
resolution) is refused with `PictureError`, never taken for something else.
"""

from __future__ import annotations

import io
import math
import os
import tempfile
from dataclasses import dataclass

import numpy as np
import OpenEXR
from PIL import Image, UnidentifiedImageError

_MOST_PIXELS = 1 << 28
_BRIGHTEST = 65504.0
"""What infinite light becomes: the largest half float, as in `src/ingest/image.rs`."""
_REC709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)
_BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])


_DAMAGE = (UnidentifiedImageError, OSError, ValueError, SyntaxError, Image.DecompressionBombError)
"""What Pillow raises for files that are no pictures."""


class PictureError(Exception):
    """The picture cannot be read. The message says why, and what to do."""


@dataclass
class Picture:
    """A decoded picture, first row on top."""

    texels: np.ndarray
    """(h, w, 4): RGBA. Light in linear Rec. 709 if `linear`, else codes in [0, 1]."""
    linear: bool
    """Whether the file holds numbers of light (floats), not codes."""
    srgb: bool
    """Whether UsdUVTexture's `auto` takes its colours for sRGB: codes of 8 bits in 3 or 4 channels."""
    cube: bool = False
    """Whether the file says that it is a cube map."""
    named: bool = False
    """Whether the file names primaries of its own, which were converted from."""


def kind(data: bytes) -> str | None:
    """`PNG`, `JPEG`, `EXR` or `HDR`, by the first bytes; None for anything else."""
    for magic, name in ((b"\x89PNG\r\n\x1a\n", "PNG"), (b"\xff\xd8\xff", "JPEG"), (b"\x76\x2f\x31\x01", "EXR")):
        if data.startswith(magic):
            return name
    return "HDR" if data.startswith((b"#?RADIANCE", b"#?RGBE")) else None


def decode(data: bytes) -> Picture:
    """Decode a file."""
    form = kind(data)
    if form == "EXR":
        return _exr(data)
    return _hdr(data) if form == "HDR" else _pillow(data)


def shape(data: bytes) -> tuple[tuple[int, int], bool] | None:
    """Width and height, and whether it is a cube map, of an OpenEXR (which is refused if it has no
    colour that can be read), PNG or JPEG; None for others."""
    if kind(data) == "EXR":
        part, _ = _colours(_exr_parts(data, header_only=True))
        _to_rec709(part.header.get("chromaticities"))
        return _window(part.header, "displayWindow")[1], _is_cube(part.header)
    if kind(data) in ("PNG", "JPEG"):
        try:
            with Image.open(io.BytesIO(data)) as image:
                return image.size, False
        except _DAMAGE as error:
            raise _unknown(error) from None
    return None


def is_srgb(data: bytes) -> bool:
    """Whether UsdUVTexture's `auto` takes the colours of a PNG or JPEG for sRGB."""
    try:
        with Image.open(io.BytesIO(data)) as image:
            return _is_srgb(image)
    except _DAMAGE as error:
        raise _unknown(error) from None


def linear_from_srgb(value: np.ndarray) -> np.ndarray:
    """IEC 61966-2-1, decoding."""
    return np.where(value <= 0.04045, value / 12.92, ((np.maximum(value, 0) + 0.055) / 1.055) ** 2.4)


def srgb_from_linear(value: np.ndarray) -> np.ndarray:
    """IEC 61966-2-1, encoding."""
    return np.where(value <= 0.0031308, value * 12.92, 1.055 * np.maximum(value, 0) ** (1 / 2.4) - 0.055)


def _pillow(data: bytes) -> Picture:
    try:
        with Image.open(io.BytesIO(data)) as image:
            if image.mode == "F":
                grey = np.asarray(image, dtype=np.float32)
                return Picture(_light(np.stack([grey, grey, grey, np.ones_like(grey)], axis=2)), True, False)
            if image.mode.startswith("I"):
                grey = np.asarray(image, dtype=np.float32) / 65535
                return Picture(np.stack([grey, grey, grey, np.ones_like(grey)], axis=2), False, False)
            return Picture(np.asarray(image.convert("RGBA"), dtype=np.float32) / 255, False, _is_srgb(image))
    except _DAMAGE as error:
        raise _unknown(error) from None


def _is_srgb(image: Image.Image) -> bool:
    return image.mode not in ("L", "LA", "1", "F") and not image.mode.startswith("I")


def _unknown(error: Exception) -> PictureError:
    text = str(error) if "BytesIO" not in str(error) else "no format that is known"
    return PictureError(f"it cannot be read ({text}); save it as PNG or OpenEXR")


def _light(texels: np.ndarray) -> np.ndarray:
    """Light is neither negative nor infinite; what is no number is dark."""
    texels = np.nan_to_num(texels, nan=0.0, posinf=_BRIGHTEST, neginf=0.0)
    return np.maximum(texels, 0.0)


# -- OpenEXR -------------------------------------------------------------------------------------


def _exr(data: bytes) -> Picture:
    _colours(_exr_parts(data, header_only=True))
    return _placed(*_colours(_exr_parts(data, header_only=False)))


def _exr_parts(data: bytes, header_only: bool) -> list:
    """The parts of an OpenEXR file. Sizes are checked, so headers come before pixels."""
    handle, path = tempfile.mkstemp(suffix=".exr")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        parts = OpenEXR.File(path, separate_channels=True, header_only=header_only).parts
        for part in parts:
            for name in ("dataWindow", "displayWindow"):
                _check_size(*_window(part.header, name)[1])
        return parts
    except (RuntimeError, ValueError, KeyError, TypeError, IndexError) as error:
        raise PictureError(f"OpenEXR cannot read it ({' '.join(str(error).split())})") from None
    finally:
        os.unlink(path)


def _colours(parts: list) -> tuple:
    """The first part with R, G and B, else with Y, else with one channel beside alpha; and the names
    of its red, green, blue and perhaps alpha."""
    channels = [{channel.name: channel for channel in part.header["channels"]} for part in parts]
    if any("deep" in str(part.header.get("type")) for part in parts):
        raise PictureError("it is a deep picture; save it as flat RGB")
    if any({"RY", "BY"} & names.keys() for names in channels):
        raise PictureError("it stores luminance and chroma; save it as flat RGB")
    for suits in (_rgb, _grey, _lone):
        for part, names in zip(parts, channels, strict=True):
            found = suits(names)
            if found:
                found += ["A"] if "A" in names else []
                if any(names[name].xSampling != 1 or names[name].ySampling != 1 for name in found):
                    raise PictureError("its channels are of different resolutions; save it as flat RGB")
                return part, found
    listed = ", ".join(sorted(name for names in channels for name in names))
    raise PictureError(f"it has no plain R, G, B or Y (its channels: {listed}); save it as flat RGB")


def _rgb(names) -> list[str]:
    return ["R", "G", "B"] if {"R", "G", "B"} <= set(names) else []


def _grey(names) -> list[str]:
    return ["Y"] * 3 if "Y" in names else []


def _lone(names) -> list[str]:
    colour = [name for name in names if name != "A"]
    return colour * 3 if len(colour) == 1 else []


def _is_cube(header: dict) -> bool:
    return header.get("envmap") in (OpenEXR.ENVMAP_CUBE, int(OpenEXR.ENVMAP_CUBE))


def _placed(part, names: list[str]) -> Picture:
    """The channels in their display window, dark around them, in linear Rec. 709."""
    (left, top), (width, height) = _window(part.header, "displayWindow")
    (x, y), (w, h) = _window(part.header, "dataWindow")
    texels = np.zeros((height, width, 4), np.float32)
    x0, y0 = max(x - left, 0), max(y - top, 0)
    x1, y1 = min(x - left + w, width), min(y - top + h, height)
    if x0 < x1 and y0 < y1:
        inside = slice(y0 - y + top, y1 - y + top), slice(x0 - x + left, x1 - x + left)
        texels[y0:y1, x0:x1, 3] = 1.0
        for number, name in enumerate(names):
            texels[y0:y1, x0:x1, number] = part.channels[name].pixels[inside]
    matrix = _to_rec709(part.header.get("chromaticities"))
    if matrix is not None:
        with np.errstate(invalid="ignore", over="ignore"):
            texels[:, :, :3] = _light(texels[:, :, :3]) @ matrix.T.astype(np.float32)
    return Picture(_light(texels), True, False, _is_cube(part.header), matrix is not None)


def _window(header: dict, name: str) -> tuple[tuple[int, int], tuple[int, int]]:
    """A window's first pixel and its size."""
    low, high = ([int(c) for c in corner] for corner in header[name])
    return (low[0], low[1]), (high[0] - low[0] + 1, high[1] - low[1] + 1)


def _check_size(width: int, height: int) -> None:
    if width < 1 or height < 1 or width * height > _MOST_PIXELS:
        raise PictureError(f"it is {width} x {height} pixels large; scale it")


def _to_rec709(chromaticities) -> np.ndarray | None:
    """The matrix to linear Rec. 709 from the primaries and the white of an OpenEXR header, which
    are Rec. 709's if it names none; white goes to white (Bradford). None if there is nothing to do.
    """
    if chromaticities is None or np.allclose(chromaticities, _REC709, atol=1e-4):
        return None
    theirs = _to_xyz(chromaticities)
    ours = _to_xyz(_REC709)
    if theirs is None:
        raise PictureError("its chromaticities span no colours; save it with those of Rec. 709")
    from_white, to_white = _BRADFORD @ theirs.sum(axis=1), _BRADFORD @ ours.sum(axis=1)
    adapt = np.linalg.inv(_BRADFORD) @ np.diag(to_white / from_white) @ _BRADFORD
    return np.linalg.inv(ours) @ adapt @ theirs


def _to_xyz(chromaticities) -> np.ndarray | None:
    """The matrix from RGB to XYZ with white at Y = 1; None if there is none."""
    xy = np.array(chromaticities, dtype=float).reshape(4, 2)
    if not np.isfinite(xy).all() or (xy[:, 1] == 0).any():
        return None
    xyz = np.stack([xy[:, 0] / xy[:, 1], np.ones(4), (1 - xy.sum(axis=1)) / xy[:, 1]])
    volume = abs(np.linalg.det(xyz[:, :3]))
    if not np.isfinite(volume) or volume < 1e-6:
        return None
    matrix = xyz[:, :3] * np.linalg.solve(xyz[:, :3], xyz[:, 3])
    return matrix if (np.abs(_BRADFORD @ matrix.sum(axis=1)) > 1e-6).all() else None


# -- Radiance ------------------------------------------------------------------------------------


def _hdr(data: bytes) -> Picture:
    """Radiance RGBE (Ward, "Real Pixels", Graphics Gems II): plain, or with adaptive run lengths."""
    header, separator, _ = data.partition(b"\n\n")
    resolution, line_end, body = data[len(header) + 2 :].partition(b"\n")
    words = resolution.split()
    lines = header.decode("latin-1").splitlines()
    if not separator or not line_end or len(words) != 4 or (words[0], words[2]) != (b"-Y", b"+X"):
        raise PictureError("its header is no picture's from top to bottom; save it as OpenEXR")
    if any(line.startswith("FORMAT=") and line.strip() != "FORMAT=32-bit_rle_rgbe" for line in lines):
        raise PictureError("its numbers are not RGBE; save it as OpenEXR")
    try:
        height, width = int(words[1]), int(words[3])
        exposures = [float(line.split("=", 1)[1]) for line in lines if line.startswith("EXPOSURE=")]
        _check_size(width, height)
        rgbe = _rgbe(np.frombuffer(body, np.uint8), width, height).astype(np.float32)
    except (ValueError, IndexError):
        raise PictureError("it is damaged; save it as OpenEXR") from None
    scale = np.where(rgbe[:, :, 3:] > 0, np.exp2(rgbe[:, :, 3:] - 136), 0) / np.float32(math.prod(exposures))
    ones = np.ones((height, width), np.float32)
    return Picture(_light(np.dstack([rgbe[:, :, :3] * scale, ones])), True, False)


def _rgbe(body: np.ndarray, width: int, height: int) -> np.ndarray:
    """The bytes of all pixels, (h, w, 4)."""
    if not (8 <= width < 32768 and tuple(body[:3]) == (2, 2, width >> 8)):
        return body[: width * height * 4].reshape(height, width, 4)
    pixels = np.empty((height, 4, width), np.uint8)
    at = 0
    for row in pixels:
        if tuple(body[at : at + 4]) != (2, 2, width >> 8, width & 255):
            raise ValueError
        at += 4
        for plane in row:
            x = 0
            while x < width:
                count = int(body[at])
                run = count > 128
                count = count - 128 if run else count
                if count == 0 or x + count > width:
                    raise ValueError
                plane[x : x + count] = body[at + 1] if run else body[at + 1 : at + 1 + count]
                at += 2 if run else 1 + count
                x += count
    return pixels.transpose(0, 2, 1)
