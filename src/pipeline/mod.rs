//! Floor 5: jobs, the only place where ingest meets the tree.
//!
//! A job is what one run of a program does: [`BuildJob`], [`LearnJob`] and [`RenderJob`]. It tells [`Event`]s to a
//! [`Watch`], prints nothing, and reads the clock only to report where time went. Jobs are made of stages:
//!
//! | stage | question |
//! |---|---|
//! | [`load_scene`], [`StageOptions`], [`force_lights`], [`Strict`] | what is in the file, or the USD stage, and is it good enough? |
//! | [`look()`] | which camera does the user mean? |
//! | [`collect_emitters`], [`survey()`] | what shines, and what do its trees depend on? |
//! | [`build_tree`], [`rebuild_tree`] | the trees of a shot, anew or upon an earlier file |
//! | [`ShotTrees`] | the trees of one frame after the other: from a file, or built |
//! | [`check_fresh`], [`standing`] | does a whole file still belong to the scene; if not, which lights changed? |
//! | [`open_learned`], [`outdated`], [`caveat`] | what is hidden from where; does that still belong to the shot? |
//! | [`Stamp`] | what was a picture rendered from? |

mod agreement;
mod ahead;
mod build;
mod build_job;
mod content;
mod fingerprint;
mod fit;
mod forced;
mod frames;
mod fresh;
mod learn_budget;
mod learn_job;
mod learned;
mod look;
pub mod option;
mod read;
mod render_job;
mod rig;
mod shot_trees;
mod stage;
mod stamp;
mod strict;
mod survey;
mod surveyor;
mod swept;
mod textures;
mod view;
mod view_keys;
mod watch;

pub use agreement::{Contradiction, Standing, standing};
pub use ahead::{Glimpse, frames_of_grey, glimpse, with_knobs};
pub use build::{Rebuilt, build_tree, origin_of, rebuild_tree};
pub use build_job::{BreakEven, BuildError, BuildJob, BuildReport, Built, TakenOver};
pub use content::scene_fingerprint;
pub use forced::{NoLightThere, force_lights};
pub use frames::frames_of;
pub use fresh::{
    OpenedTree, StaleTree, TreeError, check_agreement, check_fresh, check_output, is_tree_file,
    open_base, open_tree,
};
pub use learn_budget::Budget;
pub use learn_job::{LearnError, LearnJob, LearnReport};
pub use learned::{
    LearnedError, OpenedTable, Outdated, caveat, is_table_file, open_learned, outdated,
};
pub use read::ReadError;
pub use render_job::{
    Audit, Effort, FrameCounts, FrameNoise, Plan, Preview, Quality, RenderError, RenderJob,
    RenderReport, SceneCounts, Seconds,
};
pub use rig::carry_camera;
pub use shot_trees::{ShotTrees, TreeChoice, TreeFile, with_trees};
pub use stage::{StageError, StageOptions};
pub use stamp::{PreviewStamp, Stamp, Stamper};
pub use strict::{Strict, StrictError};
pub use survey::{Group, PlacedLight, SharedBounds, Survey, SurveyError, SurveyedFrame, survey};
pub use textures::collect_emitters;
pub use view::{ASPECT, Look, View, ViewError, look};
pub use view_keys::view_keys;
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
