"""What a surface's inputs read, made into a look in glTF's terms: textures packed the way that glTF wants them.

Values come under the names of UsdPreviewSurface, whatever shader they are of, with a few names of glTF's extensions
(`specular`, `specularTint`, `transmission`, ...) that UsdPreviewSurface has no word for.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np

from .gltf_document import number, numbers
from .materials import Look
from .report import Notebook
from .textures import CHANNELS, TextureRead, Textures

NAMES = (
    "diffuseColor", "emissiveColor", "useSpecularWorkflow", "specularColor", "metallic", "roughness",
    "clearcoat", "clearcoatRoughness", "opacity", "opacityThreshold", "ior", "normal", "displacement",
    "occlusion", "normalScale", "specular", "specularTint", "transmission", "thinWalled",
    "attenuationColor", "attenuationDistance", "clearcoatNormal", "clearcoatNormalScale",
)  # fmt: skip
"""What a surface may say: UsdPreviewSurface's inputs, and of glTF's extensions what they have no word for."""


@dataclass
class Value:
    """What an input reads: a constant, a texture, or the mesh's display colour."""

    constant: object = None
    texture: TextureRead | None = None
    display_color: bool = False
    primvar: str = "displayColor"
    """Which primvar that colour is, times `primvar_scale`; `constant` on meshes without it."""
    primvar_scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    keys: list | None = None
    """One constant for each time code that is sampled, if it varies."""


class LookBuilder:
    """Builds looks; `report` is told what glTF cannot say."""

    def __init__(self, textures: Textures, meters_per_unit: float, report: Notebook) -> None:
        self.textures, self.meters_per_unit, self.report = textures, meters_per_unit, report

    def look(self, path: str, read: dict[str, Value], is_dielectric: bool = False) -> Look:
        """The look of a surface; `is_dielectric` leaves out what it says of metal."""
        look = Look(path=path, uses_display_color=False, glow_is_known=True)
        read = {**{name: Value() for name in NAMES}, **read}
        self._base(look, read)
        self._metallic_roughness(look, read, is_dielectric)
        self._emission(look, read)
        self._normal_and_occlusion(look, read)
        self._specular(look, read)
        ior = number_of(read["ior"], 1.5)
        if ior != 1.5 and (ior >= 1.0 or ior == 0.0):
            look.extensions["KHR_materials_ior"] = {"ior": number(ior)}
        self._clearcoat(look, read)
        self._transmission(look, read)
        return look

    def _base(self, look: Look, read: dict[str, Value]) -> None:
        """baseColor from diffuseColor and opacity, and the alpha mode."""
        diffuse, opacity = read["diffuseColor"], read["opacity"]
        threshold = number_of(read["opacityThreshold"], 0.0)
        look.uses_display_color = diffuse.display_color
        if diffuse.display_color:
            look.color_primvar, look.color_scale, look.color_default = diffuse.primvar, diffuse.primvar_scale, diffuse.constant
        alpha = number_of(opacity, 1.0)
        if threshold > 0.0:
            look.alpha_mode, look.alpha_cutoff = "MASK", threshold
        elif opacity.texture or alpha < 1.0:
            look.alpha_mode = "BLEND"
        color, mask = diffuse.texture, opacity.texture
        constant = (1.0, 1.0, 1.0) if diffuse.display_color else color_of(diffuse, (0.18, 0.18, 0.18))
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
        roughness = min(max(number_of(read["roughness"], 0.5), 0.0), 1.0)
        metallic = 0.0 if specular_workflow else min(max(number_of(read["metallic"], 0.0), 0.0), 1.0)
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
            nits = functools.partial(color_of, fallback=(0.0, 0.0, 0.0), limit=math.inf)
            look.emission = nits(emissive)
            if emissive.keys is not None:
                look.emission_keys = np.array([nits(Value(key)) for key in emissive.keys])
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
            look.normal_texture = self._normal_map(look, normal, read["normalScale"])
        if occlusion is not None:
            if occlusion.is_plain("r", srgb=False) and occlusion.scale[0] == 1.0:
                image = self.textures.plain(occlusion)
            else:
                planes = [(occlusion, occlusion.channel[0]), 1.0, 1.0, 1.0]
                image = self.textures.packed(f"{_stem(occlusion)}_occlusion", planes, srgb=False)
            look.occlusion_texture = self._info(look, occlusion, image)

    def _normal_map(self, look: Look, normal: TextureRead, strength: Value) -> dict:
        """The info of a normal map."""
        standard = normal.scale[:3] == (2.0,) * 3 and normal.bias[:3] == (-1.0,) * 3
        if standard and normal.channel == "rgb" and normal.color_space != "sRGB":
            image = self.textures.plain(normal)
        else:
            planes = [(rescaled(normal, 0.5, 0.5), c) for c in _rgb(normal)]
            image = self.textures.packed(f"{_stem(normal)}_normal", [*planes, 1.0], srgb=False)
        info = self._info(look, normal, image)
        scale = number_of(strength, 1.0)
        if scale != 1.0:
            info["scale"] = number(scale)
        return info

    def _specular(self, look: Look, read: dict[str, Value]) -> None:
        """KHR_materials_specular, where the lobe is weaker than the index of refraction says, or tinted."""
        weight, tint = read["specular"], read["specularTint"]
        strength = min(max(number_of(weight, 1.0), 0.0), 1.0)
        color = color_of(tint, (1.0, 1.0, 1.0), limit=math.inf)
        if weight.texture is None and tint.texture is None and strength == 1.0 and color == (1.0, 1.0, 1.0):
            return
        extension: dict = {"specularFactor": number(strength), "specularColorFactor": numbers(color)}
        if weight.texture is not None:
            extension["specularFactor"] = 1.0
            extension["specularTexture"] = self._lone(look, weight.texture, "specular", "a")
        if tint.texture is not None:
            top = max(1.0, *(s + b for s, b in zip(tint.texture.scale[:3], tint.texture.bias[:3], strict=True)))
            extension["specularColorFactor"] = [number(top)] * 3
            planes = [(rescaled(tint.texture, 1 / top), c) for c in _rgb(tint.texture)]
            image = self.textures.packed(f"{_stem(tint.texture)}_specular_color", planes, srgb=True)
            extension["specularColorTexture"] = self._info(look, tint.texture, image)
        look.extensions["KHR_materials_specular"] = extension

    def _clearcoat(self, look: Look, read: dict[str, Value]) -> None:
        coat, rough = read["clearcoat"], read["clearcoatRoughness"]
        weight = number_of(coat, 0.0)
        if weight <= 0 and coat.texture is None:
            return
        roughness = number_of(rough, 0.01)
        extension: dict = {
            "clearcoatFactor": number(min(weight, 1.0)),
            "clearcoatRoughnessFactor": number(min(max(roughness, 0.0), 1.0)),
        }
        if coat.texture is not None:
            extension["clearcoatFactor"] = 1.0
            extension["clearcoatTexture"] = self._lone(look, coat.texture, "clearcoat", "r")
        if rough.texture is not None:
            extension["clearcoatRoughnessFactor"] = 1.0
            extension["clearcoatRoughnessTexture"] = self._lone(look, rough.texture, "clearcoat_roughness", "g")
        if read["clearcoatNormal"].texture is not None:
            normal = read["clearcoatNormal"].texture
            extension["clearcoatNormalTexture"] = self._normal_map(look, normal, read["clearcoatNormalScale"])
        look.extensions["KHR_materials_clearcoat"] = extension

    def _transmission(self, look: Look, read: dict[str, Value]) -> None:
        """KHR_materials_transmission; with KHR_materials_volume where the inside is solid."""
        value = read["transmission"]
        weight = min(max(number_of(value, 0.0), 0.0), 1.0)
        if weight == 0.0 and value.texture is None:
            return
        extension: dict = {"transmissionFactor": number(weight)}
        if value.texture is not None:
            extension = {"transmissionFactor": 1.0, "transmissionTexture": self._lone(look, value.texture, "transmission", "r")}
        look.extensions["KHR_materials_transmission"] = extension
        if number_of(read["thinWalled"], 0.0):
            return
        look.extensions["KHR_materials_volume"] = volume = {"thicknessFactor": 1.0}
        distance = number_of(read["attenuationDistance"], 0.0) * self.meters_per_unit
        if distance > 0.0:
            volume["attenuationDistance"] = number(distance)
            volume["attenuationColor"] = numbers(color_of(read["attenuationColor"], (1.0, 1.0, 1.0)))

    def _lone(self, look: Look, read: TextureRead, name: str, channel: str) -> dict:
        """The info of a texture of which glTF reads one channel; the file itself if it has the number there."""
        at = CHANNELS.index(channel)
        if read.is_plain(channel, srgb=False) and read.scale[at] == 1.0:
            return self._info(look, read, self.textures.plain(read))
        planes: list = [1.0] * 4
        planes[at] = (read, read.channel[0])
        return self._info(look, read, self.textures.packed(f"{_stem(read)}_{name}", planes, srgb=False))

    def _info(self, look: Look, read: TextureRead, image: int) -> dict:
        return self.textures.info(look.path, read, image, look.uv_names)

    def _same_mapping(self, path: str, a: TextureRead | None, b: TextureRead | None) -> None:
        if a and b and (a.uv_name, a.transform, a.wraps) != (b.uv_name, b.transform, b.wraps):
            why = "glTF reads both from one image with one mapping; the first one's is used"
            self.report.warn(path, "textures with different mappings", why)


def number_of(value: Value, fallback: float) -> float:
    """A constant number; the fallback if there is none that is finite."""
    try:
        found = float(value.constant)
    except (TypeError, ValueError):
        return fallback
    return found if math.isfinite(found) else fallback


def color_of(value: Value, fallback: tuple, limit: float = 1.0) -> tuple[float, float, float]:
    """A constant colour within [0, limit]; the fallback if there is none that is finite."""
    try:
        r, g, b = (float(c) for c in value.constant)
    except (TypeError, ValueError):
        return fallback
    if not all(map(math.isfinite, (r, g, b))):
        return fallback
    return tuple(min(max(c, 0.0), limit) for c in (r, g, b))


def _rgb(read: TextureRead) -> str:
    """The channels that feed a colour."""
    return "rgb" if read.channel == "rgb" else read.channel * 3


def _stem(read: TextureRead) -> str:
    return read.name.rsplit(".", 1)[0]


def rescaled(read: TextureRead, factor: float, shift: float = 0.0) -> TextureRead:
    """The same read with all its values times `factor` plus `shift`."""
    fields = dict(vars(read))
    fields["scale"] = tuple(s * factor for s in read.scale)
    fields["bias"] = tuple(b * factor + shift for b in read.bias)
    return TextureRead(**fields)
