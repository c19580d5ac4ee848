"""MaterialX's own library of nodes: what each is called, its inputs with their defaults, its implementation as a graph.

The package `materialx` is loaded when the first material asks for it; stages without MaterialX do not pay for it.
"""

from __future__ import annotations

import functools
import re
from dataclasses import dataclass, field

from .quantities import Lost

_ALIASES = {
    "UsdUVTexture": "ND_UsdUVTexture_23", "ND_UsdUVTexture": "ND_UsdUVTexture_23", "UsdTransform2d": "ND_UsdTransform2d",
    "UsdPrimvarReader_float2": "ND_UsdPrimvarReader_vector2", "UsdPrimvarReader_float": "ND_UsdPrimvarReader_float",
    "UsdPrimvarReader_float3": "ND_UsdPrimvarReader_vector3", "ND_normalmap": "ND_normalmap_float",
}  # fmt: skip
"""Identifiers of USD's own nodes and of MaterialX 1.38."""
WIDTHS = {
    "float": 1, "integer": 1, "boolean": 1, "vector2": 2, "color3": 3, "vector3": 3, "color4": 4, "vector4": 4,
}  # fmt: skip
"""Parts of each type that is a number."""
_SIZES = {**WIDTHS, "matrix33": 9, "matrix44": 16}


@dataclass
class Port:
    """An input of a definition."""

    type: str
    value: object = None
    """A number, a tuple, a string, or None."""
    geometry: str = ""
    """What of the geometry is read where nothing is authored: `UV0`, `Nworld`."""


@dataclass
class Definition:
    """A definition of a node."""

    kind: str
    """The node's category: `multiply`, `image`, `standard_surface`."""
    inputs: dict[str, Port]
    outputs: dict[str, str]
    """Types of the outputs by name."""
    graph: object = None
    """The MaterialX node graph that implements it, if one does."""
    nodes: dict[str, object] = field(default_factory=dict)


def materialx():
    """The package MaterialX. Raises `Lost` where it is not installed: only what needs it is left out."""
    try:
        import MaterialX
    except ImportError as error:
        remedy = "install it with `pip install -r scripts/requirements.txt`"
        raise Lost(f"MaterialX needs the Python package materialx ({error}): {remedy}") from None
    return MaterialX


@functools.cache
def library():
    """The document that holds MaterialX's standard nodes."""
    mx = materialx()
    document = mx.createDocument()
    mx.loadLibraries(mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath(), document)
    return document


@functools.cache
def definition(identifier: str) -> Definition | None:
    """The definition of a shader's `info:id`; None if the library has none."""
    identifier = _ALIASES.get(identifier, identifier)
    swizzle = re.fullmatch(r"ND_swizzle_([a-z0-9]+)_([a-z0-9]+)", identifier)
    if swizzle and swizzle[1] in WIDTHS and swizzle[2] in WIDTHS:  # MaterialX 1.38
        inputs = {"in": Port(swizzle[1], (0.0,) * WIDTHS[swizzle[1]]), "channels": Port("string", "")}
        return Definition("swizzle", inputs, {"out": swizzle[2]})
    found = library().getNodeDef(identifier)
    return describe(found) if found else None


def describe(nodedef) -> Definition:
    """The description of a MaterialX nodedef."""
    inputs = {port.getName(): described_port(port) for port in nodedef.getActiveInputs()}
    outputs = {port.getName(): port.getType() for port in nodedef.getActiveOutputs()}
    implementation = nodedef.getImplementation()
    graph = implementation if implementation and implementation.isA(materialx().NodeGraph) else None
    return Definition(nodedef.getNodeString(), inputs, outputs, graph)


def described_port(port) -> Port:
    """The description of a MaterialX input."""
    text = port.getResolvedValueString() if port.hasValueString() else None
    return Port(port.getType(), parsed(port.getType(), text), port.getAttribute("defaultgeomprop"))


def parsed(type_name: str, text: str | None) -> object:
    """A value of a MaterialX document: a number, a tuple of numbers or a string; None if it is none. An integer is one of
    32 bits."""
    if text is None:
        return None
    if type_name == "boolean":
        return float(text.strip() == "true")
    if type_name in _SIZES:
        try:
            values = tuple(float(word) for word in text.split(","))
        except ValueError:
            return None
        if len(values) != _SIZES[type_name]:
            return None
        if type_name == "integer" and not -(2**31) <= values[0] < 2**31:  # also what is not a number
            return None
        return values if len(values) > 1 else values[0]
    return text
