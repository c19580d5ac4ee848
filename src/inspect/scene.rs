//! What is in a scene.

use super::VERSION;
use super::features::{Feature, features};
use super::report::FrameSpan;
use crate::emitter::{Emitters, infinite_lights};
use crate::pipeline;
use crate::render::LightGroups;
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
    /// How many it has of each feature.
    pub requires: Requirements,
    /// Every feature: whether that switches it on, and what it costs.
    pub features: Vec<Feature>,
    /// Its light groups, by name; none if it puts no light in one.
    pub light_groups: Vec<LightGroupReport>,
    /// What was left out, mended or approximated, by category.
    pub notes: Vec<Note>,
}

/// A light group.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct LightGroupReport {
    /// Its name.
    pub name: String,
    /// How many lights are in it.
    pub lights: usize,
}

impl LightGroupReport {
    /// The groups that a scene gives its lights. None, too, if they are more than are written.
    fn all(scene: &Scene, emitters: &Emitters) -> Vec<LightGroupReport> {
        if scene.light_groups.is_empty() {
            return Vec::new();
        }
        let Ok(groups) = LightGroups::new(scene, emitters, &[]) else { return Vec::new() };
        let named = groups.names().iter().cloned();
        let mut reports: Vec<_> = named.map(|name| LightGroupReport { name, lights: 0 }).collect();
        for light in emitters.lights() {
            reports[groups.of_emitter(emitters, light.first)].lights += 1;
        }
        for light in infinite_lights(scene, &scene.pose_at(0.0)) {
            reports[groups.of_infinite(&light)].lights += 1;
        }
        reports
    }
}

/// A camera.
#[derive(Clone, Debug, Serialize)]
pub struct CameraReport {
    /// Its prim path.
    pub path: String,
    /// The vertical field of view of a perspective camera, degrees; that of the first frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height_deg: Option<f32>,
    /// What an orthographic camera sees from bottom to top, metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height_m: Option<f32>,
    /// The same at the last frame, if it differs from that of the first: degrees or metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub last_height: Option<f32>,
    /// Whether its lens, exposure or clipping planes vary with time.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub lens_varies: bool,
    /// Whether the file hides it.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub hidden: bool,
}

impl CameraReport {
    fn of(scene: &Scene, camera: &Camera, frames: &[i32]) -> CameraReport {
        let height = |frame: i32| match scene.camera_at(camera, frame.into()).projection {
            Projection::Perspective { yfov_rad } => yfov_rad.to_degrees(),
            Projection::Orthographic { height_m } => height_m,
        };
        let (first, last) = (height(frames[0]), height(frames[frames.len() - 1]));
        let is_parallel = matches!(camera.projection, Projection::Orthographic { .. });
        CameraReport {
            path: scene.nodes[camera.node as usize].path.to_string(),
            height_deg: (!is_parallel).then_some(first),
            height_m: is_parallel.then_some(first),
            last_height: (last != first).then_some(last),
            lens_varies: camera.over_time.is_some(),
            hidden: camera.is_hidden,
        }
    }
}

impl SceneReport {
    /// Looks at a scene and its emitters.
    pub fn of(scene: &Scene, emitters: &Emitters) -> SceneReport {
        let triangles_of = |mesh: u32| scene.meshes[mesh as usize].triangles.len();
        let frames = pipeline::frames_of(scene);
        let light_groups = LightGroupReport::all(scene, emitters);
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
            cameras: scene.cameras.iter().map(|c| CameraReport::of(scene, c, &frames)).collect(),
            frames: match frames.as_slice() {
                &[first, .., last] => Some(FrameSpan { first, last, count: frames.len() }),
                _ => None,
            },
            frames_per_second: scene.timeline.frames_per_second,
            lights: emitters.lights().len(),
            emitters: emitters.len(),
            changing: emitters.changing_count(),
            requires: scene.requirements(),
            features: features(scene, emitters, frames.len(), light_groups.len()),
            light_groups,
            notes: scene.notes.clone(),
        }
    }
}
