//! Floor 5: jobs, the only place where ingest meets the tree.
//!
//! [`load_scene`] reads a scene; [`collect_emitters`] finds what shines in it; [`survey()`] finds out
//! what its tree depends on; [`build_tree`] builds the trees of a shot; [`check_fresh`] tells whether
//! a tree still belongs to a scene, and if not, which lights changed. [`look()`] finds
//! the camera that a user means, and makes one where there is none.

mod agreement;
mod build;
mod content;
mod fingerprint;
mod fit;
mod forced;
mod frames;
mod fresh;
mod look;
pub mod option;
mod render_job;
mod rig;
mod shot_trees;
mod stamp;
mod strict;
mod survey;
mod surveyor;
mod textures;
mod view;
mod watch;

pub use agreement::{Contradiction, Standing, standing};
pub use build::{Rebuilt, build_tree, origin_of, rebuild_tree};
pub use content::scene_fingerprint;
pub use forced::{NoLightThere, force_lights};
pub use frames::frames_of;
pub use fresh::{
    OpenedTree, StaleTree, TreeError, check_agreement, check_fresh, check_output, is_tree_file,
    open_base, open_tree,
};
pub use render_job::{
    FrameCounts, Preview, RenderError, RenderJob, RenderReport, SceneCounts, Seconds,
};
pub use rig::carry_camera;
pub use shot_trees::{ShotTrees, TreeFile};
pub use stamp::{PreviewStamp, Stamp, Stamper};
pub use strict::{Strict, StrictError};
pub use survey::{Group, PlacedLight, SharedBounds, Survey, SurveyedFrame, survey};
pub use textures::collect_emitters;
pub use view::{ASPECT, Look, View, ViewError, look};
pub use watch::{Event, Watch};

use crate::ingest::{self, IngestError};
use crate::scene::Scene;
use std::path::Path;

/// Reads a scene from a `.gltf`, `.glb` or `.obj` file.
///
/// # Errors
/// Whatever is wrong with the file; see [`IngestError`].
pub fn load_scene(path: &Path) -> Result<Scene, IngestError> {
    ingest::load(path)
}
