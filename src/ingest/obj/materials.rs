//! MTL materials: the classic parameters, and `Ke`, `map_Ke`, `Pr` and `Pm` of its PBR extension.
//!
//! What stands in for a texture that cannot be read is neutral: a middle grey for the base colour, and no
//! light at all for emission, which would be far too bright without its texture.

use super::library::Row;
use super::map::Map;
use crate::ingest::budget::Budget;
use crate::ingest::error::Fault;
use crate::ingest::image::{self, Coding, MISSING_REFLECTANCE};
use crate::ingest::notes::Notes;
use crate::ingest::uri::Folder;
use crate::math::color::Rgb;
use crate::scene::{AlphaMode, Category, Material, Scene, Texture, TextureUse, Wrap};
use glam::Mat3;
use std::collections::HashMap;

/// CIE XYZ to linear Rec. 709 (ITU-R BT.709, white D65), by columns.
const REC_709_OF_XYZ: Mat3 = Mat3::from_cols_array(&[
    3.2404542, -0.969_266, 0.0556434, -1.5371385, 1.8760108, -0.2040259, -0.4985314, 0.041556,
    1.0572252,
]);

/// A file, how its values are coded and how it is continued.
type Key = (String, Coding, Wrap);

/// Compiles materials, and the textures that they use.
pub(super) struct Materials<'a> {
    pub folder: &'a Folder,
    pub budget: Budget,
    /// Textures that were asked for; `None` for those that cannot be read.
    pub textures: HashMap<Key, Option<u32>>,
}

/// A texture as a material uses it, and what it is multiplied by.
struct Used {
    usage: Option<TextureUse>,
    gain: f32,
}

impl Materials<'_> {
    pub(super) fn compile(&mut self, row: &Row, scene: &mut Scene, notes: &mut Notes) -> Material {
        let object = format!("material {:?}", row.name);
        let mut color = |keyword: &str, category| {
            let value = color(row.get(keyword)?);
            if value.is_none() {
                let text = format!("its {keyword} is no colour that can be read; left out");
                notes.add(category, &*object, text);
            }
            value
        };
        let diffuse = color("Kd", Category::Materials);
        let gloss = color("Ks", Category::Materials).unwrap_or(Rgb::ZERO).max_element().min(1.0);
        let emitted = color("Ke", Category::Lights);
        let number = |keyword: &str| {
            // `d -halo 0.5` too.
            let last = row.get(keyword)?.split_whitespace().last()?;
            last.parse::<f32>().ok().filter(|number| number.is_finite())
        };
        let unit = |value: f32| value.clamp(0.0, 1.0);
        let opacity = number("d").or(number("Tr").map(|clear| 1.0 - clear)).map_or(1.0, unit);
        let mut material = Material {
            name: row.name.clone(),
            base_color: diffuse.unwrap_or(Rgb::ONE).min(Rgb::ONE),
            opacity,
            alpha_mode: if opacity < 1.0 { AlphaMode::Blend } else { AlphaMode::Opaque },
            metallic: unit(number("Pm").unwrap_or(0.0)),
            roughness: unit(number("Pr").unwrap_or_else(|| roughness(number("Ns")))),
            ior: number("Ni").filter(|&ior| ior > 1.0).unwrap_or(1.5),
            specular: gloss,
            emission_nits: emitted.unwrap_or(Rgb::ZERO),
            ..Material::default()
        };
        if let Some(map) = row.get("map_Kd") {
            // A black factor beside a picture is how exporters say that the picture is all.
            if material.base_color == Rgb::ZERO {
                material.base_color = Rgb::ONE;
            }
            match self.texture(map, Category::Materials, &object, scene, notes) {
                Ok(Used { usage, gain }) => {
                    material.base_color = (material.base_color * gain).min(Rgb::ONE);
                    material.base_color_texture = usage;
                }
                Err(problem) => {
                    material.base_color *= MISSING_REFLECTANCE;
                    let text = format!("{problem}; its base colour is grey instead");
                    notes.add(Category::Materials, &*object, text);
                }
            }
        }
        if let Some(map) = row.get("map_Ke") {
            if material.emission_nits == Rgb::ZERO {
                material.emission_nits = Rgb::ONE;
            }
            match self.texture(map, Category::Lights, &object, scene, notes) {
                Ok(Used { usage, gain }) => {
                    material.emission_nits *= gain;
                    material.emission_texture = usage;
                }
                Err(problem) => {
                    material.emission_nits = Rgb::ZERO;
                    let text = format!("{problem}; its light is left out");
                    notes.add(Category::Lights, &*object, text);
                }
            }
            if !material.emission_nits.is_finite() {
                material.emission_nits = Rgb::ZERO;
                let text = "its light is too strong for a 32-bit number; left out";
                notes.add(Category::Lights, &*object, text);
            }
        }
        let is_map = |keyword: &&str| {
            let names = ["bump", "norm", "refl", "disp", "decal"];
            keyword.starts_with("map_") || names.contains(keyword)
        };
        for keyword in row.keywords().into_iter().filter(is_map) {
            if !["map_kd", "map_ke"].contains(&keyword) {
                notes.add(Category::Materials, &*object, format!("its {keyword} is not read"));
            }
        }
        material
    }

    /// The texture of a `map_` statement; else why there is none.
    fn texture(
        &mut self,
        statement: &str,
        category: Category,
        object: &str,
        scene: &mut Scene,
        notes: &mut Notes,
    ) -> Result<Used, String> {
        let map = Map::parse(statement).ok_or("a texture map names no file")?;
        if map.has_more {
            let text =
                "options of its texture maps other than -s, -o, -clamp and -mm 0 are not read";
            notes.add(category, object, text);
        }
        let key = (map.file.to_string(), Coding::Srgb, map.wrap);
        let texture = match self.textures.get(&key) {
            Some(known) => known.ok_or(format!("texture {:?}: cannot be read", map.file))?,
            None => {
                let read = self.read(&map, scene);
                self.textures.insert(key, read.as_ref().ok().copied());
                read.map_err(Fault::told)?
            }
        };
        let usage = TextureUse { texture, uv_set: 0, transform: map.transform };
        Ok(Used { usage: Some(usage), gain: map.gain })
    }

    fn read(&mut self, map: &Map, scene: &mut Scene) -> Result<u32, Fault> {
        let object = format!("texture {:?}", map.file);
        let bytes = self.folder.read(&self.folder.resolve(map.file, &object)?, &object)?;
        let picture = image::decode_surface(&bytes, Coding::Srgb, &object, &mut self.budget)?;
        scene.textures.push(Texture {
            name: map.file.to_string(),
            width: picture.width,
            height: picture.height,
            pixels: picture.pixels,
            wrap: [map.wrap; 2],
            bilinear: true,
        });
        Ok(scene.textures.len() as u32 - 1)
    }
}

/// `r g b`, one number for all three, or `xyz x y z`; nothing negative, and nothing infinite.
fn color(text: &str) -> Option<Rgb> {
    let (is_xyz, text) = match text.strip_prefix("xyz") {
        Some(rest) => (true, rest),
        None => (false, text),
    };
    let numbers: Option<Vec<f32>> = text.split_whitespace().map(|word| word.parse().ok()).collect();
    let value = match numbers?[..] {
        [grey] => Rgb::splat(grey),
        [r, g, b] => Rgb::new(r, g, b),
        _ => return None,
    };
    // Colours outside the gamut have parts below zero.
    let value = if is_xyz { (REC_709_OF_XYZ * value).max(Rgb::ZERO) } else { value };
    (value.is_finite() && value.min_element() >= 0.0).then_some(value)
}

/// The roughness whose GGX lobe is as wide as Blinn and Phong's of that exponent:
/// `alpha^2 = 2 / (n + 2)` (Walter et al. 2007), and roughness is the root of alpha.
fn roughness(shininess: Option<f32>) -> f32 {
    match shininess {
        Some(exponent) if exponent >= 0.0 => (2.0 / (exponent + 2.0)).powf(0.25),
        _ => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_come_in_three_ways() {
        assert_eq!(color("4"), Some(Rgb::splat(4.0)));
        assert_eq!(color("1 .5 0"), Some(Rgb::new(1.0, 0.5, 0.0)));
        let white = color("xyz 0.95047 1 1.08883").unwrap();
        assert!((white - Rgb::ONE).abs().max_element() < 1e-4, "{white}");
        for bad in ["", "1 2", "-1", "inf 0 0", "1e39", "spectral a.rfl 1", "1 2 3 4", "a b c"] {
            assert_eq!(color(bad), None, "{bad}");
        }
    }
}
