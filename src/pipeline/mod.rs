//! Floor 5: jobs, the only place where ingest meets the tree.
//!
//! [`load_scene`] reads a scene; [`survey()`] finds out what its tree depends on; [`build_tree`] builds
//! the trees of a shot; [`check_fresh`] tells whether a tree still belongs to a scene, and if not,
//! which lights changed.

mod build;
mod camera;
mod content;
mod forced;
mod frames;
mod fresh;
mod look;
mod strict;
mod survey;

pub use build::{Rebuilt, build_tree, rebuild_tree};
pub use camera::{NoCamera, find_camera};
pub use content::scene_fingerprint;
pub use forced::{NoLightThere, force_lights};
pub use frames::frames_of;
pub use fresh::{
    OpenedTree, StaleTree, TreeError, check_fresh, check_output, is_tree_file, open_base, open_tree,
};
pub use look::is_built_from;
pub use strict::{Strict, StrictError};
pub use survey::{Group, PlacedLight, SharedBounds, Survey, survey};

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
