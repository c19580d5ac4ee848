//! Which triangles of a mesh emit: worked out once, however often the mesh is put into the scene.

use super::textured::{self, KnownMeans, LitTriangle, TextureMeans};
use crate::math::color::Rgb;
use crate::scene::{Instance, Mesh, Scene, Shaping};
use rayon::prelude::*;
use std::collections::HashMap;

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

/// All mesh lights of a scene, for each instance which it is an instance of, and the means of
/// textures that tell which triangles emit.
pub(super) struct MeshLights {
    pub lights: Vec<MeshLight>,
    pub of_instance: Vec<Option<u32>>,
    pub means: Vec<TextureMeans>,
}

pub(super) fn find(scene: &Scene, known: &KnownMeans) -> MeshLights {
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
    let mut meshes: Vec<u32> = firsts.iter().map(|(instance, _)| instance.mesh).collect();
    meshes.sort_unstable();
    meshes.dedup();
    let means = textured::means_of(scene, &meshes, known);
    let lights: Vec<MeshLight> = firsts
        .par_iter()
        .map(|&(instance, peak)| {
            let means = means.get(&instance.mesh).map(|means| means.lit.as_slice());
            emitting_triangles(scene, instance, peak, means)
        })
        .collect();
    let shines = |row: u32| lights[row as usize].count > 0;
    let of_instance = rows_of.into_iter().map(|row| row.filter(|&row| shines(row))).collect();
    let mut means: Vec<TextureMeans> = means.into_values().collect();
    means.sort_unstable_by_key(|means| means.fingerprint);
    means.dedup_by_key(|means| means.fingerprint);
    MeshLights { lights, of_instance, means }
}

/// What tells mesh lights apart, bit by bit.
#[derive(PartialEq, Eq, Hash)]
struct Key {
    mesh: u32,
    peak: [u32; 3],
    shaping: Option<(u8, [u32; 6], Option<u32>)>,
}

impl Key {
    fn new(instance: &Instance, peak: Rgb) -> Key {
        let shaping = instance.shaping.map(|shaping| match shaping {
            Shaping::Khr { inner_rad, outer_rad } => {
                (0, [inner_rad, outer_rad, 0.0, 0.0, 0.0, 0.0].map(f32::to_bits), None)
            }
            Shaping::Usd { cone_rad, softness, focus, focus_tint: [r, g, b], profile } => {
                (1, [cone_rad, softness, focus, r, g, b].map(f32::to_bits), profile)
            }
        });
        Key { mesh: instance.mesh, peak: peak.to_array().map(f32::to_bits), shaping }
    }
}

/// The triangles that have an area, at some time if the mesh deforms, and light: by the means of their texture, if there is one.
fn emitting_triangles(
    scene: &Scene,
    instance: &Instance,
    peak_nits: Rgb,
    means: Option<&[LitTriangle]>,
) -> MeshLight {
    let mesh: &Mesh = &scene.meshes[instance.mesh as usize];
    let has_area = |triangle: u32| {
        let corners = mesh.triangles[triangle as usize];
        if let Some(deformation) = &mesh.deformation {
            return !deformation.is_always_flat(corners);
        }
        let [a, b, c] = corners.map(|corner| mesh.positions[corner as usize].as_dvec3());
        (b - a).cross(c - a).length_squared() > 0.0
    };
    // Channel by channel: a product may be too small to be told from zero.
    let shines = |mean: Rgb| (mean.cmpgt(Rgb::ZERO) & peak_nits.cmpgt(Rgb::ZERO)).any();
    let found: Vec<LitTriangle> = match means {
        None => {
            let all = (0..mesh.triangles.len() as u32).into_par_iter();
            let lit = all.filter(|&triangle| has_area(triangle));
            lit.map(|triangle| LitTriangle { triangle, mean: Rgb::ONE }).collect()
        }
        Some(lit) => {
            let lit = lit.par_iter().filter(|lit| shines(lit.mean) && has_area(lit.triangle));
            lit.copied().collect()
        }
    };
    let all = found.len() == mesh.triangles.len();
    MeshLight {
        mesh: instance.mesh,
        shaping: instance.shaping,
        peak_nits,
        count: found.len() as u32,
        triangles: (!all).then(|| found.iter().map(|lit| lit.triangle).collect()),
        texture_means: means.map(|_| found.iter().map(|lit| lit.mean).collect()),
    }
}
