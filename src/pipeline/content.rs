//! The content of a scene's files.

use crate::scene::Scene;

/// BLAKE3 over the bytes of the file that a scene was read from and of all files that it refers to, as
/// they were read: what a picture of it depends on.
pub fn scene_fingerprint(scene: &Scene) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    for file in &scene.files {
        hasher.update(&file.hash);
    }
    *hasher.finalize().as_bytes()
}
