"""UsdPreviewSurface to glTF's metallic-roughness.

Defaults are those of the UsdPreviewSurface specification. The specular workflow becomes a dielectric
whose F0 is its specular colour, and F90 white, by `KHR_materials_specular`; displacement has no carrier.
"""

from __future__ import annotations

from pxr import Sdf, UsdShade

from .look_builder import LookBuilder, Value, color_of, number_of, rescaled
from .materials import Look
from .report import Notebook
from .stage import Frames, changes
from .textures import TextureRead, Textures

_ONE, _ZERO = (1.0,) * 4, (0.0,) * 4
_F0 = 0.04
"""What a dielectric of index 1.5 reflects."""


class PreviewSurfaces:
    """Reads UsdPreviewSurface shaders."""

    def __init__(self, textures: Textures, builder: LookBuilder, frames: Frames, report: Notebook) -> None:
        self.textures, self.builder, self.frames, self.report = textures, builder, frames, report
        self.code = frames.first

    def look(self, path: str, shader: UsdShade.Shader) -> Look:
        """The look of a surface."""
        return self.look_of(path, {name: self._value(path, shader, name) for name in INPUTS})

    def look_of(self, path: str, read: dict[str, Value]) -> Look:
        """The look of a surface whose inputs are read already."""
        specular_workflow = bool(number_of(read["useSpecularWorkflow"], 0.0))
        if specular_workflow:
            value = read["specularColor"]
            color = color_of(value, (0.0, 0.0, 0.0))
            tint = Value(tuple(c / _F0 for c in color), value.texture and rescaled(value.texture, 1 / _F0))
            # The colour is F0 as it stands, whatever the index of refraction.
            read = {**read, "specularTint": tint, "ior": Value()}
        # One normal for all lobes.
        read = {**read, "clearcoatNormal": read.get("normal", Value()), "clearcoatNormalScale": read.get("normalScale", Value())}
        look = self.builder.look(path, read, is_dielectric=specular_workflow)
        if read["displacement"].texture or number_of(read["displacement"], 0.0) != 0.0:
            self.report.warn(path, "displacement", "it has no carrier")
        return look

    # -- inputs ----------------------------------------------------------------------------------

    def _value(self, path: str, shader: UsdShade.Shader, name: str) -> Value:
        """What the input reads, through interfaces and node graphs."""
        # What glows is a light, whatever says so.
        report = self.report.about("lights") if name == "emissiveColor" else self.report
        found = shader.GetInput(name)
        if not found:
            return Value()
        attributes = UsdShade.Utils.GetValueProducingAttributes(found)
        if not attributes:
            return Value()
        attribute = attributes[0]
        if not UsdShade.Output.IsOutput(attribute):
            if changes(attribute, self.frames) and name == "emissiveColor":
                return Value(attribute.Get(self.code), keys=[attribute.Get(code) for code in self.frames.codes])
            if changes(attribute, self.frames):
                report.warn(path, f"animated {name}", "materials have no animation; the first frame is used")
            return Value(constant=attribute.Get(self.code))
        source = UsdShade.Shader(attribute.GetPrim())
        kind = str(source.GetIdAttr().Get() or "")
        if kind == "UsdUVTexture":
            channel = UsdShade.Output(attribute).GetBaseName()
            return self._texture(path, source, channel, report)
        if kind.startswith("UsdPrimvarReader_float3") and name == "diffuseColor":
            if self._plain(source, "varname") in ("displayColor", "primvars:displayColor"):
                return Value(display_color=True)
        what = f"{name} from {kind or 'an unknown shader'}"
        report.warn(path, what, "only constants, UsdUVTexture and displayColor are read; the default is used")
        return Value()

    def _plain(self, shader: UsdShade.Shader, name: str, fallback=None):
        """A constant input, through interfaces."""
        found = shader.GetInput(name)
        attributes = UsdShade.Utils.GetValueProducingAttributes(found) if found else []
        if not attributes or UsdShade.Output.IsOutput(attributes[0]):
            return fallback
        value = attributes[0].Get(self.code)
        return fallback if value is None else value

    def _texture(self, path: str, shader: UsdShade.Shader, channel: str, report: Notebook) -> Value:
        """A UsdUVTexture; its fallback colour if the file is missing or unreadable."""
        fallback = tuple(self._plain(shader, "fallback", (0.0, 0.0, 0.0, 1.0)))
        constant = Value(constant=fallback[:3] if channel == "rgb" else fallback["rgba".find(channel[:1])])
        found = shader.GetInput("file")
        attributes = UsdShade.Utils.GetValueProducingAttributes(found) if found else []
        asset = attributes[0].Get(self.code) if attributes else None
        if not isinstance(asset, Sdf.AssetPath) or not asset.path:
            report.warn(path, "missing texture", f"{shader.GetPath()} names no file; its fallback is used")
            return constant
        uv_name, transform = self._mapping(path, shader)
        plan = TextureRead(
            name="",
            data=b"",
            existing=None,
            channel=channel if channel in ("r", "g", "b", "a") else "rgb",
            scale=tuple(map(float, self._plain(shader, "scale", _ONE))),
            bias=tuple(map(float, self._plain(shader, "bias", _ZERO))),
            color_space=str(self._plain(shader, "sourceColorSpace", "auto")),
            wraps=(str(self._plain(shader, "wrapS", "useMetadata")), str(self._plain(shader, "wrapT", "useMetadata"))),
            uv_name=uv_name,
            transform=transform,
        )
        if changes(attributes[0], self.frames):
            report.warn(path, "animated texture file", "materials have no animation; the first frame's file is used")
        return Value(constant=constant.constant, texture=self.textures.read(path, attributes[0], plan, report))

    def _mapping(self, path: str, shader: UsdShade.Shader) -> tuple[str, tuple | None]:
        """The primvar that the texture is read with, and its UsdTransform2d."""
        transform = None
        found = shader.GetInput("st")
        for _ in range(8):
            attributes = UsdShade.Utils.GetValueProducingAttributes(found) if found else []
            if not attributes or not UsdShade.Output.IsOutput(attributes[0]):
                break
            source = UsdShade.Shader(attributes[0].GetPrim())
            kind = str(source.GetIdAttr().Get() or "")
            if kind == "UsdTransform2d" and transform is None:
                scale = self._plain(source, "scale", (1.0, 1.0))
                shift = self._plain(source, "translation", (0.0, 0.0))
                transform = (float(self._plain(source, "rotation", 0.0)), *map(float, scale), *map(float, shift))
                found = source.GetInput("in")
                continue
            if kind.startswith("UsdPrimvarReader"):
                return str(self._plain(source, "varname", "st")).removeprefix("primvars:"), transform
            self.report.warn(path, f"texture coordinates from {kind or 'an unknown shader'}", "primvars:st is used")
            break
        return "st", transform


INPUTS = (
    "diffuseColor", "emissiveColor", "useSpecularWorkflow", "specularColor", "metallic", "roughness",
    "clearcoat", "clearcoatRoughness", "opacity", "opacityThreshold", "ior", "normal", "displacement",
    "occlusion",
)  # fmt: skip
"""The inputs that are read."""
