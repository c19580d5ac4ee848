//! Materials, compiled when the first mesh uses them.

use super::document::label;
use super::textures::Textures;
use super::{Output, Source};
use crate::ingest::error::Fault;
use crate::ingest::image::Coding;
use crate::math::color::Rgb;
use crate::scene::{AlphaMode, Material, TextureUse};
use gltf::json::extensions::material::PbrSpecularGlossiness;
use gltf::json::material::AlphaMode as RowAlphaMode;
use gltf::json::texture::Info;
use gltf::json::validation::Checked;
use gltf::json::{Index, Material as Row};

/// Reflectance at normal incidence of the default dielectric: index of refraction 1.5.
const DEFAULT_REFLECTANCE: f32 = 0.04;

/// The materials that were compiled, by their number in the file.
pub(super) struct Materials {
    compiled: Vec<Option<u32>>,
    textures: Textures,
}

impl Materials {
    pub(super) fn new(source: &Source) -> Materials {
        let compiled = vec![None; source.document.materials.len()];
        Materials { compiled, textures: Textures::default() }
    }

    /// The scene's number of a material of the file.
    pub(super) fn index(
        &mut self,
        source: &Source,
        output: &mut Output,
        number: Index<Row>,
    ) -> Result<u32, Fault> {
        if let Some(known) = self.compiled[number.value()] {
            return Ok(known);
        }
        let row = &source.document.materials[number.value()];
        let object = label("material", number.value(), row.name.as_deref());
        let material = self.compile(source, output, number.value(), object)?;
        output.scene.materials.push(material);
        let index = output.scene.materials.len() as u32 - 1;
        self.compiled[number.value()] = Some(index);
        Ok(index)
    }

    fn compile(
        &mut self,
        source: &Source,
        output: &mut Output,
        number: usize,
        object: String,
    ) -> Result<Material, Fault> {
        let row = &source.document.materials[number];
        let mut texture = |info: &Option<Info>, coding| -> Result<_, Fault> {
            match info {
                Some(info) => self.textures.texture_use(source, output, info, coding),
                None => Ok(None),
            }
        };
        let pbr = &row.pbr_metallic_roughness;
        let none = Default::default();
        let extensions = row.extensions.as_ref().unwrap_or(&none);
        let [red, green, blue, opacity] = pbr.base_color_factor.0;
        let strength = extensions.emissive_strength.as_ref();
        let strength = strength.map_or(1.0, |strength| strength.emissive_strength.0);
        let emission = Rgb::from(row.emissive_factor.0) * strength;
        if !emission.is_finite() {
            return Err(Fault::new(object, "its emission is too strong for a 32-bit number"));
        }
        let mut material = Material {
            name: row.name.clone().unwrap_or_else(|| object.clone()),
            base_color: Rgb::new(red, green, blue),
            base_color_texture: None,
            opacity,
            alpha_mode: match row.alpha_mode {
                Checked::Valid(RowAlphaMode::Mask) => {
                    AlphaMode::Mask(row.alpha_cutoff.unwrap_or_default().0)
                }
                Checked::Valid(RowAlphaMode::Blend) => AlphaMode::Blend,
                _ => AlphaMode::Opaque,
            },
            metallic: pbr.metallic_factor.0,
            roughness: pbr.roughness_factor.0,
            emission_nits: emission,
            double_sided: row.double_sided,
            normal_texture: texture(&source.document.beside.normal_maps[number], Coding::Linear)?,
            normal_scale: row.normal_texture.as_ref().map_or(1.0, |map| map.scale),
            ..Material::default()
        };
        // A texture that nothing of is left of is not decoded.
        if emission.max_element() > 0.0 {
            material.emission_texture = texture(&row.emissive_texture, Coding::Srgb)?;
        }
        if let Some(ior) = &extensions.ior {
            material.ior = ior.ior.0;
        }
        if let Some(specular) = &extensions.specular {
            material.specular = specular.specular_factor.0;
            material.specular_color = Rgb::from(specular.specular_color_factor.0);
            if material.specular > 0.0 {
                material.specular_texture = texture(&specular.specular_texture, Coding::Linear)?;
                material.specular_color_texture =
                    texture(&specular.specular_color_texture, Coding::Srgb)?;
            }
        }
        if let Some(glossy) = &extensions.pbr_specular_glossiness {
            material.base_color_texture = texture(&glossy.diffuse_texture, Coding::Srgb)?;
            approximate_glossiness(&mut material, glossy);
            output.notes.add(
                object.clone(),
                "KHR_materials_pbrSpecularGlossiness is approximated; its specular texture is not read",
            );
        } else {
            material.base_color_texture = texture(&pbr.base_color_texture, Coding::Srgb)?;
            material.metallic_roughness_texture =
                texture(&pbr.metallic_roughness_texture, Coding::Linear)?;
        }
        for extension in extensions.others.keys() {
            let text = match extension.as_str() {
                "KHR_materials_unlit" => "is unlit; drawn as a surface that light falls on".into(),
                extension => format!("{extension} is not read"),
            };
            output.notes.add(object.clone(), text);
        }
        Ok(material)
    }
}

/// A dielectric of the same diffuse colour, roughness and reflectance.
fn approximate_glossiness(material: &mut Material, glossy: &PbrSpecularGlossiness) {
    let [red, green, blue, opacity] = glossy.diffuse_factor.0;
    material.base_color = Rgb::new(red, green, blue);
    material.opacity = opacity;
    material.metallic = 0.0;
    material.roughness = 1.0 - glossy.glossiness_factor.0;
    material.specular_color = Rgb::from(glossy.specular_factor.0) / DEFAULT_REFLECTANCE;
}

/// The texture sets that a material's textures are looked up by.
pub(super) fn uv_sets(material: &Material) -> impl Iterator<Item = u32> {
    let uses: [Option<TextureUse>; 6] = [
        material.base_color_texture,
        material.metallic_roughness_texture,
        material.specular_texture,
        material.specular_color_texture,
        material.normal_texture,
        material.emission_texture,
    ];
    uses.into_iter().flatten().map(|usage| usage.uv_set)
}
