//! What a scene has of each feature, whether that switches anything on, and what it costs there.

use crate::emitter::{Emitters, LightEntry};
use crate::light_tree::{FrameRow, InstanceRow, MeanRow, TextureRow};
use crate::render::kept_in_own_space;
use crate::scene::{Requirements, Scene, Texture};
use glam::Vec2;
use serde::Serialize;

/// One feature of the renderer or the tree.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Feature {
    /// What it is.
    pub name: &'static str,
    /// How many of it the scene has.
    pub found: usize,
    /// Whether they switch it on.
    pub state: FeatureState,
    /// Bytes that it takes where it is on, if that is known without a build: of a tree file, or of the
    /// renderer's memory.
    pub bytes: Option<u64>,
    /// Where it is on and at what cost, or why it is off although there is some of it.
    pub note: Option<&'static str>,
}

/// Whether a feature is switched on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FeatureState {
    /// The scene switches it on.
    On,
    /// Nothing is spent on it.
    Off,
    /// It is there for whoever asks the renderer for it, and is off until then.
    Offered,
}

impl FeatureState {
    /// In words.
    pub fn word(self) -> &'static str {
        match self {
            FeatureState::On => "on",
            FeatureState::Off => "off",
            FeatureState::Offered => "if asked",
        }
    }
}

impl Feature {
    /// A feature that is on where there is any of it.
    fn new(name: &'static str, found: usize) -> Feature {
        let state = if found > 0 { FeatureState::On } else { FeatureState::Off };
        Feature { name, found, state, bytes: None, note: None }
    }

    /// Off unless something uses it, with a word on either.
    fn used_by(self, users: usize, on: &'static str, off: &'static str) -> Feature {
        match (self.state, users) {
            (FeatureState::On, 0) => Feature { state: FeatureState::Off, note: Some(off), ..self },
            (FeatureState::On, _) => self.with(on),
            _ => self,
        }
    }

    /// With a note, if it is not off.
    fn with(self, note: &'static str) -> Feature {
        let note = if self.state == FeatureState::Off { None } else { Some(note) };
        Feature { note, ..self }
    }

    /// With the bytes that it takes, if it is not off.
    fn taking(self, bytes: usize) -> Feature {
        let bytes = (self.state != FeatureState::Off).then_some(bytes as u64);
        Feature { bytes, ..self }
    }
}

/// Every feature, in the order in which they are told, for a shot of some frames.
pub(super) fn features(
    scene: &Scene,
    emitters: &Emitters,
    frames: usize,
    groups: usize,
) -> Vec<Feature> {
    let needs = scene.requirements();
    let mut all = lights(&needs, emitters);
    all.extend(surfaces(scene, &needs, emitters));
    all.extend(motion(&needs, emitters, frames));
    let groups = Feature::new("light groups", groups);
    all.push(match groups.state {
        FeatureState::On => Feature { state: FeatureState::Offered, ..groups }
            .with("a layer each with --aov light-groups"),
        _ => groups,
    });
    all.push(Feature::new("camera lenses", needs.lenses));
    all.push(Feature::new("camera lenses over time", needs.lenses_over_time));
    all.push(Feature::new("orthographic cameras", needs.orthographic_cameras));
    all.push(Feature::new("camera shutters", needs.shutters).used_by(
        needs.animated_nodes + needs.varying_lights + needs.deforming_meshes,
        "motion blur; --no-motion-blur switches it off",
        "nothing moves",
    ));
    all
}

fn lights(needs: &Requirements, emitters: &Emitters) -> Vec<Feature> {
    let count = |has: &dyn Fn(&&LightEntry) -> bool| emitters.lights().iter().filter(has).count();
    let placed = count(&|light| light.in_own_space && !light.forced);
    let means = emitters.texture_means();
    let lit: usize = means.iter().map(|of| of.lit.len()).sum();
    let of_means = means.len() * size_of::<TextureRow>() + lit * size_of::<MeanRow>();
    let several = emitters.len() + needs.suns + needs.domes;
    vec![
        Feature::new("mesh lights", needs.mesh_lights),
        Feature::new("sphere lights", needs.spheres),
        Feature::new("point lights", needs.points),
        Feature::new("spot lights", needs.spots),
        Feature::new("suns", needs.suns).with("weighed beside the tree at every point"),
        Feature::new("domes", needs.domes).with("weighed beside the tree at every point"),
        Feature::new("emission profiles", needs.shaped_lights),
        Feature::new("photometric profiles", needs.photometric_lights)
            .with("the tree weighs these lights by their intensity towards each point"),
        Feature::new("lights with a range", needs.ranges)
            .with("weighed in groups of the tree that hold one"),
        Feature::new("forced lights", needs.forced)
            .with("sampled at every point beside what is picked"),
        Feature::new("lights hidden from some rays", needs.hidden),
        Feature::new("lights with filters", needs.filtered_lights)
            .with("weighed by the tree as if they had none"),
        Feature::new("lights with multipliers", needs.lights_with_multipliers)
            .with("weighed by the larger of diffuse and specular; reflected light is split in two"),
        Feature::new("light links", needs.light_links)
            .with("numbers of lights, in the tree file; surfaces that not all lights light pick by them")
            .taking(if emitters.link_sets().is_empty() { 0 } else { 4 * emitters.lights().len() }),
        Feature::new("shadow links", needs.shadow_links)
            .with("rays to these lights ask each prim; reflected rays find none of their light"),
        Feature::new("filter links", needs.filter_links)
            .with("each light with such a filter asks what it lights"),
        Feature::new("textured mesh lights", needs.textured_mesh_lights)
            .used_by(
                means.len(),
                "baked: means over triangles, in the tree file",
                "no texture is baked: no coordinates",
            )
            .taking(of_means),
        Feature::new("lights with a tree of their own", placed)
            .with("rows that place shared trees, in the tree file")
            .taking(placed * size_of::<InstanceRow>()),
        Feature::new("splitting", several.saturating_sub(1))
            .with("lights beyond the first; --split 0 switches it off"),
    ]
}

fn surfaces(scene: &Scene, needs: &Requirements, emitters: &Emitters) -> Vec<Feature> {
    let textured = scene.materials.iter().filter(|m| m.textures().next().is_some()).count();
    let on_emitters = emitters.texture_means().len() + needs.pictured_domes;
    let users = textured + on_emitters;
    let kept = kept_in_own_space(scene);
    let mut kept_users = vec![0usize; scene.meshes.len()];
    for (instance, _) in scene.instances.iter().zip(kept).filter(|&(_, is_kept)| is_kept) {
        kept_users[instance.mesh as usize] += 1;
    }
    let kept_shared = kept_users.into_iter().filter(|&users| users > 1).count();
    let texels: usize = scene.textures.iter().map(|texture| Texture::bytes(texture).len()).sum();
    vec![
        Feature::new("textures", needs.textures)
            .used_by(
                users,
                if on_emitters > 0 {
                    "texels, in memory"
                } else {
                    "texels, in memory; none on emitters: nothing is baked"
                },
                "no material and no light uses one",
            )
            .taking(texels),
        Feature::new("texture coordinates", coordinates(scene))
            .with("in memory")
            .taking(coordinates(scene) * size_of::<Vec2>()),
        Feature::new("normal maps", needs.normal_maps),
        Feature::new("cut-out materials", needs.cutouts).with("rays ask at every hit on one"),
        Feature::new("glossy materials", needs.glossy)
            .with("their lobes are part of the importance"),
        Feature::new("clear coats", needs.coats)
            .with("the brighter peak, its or that of what is below, is part of the importance"),
        Feature::new("glass", needs.glass).used_by(
            needs.glass - needs.solid_glass,
            "thin; rays to lights pass it where it is smooth",
            "solid: rays to lights do not pass it",
        ),
        Feature::new("meshes shared by instances", needs.shared_meshes).used_by(
            kept_shared,
            "of those that are large, rays search one set of triangles in its own space",
            "small: rays search copies in world space",
        ),
        Feature::new("fog", needs.fog).with("every stretch of a path picks lights"),
    ]
}

fn motion(needs: &Requirements, emitters: &Emitters, frames: usize) -> Vec<Feature> {
    let changing = emitters.lights().iter().filter(|light| light.changes()).count();
    let each = size_of::<FrameRow>() + size_of::<[u8; 32]>();
    vec![
        Feature::new("animated nodes", needs.animated_nodes),
        Feature::new("deforming meshes", needs.deforming_meshes)
            .with("shaped and sorted for rays once a frame, or for each time of a shutter"),
        Feature::new("lights that vary", needs.varying_lights),
        Feature::new("lights that move, vary or deform", changing)
            .with("rows of frames, in the tree file, beside a tree for each that is unlike the others")
            .taking(frames * each),
    ]
}

/// How many texture coordinates its meshes have.
fn coordinates(scene: &Scene) -> usize {
    scene.meshes.iter().flat_map(|mesh| &mesh.uv_sets).map(Vec::len).sum()
}
