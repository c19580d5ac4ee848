"""UsdGeomCamera to a glTF camera and `extras.usdCamera`.

Apertures and focal lengths are tenths of a stage unit, distances stage units (usdGeom/schema.usda);
glTF gets metres. An orthographic camera's window is its aperture, in the same tenths.
"""

from __future__ import annotations

import math

from pxr import Usd, UsdGeom

from .arnold_placement import placement_names
from .gltf_document import number, numbers
from .report import Notebook
from .shutters import authored_shutter, is_interval
from .stage import Frames, changes
from .vendors import report_others

_TENTH = 0.1
_READ = (
    "projection", "horizontalAperture", "verticalAperture", "horizontalApertureOffset",
    "verticalApertureOffset", "focalLength", "fStop", "focusDistance", "clippingRange", "exposure",
    "exposure:iso", "exposure:time", "exposure:fStop", "exposure:responsivity", "shutter:open", "shutter:close",
)  # fmt: skip
_DEFAULT_RANGE = (1.0, 1e6)
"""UsdGeomCamera's fallback, which is not what anybody chose to see."""
_LARGEST = 3e38


def read_camera(
    prim: Usd.Prim, frames: Frames, meters_per_unit: float, report: Notebook
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

    orthographic = camera.GetProjectionAttr().Get(frames.first) == UsdGeom.Tokens.orthographic
    width, height = get(camera.GetHorizontalApertureAttr()), get(camera.GetVerticalApertureAttr())
    focal = get(camera.GetFocalLengthAttr())
    if not all(math.isfinite(v) and v > 0 for v in (width, height, 1.0 if orthographic else focal)):
        why = f"apertures {width:g} x {height:g} and focal length {focal:g} must be positive; it is left out"
        report.warn(path, "camera without a field of view", why)
        return None
    near, far = _clipping(camera, frames, report)
    extras = {
        "fStop": max(_finite(get(camera.GetFStopAttr())), 0.0),
        "focalLength_m": _finite(focal * _TENTH * meters_per_unit),
        "focusDistance_m": max(_finite(get(camera.GetFocusDistanceAttr()) * meters_per_unit), 0.0),
        "filmOffset": [
            _finite(get(camera.GetHorizontalApertureOffsetAttr()) / width),
            _finite(get(camera.GetVerticalApertureOffsetAttr()) / height),
        ],
    }
    if (near, far) != _DEFAULT_RANGE:
        extras["clippingRange_m"] = numbers((near * meters_per_unit, min(far * meters_per_unit, _LARGEST)))
    exposure = camera.ComputeLinearExposureScale(frames.first)
    if not (math.isfinite(exposure) and 0 < exposure < _LARGEST):
        report.warn(path, "camera exposure is no factor", f"its attributes give {exposure:g}; 1 is used")
    elif number(exposure) != 1.0:
        extras["exposureScale"] = number(exposure)
    shutter = authored_shutter(camera, frames.first)
    if shutter is not None and is_interval(shutter):
        extras["shutter"] = numbers(shutter)
    elif shutter is not None and shutter[0] != shutter[1]:
        why = f"it opens at {shutter[0]:g} and closes at {shutter[1]:g}; nothing is blurred by it"
        report.warn(path, "camera shutter is no interval", why)
    _report_losses(camera, frames, report)
    report.count("cameras")
    znear, zfar = number(max(near * meters_per_unit, 0.0)), number(min(far * meters_per_unit, _LARGEST))
    if orthographic:
        half = _TENTH * meters_per_unit / 2
        extent = {"xmag": number(width * half), "ymag": number(height * half)}
        return {"type": "orthographic", "orthographic": {**extent, "znear": znear, "zfar": zfar}}, extras
    perspective = {
        "yfov": number(2 * math.atan(height / (2 * focal))),
        "aspectRatio": number(width / height),
        "znear": max(znear, 1e-6),
        "zfar": zfar,
    }
    if perspective["zfar"] <= perspective["znear"]:
        del perspective["zfar"]
    return {"type": "perspective", "perspective": perspective}, extras


def _clipping(camera: UsdGeom.Camera, frames: Frames, report: Notebook) -> tuple[float, float]:
    """The clipping range in stage units; the fallback (reported) for one that is none."""
    found = camera.GetClippingRangeAttr().Get(frames.first)
    near, far = (float(found[0]), float(found[1])) if found is not None else _DEFAULT_RANGE
    if not (math.isfinite(near) and near < far):
        why = f"it is {near:g} to {far:g}; nothing is clipped"
        report.warn(camera.GetPath(), "clippingRange is no range", why)
        return _DEFAULT_RANGE
    return near, far


def _report_losses(camera: UsdGeom.Camera, frames: Frames, report: Notebook) -> None:
    """What a camera has and the file cannot hold."""
    prim, path = camera.GetPrim(), camera.GetPath()
    planes = camera.GetClippingPlanesAttr().Get(frames.first)
    if planes:
        report.warn(path, "clippingPlanes", f"{len(planes)} planes have no carrier; nothing is cut by them")
    if camera.GetStereoRoleAttr().Get(frames.first) not in (None, UsdGeom.Tokens.mono):
        report.note(path, "camera stereoRole", "each camera is carried by itself")
    report_others(prim, placement_names(prim), frames.first, report, _in_arnolds_words(camera, frames.first))


def _in_arnolds_words(camera: UsdGeom.Camera, code: float) -> dict[str, float]:
    """What Arnold's parameters are, computed of the camera's attributes as arnold-usd does it (read_camera.cpp). Its
    writer repeats some of them, so as to read the very bits again."""
    found = camera.GetCamera(code)
    shutter = authored_shutter(camera, code) or (0.0, 0.0)
    return {
        "fov": found.GetFieldOfView(found.FOVHorizontal), "focus_distance": found.focusDistance,
        "near_clip": found.clippingRange.min, "far_clip": found.clippingRange.max,
        "shutter_start": shutter[0], "shutter_end": shutter[1],
    }  # fmt: skip


def _finite(value: float) -> float:
    return number(value) if math.isfinite(value) else 0.0
