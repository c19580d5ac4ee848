"""UsdGeomCamera to a glTF camera and `extras.usdCamera`.

Apertures and focal lengths are tenths of a stage unit, distances stage units (usdGeom/schema.usda);
glTF gets metres. An orthographic camera's window is its aperture, in the same tenths.
"""

from __future__ import annotations

import math

import numpy as np
from pxr import Usd, UsdGeom

from .animation import NOISE, needed
from .arnold_lens import ArnoldLens
from .arnold_placement import placement_names
from .gltf_document import number, numbers
from .report import Notebook
from .shutters import authored_shutter, is_interval
from .stage import Frames, changes
from .vendors import report_others

_TENTH = 0.1
_EXPOSURE = ("exposure", "exposure:iso", "exposure:time", "exposure:fStop", "exposure:responsivity")
_LENS = (
    "horizontalAperture", "verticalAperture", "horizontalApertureOffset", "verticalApertureOffset",
    "focalLength", "fStop", "focusDistance", "clippingRange", *_EXPOSURE,
)  # fmt: skip
"""What is carried over time."""
_STILL = ("projection", "shutter:open", "shutter:close")
"""What is not."""
_DEFAULT_RANGE = (1.0, 1e6)
"""UsdGeomCamera's fallback, which is not what anybody chose to see."""
_LARGEST = 3e38


def read_camera(
    prim: Usd.Prim, frames: Frames, meters_per_unit: float, is_hidden: bool, report: Notebook
) -> tuple[dict, dict] | None:
    """The glTF camera and its extras; None (reported) if there is no carrier for it."""
    camera = UsdGeom.Camera(prim)
    path = prim.GetPath()
    for name in _STILL:
        if changes(prim.GetAttribute(name), frames):
            report.warn(path, f"animated camera {name}", "the first frame's value is used")
    orthographic = camera.GetProjectionAttr().Get(frames.first) == UsdGeom.Tokens.orthographic
    lens = _Lens(camera, frames, orthographic, meters_per_unit, report)
    if lens.aspect is None:
        return None
    extras = lens.extras()
    shutter = authored_shutter(camera, frames.first)
    if shutter is not None and is_interval(shutter):
        extras["shutter"] = numbers(shutter)
    elif shutter is not None and shutter[0] != shutter[1]:
        why = f"it opens at {shutter[0]:g} and closes at {shutter[1]:g}; nothing is blurred by it"
        report.warn(path, "camera shutter is no interval", why)
    if is_hidden:
        extras["hidden"] = True
    _report_losses(camera, frames, lens.arnold, report)
    report.count("cameras")
    znear, zfar = lens.clip_m()
    if orthographic:
        extent = {"xmag": number(lens.still("ymag") * lens.aspect), "ymag": number(lens.still("ymag"))}
        return {"type": "orthographic", "orthographic": {**extent, "znear": znear, "zfar": zfar}}, extras
    perspective = {
        "yfov": number(lens.still("yfov")),
        "aspectRatio": number(lens.aspect),
        "znear": max(znear, 1e-6),
        "zfar": zfar,
    }
    if perspective["zfar"] <= perspective["znear"]:
        del perspective["zfar"]
    return {"type": "perspective", "perspective": perspective}, extras


class _Lens:
    """All of a camera that may vary, as the file has it: a row for each sampled time code, or one row alone if nothing
    varies."""

    def __init__(
        self, camera: UsdGeom.Camera, frames: Frames, orthographic: bool, meters_per_unit: float, report: Notebook
    ) -> None:
        prim = camera.GetPrim()
        self.path, self.frames, self.report = prim.GetPath(), frames, report
        self.unit = meters_per_unit
        attributes = filter(prim.GetAttribute, _LENS)
        self.arnold = ArnoldLens(prim, orthographic, report)
        self.varies = any(changes(prim.GetAttribute(name), frames) for name in attributes)
        self.varies |= any(changes(attribute, frames) for attribute in self.arnold.attributes)
        self.codes = frames.codes if self.varies else (frames.first,)
        self.rest = self.codes.index(frames.first)
        self.aspect: float | None = None
        """Width over height at the first frame; None (reported) if the camera has no field of view there."""
        self.columns: dict[str, np.ndarray] = {}
        self._see(camera, orthographic)
        if self.aspect is None:
            return
        self._focus(camera)
        self.has_range = self._clip(camera)
        self._expose(camera)

    def still(self, name: str) -> float:
        """The first frame's number."""
        return float(self.columns[name][self.rest])

    def clip_m(self) -> tuple[float, float]:
        """The first frame's planes as glTF has them."""
        near, far = self.columns["clippingRange_m"][self.rest]
        return number(max(near, 0.0)), number(far)

    def extras(self) -> dict:
        """What of `extras.usdCamera` the lens is: that of the first frame, and `values` over time."""
        told = ["fStop", "focalLength_m", "focusDistance_m", "filmOffset"]
        told += ["clippingRange_m"] if self.has_range else []
        told += ["exposureScale"] if self.still("exposureScale") != 1.0 else []
        extras = {name: _written(self.columns[name][self.rest]) for name in told}
        varying = {name: column for name, column in self.columns.items() if _varies(column)}
        if varying:
            rows = self._keys(varying)
            extras["values"] = {
                "times": numbers(np.float32(self.frames.seconds[rows])),
                **{name: [_written(row) for row in column[rows]] for name, column in varying.items()},
            }
        return extras

    def _keys(self, columns: dict[str, np.ndarray]) -> np.ndarray:
        """Which rows are written: from the last one before the first change to the first one after the last."""
        rows: set[int] = set()
        for column in columns.values():
            column = column.reshape(len(column), -1)
            keys = needed(self.frames, column)
            moving = np.flatnonzero(np.any(column[keys][1:] != column[keys][:-1], axis=1))
            rows.update(keys[moving[0] : moving[-1] + 2].tolist())
        first, last = min(rows), max(rows)
        numbers_between = np.flatnonzero(self.frames.is_number)
        rows.update(row for row in numbers_between.tolist() if first < row < last)
        return np.array(sorted(rows))

    def _values(self, attribute: Usd.Attribute) -> np.ndarray:
        """An attribute's values, rows of numbers where it has several; what is no number is NaN."""

        def get(code: float):
            value = attribute.Get(code)
            return math.nan if value is None else value

        if not attribute.ValueMightBeTimeVarying():
            return np.array([get(self.frames.first)] * len(self.codes), dtype=float)
        return np.array([get(code) for code in self.codes], dtype=float)

    def _held(self, column: np.ndarray, good: np.ndarray) -> np.ndarray:
        """The column, but for rows that are not good the last good one before, or else the first one."""
        last = np.maximum.accumulate(np.where(good, np.arange(len(good)), -1))
        return column[np.where(last < 0, np.flatnonzero(good)[0], last)]

    def _later(self, good: np.ndarray) -> str:
        """The first time code that is not good, for a message."""
        return f"{self.codes[int(np.flatnonzero(~good)[0])]:g}"

    def _see(self, camera: UsdGeom.Camera, orthographic: bool) -> None:
        """The field of view, and where it is off the middle."""
        width = self._values(camera.GetHorizontalApertureAttr())
        height = self._values(camera.GetVerticalApertureAttr())
        focal = self._values(camera.GetFocalLengthAttr())
        sizes = np.stack([width, height, np.ones_like(focal) if orthographic else focal])
        good = (np.isfinite(sizes) & (sizes > 0)).all(axis=0)
        what = "camera without a field of view"
        if not good[self.rest]:
            given = f"apertures {width[self.rest]:g} x {height[self.rest]:g} and focal length {focal[self.rest]:g}"
            self.report.warn(self.path, what, f"{given} must be positive; it is left out")
            return
        if not good.all():
            why = f"at time code {self._later(good)} its apertures and focal length are not positive; those before are held"
            self.report.warn(self.path, what, why)
            width, height, focal = (self._held(column, good) for column in (width, height, focal))
        focal_there = np.ones_like(focal) if orthographic else focal
        film = [self.arnold.film(code, *sizes) for code, *sizes in zip(self.codes, width, height, focal_there, strict=True)]
        width, height, *middle = np.array(film).T
        if not (good := (np.stack([width, height]) > 0).all(axis=0)).all():
            self.report.warn(self.path, what, f"at time code {self._later(good)} Arnold's screen_window is empty; it is left out")
            return
        aspects = width / height
        self.aspect = float(aspects[self.rest])
        if not np.allclose(aspects, self.aspect, rtol=1e-5):
            why = f"it is {aspects.min():.4g} to {aspects.max():.4g} wide for its height; the picture keeps the shape of the first frame, " \
                "and all of each is in it, with more beside it (RenderSettings' expandAperture); usdrecord's changes its height"  # fmt: skip
            self.report.note(self.path, "animated camera aspect", why)
        same = np.isclose(aspects, self.aspect, rtol=1e-6)
        wider, higher = np.maximum(width, height * self.aspect), np.maximum(height, width / self.aspect)
        width, height = np.where(same, width, wider), np.where(same, height, higher)
        if orthographic:
            self.columns["ymag"] = height * (_TENTH * self.unit / 2)
        else:
            self.columns["yfov"] = 2 * np.arctan(height / (2 * focal))
        self.columns["focalLength_m"] = _finite(focal * _TENTH * self.unit)
        offsets = camera.GetHorizontalApertureOffsetAttr(), camera.GetVerticalApertureOffsetAttr()
        offsets = [_finite(self._values(attribute) + by) for attribute, by in zip(offsets, middle, strict=True)]
        offsets = [by / size for by, size in zip(offsets, (width, height), strict=True)]
        self.columns["filmOffset"] = np.stack(offsets, axis=1)

    def _focus(self, camera: UsdGeom.Camera) -> None:
        self.columns["fStop"] = np.maximum(_finite(self._values(camera.GetFStopAttr())), 0.0)
        distance = self._values(camera.GetFocusDistanceAttr()) * self.unit
        if "focus_distance" in self.arnold:
            distance = np.array([self.arnold.get("focus_distance", code, (1.0,))[0] for code in self.codes]) * self.unit
        self.columns["focusDistance_m"] = np.maximum(_finite(distance), 0.0)
        if not self.columns["fStop"].any():
            # A pinhole is focused nowhere and everywhere.
            for name in ("focalLength_m", "focusDistance_m"):
                self.columns[name] = self.columns[name][[self.rest] * len(self.codes)]

    def _clip(self, camera: UsdGeom.Camera) -> bool:
        """The clipping ranges; whether anybody chose them. What is no range is reported."""
        ranges = self._values(camera.GetClippingRangeAttr()).reshape(len(self.codes), -1)
        if ranges.shape[1] != 2:
            ranges = np.tile(_DEFAULT_RANGE, (len(self.codes), 1))
        for end, name in enumerate(("near_clip", "far_clip")):
            if name in self.arnold:
                ranges[:, end] = [self.arnold.get(name, code, (_DEFAULT_RANGE[end],))[0] for code in self.codes]
        good = np.isfinite(ranges[:, 0]) & (ranges[:, 0] < ranges[:, 1])
        what = "clippingRange is no range"
        if not good.any():
            near, far = ranges[self.rest]
            self.report.warn(self.path, what, f"it is {near:g} to {far:g}; nothing is clipped")
            ranges = np.tile(_DEFAULT_RANGE, (len(self.codes), 1))
        elif not good.all():
            self.report.warn(self.path, what, f"at time code {self._later(good)} it is none; that before is held")
            ranges = self._held(ranges, good)
        has_range = bool((ranges != np.array(_DEFAULT_RANGE)).any())
        near, far = ranges.T * self.unit
        self.columns["clippingRange_m"] = np.stack([near, np.minimum(far, _LARGEST)], axis=1)
        return has_range

    def _expose(self, camera: UsdGeom.Camera) -> None:
        attributes = (camera.GetPrim().GetAttribute(name) for name in _EXPOSURE)
        is_constant = not any(attribute and attribute.ValueMightBeTimeVarying() for attribute in attributes)
        codes = (self.frames.first,) if is_constant else self.codes
        scales = np.array([camera.ComputeLinearExposureScale(code) for code in codes], dtype=float)
        good = np.isfinite(scales) & (scales > 0) & (scales < _LARGEST)
        what = "camera exposure is no factor"
        if not good.any():
            self.report.warn(self.path, what, f"its attributes give {scales[0]:g}; 1 is used")
            scales = np.ones(1)
        elif not good.all():
            self.report.warn(self.path, what, f"at time code {self._later(good)} it is none; that before is held")
            scales = self._held(scales, good)
        scales = scales if len(scales) == len(self.codes) else np.repeat(scales[:1], len(self.codes))
        self.columns["exposureScale"] = np.array([number(scale) for scale in scales])


def _written(value) -> float | list[float]:
    return number(value) if np.ndim(value) == 0 else numbers(value)


def _varies(column: np.ndarray) -> bool:
    """Whether rows differ by more than single precision's noise, in any of their numbers."""
    numbers_of = np.reshape(column, (len(column), -1))
    apart = np.abs(numbers_of - numbers_of[0]).max(axis=0)
    return bool((apart > NOISE * np.abs(numbers_of).max(axis=0)).any())


def _finite(values: np.ndarray) -> np.ndarray:
    return np.where(np.isfinite(values), values, 0.0)


def _report_losses(camera: UsdGeom.Camera, frames: Frames, arnold: ArnoldLens, report: Notebook) -> None:
    """What a camera has and the file cannot hold."""
    prim, path = camera.GetPrim(), camera.GetPath()
    planes = camera.GetClippingPlanesAttr().Get(frames.first)
    if planes:
        report.warn(path, "clippingPlanes", f"{len(planes)} planes have no carrier; nothing is cut by them")
    if camera.GetStereoRoleAttr().Get(frames.first) not in (None, UsdGeom.Tokens.mono):
        report.note(path, "camera stereoRole", "each camera is carried by itself")
    known = placement_names(prim) | {attribute.GetName() for attribute in arnold.attributes}
    report_others(prim, known, frames.first, report, _in_arnolds_words(camera, frames.first))


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
