"""What MaterialX's nodes compute (MaterialX 1.39, "Standard Nodes"), as functions of quantities.

A function takes a `Call` and gives a `Quantity`. Nodes that the library builds of these are opened instead (`Node.opened`).
Noise has no entry: MaterialX does not say its numbers.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from pxr import Gf, UsdLux

from .quantities import Canvas, Coordinate, Lost, Part, Primvar, Quantity, add, combined, total

Function = Callable[..., np.ndarray]
_LUMA = (0.2722287, 0.6740818, 0.0536895)
_PARTS = {name: index for index, letters in enumerate(("rx", "gy", "bz", "aw")) for name in letters}


class Call(Protocol):
    """One evaluation of a node."""

    canvas: Canvas
    output: str
    width: int
    """Parts of the output."""

    def quantity(self, name: str, default: object = None) -> Quantity:
        """What an input reads."""

    def text(self, name: str, default: str = "") -> str:
        """A string input."""


def number(call: Call, name: str, default: object = 0.0) -> float:
    """An input that has to be one number."""
    value = call.quantity(name, default)
    if not value.is_constant:
        raise Lost(f"its {name} varies over the surface")
    return float(value.constant[0])


# -- symbolic ------------------------------------------------------------------------------------


def _add(call: Call) -> Quantity:
    return add(call.quantity("in1"), call.quantity("in2"))


def _subtract(call: Call) -> Quantity:
    return add(call.quantity("in1"), call.quantity("in2"), -1.0)


def _multiply(call: Call) -> Quantity:
    return call.canvas.multiply(call.quantity("in1"), call.quantity("in2"))


def _divide(call: Call) -> Quantity:
    above, below = call.quantity("in1"), call.quantity("in2")
    if below.is_constant and below.constant.all():
        return call.canvas.multiply(above, Quantity.of(1.0 / below.constant))
    return call.canvas.apply(np.divide, above, below)


def _mix(call: Call) -> Quantity:
    weight = call.quantity("mix")
    if weight.is_constant and not weight.constant.any():
        return call.quantity("bg")
    if weight.is_constant and (weight.constant == 1.0).all():
        return call.quantity("fg")
    return call.canvas.mix(call.quantity("bg"), call.quantity("fg"), weight)


def _invert(call: Call) -> Quantity:
    return add(call.quantity("amount"), call.quantity("in"), -1.0)


def _combine(call: Call) -> Quantity:
    parts = []
    for name in ("in1", "in2", "in3", "in4"):
        if len(parts) < call.width:
            parts.extend(call.quantity(name).parts)
    return Quantity(parts[: call.width])


def _extract(call: Call) -> Quantity:
    value = call.quantity("in")
    return Quantity([value.parts[min(max(int(number(call, "index")), 0), len(value.parts) - 1)]])


def _separate(call: Call) -> Quantity:
    index = _PARTS.get(call.output.removeprefix("out"), 0)
    parts = call.quantity("in").parts
    return Quantity([parts[min(index, len(parts) - 1)]])


def _swizzle(call: Call) -> Quantity:
    value, parts = call.quantity("in"), []
    for letter in call.text("channels"):
        if letter in "01":
            parts.append(Part(float(letter)))
        elif _PARTS.get(letter, 9) < len(value.parts):
            parts.append(value.parts[_PARTS[letter]])
        else:
            raise Lost(f"its channels {call.text('channels')} are not in its input")
    return Quantity(parts).wide(call.width)


def _dot_product(call: Call) -> Quantity:
    a, b = call.quantity("in1"), call.quantity("in2")
    if a.is_constant or b.is_constant:
        return total(call.canvas.multiply(a, b))
    return call.canvas.apply(lambda x, y: (x * y).sum(axis=0, keepdims=True), a, b)


def _luminance(call: Call) -> Quantity:
    value = call.quantity("in")
    weights = call.quantity("lumacoeffs", _LUMA)
    grey = total(call.canvas.multiply(Quantity(value.parts[:3]), weights))
    return Quantity([*grey.parts * 3, *value.parts[3:]])


def _rotate(call: Call) -> Quantity:
    angle = np.radians(number(call, "amount"))
    x, y = (Quantity([part]) for part in call.quantity("in").wide(2).parts)
    sine, cosine = Quantity.of(np.sin(angle)), Quantity.of(np.cos(angle))
    canvas = call.canvas
    along = add(canvas.multiply(x, cosine), canvas.multiply(y, sine))
    across = add(canvas.multiply(y, cosine), canvas.multiply(x, sine), -1.0)
    return combined([along, across])


def _choice(test: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> Callable[[Call], Quantity]:
    """A node that chooses `in1` where the test holds; what is not chosen anywhere is not looked at."""

    def choose(call: Call) -> Quantity:
        a, b = call.quantity("value1"), call.quantity("value2")
        if a.is_constant and b.is_constant:
            return call.quantity("in1" if test(a.constant, b.constant).all() else "in2")
        return call.canvas.apply(
            lambda x, y, yes, no: np.where(test(x, y), yes, no), a, b, call.quantity("in1"), call.quantity("in2")
        )

    return choose


def _coordinates(call: Call) -> Quantity:
    index = int(number(call, "index"))
    return uv(f"st{index}" if index else "st").wide(call.width)


def uv(name: str) -> Quantity:
    """A set of texture coordinates."""
    return Quantity([Part(0.0, {Coordinate(name, axis): 1.0}) for axis in (0, 1)])


def _primvar(call: Call) -> Quantity:
    name = call.text("geomprop").removeprefix("primvars:")
    if not name:
        return call.quantity("default")
    if call.width == 2:
        return uv(name)
    default = call.quantity("default", (0.0,) * call.width)
    return geometry(name, call.width, tuple(default.constant) if default.is_constant else ())


def geometry(name: str, width: int, default: tuple[float, ...] = ()) -> Quantity:
    """A property of the geometry, or another primvar than texture coordinates."""
    if name.startswith("UV") and name[2:].isdigit():
        return uv("st" if name == "UV0" else f"st{name[2:]}").wide(width)
    return Quantity([Part(0.0, {Primvar(name, index, default): 1.0}) for index in range(width)])


def _geometry_node(name: str) -> Callable[[Call], Quantity]:
    return lambda call: geometry(name, call.width)


# -- texel by texel ------------------------------------------------------------------------------


def _pointwise(function: Function, *names: str) -> Callable[[Call], Quantity]:
    return lambda call: call.canvas.apply(function, *(call.quantity(name) for name in names))


def _remap(value, in_low, in_high, low, high):
    return low + (value - in_low) / (in_high - in_low) * (high - low)


def _smoothstep(value, low, high):
    at = np.clip((value - low) / (high - low), 0, 1)
    return np.where(value >= high, 1.0, np.where(value <= low, 0.0, at * at * (3 - 2 * at)))


def _normalized(value):
    length = np.sqrt((value * value).sum(axis=0, keepdims=True))
    return np.where(length > 0, value / length, 0)


def _cross(a, b):
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def _hsv(rgb):
    """Hue in [0, 1), saturation, value; a fourth part is kept."""
    red, green, blue = rgb[0], rgb[1], rgb[2]
    value, low = rgb[:3].max(axis=0), rgb[:3].min(axis=0)
    span = value - low
    safe = np.where(span > 0, span, 1)
    hue = np.where(
        red >= value, (green - blue) / safe, np.where(green >= value, 2 + (blue - red) / safe, 4 + (red - green) / safe)
    )
    hue = np.where(span > 0, np.mod(hue / 6, 1), 0)
    saturation = np.where(value > 0, span / np.where(value > 0, value, 1), 0)
    return np.stack([hue, saturation, value, *rgb[3:]])


def _rgb(hsv):
    hue, saturation, value = np.mod(hsv[0], 1) * 6, hsv[1], hsv[2]
    parts = []
    for shift in (5, 3, 1):
        k = np.mod(shift + hue, 6)
        parts.append(value - value * saturation * np.clip(np.minimum(k, 4 - k), 0, 1))
    return np.stack([*parts, *hsv[3:]])


def _black_body(temperature):
    """Of luminance 1, by UsdLux's table."""
    kelvin = np.unique(temperature)
    if len(kelvin) > 1:
        raise Lost("it is a temperature that varies over the surface")
    color = UsdLux.BlackbodyTemperatureAsRgb(float(np.clip(kelvin[0], 1000, 10000)))
    return np.array(Gf.Vec3f(color), dtype=float).reshape(3, *([1] * (temperature.ndim - 1)))


def _blend(function: Function) -> Callable[[Call], Quantity]:
    """A node that puts `fg` on `bg`, by `mix`."""
    return lambda call: call.canvas.mix(
        call.quantity("bg"),
        call.canvas.apply(function, call.quantity("fg"), call.quantity("bg")),
        call.quantity("mix", 1.0),
    )


def _burn(fg, bg):
    return np.where(np.abs(fg) < 1e-8, 0, 1 - (1 - bg) / np.where(fg == 0, 1, fg))


def _dodge(fg, bg):
    return np.where(np.abs(1 - fg) < 1e-8, 0, bg / np.where(fg == 1, 1, 1 - fg))


def _disjoint_over(fg, bg):
    total_alpha = fg[3] + bg[3]
    scale = np.where(total_alpha > 1, (1 - fg[3]) / np.where(bg[3] > 0, bg[3], 1), 1)
    return np.stack([*(fg[:3] + bg[:3] * scale), np.minimum(total_alpha, 1)])


def _ramp(names: tuple[str, str], axis: int, hard: bool) -> Callable[[Call], Quantity]:
    """From the first value, at 0, to the second, at 1; or with an edge at `center`."""

    def evaluate(call: Call) -> Quantity:
        at = Quantity([call.quantity("texcoord").wide(2).parts[axis]])
        first, second = call.quantity(names[0]), call.quantity(names[1])
        if hard:
            weight = call.canvas.apply(lambda x, c: np.where(x >= c, 1.0, 0.0), at, call.quantity("center", 0.5))
        else:
            weight = call.canvas.apply(lambda x: np.clip(x, 0, 1), at)
        return call.canvas.mix(first, second, weight)

    return evaluate


def _outside(call: Call) -> Quantity:
    return call.canvas.multiply(call.quantity("in"), add(Quantity.of(1.0), call.quantity("mask"), -1.0))


FUNCTIONS: dict[str, Callable[[Call], Quantity]] = {
    "add": _add, "subtract": _subtract, "multiply": _multiply, "divide": _divide, "mix": _mix, "invert": _invert,
    "combine2": _combine, "combine3": _combine, "combine4": _combine, "extract": _extract, "swizzle": _swizzle,
    "separate2": _separate, "separate3": _separate, "separate4": _separate, "dotproduct": _dot_product,
    "luminance": _luminance, "rotate2d": _rotate,
    "constant": lambda call: call.quantity("value"),
    "dot": lambda call: call.quantity("in"),
    "convert": lambda call: call.quantity("in").wide(call.width),
    "ifgreater": _choice(np.greater), "ifgreatereq": _choice(np.greater_equal), "ifequal": _choice(np.equal),
    "texcoord": _coordinates, "geompropvalue": _primvar, "geompropvalueuniform": _primvar,
    "geomcolor": _geometry_node("displayColor"), "position": _geometry_node("position"),
    "normal": _geometry_node("Nworld"), "tangent": _geometry_node("Tworld"), "bitangent": _geometry_node("Bworld"),
    "viewdirection": _geometry_node("the view direction"), "time": _geometry_node("the time"),
    "frame": _geometry_node("the frame"),
    "modulo": _pointwise(lambda a, b: a - b * np.floor(a / b), "in1", "in2"),
    "power": _pointwise(np.power, "in1", "in2"),
    "min": _pointwise(np.minimum, "in1", "in2"), "max": _pointwise(np.maximum, "in1", "in2"),
    "absval": _pointwise(np.abs, "in"), "sign": _pointwise(np.sign, "in"), "floor": _pointwise(np.floor, "in"),
    "ceil": _pointwise(np.ceil, "in"), "round": _pointwise(lambda x: np.floor(x + 0.5), "in"),
    "fract": _pointwise(lambda x: x - np.floor(x), "in"), "sqrt": _pointwise(np.sqrt, "in"),
    "ln": _pointwise(np.log, "in"), "exp": _pointwise(np.exp, "in"), "sin": _pointwise(np.sin, "in"),
    "cos": _pointwise(np.cos, "in"), "tan": _pointwise(np.tan, "in"), "asin": _pointwise(np.arcsin, "in"),
    "acos": _pointwise(np.arccos, "in"), "atan2": _pointwise(np.arctan2, "iny", "inx"),
    "clamp": _pointwise(lambda x, low, high: np.minimum(np.maximum(x, low), high), "in", "low", "high"),
    "remap": _pointwise(_remap, "in", "inlow", "inhigh", "outlow", "outhigh"),
    "smoothstep": _pointwise(_smoothstep, "in", "low", "high"),
    "magnitude": _pointwise(lambda x: np.sqrt((x * x).sum(axis=0, keepdims=True)), "in"),
    "normalize": _pointwise(_normalized, "in"), "crossproduct": _pointwise(_cross, "in1", "in2"),
    "rgbtohsv": _pointwise(_hsv, "in"), "hsvtorgb": _pointwise(_rgb, "in"),
    "blackbody": _pointwise(_black_body, "temperature"),
    "and": _pointwise(np.minimum, "in1", "in2"), "or": _pointwise(np.maximum, "in1", "in2"),
    "not": _pointwise(lambda x: 1 - x, "in"), "xor": _pointwise(lambda a, b: np.abs(a - b), "in1", "in2"),
    "plus": _blend(np.add), "minus": _blend(lambda fg, bg: bg - fg), "difference": _blend(lambda fg, bg: np.abs(bg - fg)),
    "burn": _blend(_burn), "dodge": _blend(_dodge), "screen": _blend(lambda fg, bg: 1 - (1 - fg) * (1 - bg)),
    "in": _blend(lambda fg, bg: fg * bg[3:4]), "mask": _blend(lambda fg, bg: bg * fg[3:4]),
    "out": _blend(lambda fg, bg: fg * (1 - bg[3:4])), "over": _blend(lambda fg, bg: fg + bg * (1 - fg[3:4])),
    "matte": _blend(lambda fg, bg: np.stack([*(fg[:3] * fg[3] + bg[:3] * (1 - fg[3])), fg[3] + bg[3] * (1 - fg[3])])),
    "disjointover": _blend(_disjoint_over),
    "inside": lambda call: call.canvas.multiply(call.quantity("in"), call.quantity("mask")), "outside": _outside,
    "premult": _pointwise(lambda x: np.stack([*(x[:3] * x[3]), x[3]]), "in"),
    "unpremult": _pointwise(lambda x: np.stack([*(x[:3] / np.where(x[3] == 0, 1, x[3])), x[3]]), "in"),
    "ramplr": _ramp(("valuel", "valuer"), 0, hard=False), "ramptb": _ramp(("valueb", "valuet"), 1, hard=False),
    "splitlr": _ramp(("valuel", "valuer"), 0, hard=True), "splittb": _ramp(("valueb", "valuet"), 1, hard=True),
}  # fmt: skip
"""Functions by the node's category."""
