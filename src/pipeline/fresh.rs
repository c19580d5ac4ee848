//! Opening a tree file, and telling whether it still belongs to a scene.

use super::agreement::{Contradiction, find_contradiction};
use super::build::algorithm_of;
use super::frames::spell;
use super::{StageOptions, Survey, SurveyError, frames_of, survey};
use crate::emitter::{Emitters, LightOverflow};
use crate::light_tree::{ALGORITHM_VERSION, LightSummary, LightTree, NoSuchFrame, SameLinks};
use crate::scene::Scene;
use crate::store::{self, MappedFile, StoreError};
use std::collections::BTreeMap;
use std::fmt;
use std::io::Read;
use std::path::{Path, PathBuf};

/// A tree over a mapped file.
pub type OpenedTree = LightTree<MappedFile>;

/// Why a tree file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum TreeError {
    /// The file cannot be read.
    #[error("{}: {cause}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why not.
        cause: std::io::Error,
    },
    /// The file is not what the format says.
    #[error("{}: {cause}", path.display())]
    Broken {
        /// The file.
        path: PathBuf,
        /// The rule that is broken.
        cause: StoreError,
    },
    /// The scene has changed since.
    #[error("{}: {cause}", path.display())]
    Stale {
        /// The file.
        path: PathBuf,
        /// What changed.
        cause: StaleTree,
    },
    /// It differs from the scene although it has the scene's fingerprint.
    #[error(
        "{}: contradicts the scene: {cause}. It keeps the rules of the format, but was not built from the scene as it is. Build it again: {remedy}",
        path.display()
    )]
    Contradicts {
        /// The file.
        path: PathBuf,
        /// What it says.
        cause: Contradiction,
        /// The command that builds it again, as a shell takes it.
        remedy: String,
    },
    /// It was built for other frames.
    #[error("{}: {cause}", path.display())]
    NoSuchFrame {
        /// The file.
        path: PathBuf,
        /// The frames that it has.
        cause: NoSuchFrame,
    },
    /// Somebody wrote to the file while it was in use.
    #[error(
        "{}: was written to while it was in use, so what it says is not what was checked; publish a tree under another name and rename it over the old one, then render again with --resume",
        path.display()
    )]
    Overwritten {
        /// The file.
        path: PathBuf,
    },
    /// It was built by another version of the algorithm.
    #[error("{}: it was built by another version of the algorithm; build it again", path.display())]
    OtherAlgorithm {
        /// The file.
        path: PathBuf,
    },
    /// A file that is no tree file is where one should be written.
    #[error("{}: exists and is no tree file; choose another output, or remove it", path.display())]
    InTheWay {
        /// The file.
        path: PathBuf,
    },
    /// The scene has lights that no tree can hold.
    #[error(transparent)]
    Survey(#[from] SurveyError),
}

impl From<LightOverflow> for TreeError {
    fn from(overflow: LightOverflow) -> TreeError {
        TreeError::Survey(overflow.into())
    }
}

/// Whether a path is that of a tree file, by its extension.
pub fn is_tree_file(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ltree"))
}

/// Maps and opens a tree file; with `verify`, proves that it keeps the format's promises.
///
/// # Errors
/// If the file cannot be read or breaks a rule.
pub fn open_tree(path: &Path, verify: bool) -> Result<OpenedTree, TreeError> {
    let map = MappedFile::open(path).map_err(|cause| TreeError::Io { path: path.into(), cause })?;
    let broken = |cause| TreeError::Broken { path: path.into(), cause };
    let tree = LightTree::open(map).map_err(broken)?;
    if verify {
        tree.verify().map_err(broken)?;
    }
    Ok(tree)
}

/// Opens a tree file as the base of a build: one that is sound, and that this version of the
/// algorithm has built.
///
/// # Errors
/// If the file cannot be read, breaks a rule, or comes from another version.
pub fn open_base(path: &Path) -> Result<OpenedTree, TreeError> {
    let tree = open_tree(path, true)?;
    if algorithm_of(&tree) == Some(ALGORITHM_VERSION) {
        Ok(tree)
    } else {
        Err(TreeError::OtherAlgorithm { path: path.into() })
    }
}

/// Checks that a tree file may be written to a path: nothing is there, or nothing but a tree file or
/// an empty file.
///
/// # Errors
/// If something else is there.
pub fn check_output(path: &Path) -> Result<(), TreeError> {
    let mut start = Vec::new();
    let read = match path.try_exists() {
        Ok(false) => return Ok(()),
        _ => store::open_regular(path)
            .and_then(|file| file.take(store::MAGIC.len() as u64).read_to_end(&mut start)),
    };
    match read {
        Ok(_) if start.is_empty() || start == store::MAGIC => Ok(()),
        Ok(_) => Err(TreeError::InTheWay { path: path.into() }),
        Err(cause) => Err(TreeError::Io { path: path.into(), cause }),
    }
}

/// How many lights a message names.
const MOST_NAMED: usize = 10;

/// What changed in a scene since its tree was built.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StaleTree {
    /// Lights that the tree does not have.
    pub added: Vec<String>,
    /// Lights that the scene does not have.
    pub removed: Vec<String>,
    /// Lights that have changed.
    pub dirtied: Vec<String>,
    /// The command that builds it again, as a shell takes it.
    pub remedy: String,
}

impl fmt::Display for StaleTree {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the tree is stale")?;
        let kinds =
            [("added", &self.added), ("removed", &self.removed), ("dirtied", &self.dirtied)];
        let (mut left, mut unnamed) = (MOST_NAMED, 0);
        for (verb, paths) in kinds.into_iter().filter(|(_, paths)| !paths.is_empty()) {
            let named = &paths[..paths.len().min(left)];
            left -= named.len();
            unnamed += paths.len() - named.len();
            write!(
                f,
                "; {verb}: {}",
                if named.is_empty() { "(more)".into() } else { named.join(", ") }
            )?;
        }
        if unnamed > 0 {
            write!(f, " and {unnamed} more")?;
        }
        if [&self.added, &self.removed, &self.dirtied].iter().all(|paths| paths.is_empty()) {
            write!(f, ": it is damaged, or was built by another version of the algorithm")?;
        }
        write!(f, ". Build it again: {}", self.remedy)
    }
}

impl std::error::Error for StaleTree {}

/// Compares a whole tree with the scene it should belong to, in all its frames;
/// [`ShotTrees`](super::ShotTrees) compares what is asked for. `forced` are the paths that the user forces in
/// addition to those that the scene forces; the error's build command repeats them. With `leaves`, each
/// leaf is compared with its emitter, and the tree must have been verified.
///
/// # Errors
/// [`TreeError::Stale`] with the lights that changed, at most ten of them named in the message;
/// [`TreeError::Contradicts`] if the tree has the scene's fingerprint but differs from the scene.
pub fn check_fresh<D: AsRef<[u8]> + Sync>(
    tree: &LightTree<D>,
    path: &Path,
    scene: &Scene,
    emitters: &Emitters,
    options: &[String],
    leaves: bool,
) -> Result<(), TreeError> {
    let survey = survey(scene, emitters, &frames_in(tree))?;
    if survey.fingerprint != tree.fingerprint() {
        return Err(stale_by(tree, path, scene, &survey, options));
    }
    check_agreement(tree, path, scene, &survey, options, leaves)
}

/// Refuses a tree that has a survey's fingerprint but contradicts the survey. A tree with another
/// fingerprint passes.
///
/// # Errors
/// [`TreeError::Contradicts`].
pub fn check_agreement<D: AsRef<[u8]> + Sync>(
    tree: &LightTree<D>,
    path: &Path,
    scene: &Scene,
    survey: &Survey,
    options: &[String],
    leaves: bool,
) -> Result<(), TreeError> {
    if survey.fingerprint != tree.fingerprint() {
        return Ok(());
    }
    match find_contradiction(tree, survey, leaves) {
        None => Ok(()),
        Some(cause) => Err(contradicts(tree, path, scene, options, cause)),
    }
}

/// What is said of a tree whose fingerprint, in the whole or in a frame, is not the scene's. Finding the
/// lights that have changed takes a survey of all frames.
///
/// # Errors
/// [`TreeError::Survey`] if the scene has lights that no tree can hold.
pub(super) fn stale<D: AsRef<[u8]>>(
    tree: &LightTree<D>,
    path: &Path,
    scene: &Scene,
    emitters: &Emitters,
    options: &[String],
) -> Result<TreeError, TreeError> {
    let survey = survey(scene, emitters, &frames_in(tree))?;
    Ok(stale_by(tree, path, scene, &survey, options))
}

fn stale_by<D: AsRef<[u8]>>(
    tree: &LightTree<D>,
    path: &Path,
    scene: &Scene,
    survey: &Survey,
    options: &[String],
) -> TreeError {
    let remedy = build_command(scene, path, &frames_in(tree), options);
    TreeError::Stale { path: path.into(), cause: compare(tree, &survey.lights, remedy) }
}

/// What is said of a tree that differs from its scene although it has the scene's fingerprint.
pub(super) fn contradicts<D: AsRef<[u8]>>(
    tree: &LightTree<D>,
    path: &Path,
    scene: &Scene,
    options: &[String],
    cause: Contradiction,
) -> TreeError {
    let remedy = build_command(scene, path, &frames_in(tree), options);
    TreeError::Contradicts { path: path.into(), cause, remedy }
}

fn frames_in<D: AsRef<[u8]>>(tree: &LightTree<D>) -> Vec<i32> {
    tree.frames().iter().map(|row| row.frame).collect()
}

/// What `candelabra build` is told of how a scene is meant: the lights that are forced, and what of a USD stage is meant.
pub(super) fn build_options(forced: &[String], stage: &StageOptions) -> Vec<String> {
    let forced = forced.iter().flat_map(|path| ["--force-light".into(), path.clone()]);
    forced.chain(stage.arguments()).collect()
}

/// The command that builds a tree again for the frames that it was built for, with [`build_options`].
fn build_command(scene: &Scene, tree: &Path, frames: &[i32], options: &[String]) -> String {
    let name = |path: &Path| path.display().to_string();
    let mut words = ["candelabra", "build"].map(String::from).to_vec();
    words.extend([name(&scene.source), "-o".into(), name(tree)]);
    if !frames.is_empty() && frames != frames_of(scene) {
        words.extend(["--frames".into(), spell(frames)]);
    }
    words.extend(options.iter().cloned());
    shlex::try_join(words.iter().map(String::as_str)).unwrap_or_else(|_| words.join(" "))
}

fn compare<D: AsRef<[u8]>>(tree: &LightTree<D>, now: &[LightSummary], remedy: String) -> StaleTree {
    let before: BTreeMap<&str, _> = tree
        .lights()
        .iter()
        .enumerate()
        .map(|(at, row)| (tree.light_path(row), (row.fingerprint, row.class, tree.link_of(at))))
        .collect();
    let content = |light: &LightSummary| (light.fingerprint, light.class, light.link);
    let after: BTreeMap<&str, _> =
        now.iter().map(|light| (light.path.as_str(), content(light))).collect();
    let links = SameLinks::of(
        after.iter().filter_map(|(path, now)| before.get(path).map(|then| (then.2, now.2))),
    );
    let is_dirtied = |path: &str, now: &([u8; 32], u32, u32)| {
        let Some(then) = before.get(path) else { return false };
        !links.are_same(then.2, now.2) || (then.0, then.1) != (now.0, now.1)
    };
    let names = |paths: &mut dyn Iterator<Item = &&str>| paths.map(|p| p.to_string()).collect();
    StaleTree {
        added: names(&mut after.keys().filter(|path| !before.contains_key(*path))),
        removed: names(&mut before.keys().filter(|path| !after.contains_key(*path))),
        dirtied: names(
            &mut after.iter().filter(|(path, now)| is_dirtied(path, now)).map(|(path, _)| path),
        ),
        remedy,
    }
}
