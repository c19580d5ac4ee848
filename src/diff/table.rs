//! Whether a table of what is hidden is out of date, and why.
//!
//! A table holds keys of what it was learned from: the tree of the lights that stand still, the lights at infinity,
//! the geometry and the camera. So it can be held against a scene, against a tree file, which tells of lights alone,
//! and against another table.

use super::side::{Side, SideError};
use crate::light_tree::learned::ViewKeys;
use crate::pipeline::{
    OpenedTable, Outdated, TreeChoice, TreeError, frames_of, is_table_file, open_learned, outdated,
    view_keys, with_trees,
};
use serde::Serialize;
use std::path::Path;

/// A table, held against a version.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TableStanding {
    /// The table's file, as the user named it.
    pub file: String,
    /// What is not what the table was learned from. Nothing, if it is up to date.
    pub outdated: Vec<Outdated>,
    /// What the version does not tell.
    pub unknown: Vec<Outdated>,
    /// Whether a renderer uses it for the version: it does not, if the lights are others.
    pub is_used: bool,
    /// What the table says about itself: `frames`, `budget`, `rays`, `hidden`, `program`.
    pub learned: serde_json::Value,
}

/// A comparison with a table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TableDiff {
    /// The version before.
    pub before: VersionName,
    /// The version after.
    pub after: VersionName,
    /// The table, against the other version. Of two tables it is the one before.
    pub table: TableStanding,
    /// Of two tables, whether all that they say is the same.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub is_same_table: Option<bool>,
    /// Of two tables, what the one after says about itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub learned_after: Option<serde_json::Value>,
}

/// What a version was read from, where a table is one.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct VersionName {
    /// Its file, as the user named it.
    pub file: String,
    /// Whether it is a tree file.
    pub is_tree: bool,
    /// Whether it is a table of what is hidden.
    pub is_table: bool,
}

impl TableStanding {
    /// Holds a table, which must have been verified, against a version.
    ///
    /// # Errors
    /// If a scene's trees cannot be built.
    pub fn of(
        path: &Path,
        table: &OpenedTable,
        version: &Side,
    ) -> Result<TableStanding, SideError> {
        let (tree, view) = keys(version)?;
        Ok(TableStanding::by_keys(path, table, tree, view.as_ref()))
    }

    fn by_keys(
        path: &Path,
        table: &OpenedTable,
        tree: [u8; 32],
        view: Option<&ViewKeys>,
    ) -> TableStanding {
        let unknown = match view {
            Some(_) => Vec::new(),
            None => vec![Outdated::LightsAtInfinity, Outdated::Geometry, Outdated::Camera],
        };
        let outdated = outdated(table, tree, view.unwrap_or(&table.view_keys()));
        let is_used = !outdated.contains(&Outdated::Lights);
        let learned = serde_json::from_str(table.meta()).unwrap_or_default();
        TableStanding { file: path.display().to_string(), outdated, unknown, is_used, learned }
    }

    /// Whether nothing that the version tells is otherwise.
    pub fn is_up_to_date(&self) -> bool {
        self.outdated.is_empty()
    }
}

impl TableDiff {
    /// Holds a table against a version that is no table, which is looked at as it is to be rendered.
    /// `is_after` says whether the table is the version after.
    ///
    /// # Errors
    /// If the table cannot be read or is not sound, or a scene's trees cannot be built.
    pub fn of(path: &Path, version: &Side, is_after: bool) -> Result<TableDiff, SideError> {
        let table = TableStanding::of(path, &open_learned(path, true)?, version)?;
        let name = version.name();
        let other = VersionName { file: name.file.clone(), is_tree: name.is_tree, is_table: false };
        let own = VersionName::of_table(path);
        let (before, after) = if is_after { (other, own) } else { (own, other) };
        Ok(TableDiff { before, after, table, is_same_table: None, learned_after: None })
    }

    /// Compares two tables.
    ///
    /// # Errors
    /// If one cannot be read or is not sound.
    pub fn of_two(before: &Path, after: &Path) -> Result<TableDiff, SideError> {
        let [first, second] = [open_learned(before, true)?, open_learned(after, true)?];
        let view = second.view_keys();
        Ok(TableDiff {
            before: VersionName::of_table(before),
            after: VersionName::of_table(after),
            table: TableStanding::by_keys(before, &first, second.tree_key(), Some(&view)),
            is_same_table: Some(first.fingerprint() == second.fingerprint()),
            learned_after: serde_json::from_str(second.meta()).ok(),
        })
    }

    /// Whether the table is up to date; of two, whether they are the same.
    pub fn is_same(&self) -> bool {
        self.table.is_up_to_date() && self.is_same_table != Some(false)
    }
}

impl VersionName {
    fn of_table(path: &Path) -> VersionName {
        VersionName { file: path.display().to_string(), is_tree: false, is_table: true }
    }
}

/// Whether one of two paths is that of a table.
pub fn names_table(before: &Path, after: &Path) -> bool {
    is_table_file(before) || is_table_file(after)
}

/// The key of the tree of what stands still, and those of what is seen.
fn keys(version: &Side) -> Result<([u8; 32], Option<ViewKeys>), SideError> {
    let Some(scene) = version.scene() else {
        let tree = version.opened().expect("what is no scene is a tree");
        return Ok((tree.still_key(), None));
    };
    let tree =
        with_trees::<_, TreeError>(scene, &TreeChoice::default(), &|_, _| (), |_, mut trees| {
            Ok(trees.for_frame(frames_of(scene)[0])?.still_key())
        })?;
    Ok((tree, version.camera().map(|camera| view_keys(scene, camera))))
}
