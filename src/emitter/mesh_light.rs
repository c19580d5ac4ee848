//! Which triangles of a mesh emit: worked out once, however often the mesh is put into the scene.

use super::texels::TexelMeans;
use crate::math::color::{Rgb, luminance};
use crate::scene::{Instance, Mesh, Scene, Shaping};
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::OnceLock;

/// A mesh whose material emits, with an emission profile and a strength: what instances share.
#[derive(Clone, Debug)]
pub struct MeshLight {
    /// Index into [`Scene::meshes`].
    pub mesh: u32,
    /// Profile of the emission about the mesh's own -Z.
    pub shaping: Option<Shaping>,
    /// The most that each channel ever emits, nits, before the texture. Energies in the mesh's own
    /// space are of this.
    pub peak_nits: Rgb,
    /// How many of its triangles emit.
    pub count: u32,
    /// Those, ascending, if they are not all.
    triangles: Option<Vec<u32>>,
    /// For textured emission, the mean of the texture over each of them.
    texture_means: Option<Vec<Rgb>>,
}

impl MeshLight {
    /// The triangle of the mesh that one of its emitters is.
    #[inline]
    pub fn triangle(&self, own: u32) -> u32 {
        self.triangles.as_ref().map_or(own, |list| list[own as usize])
    }

    /// The emitter that a triangle of the mesh is, if it is one.
    #[inline]
    pub fn of_triangle(&self, triangle: u32) -> Option<u32> {
        match &self.triangles {
            Some(list) => list.binary_search(&triangle).ok().map(|at| at as u32),
            None => Some(triangle),
        }
    }

    /// The mean of the emission texture over an emitter; white without a texture.
    #[inline]
    pub fn texture_mean(&self, own: u32) -> Rgb {
        self.texture_means.as_ref().map_or(Rgb::ONE, |means| means[own as usize])
    }
}

/// All mesh lights of a scene, and for each instance which it is an instance of.
pub(super) fn find(scene: &Scene) -> (Vec<MeshLight>, Vec<Option<u32>>) {
    let mut rows: HashMap<Key, u32> = HashMap::new();
    let mut firsts: Vec<(&Instance, Rgb)> = Vec::new();
    let rows_of: Vec<Option<u32>> = scene
        .instances
        .iter()
        .enumerate()
        .map(|(i, instance)| {
            let peak = scene.peak_rgb_of_instance(i as u32);
            (peak.max_element() > 0.0).then(|| {
                *rows.entry(Key::new(instance, peak)).or_insert_with(|| {
                    firsts.push((instance, peak));
                    firsts.len() as u32 - 1
                })
            })
        })
        .collect();
    let whole_means: Vec<OnceLock<Rgb>> = scene.textures.iter().map(|_| OnceLock::new()).collect();
    let lights: Vec<MeshLight> = firsts
        .par_iter()
        .map(|&(instance, peak)| emitting_triangles(scene, instance, peak, &whole_means))
        .collect();
    let shines = |row: u32| lights[row as usize].count > 0;
    let of_instance = rows_of.into_iter().map(|row| row.filter(|&row| shines(row))).collect();
    (lights, of_instance)
}

/// What tells mesh lights apart, bit by bit.
#[derive(PartialEq, Eq, Hash)]
struct Key {
    mesh: u32,
    peak: [u32; 3],
    shaping: Option<(u8, [u32; 6])>,
}

impl Key {
    fn new(instance: &Instance, peak: Rgb) -> Key {
        let shaping = instance.shaping.map(|shaping| match shaping {
            Shaping::Khr { inner_rad, outer_rad } => {
                (0, [inner_rad, outer_rad, 0.0, 0.0, 0.0, 0.0].map(f32::to_bits))
            }
            Shaping::Usd { cone_rad, softness, focus, focus_tint: [r, g, b] } => {
                (1, [cone_rad, softness, focus, r, g, b].map(f32::to_bits))
            }
        });
        Key { mesh: instance.mesh, peak: peak.to_array().map(f32::to_bits), shaping }
    }
}

fn emitting_triangles(
    scene: &Scene,
    instance: &Instance,
    peak_nits: Rgb,
    whole_means: &[OnceLock<Rgb>],
) -> MeshLight {
    let mesh: &Mesh = &scene.meshes[instance.mesh as usize];
    let usage = scene.material_of(instance.mesh).and_then(|m| m.emission_texture.as_ref());
    let textured = usage
        .filter(|usage| mesh.uv_sets.get(usage.uv_set as usize).is_some_and(|set| !set.is_empty()));
    let means = textured.map(|usage| {
        let uvs = &mesh.uv_sets[usage.uv_set as usize];
        let on_texture = |triangle: &[u32; 3]| triangle.map(|corner| uvs[corner as usize]);
        let (texture, whole) =
            (&scene.textures[usage.texture as usize], &whole_means[usage.texture as usize]);
        let all = mesh.triangles.iter().map(on_texture);
        (TexelMeans::new(texture, *usage, all, whole), on_texture)
    });
    let mean_of = |triangle: &[u32; 3]| match &means {
        None => Rgb::ONE,
        Some((means, on_texture)) => means.over(on_texture(triangle)),
    };
    let emission = |(triangle, corners): (usize, &[u32; 3])| {
        let [a, b, c] = corners.map(|corner| mesh.positions[corner as usize].as_dvec3());
        let has_area = (b - a).cross(c - a).length_squared() > 0.0;
        let mean = if has_area { mean_of(corners) } else { Rgb::ZERO };
        (luminance(mean * peak_nits) > 0.0).then_some((triangle as u32, mean))
    };
    let found: Vec<(u32, Rgb)> =
        mesh.triangles.par_iter().enumerate().filter_map(emission).collect();
    let all = found.len() == mesh.triangles.len();
    MeshLight {
        mesh: instance.mesh,
        shaping: instance.shaping,
        peak_nits,
        count: found.len() as u32,
        triangles: (!all).then(|| found.iter().map(|&(triangle, _)| triangle).collect()),
        texture_means: textured.map(|_| found.iter().map(|&(_, mean)| mean).collect()),
    }
}
