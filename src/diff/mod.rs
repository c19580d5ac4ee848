//! Floor 6: what changed in the lights between two versions of a scene.
//!
//! A version is a [`Side`]: a scene, or the tree file that was built from it. [`compare()`] matches the
//! lights of both and says which were added, removed, dirtied or renamed. For a dirtied light it says
//! *what* changed and *by how much*. It also measures how the probabilities of picks moved. Prims that
//! emit no light are not compared; the [`HeatMap`] shows where they change what the camera sees.
//!
//! Two scenes are compared by what their files say. A tree file holds less: the bounds, energy, kind,
//! colour and fingerprint of each light. A scene that is compared with a tree is therefore surveyed as
//! for a build, and only what both have is compared. So a tree that is up to date does not differ from
//! its scene.
//!
//! | file | what |
//! |---|---|
//! | `side`, `tree_side`, `scene_side` | a version, opened; what a tree tells, what a scene tells |
//! | `sight` | the cameras of both |
//! | `light`, `profile`, `infinite` | a light as it is matched; its texture and shape; suns and domes |
//! | `matching`, `pairs` | which light corresponds to which, with renames |
//! | `card`, `describe` | one light, described |
//! | `change`, `amounts` | one light that differs, and each [`Difference`] with its amount |
//! | `links` | which prims lights light, and what casts their shadows |
//! | `over_time` | lights that change, followed through the frames |
//! | `totals` | how many lights and how much of them, before and after |
//! | `picking`, `probes` | how far the probabilities of picks moved, and where that is measured |
//! | `heat` | where in a camera's view direct light changed |
//! | `table` | whether a table of what is hidden is out of date, and why |
//! | `compare`, `folder` | all of this of two versions; of all shots in two folders |
//! | `text`, [`json`], `html` | for people, for programs, as a page |

mod amounts;
mod card;
mod change;
mod compare;
mod describe;
mod family;
mod folder;
mod heat;
mod html;
mod infinite;
pub mod json;
mod light;
mod links;
mod matching;
mod over_time;
mod pairs;
mod picking;
mod probes;
mod profile;
mod scene_side;
mod side;
mod sight;
mod table;
mod text;
mod totals;
mod tree_side;

pub use card::{Kind, LightCard, Place};
pub use change::{Apart, Change, Difference, Relinked, RelinkedFilter, Verb};
pub use compare::{DiffOptions, compare};
pub use folder::{FolderDiff, Outcome, Shot, compare_folders};
pub use heat::{HeatCell, HeatMap};
pub use html::html;
pub use picking::{PickingChange, ProbePlaces};
pub use side::{Side, SideError};
pub use sight::{look_at, look_at_both};
pub use table::{TableDiff, TableStanding, VersionName, names_table};
pub use text::Text;
pub use totals::{Tally, Totals};

use serde::Serialize;

/// What differs between two versions.
#[derive(Clone, Debug, Serialize)]
pub struct Diff {
    /// The version before.
    pub before: SideName,
    /// The version after.
    pub after: SideName,
    /// Sums over all lights of each.
    pub totals: Totals,
    /// How far the probabilities of picks moved; `None` where neither version has a light to pick.
    pub picking: Option<PickingChange>,
    /// The lights that differ, by descending [`Change::share`].
    pub changes: Vec<Change>,
    /// A table of what is hidden, against the version after. Only if one is named.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub table: Option<TableStanding>,
    /// The lights that are the same in both versions, for a picture of the whole. Only if asked for.
    #[serde(skip)]
    pub unchanged: Vec<Mark>,
    /// Where in the camera's view direct light changed. Only if asked for, and if both versions are
    /// scenes with a camera.
    #[serde(skip)]
    pub heat: Option<HeatMap>,
}

/// What a version was read from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct SideName {
    /// Its file, as the user named it.
    pub file: String,
    /// Whether it is a tree file and not a scene.
    pub is_tree: bool,
}

/// The position and the energy of a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mark {
    /// Middle of its box, world space, metres.
    pub center_m: [f32; 3],
    /// Peak radiant intensity, summed over its emitters, candela.
    pub energy_cd: f32,
}

impl Diff {
    /// Whether the lights are the same and picked alike.
    pub fn is_same(&self) -> bool {
        self.changes.is_empty() && self.picking.as_ref().is_none_or(|picking| picking.worst == 0.0)
    }
}
