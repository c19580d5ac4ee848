//! The job of `candelabra learn`: a scene and its tree in, a table of what is seen out.

use super::learned::{LearnedError, open_learned, view_key};
use super::read::read_scene;
use super::{
    ASPECT, Event, ReadError, StageOptions, Strict, TreeChoice, TreeError, View, ViewError, Watch,
    frames_of, look, option, with_trees,
};
use crate::learn::{LearnOptions, Lesson, learn};
use crate::light_tree::NoSuchFrame;
use crate::light_tree::learned::LearnedFile;
use crate::render::frames::Frames;
use crate::render::{RenderDelegate, RenderSettings};
use crate::store::{StoreError, check_writable, folder_of, sweep, write_atomically};
use serde_json::json;
use std::io::Write;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// The most frames that are looked at.
const FRAMES: usize = 8;
/// Rows of the picture whose pixels paths go through.
const HEIGHT: u32 = 720;

/// What to learn.
#[derive(Clone, Debug, Default)]
pub struct LearnJob {
    /// The scene: `.gltf`, `.glb` or `.obj`, or a USD stage.
    pub scene: PathBuf,
    /// What of a USD stage is meant.
    pub stage: StageOptions,
    /// Its light tree; without one, trees are built in memory.
    pub tree: Option<PathBuf>,
    /// The frames that will be rendered; the scene's own if not given. A few of them are looked at.
    pub frames: Option<Frames>,
    /// What to look through.
    pub view: View,
    /// The table to write.
    pub output: PathBuf,
    /// Rays to lights.
    pub rays: u64,
    /// Paths at and below which lights are forced.
    pub force_lights: Vec<String>,
    /// The notes that are errors.
    pub strict: Option<Strict>,
}

/// What was learned.
#[derive(Clone, Copy, Debug)]
pub struct LearnReport {
    /// Frames that were looked at.
    pub frames: usize,
    /// Rays to lights.
    pub rays: u64,
    /// The share of a render's picks that would not have arrived.
    pub hidden: f64,
    /// Cells of the table; none if nothing is hidden.
    pub cells: usize,
    /// Length of the file.
    pub bytes: usize,
    /// The time that learning took.
    pub learning: Duration,
}

/// Why nothing was learned.
#[derive(Debug, thiserror::Error)]
pub enum LearnError {
    /// There is no scene.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// There is no camera to look through.
    #[error(transparent)]
    View(#[from] ViewError),
    /// The tree file cannot be used, or none can be built.
    #[error(transparent)]
    Tree(#[from] TreeError),
    /// The tree lacks a frame.
    #[error(transparent)]
    NoSuchFrame(#[from] NoSuchFrame),
    /// A file that is no table is where it should be written.
    #[error("{}: exists and is no table of what is seen; choose another output, or remove it", .0.display())]
    InTheWay(PathBuf),
    /// The table cannot be written.
    #[error(transparent)]
    Unwritable(#[from] std::io::Error),
    /// What was learned breaks the format.
    #[error("what was learned cannot be written: {0}; please report this")]
    Unsound(StoreError),
    /// The job was to stop.
    #[error("stopped; nothing was written")]
    Stopped,
}

impl LearnError {
    /// Whether the options are at fault, whatever is in the scene.
    pub fn is_usage(&self) -> bool {
        matches!(self, LearnError::Read(error) if error.is_usage())
    }
}

impl LearnJob {
    /// Rays that pay for themselves in one frame of final quality.
    pub const RAYS: u64 = 1 << 22;

    /// Learns, and writes the table.
    ///
    /// # Errors
    /// If the scene, its tree or the output cannot be used, or the job is stopped.
    pub fn run(&self, watch: &dyn Watch) -> Result<LearnReport, LearnError> {
        sweep(folder_of(&self.output));
        check_writable(&self.output)?;
        if let Err(LearnedError::NoTable(path)) = open_learned(&self.output, false) {
            return Err(LearnError::InTheWay(path));
        }
        let stage = |name: &str| watch.tell(Event::Stage { name: name.into() });
        stage("reading the scene");
        let (stage_options, strict) = (&self.stage, self.strict.as_ref());
        let read = read_scene(&self.scene, stage_options, strict, &self.force_lights, watch);
        let mut scene = read.map_err(|error| match error.is_stop() {
            true => LearnError::Stopped,
            false => error.into(),
        })?;
        let found = look(&mut scene, &self.view, ASPECT)?;
        found.note.into_iter().for_each(|text| watch.tell(Event::Note { text }));
        let camera = found.camera;
        let (width, height) = option::size_of(camera.aspect.unwrap_or(ASPECT), HEIGHT);
        let settings = RenderSettings { width, height, ..RenderSettings::default() };
        let all = self.frames.as_ref().map_or(frames_of(&scene), |f| f.as_slice().to_vec());
        let frames = spread(&all);
        stage("looking at the light tree");
        let choice =
            TreeChoice { file: self.tree.clone(), forced: self.force_lights.clone(), verify: true };
        let (lesson, learning) = with_trees(&scene, &choice, &|_, _| (), |emitters, mut trees| {
            stage("preparing rays");
            let delegate = RenderDelegate::new(&scene, emitters, camera.clone(), settings);
            stage("learning what is seen");
            let started = Instant::now();
            let lesson = learn::<LearnError>(
                &delegate,
                &frames,
                |frame, work| Ok(work(&trees.for_frame(frame)?)?),
                &LearnOptions::of_rays(self.rays),
                &mut |done| {
                    watch.tell(Event::Progress { done, frame: None });
                    !watch.is_stopped()
                },
            )?;
            trees.check_unwritten()?;
            Ok::<_, LearnError>((lesson.ok_or(LearnError::Stopped)?, started.elapsed()))
        })?;
        let Lesson { table, rays, hidden } = lesson;
        let meta = json!({
            "program": concat!("candelabra ", env!("CARGO_PKG_VERSION")),
            "frames": frames, "rays": rays, "hidden": (hidden * 1e4).round() / 1e4,
        });
        let bytes = table.to_bytes(view_key(&scene, &camera), &meta.to_string());
        let sound = LearnedFile::open(bytes).and_then(|file| file.verify().map(|()| file));
        let file = sound.map_err(LearnError::Unsound)?;
        write_atomically(&self.output, |out| out.write_all(file.data().as_ref()))?;
        let cells = file.view().map_or(0, |learned| learned.cells.count());
        let bytes = file.byte_length();
        Ok(LearnReport { frames: frames.len(), rays, hidden, cells, bytes, learning })
    }
}

/// A few of some frames, evenly spread; both ends among them.
fn spread(frames: &[i32]) -> Vec<i32> {
    let count = frames.len().min(FRAMES);
    let at = |i: usize| frames[i * (frames.len() - 1) / count.saturating_sub(1).max(1)];
    (0..count).map(at).collect()
}
