//! Reading the scene of a job.

use super::stage::{ExportedStage, StageError, StageOptions, is_stage};
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
    /// It is a USD stage, and cannot be exported.
    #[error(transparent)]
    Stage(#[from] StageError),
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

impl ReadError {
    /// Whether the options are at fault, whatever is in the scene.
    pub fn is_usage(&self) -> bool {
        matches!(
            self,
            ReadError::Stage(
                StageError::NoStage { .. } | StageError::Refused { is_usage: true, .. }
            )
        )
    }

    /// Whether the job was stopped.
    pub fn is_stop(&self) -> bool {
        matches!(self, ReadError::Stage(StageError::Stopped(_)))
    }
}

/// Reads a scene, tells its notes, takes those under `strict` for errors, and forces lights. A USD stage is exported
/// first; what was exported is gone afterwards.
///
/// # Errors
/// If any of that fails.
pub(super) fn read_scene(
    path: &Path,
    stage: &StageOptions,
    strict: Option<&Strict>,
    forced: &[String],
    watch: &dyn Watch,
) -> Result<Scene, ReadError> {
    let mut scene = match is_stage(path) {
        true => load_stage(path, stage, strict, watch)?,
        false => {
            stage.refuse_for(path)?;
            load_scene(path)?
        }
    };
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

/// Reads a USD stage. It is the scene's source, and what the exporter read are the scene's files.
fn load_stage(
    path: &Path,
    options: &StageOptions,
    strict: Option<&Strict>,
    watch: &dyn Watch,
) -> Result<Scene, ReadError> {
    let exported = ExportedStage::of(path, options, strict, watch)?;
    let mut scene = load_scene(&exported.path())?;
    scene.source = path.into();
    scene.files.extend(exported.files());
    Ok(scene)
}
