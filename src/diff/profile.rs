//! How the lights of a scene are spread, and their shapes: what bounds do not tell, as hashes.

use super::light::Profile;
use crate::emitter::{Emitters, LightSource, MeshLight};
use crate::scene::{LightKind, Pixels, Scene, Shaping, Texture};
use rayon::prelude::*;

/// Hashes over what lights share. Hashed once, however often a mesh is put into the scene.
pub(super) struct Profiles {
    /// Of the emission texture on each mesh light; 0 without one.
    textures: Vec<u128>,
    /// Of the emitters of each in its own space.
    shapes: Vec<u128>,
}

impl Profiles {
    pub fn of(scene: &Scene, emitters: &Emitters) -> Profiles {
        let rows = emitters.mesh_lights();
        Profiles {
            textures: rows.par_iter().map(|light| texture_on(scene, light)).collect(),
            shapes: rows.par_iter().map(|light| shape_of(scene, light)).collect(),
        }
    }

    /// Of a light that is not at infinity.
    pub fn of_light(&self, scene: &Scene, source: LightSource) -> Profile {
        let (shaping, texture) = match source {
            LightSource::Mesh { instance, mesh_light } => {
                let shaping = scene.instances[instance as usize].shaping;
                (shaping, self.textures[mesh_light as usize])
            }
            LightSource::Light(row) => match scene.lights[row as usize].kind {
                LightKind::Spot { shaping, .. } => (Some(shaping), 0),
                LightKind::Sphere { shaping, .. } => (shaping, 0),
                _ => (None, 0),
            },
        };
        let half_angle_rad = shaping.map(|shaping| shaping.half_angle_rad());
        let mut hasher = blake3::Hasher::new();
        hasher.update(&texture.to_le_bytes());
        match shaping {
            None => return Profile { pattern: texture, half_angle_rad },
            Some(Shaping::Khr { inner_rad, .. }) => {
                hasher.update(&[1]).update(&inner_rad.to_le_bytes());
            }
            Some(Shaping::Usd { softness, focus, focus_tint: [r, g, b], .. }) => {
                hasher.update(&[2]);
                for number in [softness, focus, r, g, b] {
                    hasher.update(&number.to_le_bytes());
                }
            }
        }
        Profile { pattern: short(&hasher), half_angle_rad }
    }

    /// Of the emitters of a mesh light in its own space.
    pub fn shape(&self, mesh_light: u32) -> u128 {
        self.shapes[mesh_light as usize]
    }
}

/// Sixteen bytes of a hash: enough to tell versions apart.
pub(super) fn short(hasher: &blake3::Hasher) -> u128 {
    let mut bytes = [0; 16];
    hasher.finalize_xof().fill(&mut bytes);
    u128::from_le_bytes(bytes)
}

/// Adds what a texture looks like, whatever its name.
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

fn shape_of(scene: &Scene, light: &MeshLight) -> u128 {
    let mesh = &scene.meshes[light.mesh as usize];
    let mut hasher = blake3::Hasher::new();
    for own in 0..light.count {
        let corners = mesh.triangles[light.triangle(own) as usize];
        hasher.update(bytemuck::bytes_of(&corners.map(|corner| mesh.positions[corner as usize])));
    }
    short(&hasher)
}
