//! Surfaces: glTF's metallic-roughness model.

use super::TextureUse;
use crate::math::color::Rgb;

/// A metallic-roughness surface that may emit. Factors multiply their textures.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Its name in the file, for messages.
    pub name: String,
    /// Linear reflectance of the diffuse lobe, or of the metal at normal incidence.
    pub base_color: Rgb,
    /// sRGB texture of the above; its alpha multiplies `opacity`.
    pub base_color_texture: Option<TextureUse>,
    /// Coverage in `[0, 1]`.
    pub opacity: f32,
    /// What coverage means.
    pub alpha_mode: AlphaMode,
    /// 0 dielectric, 1 metal.
    pub metallic: f32,
    /// Perceptual roughness; GGX alpha is its square.
    pub roughness: f32,
    /// Linear texture: green is roughness, blue is metallic.
    pub metallic_roughness_texture: Option<TextureUse>,
    /// Index of refraction of the dielectric (`KHR_materials_ior`), 1.5 by default.
    pub ior: f32,
    /// Strength of the dielectric's specular lobe (`KHR_materials_specular`); 0 is Lambertian.
    pub specular: f32,
    /// Linear texture: alpha multiplies `specular`.
    pub specular_texture: Option<TextureUse>,
    /// Tint of the dielectric's reflection at normal incidence.
    pub specular_color: Rgb,
    /// sRGB texture of the tint.
    pub specular_color_texture: Option<TextureUse>,
    /// A clear coat above all of that, if it has one.
    pub coat: Option<Coat>,
    /// What passes through it in place of what it reflects diffusely, if anything does.
    pub transmission: Option<Transmission>,
    /// Tangent-space normals, linear.
    pub normal_texture: Option<TextureUse>,
    /// Scale of the normal map's x and y.
    pub normal_scale: f32,
    /// Emitted luminance, nits: emissive factor times strength.
    pub emission_nits: Rgb,
    /// sRGB (or float) texture that multiplies the emission.
    pub emission_texture: Option<TextureUse>,
    /// Emission leaves from both sides. Reflection always does.
    pub double_sided: bool,
}

/// A layer that reflects like a dielectric of index 1.5 and lets through what it does not reflect
/// (`KHR_materials_clearcoat`). It does not darken the emission below it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coat {
    /// Its strength, above 0 and at most 1.
    pub factor: f32,
    /// Linear texture: red multiplies the factor.
    pub factor_texture: Option<TextureUse>,
    /// Perceptual roughness; GGX alpha is its square.
    pub roughness: f32,
    /// Linear texture: green multiplies the roughness.
    pub roughness_texture: Option<TextureUse>,
    /// Its own tangent-space normals, linear. Without them it has those of the mesh, whatever map is below it.
    pub normal_texture: Option<TextureUse>,
    /// Scale of that map's x and y.
    pub normal_scale: f32,
}

/// Light that passes through the dielectric, tinted by the base colour (`KHR_materials_transmission`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transmission {
    /// The share of the diffuse part that passes instead, above 0 and at most 1.
    pub factor: f32,
    /// Linear texture: red multiplies the factor.
    pub factor_texture: Option<TextureUse>,
    /// What the surface encloses; `None` is a wall without thickness, which bends no light.
    pub volume: Option<Volume>,
}

/// What solid glass is filled with (`KHR_materials_volume`). Its index of refraction is the material's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Volume {
    /// Absorption coefficient, 1/m.
    pub absorption: Rgb,
}

/// What coverage means.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum AlphaMode {
    /// Coverage is ignored.
    #[default]
    Opaque,
    /// A hit counts where coverage is at least this.
    Mask(f32),
    /// A hit counts with the probability of its coverage.
    Blend,
}

impl Default for Material {
    /// glTF's default material, but not metallic: what a mesh without a material looks like.
    fn default() -> Self {
        Material {
            name: "(default)".into(),
            base_color: Rgb::ONE,
            base_color_texture: None,
            opacity: 1.0,
            alpha_mode: AlphaMode::Opaque,
            metallic: 0.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            ior: 1.5,
            specular: 1.0,
            specular_texture: None,
            specular_color: Rgb::ONE,
            specular_color_texture: None,
            coat: None,
            transmission: None,
            normal_texture: None,
            normal_scale: 1.0,
            emission_nits: Rgb::ZERO,
            emission_texture: None,
            double_sided: false,
        }
    }
}

impl Material {
    /// Whether it has a specular lobe. Without one it is Lambertian.
    pub fn is_glossy(&self) -> bool {
        self.specular > 0.0 || self.metallic > 0.0 || self.coat.is_some()
    }

    /// The textures of its reflection, those that are there.
    pub fn textures(&self) -> impl Iterator<Item = TextureUse> {
        let coat = self
            .coat
            .map(|coat| [coat.factor_texture, coat.roughness_texture, coat.normal_texture]);
        let transmission = self.transmission.and_then(|transmission| transmission.factor_texture);
        let uses = [
            self.base_color_texture,
            self.metallic_roughness_texture,
            self.specular_texture,
            self.specular_color_texture,
            self.normal_texture,
            transmission,
        ];
        uses.into_iter().chain(coat.into_iter().flatten()).flatten()
    }

    /// Whether its coat has other normals than what is below it.
    pub fn has_coat_normals(&self) -> bool {
        self.coat.is_some_and(|coat| {
            let is_scaled = coat.normal_texture.is_some() && coat.normal_scale != self.normal_scale;
            coat.normal_texture != self.normal_texture || is_scaled
        })
    }

    /// Whether it, or its coat, has a normal map.
    pub fn has_normal_map(&self) -> bool {
        self.normal_texture.is_some() || self.coat.is_some_and(|coat| coat.normal_texture.is_some())
    }

    /// Whether it is the surface of solid glass.
    pub fn is_solid_glass(&self) -> bool {
        self.transmission.is_some_and(|passes| passes.volume.is_some())
    }

    /// Whether any light can leave this surface of its own.
    pub fn emits(&self) -> bool {
        self.emission_nits.max_element() > 0.0
    }
}
