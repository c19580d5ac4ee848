//! The job of `candelabra learn`: a scene and its tree in, a table of what is seen out.

use super::fresh::build_options;
use super::learn_budget::{Budget, Trials};
use super::learned::{LearnedError, open_learned};
use super::read::read_scene;
use super::{
    ASPECT, Event, ReadError, StageOptions, Strict, TreeChoice, TreeError, View, ViewError, Watch,
    frames_of, look, option, view_keys, with_trees,
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
    /// How much to learn.
    pub budget: Budget,
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
    /// Rays to lights that were asked for, or that the time allowed: the same number gives the same table.
    pub budget: u64,
    /// Rays to lights that were counted.
    pub rays: u64,
    /// The share of a render's picks that would not have arrived.
    pub hidden: f64,
    /// Cells of the table; none if nothing is hidden.
    pub cells: usize,
    /// Length of the file.
    pub bytes: usize,
    /// The time that learning took, without what was learned to know how long it takes.
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
    /// Learns, and writes the table.
    ///
    /// # Errors
    /// If the scene, its tree or the output cannot be used, or the job is stopped.
    pub fn run(&self, watch: &dyn Watch) -> Result<LearnReport, LearnError> {
        let started = Instant::now();
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
        let choice = TreeChoice {
            file: self.tree.clone(),
            options: build_options(&self.force_lights, &self.stage),
            verify: true,
        };
        let (lesson, budget, learning) =
            with_trees(&scene, &choice, &|_, _| (), |emitters, mut trees| {
                stage("preparing rays");
                let delegate = RenderDelegate::new(&scene, emitters, camera.clone(), settings);
                let mut lesson = |rays: u64, tell: &dyn Fn(f64)| {
                    let started = Instant::now();
                    let lesson = learn::<LearnError>(
                        &delegate,
                        &frames,
                        |frame, work| Ok(work(&trees.for_frame(frame)?)?),
                        &LearnOptions::of_rays(rays),
                        &mut |done| {
                            tell(done);
                            !watch.is_stopped()
                        },
                    )?;
                    Ok::<_, LearnError>((lesson.ok_or(LearnError::Stopped)?, started.elapsed()))
                };
                let rays = match self.budget {
                    Budget::Rays(rays) => rays,
                    Budget::Seconds(seconds) => {
                        stage("finding out how long rays take");
                        let left = || seconds - started.elapsed().as_secs_f64();
                        let mut trials = Trials::default();
                        while let Some(rays) = trials.next(left()) {
                            let (lesson, took) = lesson(rays, &|_| ())?;
                            let is_whole = lesson.table.view().is_some();
                            trials
                                .add(if is_whole { rays } else { lesson.rays }, took.as_secs_f64());
                        }
                        trials.fitting(left())
                    }
                };
                stage("learning what is seen");
                let tell = |done| watch.tell(Event::Progress { done, frame: None });
                let (lesson, learning) = lesson(rays, &tell)?;
                trees.check_unwritten()?;
                Ok::<_, LearnError>((lesson, rays, learning))
            })?;
        let Lesson { table, rays, hidden } = lesson;
        let meta = json!({
            "program": concat!("candelabra ", env!("CARGO_PKG_VERSION")),
            "frames": frames, "budget": budget, "rays": rays, "hidden": (hidden * 1e4).round() / 1e4,
        });
        let bytes = table.to_bytes(view_keys(&scene, &camera), &meta.to_string());
        let sound = LearnedFile::open(bytes).and_then(|file| file.verify().map(|()| file));
        let file = sound.map_err(LearnError::Unsound)?;
        write_atomically(&self.output, |out| out.write_all(file.data().as_ref()))?;
        let cells = file.view().map_or(0, |learned| learned.cells.count());
        let bytes = file.byte_length();
        let frames = frames.len();
        Ok(LearnReport { frames, budget, rays, hidden, cells, bytes, learning })
    }
}

/// A few of some frames, evenly spread; both ends among them.
fn spread(frames: &[i32]) -> Vec<i32> {
    let count = frames.len().min(FRAMES);
    let at = |i: usize| frames[i * (frames.len() - 1) / count.saturating_sub(1).max(1)];
    (0..count).map(at).collect()
}
