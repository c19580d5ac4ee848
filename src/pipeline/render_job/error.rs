//! Why a shot cannot be rendered at all.

use crate::pipeline::{LearnedError, ReadError, TreeError, ViewError};
use crate::render::PlanError;
use crate::render::frame_names::FrameNamesError;
use std::io;
use std::path::PathBuf;

/// Why a shot cannot be rendered at all. A single frame that fails is an
/// [event](crate::pipeline::Event::FrameFailed).
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// The frames would share a name.
    #[error(transparent)]
    Names(#[from] FrameNamesError),
    /// There is no scene to render.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// There is no camera to look through.
    #[error(transparent)]
    View(#[from] ViewError),
    /// The tree file cannot be used, or none can be built.
    #[error(transparent)]
    Tree(#[from] TreeError),
    /// The table of what is hidden cannot be used.
    #[error(transparent)]
    Learned(#[from] LearnedError),
    /// The tree in memory cannot be opened.
    #[error("the light tree of the scene cannot be built: {0}")]
    Build(#[from] crate::store::StoreError),
    /// A picture would replace what it is rendered from.
    #[error("{}: is an input of this render; choose another name", .0.display())]
    Overwrites(PathBuf),
    /// No picture can be written.
    #[error(transparent)]
    Unwritable(io::Error),
    /// The program cannot read itself, so pictures cannot be told from those of another one.
    #[error("the program's own file cannot be read: {0}; start it from where it can be")]
    Program(io::Error),
    /// The settings do not fit the scene.
    #[error(transparent)]
    Plan(#[from] PlanError),
}

impl RenderError {
    /// Whether the options contradict each other although each is valid by itself.
    pub fn is_usage(&self) -> bool {
        match self {
            RenderError::Names(_) | RenderError::Plan(PlanError::Crop(_)) => true,
            RenderError::View(error) => error.is_usage(),
            RenderError::Read(error) => error.is_usage(),
            _ => false,
        }
    }

    /// Whether the tree file itself is at fault; not one that is absent.
    pub fn is_bad_tree(&self) -> bool {
        use TreeError::{Broken, Contradicts, Overwritten, Stale};
        matches!(
            self,
            RenderError::Tree(
                Broken { .. } | Stale { .. } | Contradicts { .. } | Overwritten { .. }
            ) | RenderError::Learned(LearnedError::Overwritten(_))
        )
    }
}
