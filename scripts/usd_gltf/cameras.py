"""UsdGeomCamera to a glTF camera and `extras.usdCamera`.

Apertures and focal lengths are tenths of a stage unit, distances stage units (usdGeom/schema.usda);
glTF gets metres.
"""

from __future__ import annotations

import math

from pxr import Usd, UsdGeom

from .gltf_document import number
from .report import Report
from .stage import Frames, changes

_TENTH = 0.1
_READ = (
    "projection", "horizontalAperture", "verticalAperture", "horizontalApertureOffset",
    "verticalApertureOffset", "focalLength", "fStop", "focusDistance", "clippingRange",
)  # fmt: skip


def read_camera(
    prim: Usd.Prim, frames: Frames, meters_per_unit: float, report: Report
) -> tuple[dict, dict] | None:
    """The glTF camera and its extras; None (reported) if there is no carrier for it."""
    camera = UsdGeom.Camera(prim)
    path = prim.GetPath()
    for attribute in prim.GetAuthoredAttributes():
        name = attribute.GetName()
        if name in _READ and changes(attribute, frames):
            report.warn(path, f"animated camera {name}", "the first frame's value is used")

    def get(attribute: Usd.Attribute) -> float:
        value = attribute.Get(frames.first)
        return float(value) if value is not None else math.nan

    if camera.GetProjectionAttr().Get(frames.first) == UsdGeom.Tokens.orthographic:
        report.warn(path, "orthographic camera", "the renderer knows perspective only; it is left out")
        return None
    width, height = get(camera.GetHorizontalApertureAttr()), get(camera.GetVerticalApertureAttr())
    focal = get(camera.GetFocalLengthAttr())
    if not all(math.isfinite(v) and v > 0 for v in (width, height, focal)):
        why = f"apertures {width:g} x {height:g} and focal length {focal:g} must be positive; it is left out"
        report.warn(path, "camera without a field of view", why)
        return None
    near, far = camera.GetClippingRangeAttr().Get(frames.first) or (1.0, 1e6)
    perspective = {
        "yfov": number(2 * math.atan(height / (2 * focal))),
        "aspectRatio": number(width / height),
        "znear": number(max(near * meters_per_unit, 1e-6)) if math.isfinite(near) else 1e-3,
    }
    if math.isfinite(far) and number(far * meters_per_unit) > perspective["znear"]:
        perspective["zfar"] = number(far * meters_per_unit)
    extras = {
        "fStop": max(_finite(get(camera.GetFStopAttr())), 0.0),
        "focalLength_m": number(focal * _TENTH * meters_per_unit),
        "focusDistance_m": max(_finite(get(camera.GetFocusDistanceAttr()) * meters_per_unit), 0.0),
        "filmOffset": [
            _finite(get(camera.GetHorizontalApertureOffsetAttr()) / width),
            _finite(get(camera.GetVerticalApertureOffsetAttr()) / height),
        ],
    }
    report.count("cameras")
    return {"type": "perspective", "perspective": perspective}, extras


def _finite(value: float) -> float:
    return number(value) if math.isfinite(value) else 0.0
