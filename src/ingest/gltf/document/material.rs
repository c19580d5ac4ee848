//! Materials, textures and images, as the file says them.

use super::Unread;
use super::real::{Real, default_ior, half, one, opaque_white, white};
use serde::Deserialize;

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::ingest::gltf) struct Material {
    pub name: Option<String>,
    #[serde(default)]
    pub pbr_metallic_roughness: MetallicRoughness,
    pub normal_texture: Option<TextureInfo>,
    pub occlusion_texture: Option<TextureInfo>,
    pub emissive_texture: Option<TextureInfo>,
    #[serde(default)]
    pub emissive_factor: [Real; 3],
    #[serde(default)]
    pub alpha_mode: AlphaMode,
    #[serde(default = "half")]
    pub alpha_cutoff: Real,
    #[serde(default)]
    pub double_sided: bool,
    #[serde(default)]
    pub extensions: MaterialExtensions,
}

#[derive(Clone, Copy, Default, Deserialize)]
pub(in crate::ingest::gltf) enum AlphaMode {
    #[default]
    #[serde(rename = "OPAQUE")]
    Opaque,
    #[serde(rename = "MASK")]
    Mask,
    #[serde(rename = "BLEND")]
    Blend,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(in crate::ingest::gltf) struct MetallicRoughness {
    pub base_color_factor: [Real; 4],
    pub base_color_texture: Option<TextureInfo>,
    pub metallic_factor: Real,
    pub roughness_factor: Real,
    pub metallic_roughness_texture: Option<TextureInfo>,
}

impl Default for MetallicRoughness {
    fn default() -> Self {
        MetallicRoughness {
            base_color_factor: opaque_white(),
            base_color_texture: None,
            metallic_factor: one(),
            roughness_factor: one(),
            metallic_roughness_texture: None,
        }
    }
}

#[derive(Default, Deserialize)]
pub(in crate::ingest::gltf) struct MaterialExtensions {
    #[serde(rename = "KHR_materials_emissive_strength")]
    pub emissive_strength: Option<EmissiveStrength>,
    #[serde(rename = "KHR_materials_ior")]
    pub ior: Option<Ior>,
    #[serde(rename = "KHR_materials_specular")]
    pub specular: Option<Specular>,
    #[serde(rename = "KHR_materials_pbrSpecularGlossiness")]
    pub specular_glossiness: Option<SpecularGlossiness>,
    #[serde(flatten)]
    pub others: Unread,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::ingest::gltf) struct EmissiveStrength {
    #[serde(default = "one")]
    pub emissive_strength: Real,
}

#[derive(Deserialize)]
pub(in crate::ingest::gltf) struct Ior {
    #[serde(default = "default_ior")]
    pub ior: Real,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::ingest::gltf) struct Specular {
    #[serde(default = "one")]
    pub specular_factor: Real,
    pub specular_texture: Option<TextureInfo>,
    #[serde(default = "white")]
    pub specular_color_factor: [Real; 3],
    pub specular_color_texture: Option<TextureInfo>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::ingest::gltf) struct SpecularGlossiness {
    #[serde(default = "opaque_white")]
    pub diffuse_factor: [Real; 4],
    pub diffuse_texture: Option<TextureInfo>,
    #[serde(default = "white")]
    pub specular_factor: [Real; 3],
    #[serde(default = "one")]
    pub glossiness_factor: Real,
    pub specular_glossiness_texture: Option<TextureInfo>,
}

/// A use of a texture; `scale` is the normal map's.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::ingest::gltf) struct TextureInfo {
    pub index: u32,
    #[serde(default)]
    pub tex_coord: u32,
    #[serde(default = "one")]
    pub scale: Real,
    #[serde(default)]
    pub extensions: TextureInfoExtensions,
}

#[derive(Default, Deserialize)]
pub(in crate::ingest::gltf) struct TextureInfoExtensions {
    #[serde(rename = "KHR_texture_transform")]
    pub transform: Option<TextureTransform>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::ingest::gltf) struct TextureTransform {
    #[serde(default)]
    pub offset: [Real; 2],
    #[serde(default)]
    pub rotation: Real,
    #[serde(default = "unscaled")]
    pub scale: [Real; 2],
    pub tex_coord: Option<u32>,
}

#[derive(Deserialize)]
pub(in crate::ingest::gltf) struct Texture {
    pub name: Option<String>,
    pub sampler: Option<u32>,
    pub source: Option<u32>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::ingest::gltf) struct Image {
    pub name: Option<String>,
    pub uri: Option<String>,
    pub buffer_view: Option<u32>,
    pub mime_type: Option<String>,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::ingest::gltf) struct Sampler {
    pub mag_filter: Option<u32>,
    pub wrap_s: Option<u32>,
    pub wrap_t: Option<u32>,
}

fn unscaled() -> [Real; 2] {
    [one(); 2]
}

impl Material {
    /// Every use of a texture, read or not.
    pub(in crate::ingest::gltf) fn texture_uses(&self) -> impl Iterator<Item = &TextureInfo> {
        let pbr = &self.pbr_metallic_roughness;
        let specular = self.extensions.specular.as_ref();
        let glossy = self.extensions.specular_glossiness.as_ref();
        [
            &self.normal_texture,
            &self.occlusion_texture,
            &self.emissive_texture,
            &pbr.base_color_texture,
            &pbr.metallic_roughness_texture,
        ]
        .into_iter()
        .chain(specular.into_iter().flat_map(|s| [&s.specular_texture, &s.specular_color_texture]))
        .chain(
            glossy.into_iter().flat_map(|g| [&g.diffuse_texture, &g.specular_glossiness_texture]),
        )
        .flatten()
    }
}
