//! How a surface reflects: Lambert below GGX, glTF's metallic-roughness model, perhaps below a clear coat, perhaps
//! glass.
//!
//! A [`Bsdf`] is one shading point, with textures already looked up into a [`SurfaceSample`]; a
//! [`Reflection`] is that point seen from one direction, `wo`.
//! It reflects on the side of its frame's normal alone, and glass lets light through; it knows nothing of
//! materials, of emission or of the geometric normal (a caller that must not leak light through
//! bent normals compares `wi` with the geometric normal itself).
//!
//! The model, with `w = (1 - cos_h)^5`, `F(F0, F90) = F0 + (F90 - F0) w` (Schlick) and GGX's
//! directional albedo `E = a + b` from [`albedo`]:
//!
//! ```text
//! f   = c f_coat + (1 - c * albedo of f_coat toward wo) f_base
//! f_base  = m f_metal + (1 - m) (f_gloss + diffuse)
//! f_x     = D G2 / (4 cos_o cos_i) * F_x * (1 + F0_x (1 - E) / E)     Turquin 2019, eq. 16
//! diffuse = base / pi * (1 - albedo of f_gloss toward wo)
//! ```
//!
//! Where light passes, with the share `t` of `KHR_materials_transmission`, `(1 - t) diffuse + t f_glass` takes the
//! place of `diffuse`; where the glass is solid, that of `f_gloss + diffuse`.
//!
//! The coat is `KHR_materials_clearcoat`'s: `c` its strength, an index of 1.5, a roughness of its own. Where it is
//! smooth, its albedo is Fresnel's term at `wo`, by which the extension darkens what is below. It may have a normal of
//! its own: its cosines and its half vector are about that one, and it reflects on the side of that one; below the other
//! horizon nothing else does. Where light passes glass it reflects on the side of both alone.
//!
//! So a white metal and a white dielectric, coated or not, reflect exactly what arrives (up to the table's
//! interpolation), and `specular = 0` is exactly `base / pi`. The compensation and what is below another
//! lobe look at `wo` alone: only Lambert and a lossless GGX (`alpha -> 0`) are reciprocal.

pub mod albedo;
mod coat;
pub mod ggx;
mod glass;
mod parts;
#[cfg(test)]
mod tests;

use crate::light_tree::Lobes;
use crate::math::color::{Rgb, luminance};
use crate::math::{Frame, built_in, warp};
use albedo::Albedo;
use coat::{COAT_F0, Coat, reflected};
use glam::{Vec2, Vec3};
use glass::Glass;
pub use glass::Passage;
use std::f32::consts::FRAC_1_PI;

/// The smallest GGX alpha, reached at roughness 0.032: smoother surfaces reflect like this one, so
/// that a mirror stays a finite lobe that next-event estimation can hit.
pub const ALPHA_MIN: f32 = 1e-3;

/// A material at one point, textures looked up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceSample {
    /// Linear reflectance of the diffuse lobe, or of the metal at normal incidence.
    pub base_color: Rgb,
    /// 0 dielectric, 1 metal.
    pub metallic: f32,
    /// Perceptual roughness; GGX alpha is its square.
    pub roughness: f32,
    /// The dielectric's reflectance at normal incidence:
    /// `min(((ior - 1) / (ior + 1))^2 * specular_color, 1) * specular`.
    pub dielectric_f0: Rgb,
    /// The dielectric's reflectance at grazing incidence (`KHR_materials_specular`: its
    /// `specular`). With this and `dielectric_f0` at 0 the surface is Lambertian.
    pub dielectric_f90: f32,
    /// Strength of the coat; 0 is none.
    pub coat: f32,
    /// Perceptual roughness of the coat.
    pub coat_roughness: f32,
    /// The share of the diffuse lobe's light that passes instead.
    pub transmission: f32,
    /// How.
    pub passage: Passage,
}

impl SurfaceSample {
    /// The share of light that passes straight in a direction with this cosine to the normal: what neither the coat
    /// nor the specular lobe reflects, times the base colour. With [`Reflection::albedo`] it adds up to 1 where
    /// everything is white. `coat_cosine` is that to the coat's normal.
    pub fn tint(&self, cosine: f32, coat_cosine: f32) -> Rgb {
        let bsdf = Bsdf::new(self, Frame::around(Vec3::Z));
        let whole = bsdf.passing;
        if whole == Rgb::ZERO || !bsdf.is_glossy() {
            return whole;
        }
        let (gloss, _) = bsdf.gloss(Albedo::of_ggx(cosine, bsdf.alpha));
        let below = match bsdf.coat > 0.0 {
            true => 1.0 - Coat::toward(coat_cosine, bsdf.coat, bsdf.coat_alpha).0,
            false => 1.0,
        };
        whole * (Rgb::ONE - gloss) * below
    }
}

/// A reflecting point. Directions are unit, world space, and point away from the surface.
#[derive(Clone, Copy, Debug)]
pub struct Bsdf {
    frame: Frame,
    diffuse: Rgb,
    /// What would pass if nothing were reflected.
    passing: Rgb,
    metal_f0: Rgb,
    dielectric_f0: Rgb,
    dielectric_f90: f32,
    metallic: f32,
    alpha: f32,
    coat: f32,
    coat_alpha: f32,
    /// In the shading frame; +Z if it is the same.
    coat_normal: Vec3,
    passage: Passage,
    /// The share of the surface that is solid glass.
    solid: f32,
}

/// A direction drawn by [`Reflection::sample`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfSample {
    /// Where the light comes from, world space.
    pub wi: Vec3,
    /// `f |cos| / pdf`.
    pub weight: Rgb,
    /// Density over solid angle, 1/sr; what [`Reflection::eval`] gives for the same direction.
    pub pdf: f32,
}

/// A reflecting point seen from one side: what is the same for every `wi` once `wo` is known.
#[derive(Clone, Copy, Debug)]
pub struct Reflection {
    frame: Frame,
    /// In the shading frame.
    wo: Vec3,
    /// The specular lobe's colour is `at_normal + toward_grazing * (1 - cos_h)^5`.
    at_normal: Rgb,
    toward_grazing: Rgb,
    /// `base / pi`, less what the specular lobe has already reflected.
    diffuse: Rgb,
    alpha: f32,
    /// Probability of choosing the specular lobe; `None` if nothing is reflected: `wo` is below the
    /// horizon, or the surface is black.
    specular_probability: Option<f32>,
    coat: Coat,
    glass: Glass,
}

impl Bsdf {
    /// The reflection of `sample` about the shading frame. Values outside their range are clamped
    /// into it; what is not finite counts as 0.
    pub fn new(sample: &SurfaceSample, frame: Frame) -> Bsdf {
        let unit = |x: f32| if x.is_finite() { x.clamp(0.0, 1.0) } else { 0.0 };
        let unit_rgb = |c: Rgb| Rgb::new(unit(c.x), unit(c.y), unit(c.z));
        let (metallic, roughness) = (unit(sample.metallic), unit(sample.roughness));
        let base = unit_rgb(sample.base_color);
        let transmission = unit(sample.transmission);
        let is_solid = matches!(sample.passage, Passage::Solid(_));
        Bsdf {
            frame,
            diffuse: base * ((1.0 - metallic) * FRAC_1_PI) * (1.0 - transmission),
            passing: base * ((1.0 - metallic) * transmission),
            metal_f0: base,
            dielectric_f0: unit_rgb(sample.dielectric_f0),
            dielectric_f90: unit(sample.dielectric_f90),
            metallic,
            alpha: (roughness * roughness).max(ALPHA_MIN),
            coat: if built_in::GLOSSY { unit(sample.coat) } else { 0.0 },
            coat_alpha: unit(sample.coat_roughness).powi(2).max(ALPHA_MIN),
            coat_normal: Vec3::Z,
            passage: sample.passage,
            solid: if is_solid { (1.0 - metallic) * transmission } else { 0.0 },
        }
    }

    /// The same with a coat that has a normal of its own, if one is given: unit, world space.
    pub fn coated_about(self, normal: Option<Vec3>) -> Bsdf {
        let Some(normal) = normal else { return self };
        let local = self.frame.to_local(normal).normalize_or(Vec3::Z);
        // To the last bits it is the same.
        let is_same = local.truncate().length_squared() < f32::EPSILON * f32::EPSILON;
        Bsdf { coat_normal: if is_same && local.z > 0.0 { Vec3::Z } else { local }, ..self }
    }

    /// Whether it has a specular lobe. Without one it is Lambertian.
    fn is_glossy(&self) -> bool {
        let is_dielectric = self.dielectric_f90 > 0.0 || self.dielectric_f0 != Rgb::ZERO;
        let has_lobe = self.passage != Passage::Straight && self.passing != Rgb::ZERO;
        let is_glass = built_in::TRANSMISSION && (has_lobe || self.solid > 0.0);
        built_in::GLOSSY && (is_dielectric || self.metallic > 0.0 || self.coat > 0.0 || is_glass)
    }

    /// The albedo of the dielectric's specular lobe, of the table's parts, and the gain that is in it.
    fn gloss(&self, part: Albedo) -> (Rgb, Rgb) {
        let lost = (1.0 - part.a - part.b).max(0.0) / (part.a + part.b);
        let gain = Rgb::ONE + self.dielectric_f0 * lost;
        let f90 = Rgb::splat(self.dielectric_f90);
        (((self.dielectric_f0 * part.a + f90 * part.b) * gain).min(Rgb::ONE), gain)
    }

    /// The lobe beyond the surface, its probability still open. `below` is what the coat lets through.
    fn glass_toward(&self, cos_o: f32, (part, gloss): (Albedo, Rgb), below: f32) -> Glass {
        let (passage, alpha, color) = (self.passage, self.alpha, self.passing * below);
        let (mirrors, f0, f90) = (self.solid * below, self.dielectric_f0, self.dielectric_f90);
        let glass = Glass { passage, alpha, color, mirrors, f0, f90, ..Glass::default() };
        match passage {
            Passage::Straight => Glass::default(),
            Passage::Thin => {
                let whole = color * (Rgb::ONE - gloss);
                Glass { color: whole / (part.a + part.b), whole, ..glass }
            }
            Passage::Solid(eta) => {
                let (fresnel, _) = glass.fresnel(eta, cos_o);
                Glass { whole: mirrors * fresnel + color * (Rgb::ONE - fresnel), ..glass }
            }
        }
    }

    /// Towards `wo`.
    pub fn toward(&self, wo: Vec3) -> Reflection {
        let wo = self.frame.to_local(wo);
        let mut reflection = Reflection {
            frame: self.frame,
            wo,
            at_normal: Rgb::ZERO,
            toward_grazing: Rgb::ZERO,
            diffuse: Rgb::ZERO,
            alpha: self.alpha,
            specular_probability: None,
            coat: Coat::NONE,
            glass: Glass::default(),
        };
        if wo.z <= 0.0 {
            return reflection;
        }
        if !self.is_glossy() {
            // Without a look at the albedos: their table takes a process 100 million instructions.
            reflection.diffuse = self.diffuse;
            reflection.specular_probability = (self.diffuse != Rgb::ZERO).then_some(0.0);
            return reflection;
        }
        let whole = 1.0 - self.metallic - self.solid;
        let part = Albedo::of_ggx(wo.z, self.alpha);
        let lost = (1.0 - part.a - part.b).max(0.0) / (part.a + part.b);
        let (f0, f90) = (self.dielectric_f0, Rgb::splat(self.dielectric_f90));
        let (gloss, gloss_gain) = self.gloss(part);
        let metal_gain = Rgb::ONE + self.metal_f0 * lost;
        let metal = (self.metal_f0 * part.a + part.b) * metal_gain;
        reflection.diffuse = self.diffuse * (Rgb::ONE - gloss);
        reflection.at_normal = f0 * gloss_gain * whole + self.metal_f0 * metal_gain * self.metallic;
        reflection.toward_grazing = (f90 - f0) * gloss_gain * whole
            + (Rgb::ONE - self.metal_f0) * metal_gain * self.metallic;
        let mut specular = (gloss * whole + metal * self.metallic).element_sum();
        let mut coat_part = 0.0;
        let coat_cosine = if self.coat_normal == Vec3::Z { wo.z } else { wo.dot(self.coat_normal) };
        if self.coat > 0.0 && coat_cosine > 0.0 {
            let (reflected, coat) = Coat::toward(coat_cosine, self.coat, self.coat_alpha);
            let below = 1.0 - reflected;
            reflection.coat = Coat { normal: self.coat_normal, ..coat };
            reflection.diffuse *= below;
            reflection.at_normal *= below;
            reflection.toward_grazing *= below;
            specular *= below;
            coat_part = 3.0 * reflected;
        }
        let mut all = coat_part + specular + reflection.diffuse.element_sum() / FRAC_1_PI;
        if built_in::TRANSMISSION && self.passage != Passage::Straight {
            let below = 1.0 - coat_part / 3.0;
            reflection.glass = self.glass_toward(wo.z, (part, gloss), below);
            all += reflection.glass.whole.element_sum();
        }
        reflection.coat.probability = if all > 0.0 { coat_part / all } else { 0.0 };
        reflection.specular_probability = (all > 0.0).then(|| specular / all);
        let glass_part = reflection.glass.whole.element_sum();
        reflection.glass.probability = if glass_part > 0.0 { glass_part / all } else { 0.0 };
        reflection
    }
}

impl Reflection {
    /// `f |cos wi|` and the density, 1/sr, with which [`sample`](Self::sample) draws `wi`. Both are 0
    /// if it is below the horizon.
    #[inline]
    pub fn eval(&self, wi: Vec3) -> (Rgb, f32) {
        self.eval_local(self.frame.to_local(wi))
    }

    /// Draws a direction. `None` if nothing is reflected, or the reflection went below the horizon:
    /// the path then ends without a contribution.
    #[inline]
    pub fn sample(&self, u_lobe: f32, u: Vec2) -> Option<BsdfSample> {
        let specular = self.specular_probability?;
        let coat = self.coat.probability;
        let wi = if built_in::GLOSSY && u_lobe < specular {
            reflected(self.wo, ggx::sample_normal(self.wo, self.alpha, u))?
        } else if built_in::GLOSSY && u_lobe < specular + coat {
            let wi = self.coat.sample(self.wo, u)?;
            // Beyond glass is what passes alone.
            (wi.z > 0.0 || !self.transmits()).then_some(wi)?
        } else if built_in::TRANSMISSION && u_lobe < specular + coat + self.glass.probability {
            let u_side = (u_lobe - specular - coat) / self.glass.probability;
            self.glass.sample(self.wo, u_side, u)
        } else {
            warp::cosine_hemisphere(u)
        };
        let (value, pdf) = self.eval_local(wi);
        if pdf > 0.0 && pdf.is_finite() {
            Some(BsdfSample { wi: self.frame.to_outer(wi), weight: value / pdf, pdf })
        } else {
            None
        }
    }

    /// Its lobes, as picking lights asks for them, and the normal of the glossy one, unit, world space; `None` if nothing
    /// is reflected. Of a coat and what is below,
    /// the one that is brighter at its peak is the glossy lobe, and the other counts as diffuse: a bright peak is
    /// what must not be missed.
    pub fn lobes(&self) -> Option<(Lobes, Vec3)> {
        self.specular_probability?;
        let base = Lobes {
            diffuse: luminance(self.diffuse) / FRAC_1_PI,
            at_normal: luminance(self.at_normal),
            toward_grazing: luminance(self.toward_grazing),
            alpha: self.alpha,
        };
        if self.coat.strength == 0.0 {
            return Some((base, self.frame.normal));
        }
        let coat = Lobes {
            diffuse: base.diffuse,
            at_normal: self.coat.strength * COAT_F0,
            toward_grazing: self.coat.strength * (1.0 - COAT_F0),
            alpha: self.coat.alpha,
        };
        let peak = |lobes: &Lobes| lobes.at_normal / (lobes.alpha * lobes.alpha);
        let is_coat = peak(&coat) > peak(&base);
        let (glossy, other) = if is_coat { (coat, base) } else { (base, coat) };
        let cosine = if is_coat { self.wo.z } else { self.coat_cosine() };
        let part = Albedo::of_ggx(cosine, other.alpha);
        let beside = other.at_normal * (part.a + part.b) + other.toward_grazing * part.b;
        let about = match is_coat && self.coat.is_bent() {
            true => self.frame.to_outer(self.coat.normal),
            false => self.frame.normal,
        };
        Some((Lobes { diffuse: glossy.diffuse + beside, ..glossy }, about))
    }

    /// Reflectance of the specular lobes and of the diffuse one; their sum is the share of a white
    /// environment that the surface reflects.
    pub fn albedo(&self) -> (Rgb, Rgb) {
        if self.specular_probability.is_none() {
            return (Rgb::ZERO, Rgb::ZERO);
        }
        let mut specular = Rgb::ZERO;
        if built_in::GLOSSY && (self.at_normal, self.toward_grazing) != (Rgb::ZERO, Rgb::ZERO) {
            let part = Albedo::of_ggx(self.wo.z, self.alpha);
            specular = self.at_normal * (part.a + part.b) + self.toward_grazing * part.b;
        }
        if self.coat.strength > 0.0 {
            specular += self.coat.albedo(Albedo::of_ggx(self.coat_cosine(), self.coat.alpha));
        }
        (specular, self.diffuse / FRAC_1_PI)
    }

    fn coat_cosine(&self) -> f32 {
        if self.coat.is_bent() { self.wo.dot(self.coat.normal) } else { self.wo.z }
    }

    /// Whether light from below the horizon of [`normal`](Self::normal) may be reflected: by a coat that has a normal of
    /// its own.
    #[inline]
    pub fn has_two_horizons(&self) -> bool {
        built_in::GLOSSY && self.coat.is_bent()
    }

    /// Both together, and what passes glass.
    pub fn whole_albedo(&self) -> Rgb {
        let (specular, diffuse) = self.albedo();
        specular + diffuse + self.glass.whole
    }

    /// Unit shading normal on the side of `wo`, world space.
    pub fn normal(&self) -> Vec3 {
        self.frame.normal
    }

    /// Whether light from beyond the surface may leave towards `wo`.
    #[inline]
    pub fn transmits(&self) -> bool {
        built_in::TRANSMISSION && self.glass.probability > 0.0
    }

    /// How many times as high radiance is beyond the surface as here: `eta^2`.
    pub fn concentration(&self) -> f32 {
        match self.glass.passage {
            Passage::Solid(eta) => eta * eta,
            _ => 1.0,
        }
    }

    /// Whether a direction is on the side of the shading normal, not beyond the surface.
    pub fn is_above(&self, wi: Vec3) -> bool {
        self.frame.normal.dot(wi) > 0.0
    }

    #[inline]
    fn eval_local(&self, wi: Vec3) -> (Rgb, f32) {
        let (cos_o, cos_i) = (self.wo.z, wi.z);
        let Some(specular_probability) = self.specular_probability else {
            return (Rgb::ZERO, 0.0);
        };
        let glass = match self.transmits() {
            true => self.glass.eval(self.wo, wi),
            false => (Rgb::ZERO, 0.0),
        };
        if cos_i <= 0.0 {
            if self.has_two_horizons() && !self.transmits() {
                let (value, pdf) = self.coat.eval_bent(self.wo, wi);
                return (Rgb::splat(value), pdf);
            }
            return (glass.0, glass.1 * self.glass.probability);
        }
        let mut value = self.diffuse * cos_i;
        let glossy_probability = specular_probability + self.coat.probability;
        let diffuse_probability = 1.0 - glossy_probability - self.glass.probability;
        let mut pdf = diffuse_probability * warp::cosine_hemisphere_pdf(cos_i);
        if built_in::GLOSSY && glossy_probability > 0.0 {
            let h = (self.wo + wi).normalize_or(Vec3::Z);
            let schlick = (1.0 - self.wo.dot(h)).clamp(0.0, 1.0).powi(5);
            let shape =
                |alpha| ggx::distribution(h, alpha) * ggx::visibility_cos(cos_o, cos_i, alpha);
            value += (self.at_normal + self.toward_grazing * schlick) * shape(self.alpha);
            pdf += specular_probability * ggx::reflection_pdf(cos_o, h, self.alpha);
            let Coat { strength, alpha, probability, .. } = self.coat;
            if self.has_two_horizons() {
                let (coat, density) = self.coat.eval_bent(self.wo, wi);
                value += coat;
                pdf += density;
            } else if strength > 0.0 {
                value += strength * (COAT_F0 + (1.0 - COAT_F0) * schlick) * shape(alpha);
                pdf += probability * ggx::reflection_pdf(cos_o, h, alpha);
            }
        }
        (value + glass.0, pdf + glass.1 * self.glass.probability)
    }
}
