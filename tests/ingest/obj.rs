//! OBJ and MTL.

use crate::{files, shared};
use candelabra::ingest::{IngestError, load};
use candelabra::scene::{AlphaMode, Category, Scene};
use glam::{DVec3, Vec2, Vec3};
use std::path::{Path, PathBuf};

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
    let paths: Vec<&str> = scene.instances.iter().map(|i| &*i.path).collect();
    assert_eq!(paths, ["/lamp", "/room"]);
    let glow = &scene.materials[scene.meshes[0].material.unwrap() as usize];
    assert_eq!(glow.emission_nits, Vec3::new(3.0, 2.0, 1.0));
    assert_eq!((glow.roughness, glow.metallic, glow.opacity), (0.5, 1.0, 0.5));
    assert_eq!(glow.alpha_mode, AlphaMode::Blend);
    assert!(glow.emission_texture.is_some());
    assert_eq!(scene.meshes[0].uv_sets[0][0], Vec2::new(0.25, 0.75), "v points down");
    let wall = &scene.materials[scene.meshes[1].material.unwrap() as usize];
    assert_eq!((wall.base_color, wall.specular, wall.ior), (Vec3::new(0.25, 0.3, 0.35), 0.5, 1.5));
    assert!((wall.roughness - (2.0f32 / 12.0).powf(0.25)).abs() < 1e-6);
    assert_eq!(scene.meshes[1].triangles.len(), 2);
    assert_eq!(scene.notes.len(), 1);
    assert!(scene.notes[0].text.contains("absent.png"), "{:?}", scene.notes);
}

/// What is not there may have been a light, so that notes about it are about lights.
#[test]
fn coordinates_that_no_texture_is_looked_up_at_are_not_kept() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("m.mtl"), "newmtl wall\nKd 0.5 0.6 0.7\n").unwrap();
    for material in ["mtllib m.mtl\nusemtl wall\n", ""] {
        let obj = format!("{TRIANGLE}{material}f 1/1 2/1 3/1\n");
        let scene = load_in(folder.path(), &obj).unwrap();
        assert_eq!((scene.meshes.len(), scene.meshes[0].uv_sets.len()), (1, 0));
    }
}

#[test]
fn stale_references_are_noted() {
    let folder = tempfile::tempdir().unwrap();
    for library in ["absent.mtl", "../outside.mtl", "C:\\models\\a.mtl", "/etc/passwd", "a b.mtl"] {
        let obj = format!("mtllib {library}\nusemtl lamb\n{TRIANGLE}f 1 2 3\n");
        let scene = load_in(folder.path(), &obj).unwrap();
        assert_eq!(scene.meshes[0].material, None);
        let [library_note, material] = &scene.notes[..] else { panic!("{:?}", scene.notes) };
        assert!(material.text.contains("material \"lamb\""), "{material}");
        assert!(
            library_note.text.contains(&format!("material library {library:?}")),
            "{library_note}"
        );
        assert!(scene.notes.iter().all(|note| note.category == Category::Lights));
    }
    // What exporters write for none.
    let scene = load_in(folder.path(), &format!("{TRIANGLE}usemtl None\nf 1 2 3\n")).unwrap();
    assert_eq!(scene.notes, []);
}

/// The format parts libraries by spaces; programs write names that hold spaces.
#[test]
fn a_line_names_several_libraries_or_one_with_spaces() {
    let folder = tempfile::tempdir().unwrap();
    for (name, material) in [("a.mtl", "a"), ("b.mtl", "b"), ("c d.mtl", "c"), ("e.mtl", "a")] {
        let mtl = format!("newmtl {material}\nKe {} 1 1\n", name.len());
        std::fs::write(folder.path().join(name), mtl).unwrap();
    }
    let load = |lines: &str| {
        let uses = ["a", "b", "c"].map(|name| format!("usemtl {name}\nf 1 2 3\n")).concat();
        let scene = load_in(folder.path(), &format!("{TRIANGLE}{lines}\n{uses}")).unwrap();
        let known: Vec<(String, f32)> =
            scene.materials.iter().map(|m| (m.name.clone(), m.emission_nits.x)).collect();
        (known, scene.notes.len())
    };
    let all = [("a", 5.0), ("b", 5.0), ("c", 7.0)].map(|(name, red)| (name.to_string(), red));
    for lines in [
        "mtllib a.mtl b.mtl c d.mtl",
        "mtllib c d.mtl b.mtl a.mtl",
        "mtllib a.mtl\nmtllib\tb.mtl  \nmtllib \"c d.mtl\"",
        "mtllib a.mtl \\\n b.mtl\nmtllib c d.mtl\nmtllib a.mtl",
    ] {
        assert_eq!(load(lines), (all.to_vec(), 0), "{lines}");
    }
    let (known, notes) = load("mtllib a.mtl absent.mtl e.mtl");
    assert_eq!((known, notes), (all[..1].to_vec(), 3), "b and c; the library; a second time a");
}

/// A face is covered once, whatever corner comes first.
#[test]
fn concave_faces_have_their_area() {
    let folder = tempfile::tempdir().unwrap();
    // An L of 2.2 square metres.
    let corners = [[0.0, 0.0], [2.0, 0.0], [2.0, 0.6], [1.0, 0.6], [1.0, 1.6], [0.0, 1.6]];
    let area = 1.2 + 1.0;
    for (turn, first) in [(false, 0), (false, 1), (true, 2), (true, 3), (false, 4), (true, 5)] {
        let mut order: Vec<usize> = (0..6).map(|i| (i + first) % 6).collect();
        if turn {
            order.reverse();
        }
        let vertices = corners.map(|[x, y]| format!("v {x} {y} 3\n")).concat();
        let face = order.iter().map(|i| format!(" {}", i + 1)).collect::<String>();
        let scene = load_in(folder.path(), &format!("{vertices}f{face}\n")).unwrap();
        let mesh = &scene.meshes[0];
        let normals = mesh.triangles.iter().map(|t| {
            let [a, b, c] = t.map(|corner| mesh.positions[corner as usize]);
            0.5 * (b - a).cross(c - a)
        });
        let covered: f32 = normals.clone().map(Vec3::length).sum();
        let facing = normals.sum::<Vec3>().z;
        assert!((covered - area).abs() < 1e-5, "{order:?}: {covered}");
        assert!((facing - if turn { -area } else { area }).abs() < 1e-5, "{order:?}: {facing}");
        assert_eq!(scene.notes, []);
    }
    let bow = "v 0 0 0\nv 1 1 0\nv 1 0 0\nv 0 3 0\nf 1 2 3 4\n";
    let scene = load_in(folder.path(), bow).unwrap();
    assert!(scene.notes[0].text.contains("cross themselves"), "{:?}", scene.notes);
}

/// One line that cannot be read costs no more than itself.
#[test]
fn odd_lines_cost_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let mtl = "Ke 9 9 9\nnewmtl glow\nillum x\nNs\nKs 1 2\nd -halo 0.5\nKe xyz 0.95047 1 1.08883\nmap_d\n\
        newmtl\nnewmtl dim\nTr 0.25\nKe spectral lamp.rfl\nKE 1 1 1\n\
        newmtl sky\nmap_Ke -mm 0 4 -s 2 2 2 glow.png\nnewmtl gone\nKe 3 3 3\nmap_Ke gone.png\n";
    std::fs::write(folder.path().join("m.mtl"), mtl).unwrap();
    std::fs::write(folder.path().join("glow.png"), files::png(1, 1, [255; 4])).unwrap();
    let uses =
        ["glow", "dim", "sky", "gone"].map(|name| format!("usemtl {name}\nf 1 2 3\n")).concat();
    let obj =
        format!("mtllib m.mtl\n{TRIANGLE}vt 1\nvn a\nl 1 2\np 1\nf 1 2\nf 1 2 9\nf x\n{uses}");
    let scene = load_in(folder.path(), &obj).unwrap();
    let [glow, dim, sky, gone] = &scene.materials[..] else { panic!("{:?}", scene.materials) };
    assert!((glow.emission_nits - Vec3::ONE).abs().max_element() < 1e-4);
    assert_eq!((glow.opacity, dim.opacity), (0.5, 0.75));
    assert_eq!(dim.emission_nits, Vec3::ONE, "the last of several counts");
    assert_eq!(sky.emission_nits, Vec3::splat(4.0));
    assert!(sky.emission_texture.unwrap().transform.is_some());
    assert_eq!(gone.emission_nits, Vec3::ZERO, "without its picture it would be too bright");
    let of_light: Vec<&str> = scene
        .notes
        .iter()
        .filter(|note| note.category == Category::Lights)
        .map(|note| note.text.as_str())
        .collect();
    assert_eq!(of_light.len(), 2, "{of_light:?}");
    assert!(of_light.iter().any(|text| text.contains("gone.png") && text.contains("left out")));
    assert!(of_light.iter().any(|text| text.contains("texture coordinates")), "{of_light:?}");
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

/// The number and the area of all triangles of a file, as another reader finds them.
fn by_tobj(path: &Path) -> (usize, f64) {
    let options = tobj::LoadOptions { triangulate: true, ..Default::default() };
    let (models, _) = tobj::load_obj(path, &options).unwrap();
    let triangles = models.iter().flat_map(|model| {
        let corner = |&i: &u32| {
            DVec3::from_slice(
                &[0, 1, 2].map(|axis| f64::from(model.mesh.positions[3 * i as usize + axis])),
            )
        };
        model
            .mesh
            .indices
            .chunks_exact(3)
            .map(move |t| [corner(&t[0]), corner(&t[1]), corner(&t[2])])
    });
    summed(triangles)
}

fn by_us(scene: &Scene) -> (usize, f64) {
    let triangles = scene.instances.iter().flat_map(|instance| {
        let mesh = &scene.meshes[instance.mesh as usize];
        mesh.triangles.iter().map(|t| t.map(|corner| mesh.positions[corner as usize].as_dvec3()))
    });
    summed(triangles)
}

fn summed(triangles: impl Iterator<Item = [DVec3; 3]>) -> (usize, f64) {
    triangles.fold((0, 0.0), |(count, area), [a, b, c]| {
        (count + 1, area + 0.5 * (b - a).cross(c - a).length())
    })
}

/// Of convex faces every way to cut gives the same area and as many triangles.
#[test]
fn another_reader_finds_the_same_surfaces() {
    let mut text = String::from("o fans\n");
    for face in 0..40usize {
        let corners = 3 + face % 6;
        for corner in 0..corners {
            let angle = corner as f64 / corners as f64 * std::f64::consts::TAU;
            text += &format!("v {} {} {face}\n", angle.cos(), angle.sin());
        }
        let named: Vec<String> = (0..corners).map(|i| format!("-{}", corners - i)).collect();
        text += &format!("f {}\n", named.join(" "));
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("fans.obj");
    std::fs::write(&path, text).unwrap();
    let mut files = vec![path];
    if let Some(folder) = shared::folder("real/stochastic_lightcuts_cornell") {
        let is_obj = |path: &PathBuf| path.extension().is_some_and(|extension| extension == "obj");
        files.extend(shared::files_below(&folder).into_iter().filter(is_obj));
    }
    for path in files {
        let ((count, area), (wanted, exact)) =
            (by_us(&candelabra::ingest::load(&path).unwrap()), by_tobj(&path));
        assert_eq!(count, wanted, "{}", path.display());
        assert!((area / exact - 1.0).abs() < 1e-6, "{area} {exact}");
    }
}
