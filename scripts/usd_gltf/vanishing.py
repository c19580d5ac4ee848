"""Visibility that changes over time: what can be carried of it, and what is lost.

A light that is hidden for some frames is dark in them: a light whose shape casts no shadows is not there at all while it
is unlit (`src/ingest/carriers.md`). Of geometry the first frame's visibility counts.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from pxr import Usd, UsdGeom

from .light_inputs import SIZES, Light, light_type
from .stage import PROTOTYPE_PREDICATE, Frames

_CARRIED = (*SIZES, "DistantLight", "DomeLight", "DomeLight_1")


def seen_over_time(imageable: UsdGeom.Imageable, frames: Frames) -> np.ndarray:
    """At which of the sampled time codes a prim does not hide itself."""
    visibility = imageable.GetVisibilityAttr()
    return np.array([visibility.Get(code) != UsdGeom.Tokens.invisible for code in frames.codes])


def is_carried(prim: Usd.Prim) -> bool:
    """Whether a prim is a light that can vanish."""
    return light_type(prim) in _CARRIED


def losses(prim: Usd.Prim) -> str | None:
    """The category of what is lost if the prim and all below it vanish: `lights` if there is one that gives light,
    `animation` for other things that are drawn, None if nothing is."""
    below = list(Usd.PrimRange(prim, PROTOTYPE_PREDICATE))
    # What a PointInstancer places is compiled by itself.
    places = any(found.IsA(UsdGeom.PointInstancer) for found in below)
    if any(light_type(found) is not None and (places or not is_carried(found)) for found in below):
        return "lights"
    drawn = (UsdGeom.Gprim, UsdGeom.PointInstancer, UsdGeom.Camera)
    return "animation" if any(found.IsA(kind) for found in below for kind in drawn) else None


def dark_while_hidden(light: Light, seen: np.ndarray) -> Light:
    """The light, of no strength at the sampled time codes at which it is not seen."""
    return replace(light, rgb=np.where(seen[:, None], light.rgb, 0.0))
