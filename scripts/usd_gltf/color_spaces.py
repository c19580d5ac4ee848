"""Colour spaces by the names that MaterialX, USD and Arnold give them, to linear Rec. 709."""

from __future__ import annotations

import numpy as np

from .pictures import linear_from_srgb

_AP1 = np.array([[1.705051, -0.621792, -0.083259], [-0.130256, 1.140805, -0.010548], [-0.024003, -0.128969, 1.152972]])
"""ACEScg to linear Rec. 709: MaterialX's `acescg_to_lin_rec709`."""
_P3 = np.array([[1.224930, -0.224930, 0.0], [-0.042059, 1.042059, 0.0], [-0.019641, -0.078648, 1.098289]])
"""Display P3 to linear Rec. 709: MaterialX's `lin_displayp3_to_lin_rec709`."""
_ADOBE = np.array([[1.398356, -0.398356, 0.0], [0.0, 1.0, 0.0], [0.0, -0.042929, 1.042929]])
"""Adobe RGB (1998) to linear Rec. 709: MaterialX's `lin_adobergb_to_lin_rec709`."""
_AP0 = np.array([[2.521685, -1.134130, -0.387555], [-0.276480, 1.372719, -0.096239], [-0.015378, -0.152975, 1.168353]])
"""ACES2065-1 to linear Rec. 709: usd-core's `lin_ap0_scene` to `lin_rec709_scene`, which has MaterialX's numbers for the others."""
_REC2020 = np.array([[1.660490, -0.587641, -0.072850], [-0.124550, 1.132900, -0.008349], [-0.018151, -0.100579, 1.118729]])
"""Rec. 2020, likewise."""
_XYZ = np.array([[3.240968, -1.537383, -0.498611], [-0.969244, 1.875967, 0.041555], [0.055630, -0.203977, 1.056971]])
"""CIE XYZ under D65, likewise."""
_SPACES = {
    "srgb_texture": ("srgb", None), "srgb": ("srgb", None), "srgb_rec709_scene": ("srgb", None),
    "lin_rec709": (1.0, None), "lin_rec709_scene": (1.0, None), "linear": (1.0, None), "raw": (1.0, None),
    "data": (1.0, None), "none": (1.0, None), "lin_srgb": (1.0, None), "utility - raw": (1.0, None),
    "utility - linear - srgb": (1.0, None), "utility - srgb - texture": ("srgb", None),
    "srgb - texture": ("srgb", None), "linear rec.709 (srgb)": (1.0, None),
    "g22_rec709": (2.2, None), "g22_rec709_scene": (2.2, None), "g18_rec709": (1.8, None), "g18_rec709_scene": (1.8, None),
    "acescg": (1.0, _AP1), "lin_ap1": (1.0, _AP1), "lin_ap1_scene": (1.0, _AP1), "aces - acescg": (1.0, _AP1),
    "aces2065-1": (1.0, _AP0), "lin_ap0": (1.0, _AP0), "lin_ap0_scene": (1.0, _AP0), "aces - aces2065-1": (1.0, _AP0),
    "lin_rec2020": (1.0, _REC2020), "lin_rec2020_scene": (1.0, _REC2020), "lin_ciexyzd65_scene": (1.0, _XYZ),
    "srgb_ap1_scene": ("srgb", _AP1), "g24_rec709_scene": (2.4, None),
    "g22_ap1": (2.2, _AP1), "g22_ap1_scene": (2.2, _AP1), "lin_displayp3": (1.0, _P3), "lin_p3d65_scene": (1.0, _P3),
    "srgb_displayp3": ("srgb", _P3), "srgb_p3d65_scene": ("srgb", _P3), "adobergb": (563 / 256, _ADOBE),
    "lin_adobergb": (1.0, _ADOBE), "lin_adobergb_scene": (1.0, _ADOBE), "g22_adobergb_scene": (563 / 256, _ADOBE),
}  # fmt: skip
"""Curve and matrix of each space, by its name in lower case."""


def is_known(name: str) -> bool:
    """Whether a colour space has an entry; `auto` and no name have none."""
    return name.lower() in _SPACES


def texture_space(name: str) -> str | None:
    """`sRGB` or `raw` where a space is one of UsdUVTexture's, `auto` where none is named; else None."""
    if name.lower() in ("", "auto"):
        return "auto"
    curve, matrix = _SPACES.get(name.lower(), (None, None))
    if matrix is not None or curve not in ("srgb", 1.0):
        return None
    return "sRGB" if curve == "srgb" else "raw"


def to_rec709(name: str, rgb: np.ndarray) -> np.ndarray:
    """Colours (3, ...) of a known space in linear Rec. 709."""
    curve, matrix = _SPACES[name.lower()]
    if curve == "srgb":
        rgb = linear_from_srgb(rgb)
    elif curve != 1.0:
        rgb = np.maximum(rgb, 0) ** curve
    return rgb if matrix is None else np.tensordot(matrix, rgb, axes=1)
