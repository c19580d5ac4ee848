//! Infinite lights: suns and domes. They have no place, so no box of the tree holds them.
//!
//! A sun stands where its node aims from: along +Z through the node's matrix as it is, as spots and
//! cameras have it.

use super::dome::{Dome, DomeSample};
use crate::math::color::{Rgb, luminance};
use crate::math::directions::aim;
use crate::math::{Frame, warp};
use crate::scene::{LightKind, Pose, Scene, Visibility};
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// An infinite light, in world space.
pub struct InfiniteLight<'a> {
    /// Index into [`Scene::lights`].
    pub light: usize,
    /// Whether it is left out of all estimates and sampled at every point.
    pub forced: bool,
    /// Which rays meet it.
    pub visibility: Visibility,
    kind: Kind<'a>,
}

enum Kind<'a> {
    Sun(Sun),
    Dome(Box<Dome<'a>>),
}

/// A sun of some angular size; of none, a delta direction.
struct Sun {
    /// Unit, towards the sun.
    towards: Vec3,
    irradiance_lux: Rgb,
    half_angle_rad: f32,
    one_minus_cos: f32,
}

/// A direction towards an infinite light.
#[derive(Clone, Copy, Debug)]
pub struct InfiniteSample {
    /// Unit, world space.
    pub direction: Vec3,
    /// Nits; for a delta direction the irradiance of a facing surface, lux.
    pub radiance: Rgb,
    /// Density over solid angle, 1/sr; `None` for a delta direction.
    pub pdf: Option<f32>,
}

/// The infinite lights of a scene that shine in a pose.
pub fn infinite_lights<'a>(scene: &'a Scene, pose: &Pose) -> Vec<InfiniteLight<'a>> {
    let kind = |light: &crate::scene::Light, rgb: Rgb| match light.kind {
        LightKind::Distant { angle_rad, .. } if rgb.max_element() > 0.0 => {
            let half_angle_rad = 0.5 * angle_rad.clamp(0.0, 2.0 * PI);
            let sine = (0.5 * half_angle_rad).sin();
            Some(Kind::Sun(Sun {
                towards: -aim(&pose.world(light.node)).as_vec3(),
                irradiance_lux: rgb,
                half_angle_rad,
                one_minus_cos: 2.0 * sine * sine,
            }))
        }
        LightKind::Dome { texture, .. } if rgb.max_element() > 0.0 => {
            let texture = texture.map(|index| &scene.textures[index as usize]);
            Some(Kind::Dome(Box::new(Dome::new(&pose.world(light.node), rgb, texture))))
        }
        _ => None,
    };
    let lights = scene.lights.iter().enumerate();
    let found = lights.filter_map(|(light, row)| {
        let rgb = scene.rgb_of_light(light as u32, pose);
        let (forced, visibility) = (row.forced, row.visibility);
        Some(InfiniteLight { light, forced, visibility, kind: kind(row, rgb)? })
    });
    found.collect()
}

impl InfiniteLight<'_> {
    /// An estimate of the irradiance on a surface with this normal (zero: in any direction), lux. It is 0
    /// only where no light arrives. It competes with the importance of the tree.
    pub fn importance(&self, normal: Vec3) -> f64 {
        match &self.kind {
            Kind::Sun(sun) => {
                let cosine = if normal == Vec3::ZERO {
                    1.0
                } else {
                    let angle = crate::math::angle::between(normal, sun.towards);
                    (angle - sun.half_angle_rad).max(0.0).cos()
                };
                // 1e-5 covers the rounding of the angle: zero must mean dark.
                if cosine < -1e-5 {
                    return 0.0;
                }
                f64::from(luminance(sun.irradiance_lux)) * f64::from(cosine.max(1e-4))
            }
            Kind::Dome(dome) => f64::from(dome.illuminance_estimate()),
        }
    }

    /// A sun's middle, unit, world space, and its half angle, radians.
    pub fn disk(&self) -> Option<(Vec3, f32)> {
        match &self.kind {
            Kind::Sun(sun) => Some((sun.towards, sun.half_angle_rad)),
            Kind::Dome(_) => None,
        }
    }

    /// A direction towards the light, for a surface with this normal (zero: in any direction).
    pub fn sample(&self, normal: Vec3, u: Vec2) -> Option<InfiniteSample> {
        match &self.kind {
            Kind::Sun(sun) if sun.is_delta() => Some(InfiniteSample {
                direction: sun.towards,
                radiance: sun.irradiance_lux,
                pdf: None,
            }),
            Kind::Sun(sun) => Some(InfiniteSample {
                direction: Frame::around(sun.towards).to_outer(warp::cone(u, sun.one_minus_cos)),
                radiance: sun.radiance_nits(),
                pdf: Some(warp::cone_pdf(sun.one_minus_cos)),
            }),
            Kind::Dome(dome) => {
                let DomeSample { direction, radiance, pdf } = dome.sample(normal, u)?;
                Some(InfiniteSample { direction, radiance, pdf: Some(pdf) })
            }
        }
    }

    /// Radiance that a ray in some direction sees, nits.
    pub fn radiance(&self, direction: Vec3) -> Rgb {
        match &self.kind {
            Kind::Sun(sun) if sun.contains(direction) => sun.radiance_nits(),
            Kind::Sun(_) => Rgb::ZERO,
            Kind::Dome(dome) => dome.radiance(direction),
        }
    }

    /// Density of [`sample`](Self::sample) for a direction, 1/sr.
    pub fn pdf(&self, normal: Vec3, direction: Vec3) -> f32 {
        match &self.kind {
            Kind::Sun(sun) if sun.contains(direction) => warp::cone_pdf(sun.one_minus_cos),
            Kind::Sun(_) => 0.0,
            Kind::Dome(dome) => dome.pdf(normal, direction),
        }
    }
}

impl Sun {
    /// Whether the disk is smaller than the steps between directions of 32-bit numbers: below a half
    /// angle of 1.4e-6 rad. It then has its irradiance, but no ray can be said to hit it.
    fn is_delta(&self) -> bool {
        self.one_minus_cos < 1e-12
    }

    /// `E = L pi sin^2` of the half angle (UsdLux DistantLight; up to a right angle, beyond which
    /// it is `pi (2 - sin^2)`).
    fn radiance_nits(&self) -> Rgb {
        let sine2 = self.half_angle_rad.sin().powi(2);
        let projected = if self.half_angle_rad <= PI / 2.0 { sine2 } else { 2.0 - sine2 };
        self.irradiance_lux / (PI * projected)
    }

    /// Whether a direction points at the disk. Squared chords keep their digits in disks of 1e-4 rad,
    /// where cosines are 1.
    fn contains(&self, direction: Vec3) -> bool {
        !self.is_delta() && (direction - self.towards).length_squared() <= 2.0 * self.one_minus_cos
    }
}
