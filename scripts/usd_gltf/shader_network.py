"""The network of shaders behind a material, as plain nodes: read from UsdShade through interfaces and node graphs.

Nodes of MaterialX carry their defaults with them, so that whoever evaluates a network needs no library; those
that the library implements as graphs are opened when they are asked for (`Node.opened`). Arnold's nodes bring only what is
authored.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

from pxr import Sdf, Usd, UsdShade

from .materialx_library import Definition, Port, definition, describe, described_port
from .quantities import Lost

_MOST_NODES = 20_000


@dataclass
class Literal:
    """An input's own value."""

    port: Port
    attribute: Usd.Attribute | None = None

    def value(self, code: float) -> object:
        """The value at a time code; None if there is none."""
        if self.attribute is None:
            return self.port.value
        value = self.attribute.Get(code)
        return self.port.value if value is None else value

    @property
    def color_space(self) -> str:
        """The colour space that is authored on the input."""
        return str(self.attribute.GetColorSpace() or "") if self.attribute is not None else ""


@dataclass
class Link:
    """An input that reads another node's output."""

    node: Node
    output: str


@dataclass(eq=False)
class Node:
    """A shader."""

    path: str
    kind: str
    """MaterialX's category (`multiply`), or `arnold:` and Arnold's name of the node; empty if nobody knows it."""
    identifier: str
    inputs: dict[str, Literal | Link] = field(default_factory=dict)
    authored: set[str] = field(default_factory=set)
    """The inputs with a value or a connection of their own."""
    outputs: dict[str, str] = field(default_factory=dict)
    definition: Definition | None = None
    _opened: dict[str, Link] | None = None

    def opened(self) -> dict[str, Link]:
        """What each output reads, where the library implements the node as a graph."""
        if self._opened is None:
            self._opened = _open(self)
        return self._opened


class Network:
    """All nodes that a shader reads, directly or not."""

    def __init__(self, surface: UsdShade.Shader) -> None:
        self._nodes: dict[Sdf.Path, Node] = {}
        self._waiting: list[tuple[Node, UsdShade.Shader]] = []
        self.surface = self._node(surface)
        while self._waiting:
            self._read(*self._waiting.pop())

    def _node(self, shader: UsdShade.Shader) -> Node:
        path = shader.GetPath()
        if path not in self._nodes:
            if len(self._nodes) >= _MOST_NODES:
                raise Lost(f"its network has more than {_MOST_NODES} shaders")
            identifier = str(shader.GetIdAttr().Get() or "")
            found = None if identifier.startswith("arnold:") or not identifier else definition(identifier)
            kind = identifier if identifier.startswith("arnold:") else found.kind if found else ""
            node = Node(str(path), kind, identifier, definition=found)
            if found:
                node.outputs = found.outputs
                node.inputs = {name: Literal(port) for name, port in found.inputs.items()}
            self._nodes[path] = node
            self._waiting.append((node, shader))
        return self._nodes[path]

    def _read(self, node: Node, shader: UsdShade.Shader) -> None:
        for found in shader.GetInputs():
            name = str(found.GetBaseName())
            attributes = UsdShade.Utils.GetValueProducingAttributes(found)
            if not attributes:
                continue
            attribute = attributes[0]
            if UsdShade.Output.IsOutput(attribute):
                source = UsdShade.Shader(attribute.GetPrim())
                node.inputs[name] = Link(self._node(source), str(UsdShade.Output(attribute).GetBaseName()))
                node.authored.add(name)
            elif attribute.HasAuthoredValue():
                port = node.definition.inputs.get(name) if node.definition else None
                node.inputs[name] = Literal(port or Port(_type(attribute)), attribute)
                node.authored.add(name)


def literals(node: Node, names: Iterable[str]) -> Iterator[Literal]:
    """All authored values behind some inputs of a node."""
    seen: set[Node] = set()
    waiting = [node.inputs[name] for name in names if name in node.inputs]
    while waiting:
        found = waiting.pop()
        if isinstance(found, Literal):
            yield found
        elif found.node not in seen:
            seen.add(found.node)
            waiting.extend(found.node.inputs.values())


def _type(attribute: Usd.Attribute) -> str:
    """MaterialX's name of an attribute's type, as far as it matters."""
    name = str(attribute.GetTypeName())
    return {"color3f": "color3", "color4f": "color4", "asset": "filename"}.get(name, name)


def _open(node: Node) -> dict[str, Link]:
    """The nodes of a library graph, with the outer node's inputs put in."""
    graph = node.definition.graph
    inner: dict[str, Node] = {}
    sources = {item.getName(): item for item in graph.getNodes()}
    for name, item in sources.items():
        nodedef = item.getNodeDef()
        if nodedef is None:
            raise Lost(f"the library's node {name} in {graph.getName()} has no definition")
        found = describe(nodedef)
        inputs: dict[str, Literal | Link] = {key: Literal(port) for key, port in found.inputs.items()}
        inner[name] = Node(node.path, found.kind, nodedef.getName(), inputs, set(), found.outputs, found)
    for name, item in sources.items():
        for port in item.getInputs():
            key, interface, source = port.getName(), port.getInterfaceName(), port.getNodeName()
            if interface:
                if interface in node.inputs:
                    inner[name].inputs[key] = node.inputs[interface]
            elif source:
                inner[name].inputs[key] = Link(inner[source], port.getOutputString() or "out")
            elif port.hasValueString():
                inner[name].inputs[key] = Literal(described_port(port))
    return {
        output.getName(): Link(inner[output.getNodeName()], output.getOutputString() or "out")
        for output in graph.getOutputs()
        if output.getNodeName() in inner
    }
