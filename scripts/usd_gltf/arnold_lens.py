"""Arnold's own parameters of a camera's lens, where USD's attributes say nothing.

arnold-usd writes `primvars:arnold:fov`, `screen_window_min`, `screen_window_max`, `focus_distance`, `near_clip` and `far_clip`, and reads
them (`ReadArnoldParameters`). Like Arnold's placement they count where the camera has no value of its own:

| parameter | means | counts without |
|---|---|---|
| `fov` | degrees across the picture's width, perspective | `horizontalAperture`, `focalLength` |
| `screen_window_min`, `_max` | perspective: what is seen of the field of view, (-1, -1) to (1, 1) being all; orthographic: the window in scene units | perspective: aperture offsets; orthographic: apertures |
| `focus_distance` | scene units | `focusDistance` |
| `near_clip`, `far_clip` | scene units | `clippingRange` |
"""  # noqa: E501

from __future__ import annotations

import math

import numpy as np
from pxr import Usd

from .light_attributes import arnold_names
from .primvars import as_rows
from .report import Notebook

_COUNT_WITHOUT = {
    "fov": ("horizontalAperture", "focalLength"), "focus_distance": ("focusDistance",),
    "near_clip": ("clippingRange",), "far_clip": ("clippingRange",),
}  # fmt: skip
_WINDOW = ("screen_window_min", "screen_window_max")


class ArnoldLens:
    """The parameters of one camera that count."""

    def __init__(self, prim: Usd.Prim, orthographic: bool, report: Notebook) -> None:
        self._orthographic = orthographic
        of_window = ("horizontalAperture", "verticalAperture") if orthographic else ("horizontalApertureOffset", "verticalApertureOffset")
        without = {**_COUNT_WITHOUT, **dict.fromkeys(_WINDOW, of_window)}
        self._found: dict[str, Usd.Attribute] = {}
        for name, others in without.items():
            if (name == "fov" and orthographic) or any(_is_authored(prim.GetAttribute(other)) for other in others):
                continue
            for alias in arnold_names(name):
                attribute = prim.GetAttribute(alias)
                if _is_authored(attribute) and len(_rows(attribute.Get(Usd.TimeCode.EarliestTime()), name)):
                    self._found.setdefault(name, attribute)
        if not orthographic and all(self._is_whole(name) for name in _WINDOW):
            for name in _WINDOW:
                self._found.pop(name, None)
        if self._found:
            why = "they say how the camera sees, for it has no such attributes of its own"
            report.note(prim.GetPath(), f"Arnold's {', '.join(self._found)}", why)

    @property
    def attributes(self) -> list[Usd.Attribute]:
        """Those that are read."""
        return list(self._found.values())

    def __contains__(self, name: str) -> bool:
        return name in self._found

    def _is_whole(self, name: str) -> bool:
        """Whether one end of a window is never other than where the field of view ends."""
        attribute, end = self._found.get(name), {"screen_window_min": -1.0, "screen_window_max": 1.0}[name]
        if attribute is None:
            return True
        codes = attribute.GetTimeSamples() or [Usd.TimeCode.Default()]
        return all((_rows(attribute.Get(code), name) == end).all() for code in codes)

    def get(self, name: str, code: float, fallback: tuple[float, ...]) -> np.ndarray:
        """A parameter's numbers at a time code; of several motion keys the first."""
        rows = _rows(self._found[name].Get(code), name) if name in self._found else np.zeros((0, len(fallback)))
        return rows[0] if len(rows) else np.array(fallback, float)

    def film(self, code: float, width: float, height: float, focal: float) -> tuple[float, float, float, float]:
        """Apertures and their offsets, in the unit of the focal length, of what USD's attributes say in it."""
        if "fov" in self:
            across = math.tan(math.radians(float(np.clip(self.get("fov", code, (60.0,))[0], 1e-3, 179.9))) / 2)
            width, height = 2 * focal * across, 2 * focal * across * height / width
        if not any(name in self for name in _WINDOW):
            return width, height, 0.0, 0.0
        low, high = (self.get(name, code, (end, end)) for name, end in zip(_WINDOW, (-1.0, 1.0), strict=True))
        size, middle = (high - low) / 2, (high + low) / 2
        if self._orthographic:
            # Tenths of a unit; the window's height is in terms of the picture's width.
            return 20 * size[0], 20 * size[1] * height / width, 10 * middle[0], 10 * middle[1] * height / width
        return width * size[0], height * size[1], width / 2 * middle[0], height / 2 * middle[1]


def _is_authored(attribute: Usd.Attribute) -> bool:
    return bool(attribute) and attribute.HasAuthoredValue()


def _rows(value, name: str) -> np.ndarray:
    """A parameter's motion keys, one or more, each of one number or two; none if it is no such thing."""
    width = 2 if name in _WINDOW else 1
    if value is None:
        return np.zeros((0, width))
    rows = as_rows(value if hasattr(value, "__len__") else [value], width).reshape(-1, width)
    return rows if np.isfinite(rows).all() else np.zeros((0, width))
