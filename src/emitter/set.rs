//! Which emitters a scene has, in canonical order, and how to find one again from a hit.

use super::mesh_light::{self, MeshLight, MeshLights};
use super::textured::{KnownMeans, TextureMeans};
use crate::math::Similarity;
use crate::math::color::{Rgb, luminance};
use crate::scene::{Keys, LightKind, Links, Scene};
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::Arc;

/// What the tree picks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EmitterRef {
    /// Its light: a row of [`Emitters::lights`].
    pub light: u32,
    /// Of a mesh light, its number among the triangles that emit; else 0.
    pub own: u32,
}

/// Where an emitter is in the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EmitterPlace {
    /// A triangle of a mesh.
    Triangle {
        /// A row of [`Scene::instances`].
        instance: u32,
        /// Index into the mesh's triangles.
        triangle: u32,
    },
    /// A row of [`Scene::lights`].
    Light(u32),
}

/// Where a light comes from in the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightSource {
    /// A mesh whose material emits.
    Mesh {
        /// A row of [`Scene::instances`].
        instance: u32,
        /// A row of [`Emitters::mesh_lights`].
        mesh_light: u32,
    },
    /// A light that is not a mesh: a row of [`Scene::lights`].
    Light(u32),
}

/// One light: a run of emitters.
#[derive(Clone, Debug)]
pub struct LightEntry {
    /// Prim path.
    pub path: Arc<str>,
    /// Where it comes from.
    pub source: LightSource,
    /// Whether its node moves with time.
    pub moves: bool,
    /// Whether its strength varies with time.
    pub varies: bool,
    /// Whether its mesh changes its shape with time.
    pub deforms: bool,
    /// Whether it is left out of all estimates and sampled at every point.
    pub forced: bool,
    /// Whether a tree in the space of its own mesh serves it, shared with other instances or carried
    /// along: its node's transform keeps shapes at every time, and does not change while a shutter is open; and
    /// its mesh keeps its shape.
    pub in_own_space: bool,
    /// What it is linked by.
    pub links: Links,
    /// Its link number: 0 if it lights everything, else the same as that of all lights that light the same, in
    /// the order of the first of them.
    pub link: u32,
    /// Number of its first emitter.
    pub first: u32,
    /// How many emitters it has.
    pub count: u32,
}

impl LightEntry {
    /// Whether anything of its bounds changes with time.
    pub fn changes(&self) -> bool {
        self.moves || self.varies || self.deforms
    }

    /// What decides the order of lights, before their paths: the forced come last, before them what
    /// changes; and of each those that trees of their own serve.
    fn class(&self) -> (bool, bool, bool) {
        (self.forced, self.changes(), self.in_own_space || self.forced)
    }
}

/// From so many triangles on a mesh light that is instanced or carried along has a tree of its own:
/// fewer do not fill a group of eight.
const LEAST_TO_SHARE: u32 = 8;
/// Emitters looked up together.
const BLOCK: u32 = 64;

/// All emitters of a scene that the tree is built over. Suns and domes are not among them; see
/// [`infinite_lights`](super::infinite_lights).
///
/// Emitters are numbered light by light, in the order of the lights' classes and then of their paths;
/// within a light in order of triangle. The numbers depend on the scene alone, not on the order of
/// its tables. A mesh light that is instanced a thousand times is stored once.
pub struct Emitters {
    lights: Vec<LightEntry>,
    mesh_lights: Vec<MeshLight>,
    texture_means: Vec<TextureMeans>,
    count: u32,
    /// The first emitter of each light, close together.
    firsts: Vec<u32>,
    /// For every [`BLOCK`] emitters the light of the first.
    blocks: Vec<u32>,
    /// The link set that each link number stands for; without that of number 0.
    link_sets: Vec<u32>,
    /// For each instance of the scene its light, if it is one.
    light_of_instance: Vec<Option<u32>>,
    /// For each light of the scene its entry, if it has one.
    entry_of_light: Vec<Option<u32>>,
}

impl Emitters {
    /// Finds all emitters of a scene, by the most that each light ever gives. Triangles without
    /// area and triangles whose texels are all black are none.
    pub fn collect(scene: &Scene) -> Emitters {
        Emitters::collect_knowing(scene, &KnownMeans::NONE)
    }

    /// The same where the means of some textures are known: to work these out is what takes time.
    pub fn collect_knowing(scene: &Scene, known: &KnownMeans) -> Emitters {
        let MeshLights { lights: mesh_lights, of_instance, means } = mesh_light::find(scene, known);
        let mut lights = mesh_entries(scene, &mesh_lights, &of_instance);
        let moving = scene.moving_nodes();
        for (i, light) in scene.lights.iter().enumerate() {
            if shines(&light.kind, scene.peak_rgb_of_light(i as u32)) {
                lights.push(LightEntry {
                    path: scene.nodes[light.node as usize].path.clone(),
                    source: LightSource::Light(i as u32),
                    moves: moving[light.node as usize],
                    varies: light.values.as_deref().is_some_and(Keys::varies),
                    deforms: false,
                    forced: light.forced,
                    in_own_space: false,
                    links: scene.linking.of_light(i as u32),
                    link: 0,
                    first: 0,
                    count: 1,
                });
            }
        }
        lights.par_sort_by(|a, b| a.class().cmp(&b.class()).then_with(|| a.path.cmp(&b.path)));
        Emitters { texture_means: means, ..Emitters::number(scene, lights, mesh_lights) }
    }

    /// Numbers the emitters of sorted lights.
    fn number(scene: &Scene, mut lights: Vec<LightEntry>, mesh_lights: Vec<MeshLight>) -> Emitters {
        let mut light_of_instance = vec![None; scene.instances.len()];
        let mut entry_of_light = vec![None; scene.lights.len()];
        let (mut count, mut blocks) = (0u32, Vec::new());
        let link_sets = number_links(&mut lights);
        for (row, entry) in (0..).zip(&mut lights) {
            entry.first = count;
            // `ingest` refuses scenes of more.
            count = count.checked_add(entry.count).expect("a scene has fewer than 2^30 emitters");
            while (blocks.len() as u32) < count.div_ceil(BLOCK) {
                blocks.push(row);
            }
            match entry.source {
                LightSource::Mesh { instance, .. } => {
                    light_of_instance[instance as usize] = Some(row)
                }
                LightSource::Light(light) => entry_of_light[light as usize] = Some(row),
            }
        }
        let firsts = lights.iter().map(|light| light.first).collect();
        let texture_means = Vec::new();
        Emitters {
            lights,
            mesh_lights,
            texture_means,
            count,
            firsts,
            blocks,
            link_sets,
            light_of_instance,
            entry_of_light,
        }
    }

    /// The lights, in the order of their emitters.
    pub fn lights(&self) -> &[LightEntry] {
        &self.lights
    }

    /// What the mesh lights are instances of.
    pub fn mesh_lights(&self) -> &[MeshLight] {
        &self.mesh_lights
    }

    /// What textures give the triangles of the mesh lights, by ascending fingerprint, each once.
    pub fn texture_means(&self) -> &[TextureMeans] {
        &self.texture_means
    }

    /// The link sets of the scene that the lights' link numbers stand for, from number 1 on. Empty if every light
    /// lights everything.
    pub fn link_sets(&self) -> &[u32] {
        &self.link_sets
    }

    /// How many emitters there are.
    pub fn len(&self) -> usize {
        self.count as usize
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// How many emitters belong to lights that change with time.
    pub fn changing_count(&self) -> usize {
        let changing = self.lights.iter().filter(|light| light.changes());
        changing.map(|light| light.count as usize).sum()
    }

    /// What an emitter is.
    #[inline]
    pub fn get(&self, emitter: u32) -> EmitterRef {
        let block = (emitter / BLOCK) as usize;
        let from = self.blocks[block] as usize;
        let to = self.blocks.get(block + 1).map_or(self.firsts.len(), |&to| to as usize + 1);
        let firsts = &self.firsts[from..to];
        // Where each light has one emitter, as points have, it is at once known which.
        let guess = (emitter - firsts[0]) as usize;
        let light = match firsts.get(guess) {
            Some(&first) if first == emitter => from + guess,
            _ => from + firsts.partition_point(|&first| first <= emitter) - 1,
        };
        EmitterRef { light: light as u32, own: emitter - self.firsts[light] }
    }

    /// Where an emitter is in the scene.
    #[inline]
    pub fn place_of(&self, emitter: u32) -> EmitterPlace {
        let EmitterRef { light, own } = self.get(emitter);
        match self.lights[light as usize].source {
            LightSource::Mesh { instance, mesh_light } => {
                let triangle = self.mesh_lights[mesh_light as usize].triangle(own);
                EmitterPlace::Triangle { instance, triangle }
            }
            LightSource::Light(row) => EmitterPlace::Light(row),
        }
    }

    /// The light of an emitter.
    #[inline]
    pub fn light_of(&self, emitter: u32) -> &LightEntry {
        &self.lights[self.get(emitter).light as usize]
    }

    /// Whether a ray may hit any of them: triangles and spheres have a surface, points and spots have none.
    pub fn have_surfaces(&self, scene: &Scene) -> bool {
        self.lights.iter().any(|light| match light.source {
            LightSource::Mesh { .. } => true,
            LightSource::Light(row) => {
                matches!(scene.lights[row as usize].kind, LightKind::Sphere { .. })
            }
        })
    }

    /// The emitter that a triangle of an instance is, if it is one.
    #[inline]
    pub fn of_triangle(&self, instance: u32, triangle: u32) -> Option<u32> {
        let entry = &self.lights[self.light_of_instance[instance as usize]? as usize];
        let LightSource::Mesh { mesh_light, .. } = entry.source else { return None };
        Some(entry.first + self.mesh_lights[mesh_light as usize].of_triangle(triangle)?)
    }

    /// The emitter that a light of the scene is, if it is one.
    #[inline]
    pub fn of_light(&self, light: u32) -> Option<u32> {
        Some(self.lights[self.entry_of_light[light as usize]? as usize].first)
    }
}

/// Numbers the link sets of sorted lights, and returns those that have numbers.
fn number_links(lights: &mut [LightEntry]) -> Vec<u32> {
    let (mut sets, mut numbers) = (Vec::new(), HashMap::new());
    for light in lights {
        if let Some(set) = light.links.light {
            light.link = *numbers.entry(set).or_insert_with(|| {
                sets.push(set);
                sets.len() as u32
            });
        }
    }
    sets
}

/// The instances that are lights.
fn mesh_entries(
    scene: &Scene,
    mesh_lights: &[MeshLight],
    of_instance: &[Option<u32>],
) -> Vec<LightEntry> {
    let (moving, rigid) = (scene.moving_nodes(), scene.rigid_nodes());
    let still = scene.pose_at(0.0);
    let keeps_shapes =
        |node: u32| rigid[node as usize] && Similarity::undoing(&still.world(node)).is_some();
    let mut users = vec![0u32; mesh_lights.len()];
    of_instance.iter().flatten().for_each(|&row| users[row as usize] += 1);
    // A tree stands in one place; what is blurred is in many.
    let is_blurred = !scene.shutters().is_empty();
    let rows = scene.instances.iter().zip(of_instance).enumerate();
    let entry = |(i, (instance, row)): (usize, (&crate::scene::Instance, &Option<u32>))| {
        let mesh_light = (*row)?;
        let deforms = scene.changes_shape(instance.mesh);
        let count = mesh_lights[mesh_light as usize].count;
        let (moves, varies) =
            (moving[instance.node as usize], instance.values.as_deref().is_some_and(Keys::varies));
        let is_shared = users[mesh_light as usize] > 1 || moves || varies;
        let is_placed = !(deforms || (moves && is_blurred)) && keeps_shapes(instance.node);
        Some(LightEntry {
            path: instance.path.clone(),
            source: LightSource::Mesh { instance: i as u32, mesh_light },
            moves,
            varies,
            deforms,
            forced: instance.forced,
            in_own_space: is_shared && count >= LEAST_TO_SHARE && is_placed,
            links: scene.linking.of_instance(i as u32),
            link: 0,
            first: 0,
            count,
        })
    };
    rows.filter_map(entry).collect()
}

/// Whether a light that is not a mesh is an emitter, given the most that it ever gives.
fn shines(kind: &LightKind, peak: Rgb) -> bool {
    let shines = luminance(peak) > 0.0;
    match kind {
        LightKind::Point { .. } | LightKind::Spot { .. } => shines,
        LightKind::Sphere { radius, .. } => shines && *radius > 0.0,
        LightKind::Distant { .. } | LightKind::Dome { .. } => false,
    }
}
