//! Reading the scene of a job.

use super::{Event, NoLightThere, Strict, StrictError, Watch, force_lights, load_scene};
use crate::ingest::IngestError;
use crate::scene::Scene;
use std::path::{Path, PathBuf};

/// Why a job has no scene.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The file cannot be read.
    #[error(transparent)]
    Scene(#[from] IngestError),
    /// It has notes that are errors.
    #[error(transparent)]
    Strict(#[from] StrictError),
    /// It has no light that is to be forced.
    #[error("{}: {cause}", scene.display())]
    Force {
        /// The scene's file.
        scene: PathBuf,
        /// The path that has no light, and what to do.
        cause: NoLightThere,
    },
}

/// Reads a scene, tells its notes, takes those under `strict` for errors, and forces lights.
///
/// # Errors
/// If any of that fails.
pub(super) fn read_scene(
    path: &Path,
    strict: Option<&Strict>,
    forced: &[String],
    watch: &dyn Watch,
) -> Result<Scene, ReadError> {
    let mut scene = load_scene(path)?;
    for note in &scene.notes {
        watch.tell(Event::Note { text: note.to_string() });
    }
    if let Some(strict) = strict {
        strict.check(&scene)?;
    }
    force_lights(&mut scene, forced)
        .map_err(|cause| ReadError::Force { scene: path.into(), cause })?;
    Ok(scene)
}
