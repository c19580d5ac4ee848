//! Opening a table of what is seen, and telling what it is worth for a shot.

use super::content::scene_fingerprint;
use super::stamp::place_of;
use crate::light_tree::learned::LearnedFile;
use crate::scene::{Camera, Scene};
use crate::store::{MappedFile, StoreError};
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

/// BLAKE3 over what a table is learned from, beside the tree: the scene's files and the camera.
pub fn view_key(scene: &Scene, camera: &Camera) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&scene_fingerprint(scene));
    hasher.update(format!("{camera:?} {:?}", place_of(scene, camera)).as_bytes());
    *hasher.finalize().as_bytes()
}

/// What there is to say of a table before a shot is rendered by it; nothing if it is of this shot. `tree` is
/// the [key](crate::light_tree::LightTree::still_key) of the tree.
pub fn caveat(
    table: &LearnedFile<impl AsRef<[u8]>>,
    path: &Path,
    tree: [u8; 32],
    view: [u8; 32],
) -> Option<String> {
    let path = path.display();
    if table.tree_key() != tree {
        return Some(format!(
            "{path}: not used: it was learned with other lights; learn again with `candelabra learn`"
        ));
    }
    (table.view_key() != view).then(|| {
        format!(
            "{path}: learned from another version of the scene or through another camera: the picture is right, \
             but may be noisier than it has to be; `candelabra learn` renews it"
        )
    })
}
