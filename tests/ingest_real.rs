//! Files that other people wrote.

#[path = "ingest/shared.rs"]
mod shared;

use candelabra::ingest::load;

#[test]
fn every_real_file_loads() {
    let Some(folder) = shared::folder("real") else { return };
    for file in shared::files_below(&folder) {
        let extension = file.extension().and_then(|e| e.to_str());
        if matches!(extension, Some("gltf" | "glb" | "obj"))
            && !file.starts_with(folder.join("malformed"))
        {
            let start = std::time::Instant::now();
            match load(&file) {
                Ok(s) => println!(
                    "{} {:?} nodes {} inst {} lights {} cams {} meshes {} mats {} tex {} notes {:#?}\n {:?}",
                    file.display(),
                    start.elapsed(),
                    s.nodes.len(),
                    s.instances.len(),
                    s.lights.len(),
                    s.cameras.len(),
                    s.meshes.len(),
                    s.materials.len(),
                    s.textures.len(),
                    s.notes,
                    s.requirements()
                ),
                Err(e) => println!("ERR {e}"),
            }
        }
    }
}
