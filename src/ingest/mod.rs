//! Floor 2: files in, a scene index out.
//!
//! [`load`] compiles a glTF (`.gltf`, `.glb`) or OBJ (`.obj`) file to [`Scene`]'s normal form, so
//! that nothing above asks where a prim came from.
//!
//! Files are not trusted. Whatever a file holds, the answer is a scene that keeps its promises, or one
//! [`IngestError`] that names the file, the object in it and the remedy. What is broken is mended or left out,
//! and noted in [`Scene::notes`]; `docs/what_is_read.md` lists what. Refused is only what cannot be read safely
//! (cycles, numbers that overflow, memory out of proportion to the file's size, anything but a regular
//! file) or is not there (a truncated buffer). A file reads nothing outside its own folder.
//!
//! What stands in for something that cannot be read is neutral. An emission without its texture would be far too
//! bright: that light is left out.
//!
//! `extras` that `scripts/usd_to_gltf.py` writes (see `carriers.md`) are read, but any glTF with emissive
//! materials or punctual lights is as good.
#![doc = include_str!("carriers.md")]

mod budget;
mod census;
mod error;
mod extent;
mod gltf;
mod ies;
mod image;
mod notes;
mod obj;
mod open_exr;
mod origin;
mod paths;
mod uri;

pub use error::IngestError;

use crate::scene::{Scene, SourceFile};
use crate::store::read_regular;
use error::Fault;
use std::path::Path;

/// Reads a scene file, and the files it refers to. The format follows from the file's extension.
pub fn load(path: &Path) -> Result<Scene, IngestError> {
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    let scene = match extension.to_str() {
        Some("gltf") => gltf::load(path, false),
        Some("glb") => gltf::load(path, true),
        Some("obj") => obj::load(path),
        _ => Err(Fault::new("file", "is in a format that is not read")
            .remedy("convert it to .gltf, .glb or .obj; USD with scripts/usd_to_gltf.py")),
    };
    let checked = scene.and_then(|scene| {
        extent::check(&scene)?;
        census::check(&scene)?;
        Ok(scene)
    });
    match checked {
        Ok(mut scene) => {
            scene.source = path.to_path_buf();
            origin::settle(&mut scene);
            Ok(scene)
        }
        Err(fault) => Err(fault.in_file(path)),
    }
}

/// No file is read that is larger: a GLB counts its bytes in 32 bits, and text of this length takes many
/// times as much memory.
const MOST_FILE_BYTES: u64 = 4 << 30;

/// The bytes of the scene file itself, and a record of them.
fn read_file(path: &Path) -> Result<(Vec<u8>, SourceFile), Fault> {
    let bytes = read_regular(path, MOST_FILE_BYTES).map_err(|error| {
        Fault::new("file", format!("cannot be read: {error}")).remedy("check the path")
    })?;
    let read = SourceFile::new(path.to_path_buf(), &bytes);
    Ok((bytes, read))
}
