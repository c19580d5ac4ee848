"""Which of a material's surfaces is read: those of the renderers that say most come first."""

from __future__ import annotations

from collections.abc import Iterator

from pxr import UsdShade

from .look_builder import LookBuilder
from .materials import Look
from .network_surfaces import NetworkSurfaces, is_read
from .preview_surface import PreviewSurfaces
from .quantities import Lost
from .report import Notebook
from .stage import Frames
from .textures import Textures

_READ_CONTEXTS = ("mtlx", "arnold", "")
"""Render contexts in the order of preference. The universal one, which is mostly UsdPreviewSurface, is what a material
looks like where nobody knows better: USD's own rule is that a renderer's context comes before it."""
_OTHER_CONTEXTS = ("ri", "mdl", "glslfx")
"""Render contexts whose shaders are named in the report."""


class Surfaces:
    """Reads materials; `Materials` keeps the looks."""

    def __init__(self, textures: Textures, frames: Frames, meters_per_unit: float, report: Notebook) -> None:
        self.report = report
        builder = LookBuilder(textures, meters_per_unit, report)
        self.previews = PreviewSurfaces(textures, builder, frames, report)
        self.networks = NetworkSurfaces(textures, builder, self.previews, frames, report)

    def read(self, material: UsdShade.Material) -> Look:
        """The look of a material; unknown shaders are reported and look like no material."""
        path = str(material.GetPath())
        unread = []
        for shader in _surfaces(material, (*_READ_CONTEXTS, *_OTHER_CONTEXTS)):
            name = str(shader.GetIdAttr().Get() or "")
            look = self._look(path, shader, name, unread)
            if look is not None:
                if unread:
                    self.report.note(
                        path, f"surface shader {unread[0]}", f"it is not read; {name} of the same material is used"
                    )
                return look
        what = f"surface shader {unread[0]}" if unread else "material without a surface shader"
        why = "only UsdPreviewSurface and the surfaces of MaterialX and Arnold are read; display colour or grey is used"
        self.report.warn(path, what, why)
        return Look(path=path)

    def _look(self, path: str, shader: UsdShade.Shader, name: str, unread: list[str]) -> Look | None:
        look = None
        if name == "UsdPreviewSurface":
            look = self.previews.look(path, shader)
        elif is_read(name):
            try:
                look = self.networks.look(path, shader)
            except Lost as lost:
                self.report.warn(path, "surface that cannot be read", str(lost))
        if look is None and name:
            unread.append(name)
        return look


def _surfaces(material: UsdShade.Material, contexts: tuple[str, ...]) -> Iterator[UsdShade.Shader]:
    """The surface shader of each render context that has one."""
    for context in contexts:
        output = material.GetSurfaceOutput(context) if context else material.GetSurfaceOutput()
        attributes = UsdShade.Utils.GetValueProducingAttributes(output) if output else []
        if attributes and UsdShade.Output.IsOutput(attributes[0]):
            shader = UsdShade.Shader(attributes[0].GetPrim())
            if shader:
                yield shader
