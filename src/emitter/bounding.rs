//! The bounds of emitters. The tree is built over them.
//!
//! Energy is the luminance of the peak radiant intensity: `I` of a point, `L A` of a triangle,
//! `L pi r^2` of a sphere. It is never quite zero: an emitter that a transform has flattened, or that
//! is dark in this frame, keeps its place in the tree.

use super::mesh_light::MeshLight;
use super::posed::PosedEmitters;
use super::set::{EmitterRef, LightSource};
use super::triangle::WorldTriangle;
use crate::bounds::{Aabb, Cone, LightBounds};
use crate::math::Similarity;
use crate::math::color::{Rgb, luminance};
use crate::math::directions::{aim, mirrors};
use crate::scene::{LightKind, Shaping};
use glam::{Affine3A, DVec3, Vec3};
use rayon::prelude::*;
use std::f32::consts::PI;
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
                    let nits = self.scene.rgb_of_instance(row, self.pose);
                    self.triangle_bounds(mesh_light, own, &self.pose.world(instance.node), nits)
                }
                LightSource::Light(row) => self.bounds_of_light(row),
            };
            sound(bounds).ok_or_else(|| LightOverflow { path: light.path.clone() })
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
            LightOverflow { path: path.map_or_else(String::new, |entry| entry.path.clone()) }
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
        let brightness = luminance(self.scene.rgb_of_instance(row, self.pose)) / peak;
        Some((to_local, brightness / to_local.scale().powi(2)))
    }

    fn triangle_bounds(
        &self,
        mesh_light: &MeshLight,
        own: u32,
        world: &Affine3A,
        nits: Rgb,
    ) -> LightBounds {
        let mesh = &self.scene.meshes[mesh_light.mesh as usize];
        let corners = mesh.triangles[mesh_light.triangle(own) as usize];
        let corners = corners.map(|c| world.transform_point3(mesh.positions[c as usize]));
        let triangle = WorldTriangle { corners };
        let handedness = if mirrors(world) { -1.0 } else { 1.0 };
        let double_sided = self.scene.material_of(mesh_light.mesh).is_some_and(|m| m.double_sided);
        let cone = match mesh_light.shaping {
            Some(shaping) if shaping.half_angle_rad() < PI / 2.0 => {
                Cone::spot(aim(world).as_vec3(), shaping.half_angle_rad())
            }
            _ => {
                let normal = triangle.area_normal().normalize_or(DVec3::Z) * handedness;
                Cone::flat(normal.as_vec3(), double_sided)
            }
        };
        LightBounds {
            aabb: Aabb::around(triangle.corners),
            cone,
            energy: luminance(nits * mesh_light.texture_mean(own)) * triangle.area(),
            range_m: f32::INFINITY,
        }
    }

    fn bounds_of_light(&self, row: u32) -> LightBounds {
        let light = &self.scene.lights[row as usize];
        let strength = luminance(self.scene.rgb_of_light(row, self.pose));
        let here = Vec3::from(self.pose.world(light.node).translation);
        let aim = self.aim(light.node).as_vec3();
        let aimed = |shaping: &Shaping| Cone::spot(aim, shaping.half_angle_rad());
        let (radius, cone, energy) = match &light.kind {
            LightKind::Point { .. } => (0.0, Cone::ALL, strength),
            LightKind::Spot { shaping, .. } => (0.0, aimed(shaping), strength),
            LightKind::Sphere { shaping, .. } => {
                let radius = self.sphere(light).radius;
                let cone = shaping.as_ref().map_or(Cone::ALL, aimed);
                (radius, cone, strength * PI * radius * radius)
            }
            LightKind::Distant { .. } | LightKind::Dome { .. } => {
                unreachable!("lights at infinity are no emitters")
            }
        };
        let aabb = Aabb { min: here - radius, max: here + radius };
        LightBounds { aabb, cone, energy, range_m: light.range_m.unwrap_or(f32::INFINITY) }
    }

    /// The middle of an emitter, world space. Points in fog are drawn by the angle under which it sees
    /// them.
    pub fn middle(&self, emitter: u32) -> Vec3 {
        match self.emitters.place_of(emitter) {
            super::EmitterPlace::Triangle { instance, triangle } => {
                let instance = &self.scene.instances[instance as usize];
                let [a, b, c] = self.triangle(instance, triangle).corners;
                a + ((b - a) + (c - a)) / 3.0
            }
            super::EmitterPlace::Light(row) => {
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
