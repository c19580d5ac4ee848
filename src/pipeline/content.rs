//! The content of a scene's files.

use crate::scene::Scene;
use crate::store::open_regular;
use std::io;

/// BLAKE3 over the bytes of the file that a scene was read from and of all files that it refers
/// to: what a picture of it depends on.
///
/// # Errors
/// If a file has gone since.
pub fn scene_fingerprint(scene: &Scene) -> io::Result<[u8; 32]> {
    let mut hasher = blake3::Hasher::new();
    for path in &scene.files {
        let name =
            |error: io::Error| io::Error::new(error.kind(), format!("{}: {error}", path.display()));
        let mut file = open_regular(path).map_err(name)?;
        hasher.update(&file.metadata().map_err(name)?.len().to_le_bytes());
        hasher.update_reader(&mut file).map_err(name)?;
    }
    Ok(*hasher.finalize().as_bytes())
}
