"""What Arnold's shaders compute (Arnold's user guide, "Shaders"), as functions of quantities, beside `shader_nodes`.

Only those whose formula is published; a network brings no defaults, so they stand here. What Arnold adds to an image
is read by `evaluator`.
"""

from __future__ import annotations

import numpy as np

from .quantities import Lost, Part, Quantity, add, total
from .shader_nodes import Call, Function, geometry, number, uv

_BLACK, _WHITE = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)


def _pointwise(function: Function, *inputs: tuple[str, object]):
    return lambda call: call.canvas.apply(function, *(call.quantity(name, default) for name, default in inputs))


def _mix(call: Call) -> Quantity:
    return call.canvas.mix(
        call.quantity("input1", (*_BLACK, 1.0)), call.quantity("input2", (*_WHITE, 1.0)), call.quantity("mix", 0.5)
    )


def _gather(*names: str, defaults: tuple[float, ...] = (0.0, 0.0, 0.0, 1.0)):
    """The first parts of several inputs."""
    return lambda call: Quantity(
        [call.quantity(name, default).parts[0] for name, default in zip(names, defaults, strict=False)]
    )


def _to_float(call: Call) -> Quantity:
    """`rgb_to_float`, `rgba_to_float`."""
    value, mode = call.quantity("input", _BLACK).wide(4), call.text("mode", "average")
    weights = {
        "r": (1, 0, 0, 0), "g": (0, 1, 0, 0), "b": (0, 0, 1, 0), "a": (0, 0, 0, 1),
        "average": (1 / 3, 1 / 3, 1 / 3, 0), "sum": (1, 1, 1, 0),
    }.get(mode)  # fmt: skip
    if weights is None:
        raise Lost(f"its mode {mode} is not read")
    return total(call.canvas.multiply(value, Quantity.of(weights)))


def _range(call: Call) -> Quantity:
    """A linear map from `input_min`..`input_max`; contrast, bias and gain have to be idle."""
    for name, idle in (("contrast", 1.0), ("bias", 0.5), ("gain", 0.5)):
        if number(call, name, idle) != idle:
            raise Lost(f"its {name} has no published formula")
    if number(call, "smoothstep"):
        raise Lost("its smooth step has no published formula")
    low, high = number(call, "input_min", 0.0), number(call, "input_max", 1.0)
    first, last = number(call, "output_min", 0.0), number(call, "output_max", 1.0)
    if low == high:
        raise Lost("its input has no range")
    slope = (last - first) / (high - low)
    return add(
        call.canvas.multiply(call.quantity("input", _BLACK), Quantity.of(slope)), Quantity.of(first - low * slope)
    )


def _color_correct(call: Call) -> Quantity:
    """Gamma, contrast around a pivot, exposure, then times `multiply` plus `add`, by `mask`."""
    if number(call, "hue_shift") != 0.0 or number(call, "saturation", 1.0) != 1.0:
        raise Lost("its hue and saturation have no published formula")
    canvas, source = call.canvas, call.quantity("input", (*_BLACK, 1.0))
    color = Quantity(source.parts[:3]).wide(3)
    if number(call, "invert"):
        color = add(Quantity.of(_WHITE), color, -1.0)
    gamma = call.quantity("gamma", 1.0)
    if not gamma.is_constant or (gamma.constant != 1.0).any():
        color = canvas.apply(lambda x, g: np.power(np.maximum(x, 0), 1 / g), color, gamma)
    pivot = call.quantity("contrast_pivot", 0.18)
    color = add(canvas.multiply(add(color, pivot, -1.0), call.quantity("contrast", 1.0)), pivot)
    gain = canvas.apply(np.exp2, call.quantity("exposure", 0.0))
    color = add(
        canvas.multiply(canvas.multiply(color, gain), call.quantity("multiply", _WHITE)), call.quantity("add", _BLACK)
    )
    color = canvas.mix(Quantity(source.parts[:3]).wide(3), color, call.quantity("mask", 1.0))
    alpha = Quantity(source.parts[3:]) if len(source.parts) == 4 else Quantity.of(1.0)
    if number(call, "alpha_is_luminance"):
        alpha = total(canvas.multiply(color, Quantity.of((0.2126, 0.7152, 0.0722))))
    if number(call, "invert_alpha"):
        alpha = add(Quantity.of(1.0), alpha, -1.0)
    alpha = add(canvas.multiply(alpha, call.quantity("alpha_multiply", 1.0)), call.quantity("alpha_add", 0.0))
    return Quantity([*color.parts, *alpha.parts])


def _layers(call: Call) -> Quantity:
    """`layer_rgba`: layer on layer, each by its `mix`; only the operation `overwrite`, which is the default."""
    result = Quantity.of((0.0, 0.0, 0.0, 0.0))
    for index in range(1, 9):
        if not number(call, f"enable{index}", float(index == 1)):
            continue
        if call.text(f"operation{index}", "overwrite") != "overwrite":
            raise Lost(f"its operation {call.text(f'operation{index}')} has no published formula")
        layer = call.quantity(f"input{index}", (*_BLACK, 0.0)).wide(4)
        result = call.canvas.mix(result, layer, call.quantity(f"mix{index}", 1.0))
    return result


def _checkerboard(call: Call) -> Quantity:
    """Two by two squares on each repetition."""
    surface = uv(call.text("uvset") or "st")
    scale = Quantity.of((number(call, "u_frequency", 1.0), number(call, "v_frequency", 1.0)))
    shift = Quantity.of((number(call, "u_offset"), number(call, "v_offset")))
    at = call.canvas.multiply(add(surface, shift), scale)
    weight = call.canvas.apply(lambda x: np.mod(np.floor(x * 2).sum(axis=0, keepdims=True), 2), at)
    color1, color2 = call.quantity("color1", _WHITE), call.quantity("color2", _BLACK)
    if number(call, "contrast", 1.0) != 1.0:
        raise Lost("its contrast has no published formula")
    return call.canvas.mix(color1, color2, weight)


def _ramp(call: Call) -> Quantity:
    """`ramp_rgb`, `ramp_float` of the types u, v and custom, constant or linear between its positions."""
    values = call.literal("color") if call.has("color") else call.literal("value")
    places = np.asarray(call.literal("position"), dtype=float)
    values = np.asarray(values, dtype=float)
    values = values.reshape(len(places), -1) if len(places) and len(values) == len(places) else None
    if values is None:
        raise Lost("its positions and colours do not fit")
    modes = np.asarray(call.literal("interpolation", [1] * len(places))).ravel()
    if not set(modes.tolist()) <= {0, 1}:
        raise Lost("its interpolation is not linear")
    kind = call.text("type", "custom")
    if kind == "custom":
        at = Quantity(call.quantity("input", 0.0).parts[:1])
    elif kind in ("u", "v"):
        at = Quantity([uv(call.text("uvset") or "st").parts["uv".index(kind)]])
    else:
        raise Lost(f"its type {kind} has no counterpart")
    order = np.argsort(places, kind="stable")
    places, values, modes = (
        places[order],
        values[order],
        modes[order] if len(modes) == len(places) else [1] * len(places),
    )
    wraps = kind != "custom" and number(call, "wrap_uvs", 1.0)

    def evaluate(x: np.ndarray) -> np.ndarray:
        x = x[0] - np.floor(x[0]) if wraps else x[0]
        index = np.clip(np.searchsorted(places, x, side="right") - 1, 0, len(places) - 1)
        following = np.minimum(index + 1, len(places) - 1)
        span = places[following] - places[index]
        weight = np.clip((x - places[index]) / np.where(span > 0, span, 1), 0, 1) * np.asarray(modes)[index]
        mixed = values[index] + (values[following] - values[index]) * weight[..., None]
        return np.moveaxis(mixed, -1, 0)

    return call.canvas.apply(evaluate, at)


def _user_data(width: int):
    def read(call: Call) -> Quantity:
        name = call.text("attribute")
        default = call.quantity("default", (0.0,) * width)
        return geometry(name, width, tuple(default.constant) if default.is_constant else ()) if name else default

    return read


FUNCTIONS = {
    "arnold:flat": lambda call: call.quantity("color", _WHITE),
    "arnold:multiply": lambda call: call.canvas.multiply(
        call.quantity("input1", _WHITE), call.quantity("input2", _WHITE)
    ),
    "arnold:add": lambda call: add(call.quantity("input1", _BLACK), call.quantity("input2", _BLACK)),
    "arnold:subtract": lambda call: add(call.quantity("input1", _BLACK), call.quantity("input2", _BLACK), -1.0),
    "arnold:divide": _pointwise(np.divide, ("input1", _WHITE), ("input2", _WHITE)),
    "arnold:min": _pointwise(np.minimum, ("input1", _BLACK), ("input2", _BLACK)),
    "arnold:max": _pointwise(np.maximum, ("input1", _BLACK), ("input2", _BLACK)),
    "arnold:pow": _pointwise(np.power, ("base", _WHITE), ("exponent", _WHITE)),
    "arnold:abs": _pointwise(np.abs, ("input", _BLACK)),
    "arnold:sqrt": _pointwise(np.sqrt, ("input", _BLACK)),
    "arnold:complement": lambda call: add(Quantity.of(1.0), call.quantity("input", _BLACK), -1.0),
    "arnold:negate": lambda call: add(Quantity.of(0.0), call.quantity("input", _BLACK), -1.0),
    "arnold:clamp": _pointwise(np.clip, ("input", _BLACK), ("min", 0.0), ("max", 1.0)),
    "arnold:mix_rgba": _mix,
    "arnold:range": _range,
    "arnold:color_correct": _color_correct,
    "arnold:layer_rgba": _layers,
    "arnold:checkerboard": _checkerboard,
    "arnold:ramp_rgb": _ramp,
    "arnold:ramp_float": _ramp,
    "arnold:float_to_rgb": _gather("r", "g", "b"),
    "arnold:float_to_rgba": _gather("r", "g", "b", "a"),
    "arnold:rgb_to_float": _to_float,
    "arnold:rgba_to_float": _to_float,
    "arnold:rgb_to_vector": lambda call: call.quantity("input", _BLACK),
    "arnold:vector_to_rgb": lambda call: call.quantity("input", _BLACK),
    "arnold:aov_write_rgb": lambda call: call.quantity("passthrough", _BLACK),
    "arnold:aov_write_rgba": lambda call: call.quantity("passthrough", (*_BLACK, 1.0)),
    "arnold:user_data_rgb": _user_data(3),
    "arnold:user_data_rgba": _user_data(4),
    "arnold:user_data_float": _user_data(1),
    "arnold:state_float": lambda call: geometry(f"the state {call.text('variable')}", 1),
    "arnold:state_vector": lambda call: geometry(f"the state {call.text('variable')}", 3),
}
"""Functions by the node's name."""

PARTS = {"r": 0, "g": 1, "b": 2, "a": 3, "x": 0, "y": 1, "z": 2}
"""Outputs and inputs that are one part of another."""


def part(value: Quantity, output: str) -> Quantity:
    """What an output that is named for a part of a node's value reads."""
    if output not in PARTS:
        return value
    index = PARTS[output]
    return Quantity(
        [value.wide(index + 1).parts[index] if index < len(value.parts) or len(value.parts) == 1 else Part(1.0)]
    )
