//! The job of `candelabra build`: a scene in, a tree file out.
//!
//! What is up to date is left alone; what has not changed is taken over from an earlier file. Only a tree that
//! keeps every rule of the format replaces the file before it. In the end the job measures what the file
//! saves: it prepares one frame with the file and one without, by the calls that a render makes.

use super::agreement::{Standing, standing};
use super::build::{Rebuilt, build_tree, rebuild_tree};
use super::fresh::{OpenedTree, TreeError, build_options, check_output, open_base};
use super::read::read_scene;
use super::{
    Event, ReadError, ShotTrees, StageOptions, Strict, Survey, SurveyError, TreeChoice, Watch,
    collect_emitters, frames_of, survey, with_trees,
};
use crate::emitter::Emitters;
use crate::light_tree::LightTree;
use crate::render::frames::Frames;
use crate::scene::Scene;
use crate::store::{AlignedBytes, StoreError, check_writable, folder_of, sweep, write_atomically};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// What to build.
#[derive(Clone, Debug, Default)]
pub struct BuildJob {
    /// The scene: `.gltf`, `.glb` or `.obj`, or a USD stage.
    pub scene: PathBuf,
    /// What of a USD stage is meant.
    pub stage: StageOptions,
    /// The tree file to write; the scene's name with `.ltree` if not given.
    pub output: Option<PathBuf>,
    /// Frames to build for, if lights change; the scene's own if not given.
    pub frames: Option<Frames>,
    /// Paths at and below which lights are forced.
    pub force_light: Vec<String>,
    /// A file to build upon; the output as it is if not given.
    pub base: Option<PathBuf>,
    /// Build even what is up to date, and all of it.
    pub force: bool,
    /// The notes that are errors.
    pub strict: Option<Strict>,
}

/// What was done.
#[derive(Clone, Debug)]
pub struct BuildReport {
    /// The tree file.
    pub output: PathBuf,
    /// How many lights the scene has.
    pub lights: usize,
    /// How many emitters they have.
    pub emitters: usize,
    /// How many emitters change with time.
    pub changing: usize,
    /// The time that reading the scene took.
    pub reading: Duration,
    /// What was built; `None` if the output was up to date.
    pub built: Option<Built>,
}

/// A tree file that was built.
#[derive(Clone, Debug)]
pub struct Built {
    /// What was taken over from an earlier file.
    pub taken_over: Option<TakenOver>,
    /// Length of the file, bytes.
    pub bytes: usize,
    /// The time that finding the emitters took.
    pub collecting: Duration,
    /// The time that surveying them took.
    pub surveying: Duration,
    /// The time that building took.
    pub building: Duration,
    /// The time that verifying and writing took.
    pub writing: Duration,
    /// What the file saves; `None` if only part of it was built, or if it has gone since.
    pub break_even: Option<BreakEven>,
}

/// What was taken over from an earlier file.
#[derive(Clone, Debug)]
pub struct TakenOver {
    /// The file.
    pub base: PathBuf,
    /// How many leaves it gave.
    pub reused: usize,
    /// How many leaves the new file has.
    pub leaves: usize,
    /// The time that opening and verifying it took.
    pub opening: Duration,
}

/// What a tree file costs, and what it saves a process before its first frame.
#[derive(Clone, Copy, Debug)]
pub struct BreakEven {
    /// The time of the whole job.
    pub made: Duration,
    /// The time that a process spends on lights without the file.
    pub without: Duration,
    /// The time that a process spends on lights with the file.
    pub with: Duration,
}

impl BreakEven {
    /// With which process the file has paid for itself; `None` if it saves no time.
    pub fn processes(&self) -> Option<u64> {
        let saved = self.without.checked_sub(self.with).filter(|saved| !saved.is_zero())?;
        Some((self.made.as_secs_f64() / saved.as_secs_f64()).ceil().max(1.0) as u64)
    }
}

/// Why nothing was built.
#[derive(Debug, thiserror::Error)]
pub enum BuildError {
    /// There is no scene to build for.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// It has lights that no tree can hold.
    #[error("{}: {cause}", scene.display())]
    Survey {
        /// The scene's file.
        scene: PathBuf,
        /// Which, and why.
        cause: SurveyError,
    },
    /// The output is a file that the scene was read from.
    #[error("{}: is the scene's own file; choose another output", output.display())]
    OwnFile {
        /// The file.
        output: PathBuf,
    },
    /// The output is no tree file.
    #[error(transparent)]
    Output(#[from] TreeError),
    /// What was built breaks a rule: a scene that is too large for the format, or a fault of ours.
    #[error("{}: not written: {cause}", output.display())]
    Unsound {
        /// The file.
        output: PathBuf,
        /// The rule.
        cause: StoreError,
    },
    /// The output cannot be written.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// Whoever watches wants no more.
    #[error("stopped; nothing was written")]
    Stopped,
}

impl BuildError {
    /// Whether the options are at fault, whatever is in the scene.
    pub fn is_usage(&self) -> bool {
        matches!(self, BuildError::Read(error) if error.is_usage())
    }
}

/// An earlier tree file, opened.
struct Base {
    path: PathBuf,
    tree: OpenedTree,
    opening: Duration,
}

/// A scene with its emitters.
struct Lit {
    scene: Scene,
    emitters: Emitters,
    collecting: Duration,
}

impl BuildJob {
    /// The file that is written.
    pub fn output(&self) -> PathBuf {
        self.output.clone().unwrap_or_else(|| self.scene.with_extension("ltree"))
    }

    /// Builds.
    ///
    /// # Errors
    /// If the scene or the output does not permit it, or if the watch stops the job.
    pub fn run(&self, watch: &dyn Watch) -> Result<BuildReport, BuildError> {
        let started = Instant::now();
        let output = self.output();
        // An output that is there may be up to date, and need no writing.
        if !output.is_file() {
            check_writable(&output)?;
        }
        stage(watch, "reading the scene")?;
        // While the scene is read, the output as it is and the base are verified.
        let (loaded, (before, base)) =
            rayon::join(|| timed(|| self.load(&output, watch)), || self.open_bases(&output));
        let (scene, reading) = (loaded.0?, loaded.1);
        stage(watch, "finding the emitters")?;
        let (emitters, collecting) = timed(|| {
            collect_emitters(&scene, None::<&OpenedTree>, &|done, all| {
                let done = done as f64 / all.max(1) as f64;
                watch.tell(Event::Progress { done, frame: None });
            })
        });
        let lit = Lit { scene, emitters, collecting };
        stage(watch, "surveying the lights")?;
        let (survey, surveying) = timed(|| self.survey(&lit));
        let survey = survey?;
        let mut report = BuildReport {
            lights: survey.lights.len(),
            emitters: lit.emitters.len(),
            changing: lit.emitters.changing_count(),
            reading,
            built: None,
            output,
        };
        // What somebody has written to since it was verified is not what was verified.
        let before = before.filter(|before| before.tree.data().is_unchanged());
        let before = match before.map(|before| (standing(&before.tree, &survey), before)) {
            Some((Standing::UpToDate, _)) => {
                let output = report.output.clone();
                watch.tell(Event::UpToDate { frame: None, output });
                return Ok(report);
            }
            Some((Standing::Contradicts(what), before)) => {
                let path = before.path.display();
                let text =
                    format!("{path}: contradicts the scene: {what}; built from the scene alone");
                watch.tell(Event::Note { text });
                None
            }
            Some((Standing::OutOfDate, before)) => Some(before),
            None => None,
        };
        check_writable(&report.output)?;
        sweep(folder_of(&report.output));
        let base = match base {
            None => before,
            Some(Ok(base)) => Some(base),
            Some(Err(error)) => {
                watch.tell(Event::Note { text: format!("not built upon {error}") });
                None
            }
        };
        stage(watch, "building the trees")?;
        let ((bytes, taken_over), building) = timed(|| build(&survey, base, watch));
        stage(watch, "writing")?;
        let (written, writing) = timed(|| write(&report.output, bytes));
        let is_partial = taken_over.as_ref().is_some_and(|base| base.reused > 0);
        let mut built = Built {
            taken_over,
            bytes: written?,
            collecting,
            surveying,
            building,
            writing,
            break_even: None,
        };
        let first = survey.frames.first().map_or(0, |frame| frame.number);
        drop(survey);
        if !is_partial && !watch.is_stopped() {
            let made = started.elapsed();
            // Somebody else may have written another tree there since.
            built.break_even = self.break_even(&lit, &report.output, first, made).ok();
        }
        report.built = Some(built);
        Ok(report)
    }

    /// Reads the scene, and sees whether it can be built there.
    fn load(&self, output: &Path, watch: &dyn Watch) -> Result<Scene, BuildError> {
        let read =
            read_scene(&self.scene, &self.stage, self.strict.as_ref(), &self.force_light, watch);
        let scene = read.map_err(|error| match error.is_stop() {
            true => BuildError::Stopped,
            false => error.into(),
        })?;
        let real = |path: &Path| path.canonicalize().ok();
        let is_output = |input: &Path| real(input).is_some() && real(input) == real(output);
        if scene.files.iter().any(|file| is_output(&file.path)) {
            return Err(BuildError::OwnFile { output: output.into() });
        }
        check_output(output)?;
        Ok(scene)
    }

    /// The output as it is, and the base that the user names.
    fn open_bases(&self, output: &Path) -> (Option<Base>, Option<Result<Base, TreeError>>) {
        let open = |path: &Path| {
            let (tree, opening) = timed(|| open_base(path));
            Ok(Base { path: path.into(), tree: tree?, opening })
        };
        let before = if self.force { None } else { open(output).ok() };
        (before, self.base.as_deref().map(open))
    }

    fn survey(&self, lit: &Lit) -> Result<Survey, BuildError> {
        let frames = match &self.frames {
            Some(frames) => {
                let mut frames = frames.as_slice().to_vec();
                frames.sort_unstable();
                frames
            }
            None => frames_of(&lit.scene),
        };
        survey(&lit.scene, &lit.emitters, &frames)
            .map_err(|cause| BuildError::Survey { scene: self.scene.clone(), cause })
    }

    /// Does what a process does before its first frame: without the file, and with it.
    fn break_even(
        &self,
        lit: &Lit,
        output: &Path,
        frame: i32,
        made: Duration,
    ) -> Result<BreakEven, TreeError> {
        let Lit { scene, emitters, collecting } = lit;
        let (built, building) =
            timed(|| ShotTrees::built(scene, emitters)?.for_frame(frame).map(drop));
        built?;
        let choice = TreeChoice {
            file: Some(output.into()),
            options: build_options(&self.force_light, &self.stage),
            verify: true,
        };
        let (checked, with) = timed(|| {
            with_trees(scene, &choice, &|_, _| {}, |_, mut trees| trees.for_frame(frame).map(drop))
        });
        checked?;
        Ok(BreakEven { made, without: *collecting + building, with })
    }
}

/// Tells that a stage begins, unless the job is to stop.
fn stage(watch: &dyn Watch, name: &str) -> Result<(), BuildError> {
    if watch.is_stopped() {
        return Err(BuildError::Stopped);
    }
    watch.tell(Event::Stage { name: name.into() });
    Ok(())
}

fn timed<T>(work: impl FnOnce() -> T) -> (T, Duration) {
    let started = Instant::now();
    let done = work();
    (done, started.elapsed())
}

/// The bytes of the file, and what of them was taken over from a base.
fn build(
    survey: &Survey,
    base: Option<Base>,
    watch: &dyn Watch,
) -> (AlignedBytes, Option<TakenOver>) {
    let Some(Base { path: base, tree, opening }) = base else {
        return (build_tree(survey), None);
    };
    let Rebuilt { bytes, reused, leaves, base_contradicts } = rebuild_tree(survey, &tree);
    if !tree.data().is_unchanged() {
        let base = base.display();
        let text = format!("not built upon {base}: it was written to meanwhile");
        watch.tell(Event::Note { text });
        return (build_tree(survey), None);
    }
    if base_contradicts {
        let base = base.display();
        let text = format!(
            "not built upon {base}: it contradicts the scene in lights that have not changed"
        );
        watch.tell(Event::Note { text });
        return (bytes, None);
    }
    (bytes, Some(TakenOver { base, reused, leaves, opening }))
}

/// Writes a tree and returns its length in bytes. Only a verified tree may replace the old file.
fn write(output: &Path, bytes: AlignedBytes) -> Result<usize, BuildError> {
    let sound = LightTree::open(bytes).and_then(|tree| tree.verify().map(|()| tree));
    let bytes =
        sound.map_err(|cause| BuildError::Unsound { output: output.into(), cause })?.into_bytes();
    write_atomically(output, |file| file.write_all(bytes.as_ref()))?;
    Ok(bytes.as_ref().len())
}
