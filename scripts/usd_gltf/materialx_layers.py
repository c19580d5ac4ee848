"""MaterialX documents that a stage refers to, as layers: what USD's plugin for `.mtlx` makes of them.

pip's usd-core has no such plugin, so a reference to `@x.mtlx@</MaterialX/Materials/gold>` composes to nothing. Here each
document is read by the package `materialx` and becomes a layer in memory with the namespace of USD's plugin
(`pxr/usd/usdMtlx/reader.cpp`), and the layers that name the document are made to name that layer instead; in memory
alone. Composition does the rest: overrides, variants, relocated references work as they do with the plugin.

Materials and node graphs are read; looks, collections and property sets are not. A node that the document itself
defines by a node graph becomes that graph.
"""

from __future__ import annotations

import os
from dataclasses import dataclass

from pxr import Ar, Gf, Sdf, Tf, Usd, UsdShade

from .materialx_library import definition, library, materialx, parsed
from .report import Notebook
from .source_hash import Dependencies

_TYPES = {
    "float": "Float", "integer": "Int", "boolean": "Bool", "vector2": "Float2", "vector3": "Float3", "vector4": "Float4",
    "color3": "Color3f", "color4": "Color4f", "string": "String", "filename": "Asset", "matrix33": "Matrix3d",
    "matrix44": "Matrix4d",
}  # fmt: skip
"""Names in `Sdf.ValueTypeNames`; any other type is a token."""
_MAKERS = {
    "vector2": Gf.Vec2f, "vector3": Gf.Vec3f, "vector4": Gf.Vec4f, "color3": Gf.Vec3f, "color4": Gf.Vec4f,
    "matrix33": Gf.Matrix3d, "matrix44": Gf.Matrix4d,
}  # fmt: skip
_MOST_GRAPHS = 64
"""Node graphs in node graphs."""
_MOST_PRIMS = 20_000
"""Prims that one document may become: graphs that hold others twice double with each level."""
_MOST_INCLUDES = 64
"""Documents that include each other in a row."""
_ROOT = Sdf.Path("/MaterialX")


class Documents:
    """The documents of a stage, each read once. It has to live as long as the stage."""

    def __init__(self, dependencies: Dependencies, report: Notebook) -> None:
        self.dependencies, self.report = dependencies, report
        self.problems: dict[str, str] = {}
        """What is wrong with those that cannot be read, by their resolved paths."""
        self._layers: dict[str, Sdf.Layer | None] = {}

    def compose(self, stage: Usd.Stage) -> None:
        """Make every reference of the stage to a document work. What cannot be read stays a composition error."""
        done: set[tuple[str, str]] = set()
        while True:
            found = [
                (layer, path)
                for layer in stage.GetUsedLayers()
                for path in sorted(layer.GetCompositionAssetDependencies())
                if _is_document(path) and (layer.identifier, path) not in done
            ]
            if not found:
                return
            for layer, path in found:
                done.add((layer.identifier, path))
                place = _resolved(layer, path)
                if place is None:
                    continue
                if place not in self._layers:
                    self._layers[place] = self._layer(place)
                if self._layers[place] is not None:
                    layer.UpdateCompositionAssetDependency(path, self._layers[place].identifier)

    def _layer(self, place: str) -> Sdf.Layer | None:
        """The layer of a document; None if it cannot be read."""
        try:
            document = materialx().createDocument()
            self._read(document, place, set())
        except Exception as error:  # noqa: BLE001 (the package raises its own types, and those of its XML reader)
            self.problems[place] = _reason(error)
            return None
        # Nodes of the document are looked up in the library, and in its own definitions.
        document.setDataLibrary(library())
        # USD opens it by the suffix of its name.
        layer = Sdf.Layer.CreateAnonymous(os.path.basename(place) + ".usda")
        stage = Usd.Stage.Open(layer)
        stage.SetDefaultPrim(stage.DefinePrim(_ROOT))
        try:
            _Writer(stage, place, self.report).write(document)
        except RecursionError:
            self.problems[place] = "its node graphs are nested too deeply"
            return None
        except Exception as error:  # noqa: BLE001 (a document of others must not end the export)
            self.problems[place] = _reason(error)
            return None
        return layer


    def _read(self, document, place: str, known: set[str], depth: int = 0) -> None:
        """Fill a MaterialX document with a file and all that it includes, each found beside the file that names it and
        read once: `known` are those read so far. Raises OSError, and what MaterialX raises."""
        if depth > _MOST_INCLUDES:
            raise OSError(f"more than {_MOST_INCLUDES} documents include each other in a row")
        mx = materialx()
        data = self.dependencies.read(place)
        if data is None:
            raise OSError(f"{place}, which it includes, cannot be opened" if depth else "it cannot be opened")
        known.add(place)

        def include(inner, name, _search_path, _options) -> None:
            beside = _beside(place, name.asString())
            if beside not in known:
                self._read(inner, beside, known, depth + 1)

        options = mx.XmlReadOptions()
        options.readXIncludeFunction = include
        mx.readFromXmlString(document, data.decode("utf-8"), mx.FileSearchPath(), options)


def _reason(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__


def _is_document(path: str) -> bool:
    return path.split(":SDF_FORMAT_ARGS:")[0].lower().endswith((".mtlx", ".mtlx]"))


def _resolved(layer: Sdf.Layer, path: str) -> str | None:
    anchored = Sdf.ComputeAssetPathRelativeToLayer(layer, path.split(":SDF_FORMAT_ARGS:")[0])
    resolved = str(Ar.GetResolver().Resolve(anchored))
    return resolved if resolved and not os.path.isdir(resolved) else None


@dataclass
class _Scope:
    """Where nodes of one graph, or of the document, are put."""

    path: Sdf.Path
    interface: UsdShade.ConnectableAPI | None = None
    """The prim whose inputs `interfacename` means."""
    depth: int = 0


class _TooLarge(Exception):
    """The document would become too many prims."""


class _Writer:
    """Writes one document to a stage. Raises `_TooLarge`, and whatever MaterialX and USD raise."""

    def __init__(self, stage: Usd.Stage, place: str, report: Notebook) -> None:
        self.stage, self.place, self.report = stage, place, report
        self._written: dict[Sdf.Path, UsdShade.ConnectableAPI] = {}
        self._prims = 0

    def write(self, document) -> None:
        materials = self.stage.DefinePrim(_ROOT.AppendChild("Materials")).GetPath()
        for node in document.getMaterialNodes():
            self._material(document, node, materials.AppendChild(_name(node)))
        graphs = _ROOT.AppendChild("NodeGraphs")
        for graph in document.getNodeGraphs():
            if not graph.getNodeDef():
                self._graph(document, graph, _Scope(graphs))

    def _count(self) -> None:
        self._prims += 1
        if self._prims > _MOST_PRIMS:
            raise _TooLarge(f"with its node graphs written out it has more than {_MOST_PRIMS} prims")

    def _material(self, document, node, path: Sdf.Path) -> None:
        """A material; its shaders and node graphs are its children."""
        self._count()
        material = UsdShade.Material.Define(self.stage, path)
        for port in node.getInputs():
            shader = port.getConnectedNode()
            if shader is None:
                continue
            source = self._node(document, shader, _Scope(path), material)
            kind = {"surfaceshader": "surface", "displacementshader": "displacement", "volumeshader": "volume"}.get(
                port.getType()
            )
            if kind and source is not None:
                output = material.CreateOutput(f"mtlx:{kind}", Sdf.ValueTypeNames.Token)
                output.ConnectToSource(_output(source, shader, port))

    def _node(
        self, document, node, scope: _Scope, material: UsdShade.Material | None = None
    ) -> UsdShade.ConnectableAPI | None:
        """A node and all that it reads; None if its graphs are nested too deeply. With a `material`, what is authored on the
        node is an input of that, as with USD's plugin."""
        waiting = [(node, material)]
        first = None
        while waiting:
            item, owner = waiting.pop()
            path = scope.path.AppendChild(_name(item))
            if path in self._written:
                first = first or self._written[path]
                continue
            prim = self._prim(document, item, path, scope)
            if prim is None:
                return None
            self._written[path] = prim
            first = first or prim
            for port in item.getInputs():
                waiting.extend((source, None) for source in self._input(document, item, prim, port, scope, owner))
        return first

    def _prim(self, document, node, path: Sdf.Path, scope: _Scope) -> UsdShade.ConnectableAPI | None:
        """The prim of a node: a shader, or the graph that the document defines it by."""
        nodedef = node.getNodeDef()
        implementation = nodedef.getImplementation() if nodedef else None
        own = implementation if implementation and implementation.isA(materialx().NodeGraph) else None
        if own is not None and definition(nodedef.getName()) is None:
            if scope.depth >= _MOST_GRAPHS:
                self.report.warn(
                    self.place, "MaterialX document", f"{node.getNamePath()}: its node graphs are nested too deeply"
                )
                return None
            return self._graph_prim(document, own, nodedef, path, scope.depth + 1)
        self._count()
        shader = UsdShade.Shader.Define(self.stage, path)
        shader.CreateIdAttr(nodedef.getName() if nodedef else node.getCategory())
        for output in nodedef.getActiveOutputs() if nodedef else []:
            shader.CreateOutput(_name(output), _type(output.getType()))
        return shader.ConnectableAPI()

    def _graph(self, document, graph, scope: _Scope) -> UsdShade.ConnectableAPI:
        path = scope.path.AppendChild(_name(graph))
        if path not in self._written:
            self._graph_prim(document, graph, graph, path, scope.depth + 1)
            for port in graph.getInputs():
                for source in self._input(document, graph, self._written[path], port, scope, None):
                    self._node(document, source, scope)
        return self._written[path]

    def _graph_prim(self, document, graph, interface, path: Sdf.Path, depth: int) -> UsdShade.ConnectableAPI:
        """A node graph with the inputs of its interface, and the nodes that its outputs read."""
        self._count()
        # A graph that reads itself finds itself here.
        prim = self._written[path] = UsdShade.NodeGraph.Define(self.stage, path).ConnectableAPI()
        for port in interface.getActiveInputs() if interface is not graph else graph.getInputs():
            self._value(prim, port)
        inside = _Scope(path, prim, depth)
        for output in graph.getOutputs():
            source = output.getConnectedNode()
            made = prim.CreateOutput(_name(output), _type(output.getType()))
            if source is not None:
                found = self._node(document, source, inside)
                if found is not None:
                    made.ConnectToSource(_output(found, source, output))
        return prim

    def _input(
        self, document, node, prim: UsdShade.ConnectableAPI, port, scope: _Scope, owner: UsdShade.Material | None
    ) -> list:
        """One input: a value or a connection. Gives the nodes of the same graph that it reads."""
        name = port.getInterfaceName()
        if name and scope.interface is not None and scope.path != prim.GetPath():
            made = prim.CreateInput(_name(port), _type(port.getType()))
            made.ConnectToSource(scope.interface.CreateInput(Tf.MakeValidIdentifier(name), _type(port.getType())))
            return []
        graph = document.getNodeGraph(port.getNodeGraphString()) if port.getNodeGraphString() else None
        if graph is not None:
            made = prim.CreateInput(_name(port), _type(port.getType()))
            outside = scope if not scope.depth else _Scope(_ROOT.AppendChild("NodeGraphs"))
            source = self._graph(document, graph, outside)
            output = port.getConnectedOutput() or graph.getOutput(port.getOutputString())
            if output is not None:
                made.ConnectToSource(source.CreateOutput(_name(output), _type(output.getType())))
            return []
        source = port.getConnectedNode()
        if source is not None:
            made = prim.CreateInput(_name(port), _type(port.getType()))
            target = scope.path.AppendChild(_name(source))
            made.GetAttr().SetConnections([target.AppendProperty(f"outputs:{_output_name(source, port)}")])
            return [source]
        if owner is not None:
            made = prim.CreateInput(_name(port), _type(port.getType()))
            made.ConnectToSource(self._value(owner, port))
        else:
            self._value(prim, port)
        return []

    def _value(self, prim, port) -> UsdShade.Input:
        """An input with the value of a port, if it has one."""
        made = prim.CreateInput(_name(port), _type(port.getType()))
        value = _value(port, self.place)
        if value is not None:
            made.Set(value)
        space = port.getActiveColorSpace() if port.getType() in ("filename", "color3", "color4") else ""
        if space:
            made.GetAttr().SetColorSpace(space)
        return made


def _output(source: UsdShade.ConnectableAPI, node, port) -> UsdShade.Output:
    nodedef = node.getNodeDef()
    name = _output_name(node, port)
    found = nodedef.getActiveOutput(name) if nodedef else None
    return source.CreateOutput(name, _type(found.getType() if found else node.getType()))


def _output_name(node, port) -> str:
    name = port.getOutputString()
    if name:
        return Tf.MakeValidIdentifier(name)
    nodedef = node.getNodeDef()
    outputs = nodedef.getActiveOutputs() if nodedef else []
    return _name(outputs[0]) if outputs else "out"


def _name(element) -> str:
    return Tf.MakeValidIdentifier(element.getName())


def _type(name: str) -> Sdf.ValueTypeName:
    return getattr(Sdf.ValueTypeNames, _TYPES.get(name, "Token"))


def _value(port, place: str) -> object:
    """The value of a port as USD has it; None if there is none."""
    if not port.hasValueString():
        return None
    kind, text = port.getType(), port.getResolvedValueString()
    if kind == "filename":
        return Sdf.AssetPath(_beside(place, text)) if text else None
    value = parsed(kind, text)
    if value is None:
        return None
    if kind in _MAKERS:
        return _MAKERS[kind](*value)
    return {"integer": int, "boolean": bool}.get(kind, lambda v: v)(value)


def _beside(place: str, path: str) -> str:
    """A path in a document, absolute or inside the package that the document is in."""
    if os.path.isabs(path):
        return path
    if Ar.IsPackageRelativePath(place):
        package, inner = Ar.SplitPackageRelativePathInner(place)
        return Ar.JoinPackageRelativePath(package, os.path.normpath(os.path.join(os.path.dirname(inner), path)))
    return os.path.normpath(os.path.join(os.path.dirname(place), path))
