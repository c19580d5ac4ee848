//! From the bytes of a scene file to a tree, as `candelabra build` goes.

use candelabra::emitter::Emitters;
use candelabra::light_tree::LightTree;
use candelabra::pipeline;
use std::cell::OnceCell;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// What makes a file a binary glTF.
const GLB: &[u8] = b"glTF";
/// What parts an OBJ text from its material library, which it knows as `scene.mtl`.
const LIBRARY_FOLLOWS: u8 = 0;
/// Scenes with more emitters are read, but no tree is built: it is the reading that is tried.
const MOST_EMITTERS: usize = 4096;

thread_local! {
    static FOLDER: OnceCell<TempDir> = const { OnceCell::new() };
}

/// A glTF file, text or binary.
pub fn probe_gltf(bytes: &[u8]) {
    let name = if bytes.starts_with(GLB) { "scene.glb" } else { "scene.gltf" };
    in_folder(|folder| {
        fs::write(folder.join(name), bytes).unwrap();
        load(&folder.join(name));
    });
}

/// An OBJ file, and after a zero byte its MTL file.
pub fn probe_obj(bytes: &[u8]) {
    let mut parts = bytes.splitn(2, |&byte| byte == LIBRARY_FOLLOWS);
    in_folder(|folder| {
        let scene = folder.join("scene.obj");
        fs::write(&scene, parts.next().unwrap_or_default()).unwrap();
        fs::write(folder.join("scene.mtl"), parts.next().unwrap_or_default()).unwrap();
        load(&scene);
    });
}

/// A folder that is used again and again.
fn in_folder(go: impl FnOnce(&Path)) {
    FOLDER.with(|folder| go(folder.get_or_init(|| TempDir::new().unwrap()).path()));
}

/// A file gives one clear error or a scene; and a scene gives one, or a tree that is sound.
fn load(path: &Path) {
    let scene = match pipeline::load_scene(path) {
        Ok(scene) => scene,
        Err(error) => {
            assert!(error.to_string().contains("scene."), "the file is not named: {error}");
            return;
        }
    };
    let emitters = Emitters::collect(&scene);
    if emitters.len() > MOST_EMITTERS {
        return;
    }
    let frames: Vec<i32> = pipeline::frames_of(&scene).into_iter().take(3).collect();
    let Ok(survey) = pipeline::survey(&scene, &emitters, &frames) else { return };
    let bytes = pipeline::build_tree(&survey);
    let tree = LightTree::open(bytes).expect("a tree just built opens");
    tree.verify().expect("a tree just built is sound");
    assert_eq!(tree.emitter_count(), emitters.len());
}
