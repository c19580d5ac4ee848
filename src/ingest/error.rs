//! Why a file could not be read.

use std::fmt::Display;
use std::path::{Path, PathBuf};

/// Why a file could not be read: always the file, the object in it, what is wrong, and what to do.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}: {object}: {problem}; {remedy}", .file.display())]
pub struct IngestError {
    /// The scene file that was asked for.
    pub file: PathBuf,
    /// The object in it, such as `node 3 "lamp"`.
    pub object: String,
    /// What is wrong with the object.
    pub problem: String,
    /// What the user can do.
    pub remedy: String,
}

/// The remedy where nothing more particular is known.
const RE_EXPORT: &str = "re-export the file, or see what a validator says of it";

/// An [`IngestError`] that does not know its file yet.
#[derive(Debug)]
pub(super) struct Fault {
    object: String,
    problem: String,
    remedy: String,
}

impl Fault {
    pub(super) fn new(object: impl Display, problem: impl Display) -> Fault {
        let (object, problem) = (object.to_string(), problem.to_string());
        Fault { object, problem, remedy: RE_EXPORT.into() }
    }

    pub(super) fn remedy(mut self, remedy: impl Display) -> Fault {
        self.remedy = remedy.to_string();
        self
    }

    /// What is wrong, without the object: for a note about it.
    pub(super) fn into_problem(self) -> String {
        self.problem
    }

    /// The object, and what is wrong with it.
    pub(super) fn parts(self) -> (String, String) {
        (self.object, self.problem)
    }

    /// What is wrong with which object: for a note about one that uses it.
    pub(super) fn told(self) -> String {
        format!("{}: {}", self.object, self.problem)
    }

    pub(super) fn in_file(self, file: &Path) -> IngestError {
        let Fault { object, problem, remedy } = self;
        IngestError { file: file.to_path_buf(), object, problem, remedy }
    }
}
