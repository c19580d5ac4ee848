//! The files that a scene was read from, and what was in them.

use std::path::PathBuf;

/// A file that was read for a scene.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct SourceFile {
    /// Where it was.
    pub path: PathBuf,
    /// BLAKE3 of the bytes that were read and used. Whatever is at the path by now may be something else.
    pub hash: [u8; 32],
}

impl SourceFile {
    /// A file, and its bytes as they were read.
    pub fn new(path: PathBuf, bytes: &[u8]) -> SourceFile {
        let hash = *blake3::Hasher::new().update_rayon(bytes).finalize().as_bytes();
        SourceFile { path, hash }
    }
}
