//! OBJ and MTL.

use crate::files;
use candelabra::ingest::{IngestError, load};
use candelabra::scene::{AlphaMode, Scene};
use glam::{Vec2, Vec3};
use std::path::Path;

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.25 0.25\n";

fn load_in(folder: &Path, obj: &str) -> Result<Scene, IngestError> {
    let path = folder.join("scene.obj");
    std::fs::write(&path, obj).unwrap();
    load(&path)
}

#[test]
fn objects_emit_by_their_material() {
    let folder = tempfile::tempdir().unwrap();
    let mtl = "newmtl glow\nKd 0 0 0\nKe 3 2 1\nmap_Ke glow.png\nPr 0.5\nPm 1\nd 0.5\n\
        newmtl wall\nKd 0.5 0.6 0.7\nmap_Kd absent.png\nNs 10\nKs 0.5 0.5 0.5\nNi 1.0\n";
    std::fs::write(folder.path().join("m.mtl"), mtl).unwrap();
    std::fs::write(folder.path().join("glow.png"), files::png(1, 1, [255; 4])).unwrap();
    let obj = format!(
        "mtllib m.mtl\n{TRIANGLE}o lamp\nusemtl glow\nf 1/1 2/1 3/1\n\
         o room\nusemtl wall\nf 1 2 3\nf -1 -2 -3\n"
    );
    let scene = load_in(folder.path(), &obj).unwrap();
    let paths: Vec<&str> = scene.instances.iter().map(|i| i.path.as_str()).collect();
    assert_eq!(paths, ["/lamp", "/room"]);
    let glow = &scene.materials[scene.meshes[0].material.unwrap() as usize];
    assert_eq!(glow.emission_nits, Vec3::new(3.0, 2.0, 1.0));
    assert_eq!((glow.roughness, glow.metallic, glow.opacity), (0.5, 1.0, 0.5));
    assert_eq!(glow.alpha_mode, AlphaMode::Blend);
    assert!(glow.emission_texture.is_some());
    assert_eq!(scene.meshes[0].uv_sets[0][0], Vec2::new(0.25, 0.75), "v points down");
    let wall = &scene.materials[scene.meshes[1].material.unwrap() as usize];
    assert_eq!((wall.base_color, wall.specular, wall.ior), (Vec3::new(0.5, 0.6, 0.7), 0.5, 1.5));
    assert!((wall.roughness - (2.0f32 / 12.0).powf(0.25)).abs() < 1e-6);
    assert_eq!(scene.meshes[1].triangles.len(), 2);
    assert_eq!(scene.notes.len(), 1);
    assert!(scene.notes[0].text.contains("absent.png"), "{:?}", scene.notes);
}

#[test]
fn stale_references_are_noted() {
    let folder = tempfile::tempdir().unwrap();
    for library in ["absent.mtl", "../outside.mtl", "C:\\models\\a.mtl", "/etc/passwd"] {
        let obj = format!("mtllib {library}\nusemtl a\n{TRIANGLE}f 1 2 3\n");
        let scene = load_in(folder.path(), &obj).unwrap();
        assert_eq!(scene.meshes[0].material, None);
        assert!(scene.notes[0].text.contains("material library"), "{library}: {:?}", scene.notes);
    }
}

#[test]
fn numbers_that_are_not_finite_are_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let obj = format!(
        "{TRIANGLE}v nan 0 0\nv 1e400 0 0\nvn inf 0 0\nf 1//1 2//1 3//1\nf 1 2 4\nf 5 1 2\n"
    );
    let scene = load_in(folder.path(), &obj).unwrap();
    let mesh = &scene.meshes[0];
    assert_eq!(mesh.triangles.len(), 1);
    assert!(mesh.positions.iter().all(|position| position.is_finite()));
    assert!(mesh.normals.iter().all(|normal| normal.is_normalized()));
    assert!(scene.notes[0].text.contains("not finite"), "{:?}", scene.notes);
}

#[test]
fn text_comes_as_it_comes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("odd.obj");
    let body = format!("# caf\u{e9}\r\n{}f 1 2 3 2", TRIANGLE.replace('\n', "\r\n"));
    let latin: Vec<u8> = body.chars().map(|c| c as u8).collect();
    std::fs::write(&path, [b"\xEF\xBB\xBF".to_vec(), latin].concat()).unwrap();
    assert_eq!(load(&path).unwrap().meshes[0].triangles, [[0, 1, 2], [0, 2, 1]]);
}
