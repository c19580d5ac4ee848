"""Colours of lights that shader networks compute: `inputs:color` that is connected, and Arnold's `shaders`.

UsdLux's formula takes what a connected `inputs:color` reads. `primvars:arnold:shaders` names an ArnoldNodeGraph whose
`outputs:color` arnold-usd puts in the place of `inputs:color` and its temperature (read_light.cpp, `ReadLightShaders`). It puts
the image of `texture:file` there too, so what is computed of texture coordinates lies on a rect light or a
dome as its picture would; of the two the network is used.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pxr import Sdf, Usd, UsdShade

from .evaluator import Evaluator
from .light_attributes import LightAttributes, arnold_names_of
from .network_images import NetworkImages
from .quantities import Lost, Quantity
from .report import Notebook
from .shader_network import Link, Network, literals
from .stage import Frames, changes

_PICTURED = ("RectLight", "DomeLight", "DomeLight_1")


@dataclass
class Computed:
    """A light's colour, linear Rec. 709."""

    rows: np.ndarray
    """(3,), or (times, 3), one for each of `Frames.codes`; white under `texels`."""
    texels: np.ndarray | None = None
    """(h, w, 3), the first row on top."""
    is_tinted: bool = True
    """Whether the colour temperature multiplies it."""

    def at(self, frames: Frames, code: float) -> np.ndarray:
        """The colour at one of the sampled time codes."""
        return self.rows[frames.codes.index(code)] if self.rows.ndim == 2 else self.rows


class LightNetworks:
    """Reads the networks of lights."""

    def __init__(self, images: NetworkImages, frames: Frames, report: Notebook) -> None:
        self.images, self.frames, self.report = images, frames, report

    def color(self, inputs: LightAttributes, kind: str) -> Computed | None:
        """What a network computes in the place of a light's colour; None if there is none, or it cannot be carried (reported)."""
        name, output = self._source(inputs)
        if output is None:
            return None
        is_arnold = name in arnold_names_of(inputs.prim, "shaders")
        try:
            found = self._computed(str(inputs.path), UsdShade.Shader(output.GetPrim()), str(UsdShade.Output(output).GetBaseName()))
            found.is_tinted = not is_arnold
            if found.texels is not None and kind not in _PICTURED:
                raise Lost("only rect lights and domes have pictures")
            if found.texels is not None and inputs.asset("texture:file") is not None and not is_arnold:
                raise Lost("it would multiply a picture")
        except Lost as lost:
            used = "its own value" if inputs.is_authored("color") else "the schema's value"
            what = f"{name} color" if is_arnold else f"connected {name}"
            self.report.warn(inputs.path, what, f"{lost}; {used} is used, and the light may be too bright")
            return None
        what = f"{name} color" if is_arnold else f"connected {name}"
        shape = "" if found.texels is None else " as a picture of {1} x {0} pixels".format(*found.texels.shape)
        self.report.note(inputs.path, what, f"it is what {output.GetPath()} computes{shape}")
        return found

    def _source(self, inputs: LightAttributes) -> tuple[str, Usd.Attribute | None]:
        """The attribute that says what the colour is, and the output of a shader that it reads."""
        names = arnold_names_of(inputs.prim, "shaders")
        for name in names:
            graph = graph_of(inputs.prim, name)
            inputs.known |= {name} if graph else set()
            output = connected(graph, "outputs:color") if graph else None
            if output is not None:
                return name, output
        own = inputs.color_link
        return (own.GetName(), inputs.color_output) if own is not None else ("", None)

    def _computed(self, path: str, shader: UsdShade.Shader, output: str) -> Computed:
        node = Network(shader).surface
        first = Evaluator(path, self.images, self.frames.first, self.report)
        value = first.output(Link(node, output)).wide(3)
        codes = self.frames.codes if any(changes(item.attribute, self.frames) for item in literals(node, node.inputs)) else ()
        if value.is_constant:
            evaluators = (Evaluator(path, self.images, code, self.report) for code in codes)
            rows = [evaluator.output(Link(node, output)).wide(3) for evaluator in evaluators]
            if all(row.is_constant for row in rows):
                return Computed(np.array([row.constant for row in rows]) if rows else value.constant)
        if codes:
            raise Lost("its picture changes")
        return Computed(np.ones(3), self._texels(first, value))

    @staticmethod
    def _texels(evaluator: Evaluator, value: Quantity) -> np.ndarray:
        planes, mapping = evaluator.canvas.planes(value)
        if mapping.transform is not None or mapping.uv_name != "st":
            raise Lost("its image is not laid on the light as a whole")
        return np.clip(np.moveaxis(np.asarray(planes, dtype=float), 0, -1), 0.0, None)


def graph_of(light: Usd.Prim, name: str) -> Usd.Prim | None:
    """The node graph that an attribute of a light names. USD does not map strings through references, so the path is
    one of the layer that it is authored in."""
    attribute = light.GetAttribute(name)
    value = attribute.Get(Usd.TimeCode.EarliestTime()) if attribute else None
    named = str(value if isinstance(value, str) else next(iter(value), "") if value else "")
    if not Sdf.Path.IsValidPathString(named) or not Sdf.Path(named).IsAbsolutePath():
        return None
    stage, path = light.GetStage(), Sdf.Path(named)
    return stage.GetPrimAtPath(_mapped(light, attribute, path)) or stage.GetPrimAtPath(path) or None


def _mapped(light: Usd.Prim, attribute: Usd.Attribute, path: Sdf.Path) -> Sdf.Path:
    """A path of the layer with the attribute's strongest opinion, on the stage."""
    specs = attribute.GetPropertyStack(Usd.TimeCode.EarliestTime())
    waiting = [light.GetPrimIndex().rootNode] if specs else []
    while waiting:
        node = waiting.pop()
        if node.path == specs[0].path.GetPrimPath() and specs[0].layer in node.layerStack.layers:
            found = node.mapToRoot.MapSourceToTarget(path)
            return path if found.isEmpty else found
        waiting += node.children
    return path


def connected(graph: Usd.Prim, name: str) -> Usd.Attribute | None:
    """The shader's output that an output of a node graph reads."""
    attribute = graph.GetAttribute(name)
    if not attribute or not attribute.HasAuthoredConnections():
        return None
    found = UsdShade.Utils.GetValueProducingAttributes(UsdShade.Output(attribute))
    return found[0] if found and UsdShade.Output.IsOutput(found[0]) and UsdShade.Shader(found[0].GetPrim()) else None
