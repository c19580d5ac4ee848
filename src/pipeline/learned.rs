//! Opening a table of what is seen, and telling what it is worth for a shot.

use crate::light_tree::learned::{LearnedFile, ViewKeys};
use crate::store::{MappedFile, StoreError};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// A table over a mapped file.
pub type OpenedTable = LearnedFile<MappedFile>;

/// Why a table cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum LearnedError {
    /// The file cannot be read.
    #[error("{}: {cause}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why not.
        cause: std::io::Error,
    },
    /// It is no table.
    #[error("{}: is no table of what is seen: write one with `candelabra learn`", .0.display())]
    NoTable(PathBuf),
    /// The file is not what the format says.
    #[error("{}: {cause}", path.display())]
    Broken {
        /// The file.
        path: PathBuf,
        /// The rule that is broken.
        cause: StoreError,
    },
    /// Somebody wrote to the file while it was in use.
    #[error(
        "{}: was written to while it was in use, so what it says is not what was checked; write a table under \
         another name and rename it over the old one, then render again with --resume",
        .0.display()
    )]
    Overwritten(PathBuf),
}

/// Whether a path is that of a table, by its extension.
pub fn is_table_file(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("lvis"))
}

/// Maps and opens a table; with `verify`, proves that it keeps the format's promises.
///
/// # Errors
/// If the file cannot be read or breaks a rule.
pub fn open_learned(path: &Path, verify: bool) -> Result<OpenedTable, LearnedError> {
    let io = |cause| LearnedError::Io { path: path.into(), cause };
    let broken = |cause| match cause {
        StoreError::NotOurs => LearnedError::NoTable(path.into()),
        cause => LearnedError::Broken { path: path.into(), cause },
    };
    let file = LearnedFile::open(MappedFile::open(path).map_err(io)?).map_err(broken)?;
    if verify {
        file.verify().map_err(broken)?;
    }
    Ok(file)
}

/// Something that a table was learned from and that is not what it was.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outdated {
    /// Lights that stand still: weights are told of the groups of their tree, so the table is not used.
    Lights,
    /// Suns and domes.
    LightsAtInfinity,
    /// What rays can meet.
    Geometry,
    /// The camera.
    Camera,
}

impl Outdated {
    /// Its name in a sentence.
    pub fn name(self) -> &'static str {
        match self {
            Outdated::Lights => "lights",
            Outdated::LightsAtInfinity => "lights at infinity",
            Outdated::Geometry => "geometry",
            Outdated::Camera => "camera",
        }
    }
}

/// What of a shot is not what a table was learned from; nothing if it is up to date. `tree` is the
/// [key](crate::light_tree::LightTree::still_key) of the tree.
pub fn outdated(
    table: &LearnedFile<impl AsRef<[u8]>>,
    tree: [u8; 32],
    view: &ViewKeys,
) -> Vec<Outdated> {
    let was = table.view_keys();
    let differs = [
        (table.tree_key() != tree, Outdated::Lights),
        (was.infinite != view.infinite, Outdated::LightsAtInfinity),
        (was.geometry != view.geometry, Outdated::Geometry),
        (was.camera != view.camera, Outdated::Camera),
    ];
    differs.into_iter().filter_map(|(differs, what)| differs.then_some(what)).collect()
}

/// What there is to say of a table before a shot is rendered by it; nothing if it is of this shot. `tree` is
/// the [key](crate::light_tree::LightTree::still_key) of the tree.
pub fn caveat(
    table: &LearnedFile<impl AsRef<[u8]>>,
    path: &Path,
    tree: [u8; 32],
    view: &ViewKeys,
) -> Option<String> {
    let path = path.display();
    let outdated = outdated(table, tree, view);
    if outdated.contains(&Outdated::Lights) {
        return Some(format!(
            "{path}: not used: it was learned with other lights; learn again with `candelabra learn`"
        ));
    }
    let names: Vec<&str> = outdated.iter().map(|what| what.name()).collect();
    (!names.is_empty()).then(|| {
        format!(
            "{path}: out of date ({}): the picture is right, but may be noisier than it has to be; \
             `candelabra learn` renews it",
            names.join(", ")
        )
    })
}
