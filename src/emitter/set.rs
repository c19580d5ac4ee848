//! Which emitters a scene has, in canonical order, and how to find one again from a hit.

use super::texels::TexelMeans;
use crate::math::color::{Rgb, luminance};
use crate::scene::{LightKind, Material, Mesh, Scene};
use rayon::prelude::*;
use std::sync::OnceLock;

/// What the tree picks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EmitterRef {
    /// Its light: a row of [`Emitters::lights`].
    pub light: u32,
    /// Of a mesh light, its triangle; else 0.
    pub triangle: u32,
}

/// Where a light comes from in the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightSource {
    /// A mesh whose material emits: a row of [`Scene::instances`].
    Instance(u32),
    /// A light that is not a mesh: a row of [`Scene::lights`].
    Light(u32),
}

/// One light: a run of emitters.
#[derive(Clone, Debug)]
pub struct LightEntry {
    /// Prim path.
    pub path: String,
    /// Where it comes from.
    pub source: LightSource,
    /// Whether its bounds change with time: its node moves, or its strength varies.
    pub moves: bool,
    /// Whether its strength varies with time.
    pub varies: bool,
    /// Number of its first emitter.
    pub first: u32,
    /// How many emitters it has.
    pub count: u32,
    /// For a mesh light of which not every triangle emits: those that do, ascending.
    triangles: Option<Vec<u32>>,
    /// For textured emission, the mean of the texture over each emitter (nits are a factor).
    texture_means: Option<Vec<Rgb>>,
}

/// All emitters of a scene that the tree is built over. Suns and domes are not among them; see
/// [`infinite_lights`](super::infinite_lights).
///
/// Emitters are numbered light by light: first the lights that stand still, then those that move
/// or vary, each in order of path; within a light in order of triangle. The numbers depend on the scene
/// alone, not on the order of its tables.
pub struct Emitters {
    lights: Vec<LightEntry>,
    refs: Vec<EmitterRef>,
    static_count: usize,
    /// For each instance of the scene its light, if it is one.
    light_of_instance: Vec<Option<u32>>,
    /// For each light of the scene its entry, if it has one.
    entry_of_light: Vec<Option<u32>>,
}

impl Emitters {
    /// Finds all emitters of a scene, by the most that each light ever gives. Triangles without
    /// area and triangles whose texels are all black are none.
    pub fn collect(scene: &Scene) -> Emitters {
        let moving = scene.moving_nodes();
        let whole_means: Vec<OnceLock<Rgb>> =
            scene.textures.iter().map(|_| OnceLock::new()).collect();
        let mesh_light = |(i, instance): (usize, &crate::scene::Instance)| {
            let mesh = &scene.meshes[instance.mesh as usize];
            let material = scene.material_of(instance.mesh)?;
            let peak = scene.peak_rgb_of_instance(i as u32);
            if peak.max_element() <= 0.0 {
                return None;
            }
            let found = emitting_triangles(scene, mesh, material, peak, &whole_means);
            let varies = instance.values.is_some();
            (found.count > 0).then(|| LightEntry {
                path: instance.path.clone(),
                source: LightSource::Instance(i as u32),
                moves: moving[instance.node as usize] || varies,
                varies,
                first: 0,
                count: found.count,
                triangles: found.triangles,
                texture_means: found.texture_means,
            })
        };
        let mut lights: Vec<LightEntry> =
            scene.instances.par_iter().enumerate().filter_map(mesh_light).collect();
        let other = scene
            .lights
            .iter()
            .enumerate()
            .filter(|(i, light)| shines(&light.kind, scene.peak_rgb_of_light(*i as u32)));
        lights.extend(other.map(|(i, light)| LightEntry {
            path: scene.light_path(i).to_owned(),
            source: LightSource::Light(i as u32),
            moves: moving[light.node as usize] || light.values.is_some(),
            varies: light.values.is_some(),
            first: 0,
            count: 1,
            triangles: None,
            texture_means: None,
        }));
        lights.sort_by(|a, b| (a.moves, &a.path).cmp(&(b.moves, &b.path)));
        Emitters::number(scene, lights)
    }

    /// Numbers the emitters of sorted lights.
    fn number(scene: &Scene, mut lights: Vec<LightEntry>) -> Emitters {
        let mut refs = Vec::new();
        let mut static_count = 0;
        let mut light_of_instance = vec![None; scene.instances.len()];
        let mut entry_of_light = vec![None; scene.lights.len()];
        for (row, entry) in lights.iter_mut().enumerate() {
            let light = row as u32;
            entry.first = refs.len() as u32;
            match &entry.triangles {
                Some(list) => refs.extend(list.iter().map(|&t| EmitterRef { light, triangle: t })),
                None => refs.extend((0..entry.count).map(|t| EmitterRef { light, triangle: t })),
            }
            if !entry.moves {
                static_count = refs.len();
            }
            match entry.source {
                LightSource::Instance(instance) => {
                    light_of_instance[instance as usize] = Some(light)
                }
                LightSource::Light(light_row) => entry_of_light[light_row as usize] = Some(light),
            }
        }
        Emitters { lights, refs, static_count, light_of_instance, entry_of_light }
    }

    /// The lights, in the order of their emitters.
    pub fn lights(&self) -> &[LightEntry] {
        &self.lights
    }

    /// How many emitters there are.
    pub fn len(&self) -> usize {
        self.refs.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.refs.is_empty()
    }

    /// How many emitters neither move nor vary: they come first.
    pub fn static_count(&self) -> usize {
        self.static_count
    }

    /// What an emitter is.
    #[inline]
    pub fn get(&self, emitter: u32) -> EmitterRef {
        self.refs[emitter as usize]
    }

    /// The light of an emitter.
    #[inline]
    pub fn light_of(&self, emitter: u32) -> &LightEntry {
        &self.lights[self.get(emitter).light as usize]
    }

    /// The emitter that a triangle of an instance is, if it is one.
    #[inline]
    pub fn of_triangle(&self, instance: u32, triangle: u32) -> Option<u32> {
        let entry = &self.lights[self.light_of_instance[instance as usize]? as usize];
        let at = match &entry.triangles {
            Some(list) => list.binary_search(&triangle).ok()? as u32,
            None => triangle,
        };
        Some(entry.first + at)
    }

    /// The emitter that a light of the scene is, if it is one.
    #[inline]
    pub fn of_light(&self, light: u32) -> Option<u32> {
        Some(self.lights[self.entry_of_light[light as usize]? as usize].first)
    }

    /// The mean of the emission texture over an emitter; white without a texture.
    pub(super) fn texture_mean(&self, emitter: u32) -> Rgb {
        let entry = self.light_of(emitter);
        let means = entry.texture_means.as_ref();
        means.map_or(Rgb::ONE, |means| means[(emitter - entry.first) as usize])
    }
}

/// Whether a light that is not a mesh is an emitter.
fn shines(kind: &LightKind, peak: Rgb) -> bool {
    match kind {
        LightKind::Point { .. } | LightKind::Spot { .. } => luminance(peak) > 0.0,
        LightKind::Sphere { radius, .. } => luminance(peak) > 0.0 && *radius > 0.0,
        LightKind::Distant { .. } | LightKind::Dome { .. } => false,
    }
}

/// The triangles of a mesh that emit.
struct Emitting {
    count: u32,
    triangles: Option<Vec<u32>>,
    texture_means: Option<Vec<Rgb>>,
}

fn emitting_triangles(
    scene: &Scene,
    mesh: &Mesh,
    material: &Material,
    peak_nits: Rgb,
    whole_means: &[OnceLock<Rgb>],
) -> Emitting {
    let textured = material
        .emission_texture
        .filter(|usage| mesh.uv_sets.get(usage.uv_set as usize).is_some_and(|set| !set.is_empty()));
    let means = textured.map(|usage| {
        let uvs = &mesh.uv_sets[usage.uv_set as usize];
        let on_texture = |triangle: &[u32; 3]| triangle.map(|corner| uvs[corner as usize]);
        let (texture, whole) =
            (&scene.textures[usage.texture as usize], &whole_means[usage.texture as usize]);
        let all = mesh.triangles.iter().map(on_texture);
        (TexelMeans::new(texture, usage, all, whole), on_texture)
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
    Emitting {
        count: found.len() as u32,
        triangles: (!all).then(|| found.iter().map(|&(triangle, _)| triangle).collect()),
        texture_means: textured.map(|_| found.iter().map(|&(_, mean)| mean).collect()),
    }
}
