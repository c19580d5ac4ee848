"""Evaluates a shader network: what an input of a node reads, as a `Quantity`."""

from __future__ import annotations

import numpy as np
from pxr import Sdf

from . import arnold_nodes, shader_nodes
from .color_spaces import is_known, to_rec709
from .materialx_library import WIDTHS
from .network_images import NetworkImages, channels, straight
from .quantities import Canvas, Lost, Quantity, add
from .report import Notebook
from .shader_network import Link, Literal, Node
from .shader_nodes import geometry, number, uv

_DEEPEST = 2000
"""Nodes in a row."""
_FUNCTIONS = {**shader_nodes.FUNCTIONS, **arnold_nodes.FUNCTIONS}
_IMAGES = ("image", "arnold:image")


class Evaluator:
    """Evaluates one material's network at one time code. `report` is told of images that cannot be read."""

    def __init__(
        self, owner: str, images: NetworkImages, code: float, report: Notebook, tile: tuple[int, int] = (0, 0)
    ) -> None:
        self.owner, self.images, self.code, self.report = owner, images, code, report
        self.canvas = Canvas(tile)
        self._known: dict[tuple[Node, str], Quantity] = {}
        self._open: set[tuple[Node, str]] = set()

    def input(self, node: Node, name: str, default: object = None, width: int | None = None) -> Quantity:
        """What an input reads; `default` if it has no value."""
        value = self._input(node, name, default, width)
        for letter, index in arnold_nodes.PARTS.items():
            if f"{name}:{letter}" in node.inputs:
                one = self._input(node, f"{name}:{letter}", None, 1)
                parts = list(value.wide(max(len(value.parts), index + 1)).parts)
                parts[index] = one.parts[0]
                value = Quantity(parts)
        return value if width is None else value.wide(width)

    def _input(self, node: Node, name: str, default: object, width: int | None) -> Quantity:
        found = node.inputs.get(name)
        if isinstance(found, Link):
            return self.output(found)
        if found is not None:
            value = found.value(self.code)
            if value is not None:
                return self._constant(found, value, name)
            if found.port.geometry:
                return geometry(found.port.geometry, WIDTHS.get(found.port.type, width or 1))
        if default is None:
            raise Lost(f"input {name} of {node.path} has no value")
        return Quantity.of(default)

    def output(self, link: Link) -> Quantity:
        """What a node gives."""
        key = (link.node, link.output)
        if key not in self._known:
            if key in self._open:
                raise Lost(f"{link.node.path} reads itself")
            if len(self._open) >= _DEEPEST:
                raise Lost(f"its network is more than {_DEEPEST} nodes deep")
            self._open.add(key)
            try:
                self._known[key] = self._evaluate(link)
            finally:
                self._open.discard(key)
        return self._known[key]

    def _evaluate(self, link: Link) -> Quantity:
        node = link.node
        call = _Call(self, node, link.output)
        try:
            if node.kind in _IMAGES:
                value = self._image(call) if node.kind == "image" else self._arnold_image(call)
            elif node.kind in _FUNCTIONS:
                value = _FUNCTIONS[node.kind](call)
            elif node.definition is not None and node.definition.graph is not None:
                opened = node.opened()
                if link.output not in opened and len(opened) != 1:
                    raise Lost("it has no such output")
                value = self.output(opened.get(link.output) or next(iter(opened.values())))
            else:
                raise Lost("this node is not read" if node.kind else "nobody knows this node")
        except Lost as lost:
            raise lost.placed(_named(node)) from None
        except (IndexError, ValueError, TypeError, ArithmeticError):
            raise Lost("its inputs do not fit together").placed(_named(node)) from None
        return arnold_nodes.part(value, link.output) if node.kind.startswith("arnold:") else value

    def normal(self, node: Node, name: str) -> tuple[Quantity, float] | None:
        """The normal map that an input reads, three parts that are 0.5 where nothing is changed but the third, 1; and its
        strength. None if it reads the surface's own normal."""
        found = node.inputs.get(name)
        for _ in range(_DEEPEST):
            if not isinstance(found, Link):
                return None
            source = found.node
            call = _Call(self, source, found.output)
            if source.kind == "normal":
                return None
            if source.kind == "normalmap":
                if call.text("space", "tangent") != "tangent":
                    raise Lost("its normal map is not in tangent space")
                return call.quantity("in").wide(3), number(call, "scale", 1.0)
            if source.kind == "arnold:normal_map":
                for key in ("invert_x", "invert_y", "invert_z", "normal"):
                    if key in source.inputs and (
                        isinstance(source.inputs[key], Link) or source.inputs[key].value(self.code) not in (False, None)
                    ):
                        raise Lost(f"the normal map's {key} is not read")
                if not call.flag("tangent_space", True) or not call.flag("color_to_signed", True):
                    raise Lost("its normal map is not coded in tangent space")
                return call.quantity("input").wide(3), number(call, "strength", 1.0)
            if source.kind == "dot":
                found = source.inputs.get("in")
            elif (
                source.kind not in _FUNCTIONS and source.definition is not None and source.definition.graph is not None
            ):
                found = source.opened().get(found.output) or next(iter(source.opened().values()), None)
            else:
                break
        raise Lost(f"{_named(found.node)} is no normal map in tangent space")

    def _constant(self, literal: Literal, value: object, name: str) -> Quantity:
        try:
            numbers = np.atleast_1d(np.asarray(value, dtype=float)).ravel()
        except (TypeError, ValueError):
            raise Lost(f"its {name} is no number") from None
        if not 1 <= len(numbers) <= 16:
            raise Lost(f"its {name} has {len(numbers)} values")
        space = literal.color_space
        if literal.port.type in ("color3", "color4") and space and is_known(space) and len(numbers) >= 3:
            numbers = np.concatenate([to_rec709(space, numbers[:3]), numbers[3:]])
        return Quantity.of(numbers)

    # -- images ----------------------------------------------------------------------------------

    def _file(self, call: _Call, name: str) -> Literal | None:
        """The input that names a file; None if it names none, which is how a slot for a file is left empty."""
        found = call.node.inputs.get(name)
        if isinstance(found, Link):
            raise Lost(f"its {name} is connected")
        value = None if found is None else found.value(self.code)
        if not value or not getattr(value, "path", value):
            return None
        if found.attribute is None or not isinstance(value, Sdf.AssetPath):
            raise Lost(f"its {name} is no asset")
        return found

    def _image(self, call: _Call) -> Quantity:
        if call.text("layer"):
            raise Lost(f"it reads the layer {call.text('layer')} of a file")
        file = self._file(call, "file")
        if file is None:
            return call.quantity("default", (0.0,) * call.width)
        is_color = call.node.outputs.get(call.output, call.node.outputs.get("out", "")).startswith("color")
        space = file.color_space or ("auto" if is_color else "raw")
        wraps = (call.text("uaddressmode", "periodic"), call.text("vaddressmode", "periodic"))
        mapping = straight(call.quantity("texcoord"))
        picture = self.images.read(self.owner, file.attribute, self.code, space, mapping, wraps, self.report)
        return call.quantity("default", (0.0,) * call.width) if picture is None else channels(picture, call.width)

    def _arnold_image(self, call: _Call) -> Quantity:
        for name, idle in (("swap_st", False), ("sflip", False), ("tflip", False), ("single_channel", False)):
            if call.flag(name, idle) is not idle:
                raise Lost(f"its {name} is not read")
        coordinates = uv(call.text("uvset") or "st")
        if isinstance(call.node.inputs.get("uvcoords"), Link):
            coordinates = call.quantity("uvcoords").wide(2)
        scale = Quantity.of((number(call, "sscale", 1.0), number(call, "tscale", 1.0)))
        shift = Quantity.of((number(call, "soffset"), number(call, "toffset")))
        mapping = straight(add(self.canvas.multiply(coordinates, scale), shift))
        wraps = (call.text("swrap", "periodic"), call.text("twrap", "periodic"))
        file = self._file(call, "filename")
        if file is None:
            return call.quantity("missing_texture_color", (0.0, 0.0, 0.0, 0.0))
        space = call.text("color_space", "auto") or "raw"
        picture = self.images.read(self.owner, file.attribute, self.code, space, mapping, wraps, self.report)
        if picture is None:
            return call.quantity("missing_texture_color", (0.0, 0.0, 0.0, 0.0))
        color = self.canvas.multiply(channels(picture, 3), call.quantity("multiply", (1.0, 1.0, 1.0)))
        color = add(color, call.quantity("offset", (0.0, 0.0, 0.0)))
        return Quantity([*color.parts, channels(picture, 4).parts[3]])


def _named(node: Node) -> str:
    return f"{node.identifier or 'a shader without info:id'} at {node.path}"


class _Call:
    """One evaluation of a node (`shader_nodes.Call`)."""

    def __init__(self, evaluator: Evaluator, node: Node, output: str) -> None:
        self.evaluator, self.node, self.output = evaluator, node, output
        self.canvas = evaluator.canvas
        outputs = node.outputs
        self.width = WIDTHS.get(outputs.get(output, next(iter(outputs.values()), "")), 3)

    def quantity(self, name: str, default: object = None) -> Quantity:
        return self.evaluator.input(self.node, name, default)

    def literal(self, name: str, default: object = None) -> object:
        """A value that may be an array."""
        found = self.node.inputs.get(name)
        if isinstance(found, Link):
            raise Lost(f"its {name} is connected")
        value = None if found is None else found.value(self.evaluator.code)
        if value is None:
            value = default
        if value is None:
            raise Lost(f"its {name} has no value")
        return value

    def text(self, name: str, default: str = "") -> str:
        value = self.literal(name, default)
        return value.path if isinstance(value, Sdf.AssetPath) else str(value)

    def flag(self, name: str, default: bool) -> bool:
        return bool(self.literal(name, default))

    def has(self, name: str) -> bool:
        return name in self.node.inputs
