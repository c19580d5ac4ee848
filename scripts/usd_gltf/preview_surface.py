"""UsdPreviewSurface to glTF's metallic-roughness.

Defaults are those of the UsdPreviewSurface specification. The specular workflow becomes a dielectric
with `KHR_materials_specular` (reported: an approximation); displacement has no carrier.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from pxr import Sdf, UsdShade

from .gltf_document import number, numbers
from .materials import Look
from .report import Notebook
from .stage import Frames, changes
from .textures import TextureRead, Textures

_OTHER_CONTEXTS = ("mtlx", "arnold", "ri", "mdl", "glslfx")
"""Render contexts whose shaders are named in the report."""
_ONE, _ZERO = (1.0,) * 4, (0.0,) * 4


@dataclass
class Value:
    """What an input reads: a constant, a texture, or the mesh's display colour."""

    constant: object = None
    texture: TextureRead | None = None
    display_color: bool = False
    varies: bool = False
    """Whether `constant` is a list of one value for each frame."""


class PreviewSurfaces:
    """Reads materials; `Materials` keeps the looks."""

    def __init__(self, textures: Textures, frames: Frames, report: Notebook) -> None:
        self.textures, self.frames, self.report = textures, frames, report
        self.code = frames.first

    def read(self, material: UsdShade.Material) -> Look:
        """The look of a material; unknown shaders are reported and look like no material."""
        path = material.GetPath()
        shader, _, _ = material.ComputeSurfaceSource()
        name = str(shader.GetIdAttr().Get() or "") if shader else ""
        if name != "UsdPreviewSurface":
            for context in _OTHER_CONTEXTS if not shader else ():
                shader, _, _ = material.ComputeSurfaceSource(context)
                if shader:
                    name = str(shader.GetIdAttr().Get() or "")
                    break
            what = f"surface shader {name}" if name else "material without a surface shader"
            self.report.warn(path, what, "only UsdPreviewSurface is read; display colour or grey is used")
            return Look(path=str(path))
        return self._look(str(path), shader)

    # -- one surface -----------------------------------------------------------------------------

    def _look(self, path: str, shader: UsdShade.Shader) -> Look:
        look = Look(path=path, uses_display_color=False, glow_is_known=True)
        read = {name: self._value(path, shader, name) for name in _DEFAULTS}
        specular_workflow = bool(self._number(read["useSpecularWorkflow"], 0.0))
        self._base(look, read)
        self._metallic_roughness(look, read, specular_workflow)
        self._emission(look, read)
        self._normal_and_occlusion(look, read)
        if specular_workflow:
            color = self._color(read["specularColor"], (0.0, 0.0, 0.0))
            f0 = max(color)
            look.extensions["KHR_materials_specular"] = {
                "specularFactor": 1.0,
                "specularColorFactor": numbers([c / 0.04 for c in color]),
            }
            why = "it becomes a dielectric with a specular colour" + (
                "; its texture is lost" if read["specularColor"].texture else ""
            )
            self.report.warn(path, "specular workflow", f"{why} (F0 up to {f0:g})")
        ior = self._number(read["ior"], 1.5)
        if ior != 1.5 and (ior >= 1.0 or ior == 0.0):
            look.extensions["KHR_materials_ior"] = {"ior": number(ior)}
        clearcoat = self._number(read["clearcoat"], 0.0)
        if clearcoat > 0:
            roughness = self._number(read["clearcoatRoughness"], 0.01)
            look.extensions["KHR_materials_clearcoat"] = {
                "clearcoatFactor": number(min(clearcoat, 1.0)),
                "clearcoatRoughnessFactor": number(min(max(roughness, 0.0), 1.0)),
            }
        if read["clearcoat"].texture or read["clearcoatRoughness"].texture:
            self.report.warn(path, "clearcoat texture", "its constant value is used")
        if read["displacement"].texture or self._number(read["displacement"], 0.0) != 0.0:
            self.report.warn(path, "displacement", "it has no carrier")
        return look

    def _base(self, look: Look, read: dict[str, Value]) -> None:
        """baseColor from diffuseColor and opacity, and the alpha mode."""
        diffuse, opacity = read["diffuseColor"], read["opacity"]
        threshold = self._number(read["opacityThreshold"], 0.0)
        look.uses_display_color = diffuse.display_color
        alpha = self._number(opacity, 1.0)
        if threshold > 0.0:
            look.alpha_mode, look.alpha_cutoff = "MASK", threshold
        elif opacity.texture or alpha < 1.0:
            look.alpha_mode = "BLEND"
        color, mask = diffuse.texture, opacity.texture
        constant = (1.0, 1.0, 1.0) if diffuse.display_color else self._color(diffuse, (0.18, 0.18, 0.18))
        if color is None and mask is None:
            look.base_color = (*constant, alpha)
            return
        main = color or mask
        same = mask is None or (mask.data == main.data and mask.channel == "a" and mask.bias[3] == 0)
        scales = [*main.scale[:3], mask.scale[3] if mask else alpha]
        fits = all(0 <= s <= 1 for s in scales) and (mask is not None or look.alpha_mode == "OPAQUE")
        if color is not None and color.is_plain("rgb", srgb=True) and same and fits:
            image = self.textures.plain(color)
            look.base_color = tuple(scales)
        else:
            planes = [(color, c) for c in _rgb(color)] if color else [float(c) for c in constant]
            planes.append((mask, mask.channel[0]) if mask else float(alpha))
            image = self.textures.packed(f"{_stem(main)}_base", planes, srgb=True)
            look.base_color = (1.0, 1.0, 1.0, 1.0)
        self._same_mapping(look.path, color, mask)
        look.base_texture = self._info(look, main, image)

    def _metallic_roughness(self, look: Look, read: dict[str, Value], specular_workflow: bool) -> None:
        """Roughness in green, metalness in blue."""
        rough, metal = read["roughness"].texture, None if specular_workflow else read["metallic"].texture
        roughness = min(max(self._number(read["roughness"], 0.5), 0.0), 1.0)
        metallic = 0.0 if specular_workflow else min(max(self._number(read["metallic"], 0.0), 0.0), 1.0)
        look.roughness, look.metallic = roughness, metallic
        if rough is None and metal is None:
            return
        main = rough or metal
        as_is = (
            (rough is None or (rough.is_plain("g", srgb=False) and 0 <= rough.scale[1] <= 1))
            and (metal is None or (metal.is_plain("b", srgb=False) and 0 <= metal.scale[2] <= 1))
            and (rough is None or metal is None or rough.data == metal.data)
            and (rough is not None)
            and (metal is not None or metallic == 0.0)
        )
        if as_is:
            image = self.textures.plain(main)
            look.roughness = rough.scale[1]
            look.metallic = metal.scale[2] if metal else 0.0
        else:
            planes = [
                1.0,
                (rough, rough.channel[0]) if rough else float(roughness),
                (metal, metal.channel[0]) if metal else float(metallic),
                1.0,
            ]
            image = self.textures.packed(f"{_stem(main)}_roughness_metallic", planes, srgb=False)
            look.roughness, look.metallic = 1.0, 1.0
        self._same_mapping(look.path, rough, metal)
        look.metallic_roughness_texture = self._info(look, main, image)

    def _emission(self, look: Look, read: dict[str, Value]) -> None:
        emissive = read["emissiveColor"]
        texture = emissive.texture
        if texture is None:
            keys = emissive.constant if emissive.varies else [emissive.constant]
            rows = [self._color(Value(key), (0.0, 0.0, 0.0), limit=math.inf) for key in keys]
            look.emission = rows[0]
            look.emission_keys = np.array(rows) if emissive.varies else None
            return
        if texture.is_plain("rgb", srgb=True) and min(texture.scale[:3]) >= 0 and "black" not in texture.wraps:
            image = self.textures.plain(texture)
            look.emission = texture.scale[:3]
        else:
            planes = [(texture, c) for c in _rgb(texture)]
            image, factor = self.textures.baked(look.path, f"{_stem(texture)}_emission", planes)
            look.emission = tuple(float(f) for f in factor)
        look.emission_texture = self._info(look, texture, image)

    def _normal_and_occlusion(self, look: Look, read: dict[str, Value]) -> None:
        normal, occlusion = read["normal"].texture, read["occlusion"].texture
        if normal is not None:
            standard = normal.scale[:3] == (2.0,) * 3 and normal.bias[:3] == (-1.0,) * 3
            if standard and normal.channel == "rgb" and normal.color_space != "sRGB":
                image = self.textures.plain(normal)
            else:
                planes = [(_rescaled(normal, 0.5, 0.5), c) for c in _rgb(normal)]
                image = self.textures.packed(f"{_stem(normal)}_normal", [*planes, 1.0], srgb=False)
            look.normal_texture = self._info(look, normal, image)
        if occlusion is not None:
            if occlusion.is_plain("r", srgb=False) and occlusion.scale[0] == 1.0:
                image = self.textures.plain(occlusion)
            else:
                planes = [(occlusion, occlusion.channel[0]), 1.0, 1.0, 1.0]
                image = self.textures.packed(f"{_stem(occlusion)}_occlusion", planes, srgb=False)
            look.occlusion_texture = self._info(look, occlusion, image)

    def _info(self, look: Look, read: TextureRead, image: int) -> dict:
        return self.textures.info(look.path, read, image, look.uv_names)

    def _same_mapping(self, path: str, a: TextureRead | None, b: TextureRead | None) -> None:
        if a and b and (a.uv_name, a.transform, a.wraps) != (b.uv_name, b.transform, b.wraps):
            why = "glTF reads both from one image with one mapping; the first one's is used"
            self.report.warn(path, "textures with different mappings", why)

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
                return Value([attribute.Get(code) for code in self.frames.codes], varies=True)
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

    @staticmethod
    def _number(value: Value, fallback: float) -> float:
        try:
            found = float(value.constant)
        except (TypeError, ValueError):
            return fallback
        return found if math.isfinite(found) else fallback

    @staticmethod
    def _color(value: Value, fallback: tuple, limit: float = 1.0) -> tuple[float, float, float]:
        try:
            r, g, b = (float(c) for c in value.constant)
        except (TypeError, ValueError):
            return fallback
        if not all(map(math.isfinite, (r, g, b))):
            return fallback
        return tuple(min(max(c, 0.0), limit) for c in (r, g, b))


_DEFAULTS = (
    "diffuseColor", "emissiveColor", "useSpecularWorkflow", "specularColor", "metallic", "roughness",
    "clearcoat", "clearcoatRoughness", "opacity", "opacityThreshold", "ior", "normal", "displacement",
    "occlusion",
)  # fmt: skip


def _rgb(read: TextureRead) -> str:
    """The channels that feed a colour."""
    return "rgb" if read.channel == "rgb" else read.channel * 3


def _stem(read: TextureRead) -> str:
    return read.name.rsplit(".", 1)[0]


def _rescaled(read: TextureRead, factor: float, shift: float = 0.0) -> TextureRead:
    """The same read with all its values times `factor` plus `shift`."""
    fields = dict(vars(read))
    fields["scale"] = tuple(s * factor for s in read.scale)
    fields["bias"] = tuple(b * factor + shift for b in read.bias)
    return TextureRead(**fields)
