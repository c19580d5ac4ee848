//! Rendering a shot: read once, checked before the first frame, then frame after frame.
//!
//! ```text
//! read the scene -> find the camera -> open and check the tree, or build it
//!   for each frame:  there already, of the same?  can it be written?  render  -> hand over
//!                                                            beside it: encode, write, rename
//! ```
//!
//! What cannot work is found before a frame is rendered. A frame that fails does not stop the
//! others. The picture of a frame depends on the job and on that frame alone, not on which other frames this
//! process renders, nor on how often it was stopped before.

mod checkpoint;
mod clock;
mod control;
mod effort;
mod error;
mod frame_noise;
mod outputs;
mod pass;
mod plan;
mod progress;
mod report;
mod shot;
mod writer;

pub use effort::{Effort, Quality};
pub use error::RenderError;
pub use frame_noise::{Audit, FrameNoise};
pub use plan::Plan;
pub use report::{FrameCounts, RenderReport, SceneCounts, Seconds};

use super::fresh::build_options;
use super::{
    Event, PreviewStamp, StageOptions, Stamp, Strict, TreeChoice, View, Watch, open_learned,
    with_trees,
};
use crate::render::RenderSettings;
use crate::render::frame_names::FrameNames;
use crate::render::frames::Frames;
use crate::scene::Medium;
use clock::Clock;
use outputs::Outputs;
use pass::Pass;
use shot::Shot;
use std::path::PathBuf;
use std::sync::atomic::AtomicU64;
use writer::{Writer, Writing};

/// A shot to be rendered.
#[derive(Clone, Debug)]
pub struct RenderJob {
    /// The scene: `.gltf`, `.glb` or `.obj`, or a USD stage.
    pub scene: PathBuf,
    /// What of a USD stage is meant.
    pub stage: StageOptions,
    /// Its light tree; without one, trees are built in memory.
    pub tree: Option<PathBuf>,
    /// A table of what is hidden from where, if there is one.
    pub learned: Option<PathBuf>,
    /// Which frames; the first of the scene if not given.
    pub frames: Option<Frames>,
    /// The names of the pictures.
    pub output: FrameNames,
    /// What to look through.
    pub view: View,
    /// Columns and rows; if not given, [`HEIGHT`](Self::HEIGHT) rows in the camera's shape.
    pub size: Option<(u32, u32)>,
    /// The other knobs. Their size and number of samples are not used.
    pub settings: RenderSettings,
    /// How much work goes into each frame.
    pub effort: Effort,
    /// Render so many pixels of each frame again, with more samples, to see how far off it is.
    pub audit: Option<u32>,
    /// Keep frames in the making on the disk, and go on with those that are there.
    pub checkpoint: bool,
    /// Fog in the place of the scene's own.
    pub fog: Option<Medium>,
    /// Paths of lights to be forced, beside those that the scene forces.
    pub force_lights: Vec<String>,
    /// Previews beside the pictures, if any.
    pub preview: Option<Preview>,
    /// Keep pictures that are there, whole, and of the same.
    pub resume: bool,
    /// Prove that the tree file is sound before it is used.
    pub verify: bool,
    /// Notes about the scene that are errors.
    pub strict: Option<Strict>,
}

/// How a preview is exposed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Preview {
    /// In stops; if not given, one for the whole shot is chosen from the scene's first frame.
    pub exposure: Option<f32>,
}

impl RenderJob {
    /// Rows of a picture whose size is not given.
    pub const HEIGHT: u32 = 720;

    /// Renders the frames. Those that fail are told, and counted in the report.
    ///
    /// # Errors
    /// If nothing can be rendered at all.
    pub fn run(&self, watch: &dyn Watch) -> Result<RenderReport, RenderError> {
        let mut clock = Clock::start();
        let outputs = Outputs::new(&self.output, self.preview.is_some());
        if let Some(frames) = &self.frames {
            outputs.check(frames, self.resume)?;
        }
        tell_stage(watch, "reading the scene");
        let shot = match Shot::read(self, watch) {
            Err(RenderError::Read(error)) if error.is_stop() => None,
            shot => Some(shot?),
        };
        let asked = shot.as_ref().map(|shot| &shot.frames).or(self.frames.as_ref());
        let asked = asked.map_or(1, |frames| frames.as_slice().len());
        let Some(shot) = shot.filter(|_| !watch.is_stopped()) else {
            let frames = FrameCounts { asked, ..FrameCounts::default() };
            let seconds = clock.finish();
            return Ok(RenderReport { frames, seconds, stopped: true, ..RenderReport::default() });
        };
        if self.frames.is_none() {
            outputs.check(&shot.frames, self.resume)?;
        }
        let files = [self.tree.as_deref(), self.learned.as_deref()];
        outputs.refuse_inputs(&shot.scene, files.into_iter().flatten(), &shot.frames)?;
        outputs.sweep(&shot.frames);
        clock.lap(|seconds| &mut seconds.scene);

        let learned = self.learned.as_deref().map(|path| open_learned(path, self.verify));
        let learned = learned.transpose()?;
        tell_stage(watch, "looking at the light tree");
        let choice = TreeChoice {
            file: self.tree.clone(),
            options: build_options(&self.force_lights, &self.stage),
            verify: self.verify,
        };
        let textures = |done: u64, all: u64| {
            let percent = 100 * done / all.max(1);
            tell_stage(watch, &format!("integrating textures, {percent} %"));
        };
        let (frames, written, scene) =
            with_trees(&shot.scene, &choice, &textures, |emitters, trees| {
                clock.lap(|seconds| &mut seconds.trees);
                let counts = shot.count(emitters, &trees);
                let nanoseconds = AtomicU64::new(0);
                let writing =
                    Writing { job: self, outputs: &outputs, watch, nanoseconds: &nanoseconds };
                let (frames, written) = std::thread::scope(|scope| {
                    let writer = Writer::start(scope, writing);
                    let inputs = (emitters, trees, learned.as_ref());
                    let pass = Pass::new(self, &shot, inputs, &outputs, watch, &mut clock);
                    let frames = pass.and_then(|mut pass| pass.render_all(&writer));
                    (frames, writer.finish())
                });
                Ok::<_, RenderError>((frames?, written, counts))
            })?;
        clock.lap(|seconds| &mut seconds.waiting);
        let frames = FrameCounts {
            done: written.frames.done,
            failed: frames.failed + written.frames.failed,
            ..frames
        };
        Ok(RenderReport {
            stopped: frames.asked > frames.done + frames.up_to_date + frames.failed,
            frames,
            seconds: Seconds { writing: written.seconds, ..clock.finish() },
            rays: written.trace.rays,
            light_picks: written.trace.light_picks,
            non_finite_samples: written.non_finite,
            scene,
        })
    }

    /// The stamp of the preview of a picture.
    fn preview_stamp(&self, picture: &Stamp) -> PreviewStamp {
        PreviewStamp::new(picture, self.preview.and_then(|preview| preview.exposure))
    }
}

fn tell_stage(watch: &dyn Watch, name: &str) {
    watch.tell(Event::Stage { name: name.into() });
}
