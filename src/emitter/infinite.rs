//! Infinite lights: suns and domes. They have no place, so no box of the tree holds them.
//!
//! A sun stands where its node aims from: along +Z through the node's matrix as it is, as spots and
//! cameras have it.

use super::dome::{Dome, DomeSample};
use super::picture::PictureDistribution;
use crate::math::color::{Rgb, luminance};
use crate::math::directions::aim;
use crate::math::{Frame, warp};
use crate::scene::{LightKind, Pose, Scene, Texture, Visibility};
use glam::{Affine3A, Vec2, Vec3};
use std::collections::BTreeMap;
use std::f32::consts::PI;
use std::sync::{Arc, Mutex, PoisonError};

/// An infinite light, in world space.
pub struct InfiniteLight<'a> {
    /// Index into [`Scene::lights`].
    pub light: usize,
    /// Whether it is left out of all estimates and sampled at every point.
    pub forced: bool,
    /// Which rays meet it.
    pub visibility: Visibility,
    /// How many times it counts where lights are picked.
    effect: f64,
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
    Skies::default().lights(scene, pose)
}

/// The infinite lights of a scene, pose after pose. What a dome's picture is sampled by is worked out again
/// only if the dome has moved.
#[derive(Default)]
pub struct Skies {
    /// Of each dome with a picture: where it stood, and the distribution of its picture there.
    known: Mutex<BTreeMap<usize, (Affine3A, Arc<PictureDistribution>)>>,
}

impl Skies {
    /// Those that shine in a pose. The scene must always be the same.
    pub fn lights<'a>(&self, scene: &'a Scene, pose: &Pose) -> Vec<InfiniteLight<'a>> {
        let lights = scene.lights.iter().enumerate();
        let found = lights.filter_map(|(light, row)| {
            let rgb = scene.rgb_of_light(light as u32, pose);
            let kind = self.kind(scene, pose, light, rgb)?;
            let (forced, visibility) = (row.forced, row.visibility);
            let effect = scene.effect_of_light(light as u32).into();
            Some(InfiniteLight { light, forced, visibility, effect, kind })
        });
        found.collect()
    }

    fn kind<'a>(&self, scene: &'a Scene, pose: &Pose, row: usize, rgb: Rgb) -> Option<Kind<'a>> {
        let light = &scene.lights[row];
        match light.kind {
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
                let place = pose.world(light.node);
                let picture = texture.map(|index| {
                    let texture = &scene.textures[index as usize];
                    (texture, self.distribution(row, place, texture))
                });
                Some(Kind::Dome(Box::new(Dome::new(&place, rgb, picture))))
            }
            _ => None,
        }
    }

    fn distribution(
        &self,
        row: usize,
        place: Affine3A,
        texture: &Texture,
    ) -> Arc<PictureDistribution> {
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        match known.get(&row) {
            Some((then, distribution)) if *then == place => distribution.clone(),
            _ => {
                let distribution = Arc::new(Dome::distribution(&place, texture));
                known.insert(row, (place, distribution.clone()));
                distribution
            }
        }
    }
}

impl InfiniteLight<'_> {
    /// An estimate of the irradiance on a surface with this normal (zero: in any direction), lux. It is 0
    /// only where no light arrives. It competes with the importance of the tree.
    pub fn importance(&self, normal: Vec3) -> f64 {
        self.effect * self.illuminance(normal)
    }

    fn illuminance(&self, normal: Vec3) -> f64 {
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

    /// Whether a reflected ray may hit the light.
    pub fn meets_reflections(&self) -> bool {
        let is_point = matches!(&self.kind, Kind::Sun(sun) if sun.is_delta());
        self.visibility.reflections && !is_point
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Channel, Interpolation, Keys, Light, Node, Pixels, Trs, Wrap};
    use glam::Quat;

    /// A sky that turns, in the first two seconds alone, under a picture with one bright corner.
    fn turning_sky() -> Scene {
        let turned = [0.0, 1.0, 2.0, 2.0].map(Quat::from_rotation_y).to_vec();
        let keys = Keys {
            times_s: vec![0.0, 1.0, 2.0, 3.0],
            values: turned,
            interpolation: Interpolation::Linear,
        };
        let mut node = Node::fixed("/sky", None, Trs::default());
        node.channels = vec![Channel::Rotation(keys)];
        let mut texels = vec![[0.1; 3]; 16 * 8];
        texels[3 * 16 + 2] = [50.0; 3];
        Scene {
            nodes: vec![node],
            textures: vec![Texture {
                width: 16,
                height: 8,
                name: "sky".into(),
                pixels: Pixels::Float(texels),
                wrap: [Wrap::Repeat, Wrap::Clamp],
                bilinear: true,
            }],
            lights: vec![Light {
                node: 0,
                kind: LightKind::Dome { radiance_nits: Rgb::ONE, texture: Some(0) },
                values: None,
                range_m: None,
                forced: false,
                visibility: Visibility::default(),
            }],
            ..Default::default()
        }
    }

    /// What was kept from other poses, there and back, is what a pose alone gives.
    #[test]
    fn a_sky_that_turned_is_the_sky_as_it_stands() {
        let scene = turning_sky();
        let skies = Skies::default();
        for time_s in [0.0, 1.0, 1.0, 2.0, 3.0, 0.0] {
            let pose = scene.pose_at(time_s);
            let (kept, alone) = (skies.lights(&scene, &pose), infinite_lights(&scene, &pose));
            for i in 0..64 {
                let u = Vec2::new((i % 8) as f32 + 0.5, (i / 8) as f32 + 0.5) / 8.0;
                let [kept, alone] = [&kept, &alone].map(|lights| lights[0].sample(Vec3::ZERO, u));
                let parts = |sample: Option<InfiniteSample>| {
                    sample.map(|s| (s.direction, s.radiance, s.pdf))
                };
                assert_eq!(parts(kept), parts(alone), "{time_s} {u}");
            }
        }
    }
}
