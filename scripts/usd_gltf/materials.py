"""glTF materials: the black ones of lights, those of UsdPreviewSurface, and the fallback.

Emission is a factor within [0, 1] times `KHR_materials_emissive_strength`, in nits.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from pxr import Sdf, Usd, UsdShade

from .gltf_document import Document, number, numbers
from .report import Notebook

if TYPE_CHECKING:
    from .mesh import Piece


@dataclass
class Emission:
    """Nits, and perhaps a texture that multiplies them."""

    rgb: np.ndarray
    texture: dict | None = None
    varies: bool = False
    """Whether `rgb` is only the first frame's: black, it still needs its texture."""


@dataclass
class Look:
    """A surface in glTF's terms, before it is known what it is put on."""

    path: str = ""
    base_color: tuple[float, float, float, float] = (0.5, 0.5, 0.5, 1.0)
    metallic: float = 0.0
    roughness: float = 1.0
    base_texture: dict | None = None
    metallic_roughness_texture: dict | None = None
    normal_texture: dict | None = None
    occlusion_texture: dict | None = None
    emission: tuple[float, float, float] = (0.0, 0.0, 0.0)
    emission_keys: np.ndarray | None = None
    """(frames, 3) nits, if the glow is animated; `emission` is the first frame's."""
    emission_texture: dict | None = None
    alpha_mode: str = "OPAQUE"
    alpha_cutoff: float = 0.5
    extensions: dict = field(default_factory=dict)
    uv_names: list[str] = field(default_factory=list)
    uses_display_color: bool = True
    color_primvar: str = "displayColor"
    """Which primvar the display colour is."""
    color_scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    color_default: tuple[float, float, float] | None = None
    """Linear colour of meshes without another primvar than displayColor."""
    glow_is_known: bool = False
    """Whether `emission` is what the bound material says (no material says nothing)."""


class Materials:
    """Resolves bindings to looks, and looks to glTF materials."""

    def __init__(
        self, document: Document, read_surface: Callable[[UsdShade.Material], Look], report: Notebook
    ) -> None:
        self.document, self.read_surface, self.report = document, read_surface, report
        self._looks: dict[Sdf.Path, Look] = {}
        self._unbound = Look()

    def bound(self, prim: Usd.Prim) -> Look:
        """The look of the material bound to `prim` (purpose full, else all)."""
        material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial(UsdShade.Tokens.full)
        if not material:
            relationship = UsdShade.MaterialBindingAPI(prim).GetDirectBindingRel()
            if relationship and relationship.GetTargets():
                why = f"{relationship.GetTargets()[0]} is no material; display colour or grey is used"
                self.report.warn(prim.GetPath(), "material binding to nothing", why)
            return self._unbound
        source = material.GetPrim()
        if source.IsInstanceProxy():
            source = source.GetPrimInPrototype()
        key = source.GetPath()
        if key not in self._looks:
            self._looks[key] = self.read_surface(material)
        return self._looks[key]

    def index(self, piece: Piece, emission: Emission | None = None) -> int:
        """The glTF material of a piece of a mesh; `emission` replaces its look's own glow."""
        look = piece.look
        color = look.base_color if piece.tint is None else piece.tint
        mode = "BLEND" if piece.translucent and look.alpha_mode == "OPAQUE" else look.alpha_mode
        surface: dict = {
            "baseColorFactor": numbers(np.clip(color, 0.0, 1.0)),
            "metallicFactor": number(look.metallic),
            "roughnessFactor": number(look.roughness),
        }
        if look.base_texture:
            surface["baseColorTexture"] = look.base_texture
        if look.metallic_roughness_texture:
            surface["metallicRoughnessTexture"] = look.metallic_roughness_texture
        material: dict = {"pbrMetallicRoughness": surface}
        if look.path:
            material["name"] = Sdf.Path(look.path).name
        if look.normal_texture:
            material["normalTexture"] = look.normal_texture
        if look.occlusion_texture:
            material["occlusionTexture"] = look.occlusion_texture
        if mode != "OPAQUE":
            material["alphaMode"] = mode
        if mode == "MASK":
            material["alphaCutoff"] = number(look.alpha_cutoff)
        if look.extensions:
            material["extensions"] = dict(look.extensions)
            for extension in look.extensions:
                self.document.use(extension)
        emission = emission or Emission(np.array(look.emission), look.emission_texture)
        return self._emitting(material, emission, piece.double_sided)

    def light_material(self, emission: Emission, double_sided: bool = False) -> int:
        """A black material that only emits."""
        specular = self.document.use("KHR_materials_specular")
        material = {
            "pbrMetallicRoughness": {
                "baseColorFactor": [0.0, 0.0, 0.0, 1.0],
                "metallicFactor": 0.0,
                "roughnessFactor": 1.0,
            },
            "extensions": {specular: {"specularFactor": 0.0}},
        }
        return self._emitting(material, emission, double_sided)

    def _emitting(self, material: dict, emission: Emission, double_sided: bool) -> int:
        strength = float(np.max(emission.rgb))
        if strength > 0.0:
            scale = max(strength, 1.0)
            material["emissiveFactor"] = numbers(np.minimum(emission.rgb / scale, 1.0))
            if scale > 1.0:
                extension = self.document.use("KHR_materials_emissive_strength")
                material.setdefault("extensions", {})[extension] = {"emissiveStrength": number(scale)}
        if emission.texture is not None and (strength > 0.0 or emission.varies):
            material["emissiveTexture"] = emission.texture
        if double_sided:
            material["doubleSided"] = True
        return self.document.shared("materials", material)
