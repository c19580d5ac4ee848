//! The bounds of emitters. The tree is built over them.
//!
//! Energy is the luminance of the peak radiant intensity: `I` of a point, `L A` of a triangle,
//! `L pi r^2` of a sphere. With a photometric profile it is the mean over directions that counts and not the peak, which
//! may be anywhere. Of a light with multipliers it is what the larger of them leaves. It is never quite zero: an emitter
//! that a transform or the shape of its mesh has flattened, or that is dark in this frame, keeps its place in the tree.

use super::mesh_light::MeshLight;
use super::posed::PosedEmitters;
use super::set::{EmitterPlace, EmitterRef, LightSource};
use crate::bounds::{Aabb, Cone, LightBounds};
use crate::math::Similarity;
use crate::math::color::{Rgb, luminance};
use crate::math::directions::{aim, light_axes, mirrors};
use crate::scene::{IesProfile, LightKind, LitCone, Shaping};
use glam::{Affine3A, DVec3, Vec3};
use rayon::prelude::*;
use std::f32::consts::PI;
use std::f64::consts::FRAC_PI_2;
use std::ops::Range;

/// A light whose numbers are too large for `f32`.
#[derive(Clone, Debug, thiserror::Error, PartialEq, Eq)]
#[error(
    "{path}: its position or its intensity times its area is beyond the range of numbers (3e38); scale it down"
)]
pub struct LightOverflow {
    /// Prim path of the light.
    pub path: String,
}

impl PosedEmitters<'_> {
    /// The bounds of some emitters in world space, in their order.
    ///
    /// # Errors
    /// The path of a light whose place or energy is beyond `f32`.
    pub fn bounds(&self, emitters: Range<u32>) -> Result<Vec<LightBounds>, LightOverflow> {
        let bounds_of = |emitter: u32| {
            let EmitterRef { light, own } = self.emitters.get(emitter);
            let light = &self.emitters.lights()[light as usize];
            let bounds = match light.source {
                LightSource::Mesh { instance: row, mesh_light } => {
                    let mesh_light = &self.emitters.mesh_lights()[mesh_light as usize];
                    let instance = &self.scene.instances[row as usize];
                    let effect = self.scene.effect_of_instance(row);
                    let nits = self.scene.rgb_of_instance(row, self.pose) * effect;
                    self.triangle_bounds(mesh_light, own, &self.pose.world(instance.node), nits)
                }
                LightSource::Light(row) => self.bounds_of_light(row),
            };
            sound(bounds).ok_or_else(|| LightOverflow { path: light.path.to_string() })
        };
        emitters.into_par_iter().map(bounds_of).collect()
    }

    /// The bounds of all emitters of a mesh light, in the space of its mesh and at its peak.
    ///
    /// # Errors
    /// The path of one of its instances, if anything is beyond `f32`.
    pub fn bounds_in_own_space(&self, mesh_light: u32) -> Result<Vec<LightBounds>, LightOverflow> {
        let light = &self.emitters.mesh_lights()[mesh_light as usize];
        let bounds_of = |own: u32| {
            sound(self.triangle_bounds(light, own, &Affine3A::IDENTITY, light.peak_nits))
        };
        let bounds: Option<Vec<_>> = (0..light.count).into_par_iter().map(bounds_of).collect();
        bounds.ok_or_else(|| {
            let is_instance = |entry: &&super::LightEntry| {
                matches!(entry.source, LightSource::Mesh { mesh_light: row, .. } if row == mesh_light)
            };
            let path = self.emitters.lights().iter().find(is_instance);
            LightOverflow { path: path.map_or_else(String::new, |entry| entry.path.to_string()) }
        })
    }

    /// Where a mesh light with a tree of its own stands: the map from world space to the space of its
    /// mesh, and its energy over the energy that the tree holds. `None` if its transform does not keep
    /// shapes.
    pub fn placing(&self, light: u32) -> Option<(Similarity, f32)> {
        let entry = &self.emitters.lights()[light as usize];
        let LightSource::Mesh { instance: row, mesh_light } = entry.source else { return None };
        let world = self.pose.world(self.scene.instances[row as usize].node);
        let to_local = Similarity::undoing(&world)?;
        let peak = luminance(self.emitters.mesh_lights()[mesh_light as usize].peak_nits);
        let nits = self.scene.rgb_of_instance(row, self.pose) * self.scene.effect_of_instance(row);
        let brightness = luminance(nits) / peak;
        Some((to_local, brightness / to_local.scale().powi(2)))
    }

    fn triangle_bounds(
        &self,
        mesh_light: &MeshLight,
        own: u32,
        world: &Affine3A,
        nits: Rgb,
    ) -> LightBounds {
        let triangle = self.triangle_through(world, mesh_light.mesh, mesh_light.triangle(own));
        let handedness = if mirrors(world) { -1.0 } else { 1.0 };
        let double_sided = self.scene.material_of(mesh_light.mesh).is_some_and(|m| m.double_sided);
        let cone = match mesh_light.shaping {
            Some(shaping) if shaping.lit(self.scene).half_angle_rad < FRAC_PI_2 => {
                self.lit_cone(&shaping, world)
            }
            _ => {
                let normal = triangle.area_normal().normalize_or(DVec3::Z) * handedness;
                Cone::flat(normal.as_vec3(), double_sided)
            }
        };
        let energy = luminance(nits * mesh_light.texture_mean(own))
            * triangle.area()
            * self.mean(mesh_light.shaping);
        LightBounds::of_emitter(Aabb::around(triangle.corners), cone, energy, f32::INFINITY)
    }

    fn bounds_of_light(&self, row: u32) -> LightBounds {
        let light = &self.scene.lights[row as usize];
        let rgb = self.scene.rgb_of_light(row, self.pose) * self.scene.effect_of_light(row);
        let strength = luminance(rgb);
        let here = Vec3::from(self.pose.world(light.node).translation);
        let world = self.pose.world(light.node);
        let aimed = |shaping: &Shaping| self.lit_cone(shaping, &world);
        let (radius, cone, energy) = match &light.kind {
            LightKind::Point { .. } => (0.0, Cone::ALL, strength),
            LightKind::Spot { shaping, .. } => {
                (0.0, aimed(shaping), strength * self.mean(Some(*shaping)))
            }
            LightKind::Sphere { shaping, .. } => {
                let radius = self.sphere(light).radius;
                let cone = shaping.as_ref().map_or(Cone::ALL, aimed);
                let strength = strength * self.mean(*shaping);
                (radius, cone, strength * PI * radius * radius)
            }
            LightKind::Distant { .. } | LightKind::Dome { .. } => {
                unreachable!("lights at infinity are no emitters")
            }
        };
        let aabb = Aabb { min: here - radius, max: here + radius };
        LightBounds::of_emitter(aabb, cone, energy, light.range_m.unwrap_or(f32::INFINITY))
    }

    /// A cone around the directions in which shaped light leaves.
    fn lit_cone(&self, shaping: &Shaping, world: &Affine3A) -> Cone {
        let LitCone { axis, half_angle_rad } = shaping.lit(self.scene);
        let axis = if axis == DVec3::NEG_Z { aim(world) } else { light_axes(world) * axis };
        Cone::spot(axis.as_vec3(), half_angle_rad as f32)
    }

    /// The mean of a photometric profile; 1 without one.
    fn mean(&self, shaping: Option<Shaping>) -> f32 {
        shaping.and_then(|shaping| shaping.ies(self.scene)).map_or(1.0, IesProfile::mean)
    }

    /// Whether an emitter's light has a photometric profile.
    pub fn is_photometric(&self, emitter: u32) -> bool {
        let shaping = match self.emitters.place_of(emitter) {
            EmitterPlace::Triangle { instance, .. } => {
                self.scene.instances[instance as usize].shaping
            }
            EmitterPlace::Light(row) => self.scene.lights[row as usize].kind.shaping(),
        };
        shaping.is_some_and(|shaping| shaping.ies(self.scene).is_some())
    }

    /// The luminance of the intensity that leaves an emitter in a direction, seen from far away, in the unit of
    /// energies. The direction is unit, in world space.
    pub fn intensity(&self, emitter: u32, direction: Vec3) -> f32 {
        let direction = direction.as_dvec3();
        match self.emitters.place_of(emitter) {
            EmitterPlace::Triangle { instance: row, triangle } => {
                let instance = &self.scene.instances[row as usize];
                let across =
                    self.triangle(instance, triangle).area_normal() * self.handedness(instance);
                let seen = across.dot(direction);
                let seen =
                    if self.material(instance).double_sided { seen.abs() } else { seen.max(0.0) };
                if seen == 0.0 {
                    return 0.0;
                }
                let EmitterRef { light, own } = self.emitters.get(emitter);
                let mean = match self.emitters.lights()[light as usize].source {
                    LightSource::Mesh { mesh_light, .. } => {
                        self.emitters.mesh_lights()[mesh_light as usize].texture_mean(own)
                    }
                    LightSource::Light(_) => Rgb::ONE,
                };
                let nits = self.scene.rgb_of_instance(row, self.pose) * mean;
                let profile = self.profile(instance.shaping, instance.node, -direction);
                let effect = self.scene.effect_of_instance(row);
                luminance(nits * profile) * effect * (0.5 * seen) as f32
            }
            EmitterPlace::Light(row) => {
                let light = &self.scene.lights[row as usize];
                let profile = self.profile(light.kind.shaping(), light.node, -direction);
                let rgb = self.scene.rgb_of_light(row, self.pose) * self.scene.effect_of_light(row);
                let strength = luminance(rgb * profile);
                match light.kind {
                    LightKind::Sphere { .. } => strength * PI * self.sphere(light).radius.powi(2),
                    _ => strength,
                }
            }
        }
    }

    /// The middle of an emitter, world space. Points in fog are drawn by the angle under which it sees
    /// them.
    pub fn middle(&self, emitter: u32) -> Vec3 {
        match self.emitters.place_of(emitter) {
            EmitterPlace::Triangle { instance, triangle } => {
                let instance = &self.scene.instances[instance as usize];
                let [a, b, c] = self.triangle(instance, triangle).corners;
                a + ((b - a) + (c - a)) / 3.0
            }
            EmitterPlace::Light(row) => {
                Vec3::from(self.pose.world(self.scene.lights[row as usize].node).translation)
            }
        }
    }
}

/// The bounds, if a tree may be built over them.
fn sound(mut bounds: LightBounds) -> Option<LightBounds> {
    bounds.energy = bounds.energy.max(f32::MIN_POSITIVE);
    bounds.is_sound().then_some(bounds)
}
