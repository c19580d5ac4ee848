//! Rendering a shot: read once, checked before the first frame, then frame after frame.
//!
//! ```text
//! read the scene -> find the camera -> open and check the tree, or build it
//!   for each frame:  there already, of the same?  can it be written?  render  -> hand over
//!                                                            beside it: encode, write, rename
//! ```
//!
//! What cannot work is found before the first frame is rendered. A frame that fails does not stop the
//! others. The picture of a frame depends on the job and on that frame alone, not on which other frames this
//! process renders, nor on how often it was stopped before.

mod clock;
mod error;
mod exposure;
mod outputs;
mod pass;
mod report;
mod shot;
mod writer;

pub use error::RenderError;
pub use report::{FrameCounts, RenderReport, SceneCounts, Seconds};

use super::{
    Event, OpenedTree, PreviewStamp, Stamp, Strict, TreeError, View, Watch, build_tree,
    check_fresh, collect_emitters, open_tree, survey,
};
use crate::emitter::Emitters;
use crate::light_tree::LightTree;
use crate::render::RenderSettings;
use crate::render::frame_names::FrameNames;
use crate::render::frames::Frames;
use crate::scene::Medium;
use crate::store::AlignedBytes;
use clock::Clock;
use outputs::Outputs;
use pass::Pass;
use shot::Shot;
use std::path::PathBuf;
use writer::{Writer, Writing};

/// A shot to be rendered.
#[derive(Clone, Debug)]
pub struct RenderJob {
    /// The scene: `.gltf`, `.glb` or `.obj`.
    pub scene: PathBuf,
    /// Its light tree; without one, trees are built in memory.
    pub tree: Option<PathBuf>,
    /// Which frames; the first of the scene if not given.
    pub frames: Option<Frames>,
    /// The names of the pictures.
    pub output: FrameNames,
    /// What to look through.
    pub view: View,
    /// Columns and rows; if not given, [`HEIGHT`](Self::HEIGHT) rows in the camera's shape.
    pub size: Option<(u32, u32)>,
    /// The other knobs. Their size is not used.
    pub settings: RenderSettings,
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
        let shot = Shot::read(self, watch)?;
        if self.frames.is_none() {
            outputs.check(&shot.frames, self.resume)?;
        }
        outputs.refuse_inputs(&shot.scene, self.tree.as_deref(), &shot.frames)?;
        outputs.sweep(&shot.frames);
        clock.lap(|seconds| &mut seconds.scene);

        tell_stage(watch, "looking at the light tree");
        let (emitters, trees) = self.trees(&shot, watch)?;
        let tree = trees.by_reference();
        clock.lap(|seconds| &mut seconds.trees);

        let writing = Writing { outputs: &outputs, job: self, watch };
        let (frames, writing) = std::thread::scope(|scope| {
            let writer = Writer::start(scope, writing);
            let source = (&emitters, &tree);
            let pass = Pass::new(self, &shot, source, &outputs, watch, &mut clock);
            let frames = pass.map(|mut pass| pass.render_all(&writer));
            let written = writer.finish();
            let mut frames = frames?;
            frames.done += written.frames.done;
            frames.failed += written.frames.failed;
            Ok::<_, RenderError>((frames, written.seconds))
        })?;
        clock.lap(|seconds| &mut seconds.waiting);
        let seconds = Seconds { writing, ..clock.finish() };
        let missing = frames.asked - frames.done - frames.up_to_date - frames.failed;
        Ok(RenderReport { frames, seconds, stopped: missing > 0, ..RenderReport::default() })
    }

    /// The stamp of the preview of a picture.
    fn preview_stamp(&self, picture: &Stamp) -> PreviewStamp {
        PreviewStamp::new(picture, self.preview.and_then(|preview| preview.exposure))
    }

    /// The emitters and the trees.
    fn trees(&self, shot: &Shot, watch: &dyn Watch) -> Result<(Emitters, Trees), RenderError> {
        let tree = match &self.tree {
            Some(path) => Some((path, open_tree(path, self.verify)?)),
            None => None,
        };
        let progress = |done: u64, all: u64| {
            let done = done as f64 / all.max(1) as f64;
            watch.tell(Event::Stage {
                name: format!("integrating textures, {:.0} %", done * 100.0),
            });
        };
        let scene = &shot.scene;
        let emitters = collect_emitters(scene, tree.as_ref().map(|(_, tree)| tree), &progress);
        let trees = match tree {
            Some((path, tree)) => {
                check_fresh(&tree, path, scene, &emitters, &self.force_lights, self.verify)?;
                Trees::File(tree)
            }
            None => {
                let mut ascending = shot.frames.as_slice().to_vec();
                ascending.sort_unstable();
                let survey = survey(scene, &emitters, &ascending).map_err(TreeError::from)?;
                Trees::Memory(LightTree::open(build_tree(&survey))?)
            }
        };
        Ok((emitters, trees))
    }
}

enum Trees {
    File(OpenedTree),
    Memory(LightTree<AlignedBytes>),
}

impl Trees {
    fn by_reference(&self) -> LightTree<&[u8]> {
        match self {
            Trees::File(tree) => tree.by_reference(),
            Trees::Memory(tree) => tree.by_reference(),
        }
    }
}

fn tell_stage(watch: &dyn Watch, name: &str) {
    watch.tell(Event::Stage { name: name.into() });
}
