//! What is in a scene, and what it requires.

use super::VERSION;
use super::report::FrameSpan;
use crate::emitter::Emitters;
use crate::pipeline;
use crate::scene::{Camera, Note, Projection, Requirements, Scene};
use serde::Serialize;

/// A scene.
#[derive(Clone, Debug, Serialize)]
pub struct SceneReport {
    /// `candelabra.scene`.
    pub schema: &'static str,
    /// [`VERSION`].
    pub version: u32,
    /// The file.
    pub file: String,
    /// Transforms.
    pub nodes: usize,
    /// Meshes, each stored once.
    pub meshes: usize,
    /// Their triangles.
    pub stored_triangles: usize,
    /// Meshes put somewhere.
    pub instances: usize,
    /// Their triangles.
    pub placed_triangles: usize,
    /// Materials.
    pub materials: usize,
    /// Cameras, in the order of their numbers.
    pub cameras: Vec<CameraReport>,
    /// The frames of its timeline, if it has more than one.
    pub frames: Option<FrameSpan>,
    /// How many of them make a second.
    pub frames_per_second: f64,
    /// Lights that have emitters.
    pub lights: usize,
    /// Their emitters.
    pub emitters: usize,
    /// Emitters of lights that change with time.
    pub changing: usize,
    /// The features that it switches on, with counts.
    pub requires: Requirements,
    /// What was left out, mended or approximated, by category.
    pub notes: Vec<Note>,
}

/// A camera.
#[derive(Clone, Debug, Serialize)]
pub struct CameraReport {
    /// Its prim path.
    pub path: String,
    /// The vertical field of view of a perspective camera, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height_deg: Option<f32>,
    /// What an orthographic camera sees from bottom to top, metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height_m: Option<f32>,
}

impl CameraReport {
    fn of(scene: &Scene, camera: &Camera) -> CameraReport {
        let (height_deg, height_m) = match camera.projection {
            Projection::Perspective { yfov_rad } => (Some(yfov_rad.to_degrees()), None),
            Projection::Orthographic { height_m } => (None, Some(height_m)),
        };
        CameraReport { path: scene.nodes[camera.node as usize].path.clone(), height_deg, height_m }
    }
}

impl SceneReport {
    /// Looks at a scene and its emitters.
    pub fn of(scene: &Scene, emitters: &Emitters) -> SceneReport {
        let triangles_of = |mesh: u32| scene.meshes[mesh as usize].triangles.len();
        let frames = pipeline::frames_of(scene);
        SceneReport {
            schema: "candelabra.scene",
            version: VERSION,
            file: scene.source.display().to_string(),
            nodes: scene.nodes.len(),
            meshes: scene.meshes.len(),
            stored_triangles: scene.meshes.iter().map(|mesh| mesh.triangles.len()).sum(),
            instances: scene.instances.len(),
            placed_triangles: scene.instances.iter().map(|i| triangles_of(i.mesh)).sum(),
            materials: scene.materials.len(),
            cameras: scene.cameras.iter().map(|c| CameraReport::of(scene, c)).collect(),
            frames: match frames.as_slice() {
                &[first, .., last] => Some(FrameSpan { first, last, count: frames.len() }),
                _ => None,
            },
            frames_per_second: scene.timeline.frames_per_second,
            lights: emitters.lights().len(),
            emitters: emitters.len(),
            changing: emitters.changing_count(),
            requires: scene.requirements(),
            notes: scene.notes.clone(),
        }
    }

    /// The features that it switches on, in words, with counts.
    pub fn features(&self) -> impl Iterator<Item = (usize, &'static str)> {
        let needs = &self.requires;
        let features = [
            (needs.mesh_lights, "mesh lights"),
            (needs.textured_mesh_lights, "textured mesh lights"),
            (needs.shaped_lights, "emission profiles"),
            (needs.varying_lights, "lights that vary"),
            (needs.spheres, "sphere lights"),
            (needs.points, "point lights"),
            (needs.spots, "spot lights"),
            (needs.suns, "suns"),
            (needs.domes, "domes"),
            (needs.shared_meshes, "meshes shared by instances"),
            (needs.animated_nodes, "animated nodes"),
            (needs.textures, "textures"),
            (needs.cutouts, "cut-out materials"),
            (needs.normal_maps, "normal maps"),
            (needs.fog, "fog"),
            (needs.lenses, "camera lenses"),
            (needs.orthographic_cameras, "orthographic cameras"),
        ];
        features.into_iter().filter(|(count, _)| *count > 0)
    }
}
