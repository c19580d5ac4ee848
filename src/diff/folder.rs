//! Folders of shots, compared shot by shot.

use super::{Diff, DiffOptions, Side, SideError, compare, look_at_both};
use crate::pipeline::{View, is_tree_file};
use rayon::prelude::*;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use walkdir::WalkDir;

/// What differs between two folders of shots.
#[derive(Debug, Serialize)]
pub struct FolderDiff {
    /// The folder before.
    pub before: String,
    /// The folder after.
    pub after: String,
    /// Every scene and tree file in either, by relative path.
    pub shots: Vec<Shot>,
}

/// A file of two folders.
#[derive(Debug, Serialize)]
pub struct Shot {
    /// Its path in the folders, with `/` between names.
    pub name: String,
    /// What became of it.
    #[serde(flatten)]
    pub outcome: Outcome,
}

/// What became of a shot.
#[derive(Debug, Serialize)]
#[serde(tag = "outcome", rename_all = "lowercase")]
pub enum Outcome {
    /// Only the folder after has it.
    Added,
    /// Only the folder before has it.
    Removed,
    /// Both have it, and its lights are the same.
    Same,
    /// Both have it.
    Dirtied {
        /// What differs.
        diff: Box<Diff>,
    },
    /// It cannot be compared.
    Trouble {
        /// Why, with the file's name.
        message: String,
    },
}

impl FolderDiff {
    /// Whether both have the same shots with the same lights.
    pub fn is_same(&self) -> bool {
        self.shots.iter().all(|shot| matches!(shot.outcome, Outcome::Same))
    }

    /// Whether there is a shot that cannot be compared.
    pub fn has_trouble(&self) -> bool {
        self.shots.iter().any(|shot| matches!(shot.outcome, Outcome::Trouble { .. }))
    }
}

/// Compares all scenes and tree files (`.ltree`, `.gltf`, `.glb`, `.obj`) of two folders and their
/// subfolders. Files are matched by relative path, and [`look_at_both`] chooses the cameras of each pair.
/// If a shot cannot be compared, the others still are.
///
/// # Errors
/// A folder that cannot be walked.
pub fn compare_folders(before: &Path, after: &Path, view: &View) -> Result<FolderDiff, SideError> {
    let mut shots: BTreeMap<String, [Option<PathBuf>; 2]> = BTreeMap::new();
    for (side, folder) in [before, after].into_iter().enumerate() {
        for entry in WalkDir::new(folder).follow_links(true) {
            let entry = entry?;
            if entry.file_type().is_file() && is_comparable(entry.path()) {
                let inside = entry.path().strip_prefix(folder).unwrap_or(entry.path());
                let names: Vec<_> =
                    inside.iter().map(|name| name.to_string_lossy().into_owned()).collect();
                shots.entry(names.join("/")).or_default()[side] = Some(entry.into_path());
            }
        }
    }
    let shots: Vec<_> = shots.into_iter().collect();
    let shot = |(name, files): &(String, [Option<PathBuf>; 2])| {
        let outcome = match files {
            [Some(before), Some(after)] => of_both(before, after, view),
            [Some(_), None] => Outcome::Removed,
            [None, _] => Outcome::Added,
        };
        Shot { name: name.clone(), outcome }
    };
    Ok(FolderDiff {
        before: before.display().to_string(),
        after: after.display().to_string(),
        shots: shots.par_iter().map(shot).collect(),
    })
}

fn of_both(before: &Path, after: &Path, view: &View) -> Outcome {
    let compared = Side::open(before).and_then(|mut before| {
        let mut after = Side::open(after)?;
        look_at_both(&mut before, &mut after, view)?;
        compare(&before, &after, &DiffOptions::default())
    });
    match compared {
        Ok(diff) if diff.is_same() => Outcome::Same,
        Ok(diff) => Outcome::Dirtied { diff: Box::new(diff) },
        Err(error) => Outcome::Trouble { message: error.to_string() },
    }
}

fn is_comparable(path: &Path) -> bool {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
    is_tree_file(path) || ["gltf", "glb", "obj"].iter().any(|e| extension.eq_ignore_ascii_case(e))
}
