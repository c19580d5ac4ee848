//! A job: layers of frames, and which waits for which.

use super::cjsl::{Element, Refusal};
use super::reader::from_text;
use crate::store::read_regular;
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// No job file is longer than this: 16 MiB.
const LONGEST_FILE: u64 = 16 << 20;

/// A job, as its file describes it. Names are as Cuebot makes them: lower case, dashes as underscores.
#[derive(Clone, Debug, PartialEq)]
pub struct Job {
    /// Its name.
    pub name: String,
    /// The show that it is for.
    pub show: String,
    /// The shot that it is for.
    pub shot: String,
    /// Who runs it on an OpenCue farm.
    pub user: String,
    /// How often a task that fails is tried again.
    pub retries: u32,
    /// What is to be done, in the file's order; at least one.
    pub layers: Vec<Layer>,
    /// Which layer waits for which.
    pub depends: Vec<Depend>,
    /// The file.
    pub path: PathBuf,
    /// The folder in which its commands run: the one that holds `pipelines/` if the file is in a folder of
    /// that name, else the file's own. Absolute.
    pub root: PathBuf,
    /// The file's elements, whole.
    pub(super) spec: Element,
}

/// Frames that one command makes.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// Its name.
    pub name: String,
    /// What kind of work it is.
    pub kind: LayerKind,
    /// A line of `sh`, with [`tokens`](super::tokens).
    pub command: String,
    /// Its frames in order, each once; at least one.
    pub frames: Vec<i32>,
    /// How many frames a task takes; at least one.
    pub chunk: usize,
    /// Cores that a task reserves, in hundredths.
    pub core_points: Option<u32>,
    /// Memory that a task reserves, in MiB.
    pub memory_mib: Option<u64>,
    /// A task is stopped after so many minutes.
    pub timeout_minutes: Option<u64>,
    /// A task is stopped if it has said nothing for so many minutes.
    pub silence_minutes: Option<u64>,
    /// Environment of the commands, the job's included.
    pub env: Vec<(String, String)>,
}

#[cfg(test)]
impl Layer {
    /// A layer of one frame that does nothing.
    pub fn example() -> Layer {
        Layer {
            name: "layer".into(),
            kind: LayerKind::Render,
            command: "true".into(),
            frames: vec![1],
            chunk: 1,
            core_points: None,
            memory_mib: None,
            timeout_minutes: None,
            silence_minutes: None,
            env: Vec::new(),
        }
    }
}

/// What kind of work a layer is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LayerKind {
    /// Frames.
    Render,
    /// Preparation.
    Util,
    /// What is done after all layers that are not of this kind.
    Post,
}

/// A dependence of one layer on another, both by their place in [`Job::layers`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Depend {
    /// The layer that waits.
    pub layer: usize,
    /// The layer that it waits for.
    pub on: usize,
    /// For what of it.
    pub kind: DependKind,
}

/// What a layer waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum DependKind {
    /// The whole of the other layer.
    LayerOnLayer,
    /// The tasks of the other layer that make the same frames.
    FrameByFrame,
}

/// Why a job file is refused.
#[derive(Debug, Error)]
pub enum JobError {
    /// It cannot be read.
    #[error("{}: {error}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// It is no valid job; the message has line, column and remedy.
    #[error("{}:{refusal}", path.display())]
    Refused {
        /// The file.
        path: PathBuf,
        /// What is wrong, and where.
        refusal: Refusal,
    },
    /// Another job has its name and its folder of logs, which would be mixed up.
    #[error("{}: its job is called {name} as that of {} is, and both would log to one folder; rename one", path.display(), other.display())]
    SameName {
        /// The file.
        path: PathBuf,
        /// The other one.
        other: PathBuf,
        /// The name.
        name: String,
    },
    /// A folder without job files.
    #[error("{}: no job file (*.xml) is in this folder", path.display())]
    Empty {
        /// The folder.
        path: PathBuf,
    },
}

impl Job {
    /// Reads a job file and checks all of it.
    ///
    /// # Errors
    /// The first thing in the file that is wrong: see [`JobError`].
    pub fn read(path: &Path) -> Result<Job, JobError> {
        let unreadable = |error| JobError::Unreadable { path: path.into(), error };
        let bytes = read_regular(path, LONGEST_FILE).map_err(unreadable)?;
        let no_text = |_| unreadable(io::Error::other("is not UTF-8; save it as UTF-8"));
        let text = String::from_utf8(bytes).map_err(no_text)?;
        let absolute = std::path::absolute(path).map_err(unreadable)?;
        let folder = absolute.parent().unwrap_or(Path::new("/"));
        let is_pipelines = folder.file_name().is_some_and(|name| name == "pipelines");
        let root = if is_pipelines { folder.parent().unwrap_or(folder) } else { folder };
        let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
        from_text(text, path, root)
            .map_err(|refusal| JobError::Refused { path: path.into(), refusal })
    }

    /// What Cuebot calls the job: `show-shot-user_name`.
    pub fn full_name(&self) -> String {
        format!("{}-{}-{}_{}", self.show, self.shot, self.user, self.name).to_lowercase()
    }
}
