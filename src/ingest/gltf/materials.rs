//! Materials, compiled when the first mesh uses them.
//!
//! Parameters out of their range are brought into it. What stands in for a texture that cannot be read is
//! neutral: a middle grey for the base colour, no metal, the surface's own normals, and no light at all for
//! emission, which would be far too bright without its texture.

use super::document::label;
use super::textures::Textures;
use super::{Output, Source, coat, glass, glossiness};
use crate::ingest::image::{Coding, MISSING_REFLECTANCE};
use crate::math::color::Rgb;
use crate::scene::{AlphaMode, Category, Keys, Material};
use gltf::json::material::AlphaMode as RowAlphaMode;
use gltf::json::texture::Info;
use gltf::json::validation::Checked;
use gltf::json::{Index, Material as Row};
use std::cell::Cell;
use std::collections::BTreeMap;

/// The materials that were compiled, by their number in the file.
pub(super) struct Materials {
    compiled: Vec<Option<u32>>,
    textures: Textures,
    glossy: glossiness::Computed,
    /// Emission over time, by number in the file; of those that were compiled, what can be read.
    glows: BTreeMap<usize, Keys<Rgb>>,
}

impl Materials {
    pub(super) fn new(source: &Source, glows: BTreeMap<usize, Keys<Rgb>>) -> Materials {
        let compiled = vec![None; source.document.materials.len()];
        Materials {
            compiled,
            textures: Textures::default(),
            glossy: glossiness::Computed::default(),
            glows,
        }
    }

    /// The emission over time of a material of the file, if it is animated.
    pub(super) fn glow(&self, number: Index<Row>) -> Option<&Keys<Rgb>> {
        self.glows.get(&number.value())
    }

    /// Whether a material of the file may emit, as far as can be told without its texture.
    pub(super) fn may_emit(&self, row: &Row, number: Index<Row>) -> bool {
        row.emissive_factor.0 != [0.0; 3] || self.glow(number).is_some()
    }

    /// The scene's number of a material of the file; `None` if it is not there, which is noted.
    pub(super) fn index(
        &mut self,
        source: &Source,
        output: &mut Output,
        number: Index<Row>,
        object: &str,
    ) -> Option<u32> {
        let Some(row) = source.document.get(number) else {
            // Whether it would emit is not known.
            let text = "its material is not in the file; it has the default, and does not emit";
            output.notes.add(Category::Lights, object, text);
            return None;
        };
        if let Some(known) = self.compiled[number.value()] {
            return Some(known);
        }
        let object = label("material", number.value(), row.name.as_deref());
        let material = self.compile(source, output, number.value(), object);
        output.scene.materials.push(material);
        let index = output.scene.materials.len() as u32 - 1;
        self.compiled[number.value()] = Some(index);
        Some(index)
    }

    fn compile(
        &mut self,
        source: &Source,
        output: &mut Output,
        number: usize,
        object: String,
    ) -> Material {
        let row = &source.document.materials[number];
        let pbr = &row.pbr_metallic_roughness;
        let none = Default::default();
        let extensions = row.extensions.as_ref().unwrap_or(&none);
        let mended = Cell::new(false);
        let within = |value: f32, least: f32, most: f32, spare: f32| {
            let inside = if value.is_finite() { value.clamp(least, most) } else { spare };
            mended.set(mended.get() || inside != value);
            inside
        };
        let base = pbr.base_color_factor.0.map(|part| within(part, 0.0, 1.0, 1.0));
        let mut material = Material {
            name: row.name.clone().unwrap_or_else(|| object.clone()),
            base_color: Rgb::new(base[0], base[1], base[2]),
            opacity: base[3],
            alpha_mode: match row.alpha_mode {
                Checked::Valid(RowAlphaMode::Mask) => {
                    let cutoff = row.alpha_cutoff.unwrap_or_default().0;
                    AlphaMode::Mask(within(cutoff, 0.0, f32::MAX, 0.5))
                }
                Checked::Valid(RowAlphaMode::Blend) => AlphaMode::Blend,
                _ => AlphaMode::Opaque,
            },
            metallic: within(pbr.metallic_factor.0, 0.0, 1.0, 1.0),
            roughness: within(pbr.roughness_factor.0, 0.0, 1.0, 1.0),
            double_sided: row.double_sided,
            ..Material::default()
        };
        if let Some(map) = &row.normal_texture {
            material.normal_scale = within(map.scale, f32::MIN, f32::MAX, 1.0);
        }
        if let Some(ior) = extensions.ior.as_ref().map(|ior| ior.ior.0) {
            // Zero asks for an infinitely strong reflection, by the extension's own words.
            material.ior = if ior == 0.0 { 0.0 } else { within(ior, 1.0, f32::MAX, material.ior) };
        }
        if let Some(specular) = &extensions.specular {
            material.specular = within(specular.specular_factor.0, 0.0, 1.0, 1.0);
            let color = specular.specular_color_factor.0;
            material.specular_color = color.map(|part| within(part, 0.0, f32::MAX, 1.0)).into();
        }
        if let Some(glossy) = &extensions.pbr_specular_glossiness {
            let diffuse = glossy.diffuse_factor.0.map(|part| within(part, 0.0, 1.0, 1.0));
            let specular = glossy.specular_factor.0.map(|part| within(part, 0.0, 1.0, 1.0));
            let gloss = within(glossy.glossiness_factor.0, 0.0, 1.0, 1.0);
            glossiness::put_factors(&mut material, diffuse, specular, gloss);
        }
        if mended.get() {
            let text = "has parameters out of their range; brought into it";
            output.notes.add(Category::Materials, &*object, text);
        }
        if row.alpha_mode == Checked::Invalid {
            let text = "its alpha mode is unknown; opaque";
            output.notes.add(Category::Materials, &*object, text);
        }
        self.emit(source, output, number, &object, &mut material);
        self.add_textures(source, output, number, &object, &mut material);
        if let Some(extension) = extensions.others.get(coat::NAME) {
            material.coat = coat::compile(&mut self.textures, source, output, extension, &object);
            let shines = material.emits() || self.glows.contains_key(&number);
            if material.coat.is_some() && shines {
                let text = "its coat does not darken its light";
                output.notes.add(Category::Lights, &*object, text);
            }
        }
        let others = &extensions.others;
        material.transmission = glass::compile(&mut self.textures, source, output, others, &object);
        let is_read = |name: &str| name == coat::NAME || glass::NAMES.contains(&name);
        for extension in extensions.others.keys().filter(|name| !is_read(name)) {
            let text = match extension.as_str() {
                "KHR_materials_unlit" => "is unlit; drawn as a surface that light falls on".into(),
                extension => format!("{extension} is not read"),
            };
            output.notes.add(Category::Materials, &*object, text);
        }
        material
    }

    /// Adds the emission, which is left out where it cannot be read.
    fn emit(
        &mut self,
        source: &Source,
        output: &mut Output,
        number: usize,
        object: &str,
        material: &mut Material,
    ) {
        let row = &source.document.materials[number];
        let (factor, strength) = emission(row);
        let emission = factor.max(Rgb::ZERO) * strength;
        let mut note = |text: String| output.notes.add(Category::Lights, object, text);
        if !emission.is_finite() || !factor.is_finite() || strength < 0.0 {
            note("its light is negative, or too strong for a 32-bit number; left out".into());
            self.glows.remove(&number);
            return;
        }
        if factor.min_element() < 0.0 {
            note("its emissive colour is negative in part; that part is left out".into());
        }
        // Without any emission its texture is not decoded.
        let glow = self.glows.get(&number).into_iter().flat_map(|glow| &glow.values);
        let shines = glow.chain([&emission]).any(|value| value.max_element() > 0.0);
        let texture = row.emissive_texture.as_ref().filter(|_| shines);
        let texture =
            texture.map(|info| self.textures.texture_use(source, output, info, Coding::Srgb));
        match texture.transpose() {
            Ok(texture) => {
                material.emission_nits = emission;
                material.emission_texture = texture;
            }
            Err(problem) => {
                let text = format!("{problem}; its light is left out");
                output.notes.add(Category::Lights, object, text);
                self.glows.remove(&number);
            }
        }
    }

    /// Adds the textures of reflection. A texture that cannot be read is replaced by a neutral value.
    fn add_textures(
        &mut self,
        source: &Source,
        output: &mut Output,
        number: usize,
        object: &str,
        material: &mut Material,
    ) {
        let row = &source.document.materials[number];
        let pbr = &row.pbr_metallic_roughness;
        let none = Default::default();
        let extensions = row.extensions.as_ref().unwrap_or(&none);
        // The texture, and whether it is asked for but cannot be read.
        let mut texture = |info: Option<&Info>, coding, instead: &str| match info {
            None => (None, false),
            Some(info) => match self.textures.texture_use(source, output, info, coding) {
                Ok(texture) => (Some(texture), false),
                Err(problem) => {
                    let text = format!("{problem}; {instead}");
                    output.notes.add(Category::Materials, object, text);
                    (None, true)
                }
            },
        };
        let map = source.document.beside.normal_maps[number].as_ref();
        (material.normal_texture, _) =
            texture(map, Coding::Linear, "its surfaces are drawn without a normal map");
        if let Some(glossy) = &extensions.pbr_specular_glossiness {
            return self.glossy.put_textures(
                &mut self.textures,
                source,
                output,
                glossy,
                object,
                material,
            );
        }
        let info = pbr.base_color_texture.as_ref();
        let (base, is_missing) = texture(info, Coding::Srgb, "its base colour is grey instead");
        material.base_color_texture = base;
        if is_missing {
            material.base_color *= MISSING_REFLECTANCE;
        }
        let info = pbr.metallic_roughness_texture.as_ref();
        let instead = "it is no metal, and as rough as its factor says";
        let (rough, is_missing) = texture(info, Coding::Linear, instead);
        material.metallic_roughness_texture = rough;
        if is_missing {
            material.metallic = 0.0;
        }
        if let Some(specular) = extensions.specular.as_ref().filter(|_| material.specular > 0.0) {
            let instead = "it reflects as its factor says";
            let (strength, color) = (&specular.specular_texture, &specular.specular_color_texture);
            (material.specular_texture, _) = texture(strength.as_ref(), Coding::Linear, instead);
            (material.specular_color_texture, _) = texture(color.as_ref(), Coding::Srgb, instead);
        }
    }
}

/// The factor and the strength of a material's emission.
pub(super) fn emission(row: &Row) -> (Rgb, f32) {
    let strength = row.extensions.as_ref().and_then(|e| e.emissive_strength.as_ref());
    let strength = strength.map_or(1.0, |strength| strength.emissive_strength.0);
    (row.emissive_factor.0.into(), strength)
}

/// The texture sets that a material's textures are looked up by.
pub(super) fn uv_sets(material: &Material) -> impl Iterator<Item = u32> {
    material.textures().chain(material.emission_texture).map(|usage| usage.uv_set)
}
