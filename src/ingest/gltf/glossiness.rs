//! `KHR_materials_pbrSpecularGlossiness` as a dielectric of the same reflection.
//!
//! The extension's own terms are a colour `F0` that is reflected straight on, the diffuse colour times
//! `1 - max(F0)`, and a glossiness. A dielectric whose specular lobe is tinted says all three; so what Khronos published
//! as a conversion to metallic-roughness ("convert-between-workflows", beside the extension) is followed in what it says of
//! the diffuse part and of roughness, and its guess of what is metal is not needed: a metal is a dielectric that
//! reflects its colour and has no diffuse part.
//!
//! | there | here |
//! |---|---|
//! | diffuse | base colour, times `(1 - max(F0)) / (1 - 0.04)` |
//! | specular | tint of the specular lobe, over 0.04 |
//! | glossiness | roughness, `1 - glossiness` |

use super::textures::Textures;
use super::{Output, Source};
use crate::ingest::error::Fault;
use crate::ingest::image::{Coding, MISSING_REFLECTANCE};
use crate::math::color::{Rgb, linear_to_srgb};
use crate::scene::{Category, Material, Pixels, Texture, TextureUse};
use glam::{Vec2, Vec4};
use gltf::json::extensions::material::PbrSpecularGlossiness;
use std::collections::HashMap;

/// What a dielectric of index 1.5 reflects straight on.
const F0: f32 = 0.04;

/// What the diffuse colour is multiplied by under a reflection.
fn diffuse_part(reflected: Rgb) -> f32 {
    ((1.0 - reflected.max_element()) / (1.0 - F0)).max(0.0)
}

/// Puts the factors of the extension, which are within [0, 1], into a material.
pub(super) fn put_factors(
    material: &mut Material,
    diffuse: [f32; 4],
    specular: [f32; 3],
    glossiness: f32,
) {
    let [red, green, blue, opacity] = diffuse;
    material.base_color = Rgb::new(red, green, blue);
    material.opacity = opacity;
    material.metallic = 0.0;
    material.ior = 1.5;
    material.roughness = 1.0 - glossiness;
    material.specular_color = Rgb::from(specular) / F0;
}

/// Textures that were computed of others, by what they were computed of.
#[derive(Default)]
pub(super) struct Computed {
    rough: HashMap<(u32, u32), u32>,
    darkened: HashMap<(Option<u32>, u32, [u32; 3]), u32>,
}

impl Computed {
    /// Puts the textures of the extension beside the factors, and darkens the diffuse part by what is reflected.
    pub(super) fn put_textures(
        &mut self,
        textures: &mut Textures,
        source: &Source,
        output: &mut Output,
        glossy: &PbrSpecularGlossiness,
        object: &str,
        material: &mut Material,
    ) {
        let note = |output: &mut Output, text: String| {
            output.notes.add(Category::Materials, object, text);
        };
        if let Some(info) = &glossy.diffuse_texture {
            match textures.texture_use(source, output, info, Coding::Srgb) {
                Ok(texture) => material.base_color_texture = Some(texture),
                Err(problem) => {
                    note(output, format!("{problem}; its base colour is grey instead"));
                    material.base_color *= MISSING_REFLECTANCE;
                }
            }
        }
        let specular = material.specular_color * F0;
        let used = glossy.specular_glossiness_texture.as_ref().map(|info| {
            let color = textures.texture_use(source, output, info, Coding::Srgb)?;
            let numbers = textures.texture_use(source, output, info, Coding::Linear)?;
            let rough = self.rough(output, numbers.texture, 1.0 - material.roughness)?;
            Ok::<_, String>((color, TextureUse { texture: rough, ..numbers }))
        });
        let (color, rough) = match used {
            Some(Ok(used)) => used,
            other => {
                if let Some(Err(problem)) = other {
                    note(output, format!("{problem}; it reflects as its factors say"));
                }
                material.base_color *= diffuse_part(specular);
                material.base_color = material.base_color.min(Rgb::ONE);
                return;
            }
        };
        material.roughness = 1.0;
        material.specular_color_texture = Some(color);
        material.metallic_roughness_texture = Some(rough);
        let base = material.base_color_texture;
        if base.is_some_and(|base| (base.uv_set, base.transform) != (color.uv_set, color.transform))
        {
            let text = "its diffuse and its specular texture are read with different coordinates; the diffuse colour \
                        is not darkened by what is reflected";
            return note(output, text.into());
        }
        match self.darkened(output, base.map(|base| base.texture), color.texture, specular) {
            Ok(texture) => {
                material.base_color_texture = Some(TextureUse { texture, ..base.unwrap_or(color) });
            }
            Err(problem) => note(output, format!("{problem}; the diffuse colour is not darkened")),
        }
    }

    /// The number of a texture of roughness.
    fn rough(&mut self, output: &mut Output, gloss: u32, factor: f32) -> Result<u32, String> {
        let key = (gloss, factor.to_bits());
        if let Some(&known) = self.rough.get(&key) {
            return Ok(known);
        }
        let of = &output.scene.textures[gloss as usize];
        output.picture_budget.take(texels(of) * 4, || of.name.clone()).map_err(Fault::told)?;
        let made = push(output, roughness(of, factor));
        self.rough.insert(key, made);
        Ok(made)
    }

    /// The number of a texture of the diffuse part.
    fn darkened(
        &mut self,
        output: &mut Output,
        diffuse: Option<u32>,
        specular: u32,
        factor: Rgb,
    ) -> Result<u32, String> {
        let key = (diffuse, specular, factor.to_array().map(f32::to_bits));
        if let Some(&known) = self.darkened.get(&key) {
            return Ok(known);
        }
        let textures = &output.scene.textures;
        let below = diffuse.map(|diffuse| &textures[diffuse as usize]);
        let above = &textures[specular as usize];
        let bytes = 4 * texels(above).max(below.map_or(0, texels));
        output.picture_budget.take(bytes, || above.name.clone()).map_err(Fault::told)?;
        let made = push(output, darkened(below, above, factor));
        self.darkened.insert(key, made);
        Ok(made)
    }
}

fn texels(texture: &Texture) -> u64 {
    u64::from(texture.width) * u64::from(texture.height)
}

fn push(output: &mut Output, texture: Texture) -> u32 {
    output.scene.textures.push(texture);
    output.scene.textures.len() as u32 - 1
}

/// Roughness in green, of glossiness in alpha.
fn roughness(gloss: &Texture, factor: f32) -> Texture {
    let texel = |glossiness: u8| {
        let rough = 255.0 - factor * f32::from(glossiness);
        [255, rough.round() as u8, 0, 255]
    };
    let pixels = match &gloss.pixels {
        Pixels::Srgb8(texels) | Pixels::Linear8(texels) => {
            texels.iter().map(|&[_, _, _, alpha]| texel(alpha)).collect()
        }
        Pixels::Float(texels) => texels.iter().map(|_| texel(u8::MAX)).collect(),
    };
    let name = format!("{}: roughness", gloss.name);
    Texture { name, pixels: Pixels::Linear8(pixels), ..gloss.clone() }
}

/// The diffuse colour, or white, with what is left of it under a reflection, in the larger of both sizes.
fn darkened(diffuse: Option<&Texture>, specular: &Texture, factor: Rgb) -> Texture {
    let like = diffuse.filter(|diffuse| texels(diffuse) >= texels(specular)).unwrap_or(specular);
    let size = Vec2::new(like.width as f32, like.height as f32);
    let at = |x: u32, y: u32| (Vec2::new(x as f32, y as f32) + 0.5) / size;
    let places = (0..like.height).flat_map(|y| (0..like.width).map(move |x| (x, y)));
    let code = |linear: f32| (linear_to_srgb(linear.clamp(0.0, 1.0)) * 255.0).round() as u8;
    let texel = |(x, y): (u32, u32)| {
        let reflected = specular.lookup(at(x, y)).truncate() * factor;
        let below = diffuse.map_or(Vec4::ONE, |diffuse| diffuse.lookup(at(x, y)));
        let [red, green, blue] = (below.truncate() * diffuse_part(reflected)).to_array().map(code);
        [red, green, blue, (below.w.clamp(0.0, 1.0) * 255.0).round() as u8]
    };
    let pixels = Pixels::Srgb8(places.map(texel).collect());
    let named = diffuse.unwrap_or(specular);
    Texture { name: format!("{}: diffuse part", named.name), pixels, ..like.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Wrap;

    fn plain(width: u32, height: u32, texel: [u8; 4]) -> Texture {
        let pixels = Pixels::Srgb8(vec![texel; (width * height) as usize]);
        Texture { name: "t".into(), width, height, pixels, wrap: [Wrap::Clamp; 2], bilinear: true }
    }

    #[test]
    fn factors_are_a_dielectrics() {
        let mut material = Material { metallic: 1.0, ior: 2.0, ..Material::default() };
        put_factors(&mut material, [0.2, 0.4, 0.6, 0.5], [1.0, 0.5, F0], 0.75);
        assert_eq!(material.base_color, Rgb::new(0.2, 0.4, 0.6));
        assert!((material.specular_color * F0).abs_diff_eq(Rgb::new(1.0, 0.5, F0), 1e-6));
        assert_eq!((material.opacity, material.roughness), (0.5, 0.25));
        assert_eq!((material.metallic, material.ior), (0.0, 1.5));
        assert_eq!((diffuse_part(Rgb::splat(F0)), diffuse_part(Rgb::X)), (1.0, 0.0));
    }

    #[test]
    fn nothing_is_reflected_twice() {
        // Diffuse part and reflection never exceed what falls in, whatever the factors.
        for step in 0..=20 {
            let reflected = Rgb::new(step as f32 / 20.0, 0.01, 0.3);
            let part = diffuse_part(reflected);
            assert!(part >= 0.0 && part * (1.0 - F0) + reflected.max_element() <= 1.0 + 1e-6);
        }
    }

    #[test]
    fn texels_are_darkened_and_rough_each_by_its_own() {
        let gloss = plain(4, 2, [255, 128, 0, 51]);
        let rough = roughness(&gloss, 0.5);
        assert!(
            matches!(&rough.pixels, Pixels::Linear8(texels) if texels[7] == [255, 230, 0, 255])
        );
        let black = darkened(Some(&plain(2, 2, [200, 100, 50, 77])), &gloss, Rgb::ONE);
        assert_eq!((black.width, black.height), (4, 2));
        assert!(
            matches!(&black.pixels, Pixels::Srgb8(texels) if texels.iter().all(|t| *t == [0, 0, 0, 77]))
        );
        let kept = darkened(Some(&plain(8, 8, [200, 100, 50, 77])), &gloss, Rgb::splat(F0));
        assert_eq!((kept.width, kept.height), (8, 8));
        assert!(matches!(&kept.pixels, Pixels::Srgb8(texels) if texels[9] == [200, 100, 50, 77]));
    }
}
