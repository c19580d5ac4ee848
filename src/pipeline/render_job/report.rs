//! What became of a shot, and where time and memory went.

use serde::Serialize;

/// What became of a shot.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct RenderReport {
    /// Frames by what became of them.
    pub frames: FrameCounts,
    /// Seconds of the job's own thread, by what it did; `writing` is another thread's, beside `rendering`.
    pub seconds: Seconds,
    /// Rays of all kinds.
    pub rays: u64,
    /// Lights picked.
    pub light_picks: u64,
    /// Samples left out of their pixels because their radiance was infinite or no number.
    pub non_finite_samples: u64,
    /// What was prepared.
    pub scene: SceneCounts,
    /// Whether the job was told to stop before all frames were done.
    pub stopped: bool,
}

/// Frames by what became of them.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct FrameCounts {
    /// Asked for.
    pub asked: usize,
    /// Rendered and written.
    pub done: usize,
    /// There already, of the same.
    pub up_to_date: usize,
    /// Could not be rendered or written.
    pub failed: usize,
}

/// Seconds by what was done in them.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Seconds {
    /// Reading the scene.
    pub scene: f64,
    /// Opening, checking or building the light trees.
    pub trees: f64,
    /// Preparing what rays hit.
    pub rays: f64,
    /// Looking for pictures that are there already.
    pub resume: f64,
    /// Looking at small pictures of the shot, for exposure and grey floor.
    pub ahead: f64,
    /// Rendering frames.
    pub rendering: f64,
    /// Rendering pixels again, to audit the error.
    pub audit: f64,
    /// Writing pictures and previews, while the next frame is rendered.
    pub writing: f64,
    /// Waiting for a picture to be written before the next can be handed over.
    pub waiting: f64,
    /// From the start of the job to its end.
    pub total: f64,
}

/// What a shot consists of.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct SceneCounts {
    /// Lights.
    pub lights: usize,
    /// Emitters that the tree is over.
    pub emitters: usize,
    /// Triangles of all instances.
    pub triangles: u64,
    /// Bytes of the tree file, if there is one.
    pub tree_file_bytes: Option<usize>,
}
