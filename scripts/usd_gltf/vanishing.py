"""Visibility that changes over time.

What is drawn vanishes with a node around it, whose size is 1 while it is seen and 0 while it is hidden; keys are held, as
visibility is. A light without a mesh is dark while it is hidden, for size does not matter to all of them: a light whose shape
casts no shadows is not there at all while it is unlit (`src/ingest/carriers.md`). A camera has no use for a size
of 0: of what is drawn beside a camera, below a prim that hides both, the first frame's visibility counts. A camera itself
is not drawn, and never left out for visibility.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from pxr import Usd, UsdGeom

from .gltf_document import Document
from .light_inputs import SIZES, Light, light_type
from .stage import PROTOTYPE_PREDICATE, Frames

_DARKENED = (*SIZES, "DistantLight", "DomeLight", "DomeLight_1")


def seen_over_time(imageable: UsdGeom.Imageable, frames: Frames) -> np.ndarray:
    """At which of the sampled time codes a prim does not hide itself."""
    visibility = imageable.GetVisibilityAttr()
    return np.array([visibility.Get(code) != UsdGeom.Tokens.invisible for code in frames.codes])


def is_darkened(prim: Usd.Prim) -> bool:
    """Whether a prim is a light that is dark while it is hidden."""
    return light_type(prim) in _DARKENED


def is_drawn(prim: Usd.Prim) -> bool:
    """Whether the prim, or something below it, is drawn."""
    drawn = (UsdGeom.Gprim, UsdGeom.PointInstancer)
    return any(found.IsA(kind) for found in Usd.PrimRange(prim, PROTOTYPE_PREDICATE) for kind in drawn)


def holds_camera(prim: Usd.Prim) -> bool:
    """Whether the prim, or something below it, is a camera."""
    return any(found.IsA(UsdGeom.Camera) for found in Usd.PrimRange(prim, PROTOTYPE_PREDICATE))


def holds_light(prim: Usd.Prim) -> bool:
    """Whether the prim, or something below it, is a light that does not merely become dark."""
    found = Usd.PrimRange(prim, PROTOTYPE_PREDICATE)
    return any(light_type(below) is not None and not is_darkened(below) for below in found)


def dark_while_hidden(light: Light, seen: np.ndarray) -> Light:
    """The light, of no strength at the sampled time codes at which it is not seen."""
    others = [dark_while_hidden(other, seen) for other in light.others]
    others = [other for other in others if other.rgb.any()]
    return replace(light, rgb=np.where(seen[:, None], light.rgb, 0.0), others=others)


def hide(document: Document, frames: Frames, node: int, name: str, seen: np.ndarray) -> int:
    """The index of a node around `node`, of no size while that is not seen."""
    around = {"name": f"{name}_seen", "children": [node]}
    if not seen[frames.rest]:
        around["scale"] = [0.0] * 3
    index = document.node(around)
    keys = np.flatnonzero(np.concatenate([[True], seen[1:] != seen[:-1]]))
    sampler = {
        "input": document.accessor(frames.seconds[keys].astype(np.float32), bounds=True),
        "interpolation": "STEP",
        "output": document.accessor(np.repeat(seen[keys, None], 3, axis=1).astype(np.float32)),
    }
    document.animation["samplers"].append(sampler)
    target = {"node": index, "path": "scale"}
    document.animation["channels"].append({"sampler": len(document.animation["samplers"]) - 1, "target": target})
    return index
