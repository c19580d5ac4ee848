//! Hashes of what bounds do not tell: the emission patterns of a scene's lights, and their shapes.

use super::light::Profile;
use crate::emitter::{Emitters, LightSource, MeshLight};
use crate::math::directions::light_axes;
use crate::scene::{IesProfile, Pixels, Pose, Response, Scene, Shaping, Texture};
use glam::Vec3;
use rayon::prelude::*;

/// Hashes of what the instances of a mesh light share. Each is computed once, however many instances
/// there are.
pub(super) struct Profiles {
    /// The hash of the emission texture of each mesh light; 0 without a texture.
    textures: Vec<u128>,
    /// The hash of the emitters of each mesh light, in its own space, as they are in one pose.
    shapes: Vec<u128>,
}

impl Profiles {
    pub fn of(scene: &Scene, emitters: &Emitters, pose: &Pose) -> Profiles {
        let rows = emitters.mesh_lights();
        Profiles {
            textures: rows.par_iter().map(|light| texture_on(scene, light)).collect(),
            shapes: rows.par_iter().map(|light| shape_of(scene, light, pose)).collect(),
        }
    }

    /// The profile of a light that is not infinite, in a pose.
    pub fn of_light(&self, scene: &Scene, pose: &Pose, source: LightSource) -> Profile {
        let (of_filters, of_responses) = (&scene.light_filters, &scene.light_responses);
        let (filters, response) = match source {
            LightSource::Mesh { instance, .. } => {
                (of_filters.of_instance(instance), of_responses.of_instance(instance))
            }
            LightSource::Light(row) => (of_filters.of_light(row), of_responses.of_light(row)),
        };
        let profile = self.unfiltered(scene, pose, source);
        let pattern = with_filters(profile.pattern, scene, pose, filters);
        Profile { pattern, response, ..profile }
    }

    fn unfiltered(&self, scene: &Scene, pose: &Pose, source: LightSource) -> Profile {
        let (shaping, texture, node) = match source {
            LightSource::Mesh { instance, mesh_light } => {
                let instance = &scene.instances[instance as usize];
                (instance.shaping, self.textures[mesh_light as usize], instance.node)
            }
            LightSource::Light(row) => {
                let light = &scene.lights[row as usize];
                (light.kind.shaping(), 0, light.node)
            }
        };
        let half_angle_rad = shaping.map(|shaping| shaping.lit(scene).half_angle_rad as f32);
        let ies = shaping.and_then(|shaping| shaping.ies(scene));
        let turn = ies.filter(|ies| !ies.is_round()).map_or(0, |_| turn(pose, node));
        let mut hasher = blake3::Hasher::new();
        hasher.update(&texture.to_le_bytes());
        match shaping {
            None => {
                let response = Response::PLAIN;
                return Profile { pattern: texture, half_angle_rad, turn, response };
            }
            Some(Shaping::Khr { inner_rad, .. }) => {
                hasher.update(&[1]).update(&inner_rad.to_le_bytes());
            }
            Some(Shaping::Usd { cone_rad, softness, focus, focus_tint: [r, g, b], .. }) => {
                hasher.update(&[2]);
                for number in [softness, focus, r, g, b] {
                    hasher.update(&number.to_le_bytes());
                }
                // A narrower beam stands for the cone, which may still cut it off where it is aimed aside.
                if ies.is_some() && half_angle_rad != Some(cone_rad) {
                    hasher.update(&cone_rad.to_le_bytes());
                }
                ies.into_iter().flat_map(IesProfile::numbers).for_each(|number| {
                    hasher.update(&number.to_le_bytes());
                });
            }
        }
        Profile { pattern: short(&hasher), half_angle_rad, turn, response: Response::PLAIN }
    }

    /// The hash of the emitters of a mesh light, in its own space.
    pub fn shape(&self, mesh_light: u32) -> u128 {
        self.shapes[mesh_light as usize]
    }
}

/// The hash of a pattern behind filters, which are rows of the scene's.
pub(super) fn with_filters(pattern: u128, scene: &Scene, pose: &Pose, filters: &[u32]) -> u128 {
    // A smaller step is rounding, metres.
    const LEAST: f64 = 1e-4;
    if filters.is_empty() {
        return pattern;
    }
    let mut hasher = blake3::Hasher::new();
    hasher.update(&pattern.to_le_bytes());
    for &row in filters {
        let filter = &scene.light_filters.all()[row as usize];
        hasher.update(format!("{:?}", filter.kind).as_bytes());
        let world = pose.world(filter.node);
        let place = Vec3::from(world.translation).as_dvec3() + scene.origin;
        let axes = world.matrix3.to_cols_array().map(f64::from);
        for number in axes.into_iter().chain(place.to_array()) {
            hasher.update(&((number / LEAST).round() as i64).to_le_bytes());
        }
    }
    short(&hasher)
}

/// The hash of a light's axes in the world, but for what is rounding.
fn turn(pose: &Pose, node: u32) -> u64 {
    // A smaller turn is rounding, radians.
    const LEAST: f64 = 2e-5;
    let mut hasher = blake3::Hasher::new();
    for number in light_axes(&pose.world(node)).to_cols_array() {
        hasher.update(&((number / LEAST).round() as i32).to_le_bytes());
    }
    short(&hasher) as u64
}

/// Sixteen bytes of a hash: enough to tell versions apart.
pub(super) fn short(hasher: &blake3::Hasher) -> u128 {
    let mut bytes = [0; 16];
    hasher.finalize_xof().fill(&mut bytes);
    u128::from_le_bytes(bytes)
}

/// Adds the size, sampling and pixels of a texture, but not its name.
pub(super) fn add_texture(hasher: &mut blake3::Hasher, texture: &Texture) {
    hasher.update(&texture.width.to_le_bytes()).update(&texture.height.to_le_bytes());
    let [u, v] = texture.wrap.map(|wrap| wrap as u8);
    hasher.update(&[u, v, u8::from(texture.bilinear)]);
    match &texture.pixels {
        Pixels::Srgb8(pixels) => hasher.update(&[0]).update_rayon(bytemuck::cast_slice(pixels)),
        Pixels::Linear8(pixels) => hasher.update(&[1]).update_rayon(bytemuck::cast_slice(pixels)),
        Pixels::Float(pixels) => hasher.update(&[2]).update_rayon(bytemuck::cast_slice(pixels)),
    };
}

fn texture_on(scene: &Scene, light: &MeshLight) -> u128 {
    let material = scene.material_of(light.mesh);
    let Some(usage) = material.and_then(|material| material.emission_texture) else { return 0 };
    let mesh = &scene.meshes[light.mesh as usize];
    let mut hasher = blake3::Hasher::new();
    add_texture(&mut hasher, &scene.textures[usage.texture as usize]);
    let map = usage.transform.unwrap_or_default();
    map.to_cols_array().iter().for_each(|number| {
        hasher.update(&number.to_le_bytes());
    });
    if let Some(uvs) = mesh.uv_sets.get(usage.uv_set as usize).filter(|uvs| !uvs.is_empty()) {
        for own in 0..light.count {
            let corners = mesh.triangles[light.triangle(own) as usize];
            hasher.update(bytemuck::bytes_of(&corners.map(|corner| uvs[corner as usize])));
        }
    }
    short(&hasher)
}

/// The hash of the emitters of a mesh light in a pose, in its own space.
pub(super) fn shape_of(scene: &Scene, light: &MeshLight, pose: &Pose) -> u128 {
    let mesh = &scene.meshes[light.mesh as usize];
    let positions = pose.positions(scene, light.mesh);
    let mut hasher = blake3::Hasher::new();
    for own in 0..light.count {
        let corners = mesh.triangles[light.triangle(own) as usize];
        hasher.update(bytemuck::bytes_of(&corners.map(|corner| positions[corner as usize])));
    }
    short(&hasher)
}
