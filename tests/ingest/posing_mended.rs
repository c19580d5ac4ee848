//! Skins and morph targets that are broken: the mesh is left as it is, with one note.

use crate::files::{File, lamp};
use crate::posing::{all, assert_near, bind, load, places, shaded, target};
use candelabra::scene::Category;
use glam::{Mat4, Vec3};
use serde_json::{Value, json};

/// A file with a skin and a morph target that are good.
fn posed() -> File {
    let mut file = shaded();
    target(&mut file, &[("POSITION", &[1.0; 9]), ("NORMAL", &[0.5; 9])]);
    file.json["nodes"][0]["weights"] = json!([1]);
    let joint = file.add("nodes", json!({"name": "joint", "translation": [0, 0, 2]}));
    file.json["scenes"][0]["nodes"] = json!([0, joint]);
    bind(&mut file, &[joint], Some(&[Mat4::IDENTITY]), &[vec![all((0, 1.0)); 3]]);
    file
}

#[test]
fn what_cannot_pose_a_mesh_leaves_it_as_it_is() {
    let primitive = |file: &mut File, key: &str, name: &str, value: Value| {
        file.json["meshes"][0]["primitives"][0][key][name] = value;
    };
    let attribute = |file: &mut File, name: &str, accessor: usize| {
        primitive(file, "attributes", name, json!(accessor));
    };
    let skinless = |text: &str, damage: &dyn Fn(&mut File)| {
        let mut file = posed();
        damage(&mut file);
        // The morph target still is.
        (
            text.to_string(),
            file,
            vec![Vec3::ONE, Vec3::new(2.0, 1.0, 1.0), Vec3::new(1.0, 2.0, 1.0)],
        )
    };
    let unmorphed = |text: &str, damage: &dyn Fn(&mut File)| {
        let mut file = posed();
        damage(&mut file);
        let lifted = [Vec3::ZERO, Vec3::X, Vec3::Y].map(|place| place + Vec3::Z * 2.0);
        (text.to_string(), file, lifted.to_vec())
    };
    let joints = |numbers: [u16; 4]| {
        move |file: &mut File| {
            let bytes = numbers.map(u16::to_le_bytes).concat().repeat(3);
            let accessor = file.array(&bytes, 5123, 3, "VEC4");
            attribute(file, "JOINTS_0", accessor);
        }
    };
    let weights = |values: [f32; 4]| {
        move |file: &mut File| {
            let accessor = file.floats(&values.repeat(3), "VEC4");
            attribute(file, "WEIGHTS_0", accessor);
        }
    };
    let matrices = |columns: Mat4| {
        move |file: &mut File| {
            let bytes = columns.to_cols_array().map(f32::to_le_bytes).concat();
            let accessor = file.array(&bytes, 5126, 1, "MAT4");
            file.json["skins"][0]["inverseBindMatrices"] = json!(accessor);
        }
    };
    let huge = Mat4::from_scale(Vec3::splat(1e30));
    for (text, file, expected) in [
        skinless("skin is not in the file", &|f| f.json["nodes"][0]["skin"] = json!(7)),
        skinless("a joint that its skin does not have", &joints([1, 0, 0, 0])),
        skinless("a joint that its skin does not have", &|f| {
            f.json["skins"][0]["joints"] = json!([])
        }),
        skinless("joints that are not in the scene", &|f| {
            f.json["skins"][0]["joints"] = json!([9])
        }),
        skinless("joints that are not in the scene", &|f| {
            f.json["scenes"][0]["nodes"] = json!([0])
        }),
        skinless("17 sets of joints", &|f| {
            let attributes = f.json["meshes"][0]["primitives"][0]["attributes"].clone();
            for set in 1..17 {
                for name in ["JOINTS", "WEIGHTS"] {
                    let accessor = attributes[format!("{name}_0")].as_u64().unwrap();
                    attribute(f, &format!("{name}_{set}"), accessor as usize);
                }
            }
        }),
        skinless("no WEIGHTS_0", &|f| {
            let primitive = &mut f.json["meshes"][0]["primitives"][0];
            primitive["attributes"].as_object_mut().unwrap().remove("WEIGHTS_0");
        }),
        skinless("WEIGHTS_0 has fewer elements", &|f| {
            let short = f.floats(&[1.0; 4], "VEC4");
            attribute(f, "WEIGHTS_0", short);
        }),
        skinless("WEIGHTS_0 cannot be F32 x 3", &|f| {
            let flat = f.floats(&[1.0; 9], "VEC3");
            attribute(f, "WEIGHTS_0", flat);
        }),
        skinless("JOINTS_0 cannot be F32 x 4", &|f| {
            let floats = f.floats(&[0.0; 12], "VEC4");
            attribute(f, "JOINTS_0", floats);
        }),
        skinless("JOINTS_0 cannot be read: accessor 99", &|f| attribute(f, "JOINTS_0", 99)),
        skinless("out of all bounds", &weights([f32::INFINITY, 0.0, 0.0, 0.0])),
        skinless("out of all bounds", &matrices(Mat4::NAN)),
        skinless("out of all bounds", &matrices(huge)),
        skinless("no inverse bind matrix for each joint", &|f| {
            f.json["skins"][0]["joints"] = json!([1, 1]);
        }),
        skinless("no inverse bind matrix for each joint", &|f| {
            let accessor = f.floats(&[1.0; 16], "SCALAR");
            f.json["skins"][0]["inverseBindMatrices"] = json!(accessor);
        }),
        skinless("its skin cannot be read: accessor 99", &|f| {
            f.json["skins"][0]["inverseBindMatrices"] = json!(99);
        }),
        unmorphed("1 morph targets and 2 weights", &|f| {
            f.json["nodes"][0]["weights"] = json!([1, 1])
        }),
        unmorphed("fewer POSITION than there are positions", &|f| {
            let short = f.floats(&[1.0; 3], "VEC3");
            f.json["meshes"][0]["primitives"][0]["targets"][0]["POSITION"] = json!(short);
        }),
        unmorphed("NORMAL of morph target 0 has a type", &|f| {
            let wide = f.floats(&[1.0; 12], "VEC4");
            f.json["meshes"][0]["primitives"][0]["targets"][0]["NORMAL"] = json!(wide);
        }),
        unmorphed("accessor 99", &|f| {
            f.json["meshes"][0]["primitives"][0]["targets"][0]["NORMAL"] = json!(99);
        }),
        unmorphed("out of all bounds", &|f| f.json["nodes"][0]["weights"] = json!([1e30])),
        unmorphed("out of all bounds", &|f| {
            let nan = f.floats(&[f32::NAN; 9], "VEC3");
            f.json["meshes"][0]["primitives"][0]["targets"][0]["POSITION"] = json!(nan);
        }),
    ] {
        let scene = load(&file);
        let [note] = &scene.notes[..] else { panic!("{text}: {:?}", scene.notes) };
        assert_eq!(note.category, Category::Animation, "{note}");
        assert!(
            note.text.contains("mesh 0 \"flame\"") && note.text.contains(&text),
            "{text}: {note}"
        );
        assert_near(&places(&scene, 0, 0.0), &expected);
    }
}

/// What is odd and can be posed all the same.
#[test]
fn what_poses_a_mesh_may_be_odd() {
    let expected = [Vec3::ONE, Vec3::new(2.0, 1.0, 1.0), Vec3::new(1.0, 2.0, 1.0)]
        .map(|place| place + Vec3::Z * 2.0);
    let takes = |notes: usize, damage: &dyn Fn(&mut File)| {
        let mut file = posed();
        damage(&mut file);
        let scene = load(&file);
        assert_eq!(scene.notes.len(), notes, "{:?}", scene.notes);
        assert_near(&places(&scene, 0, 0.0), &expected);
    };
    takes(0, &|_| {});
    takes(0, &|f| drop(f.json["skins"][0].as_object_mut().unwrap().remove("inverseBindMatrices")));
    takes(0, &|f| f.json["skins"][0]["skeleton"] = json!(-1));
    // Integers that were not normalised; numbers of joints that are not there, of weight zero.
    takes(0, &|f| {
        let weights = f.array(&[200, 0, 0, 0].repeat(3), 5121, 3, "VEC4");
        let joints = f.array(&[0, 77, 0, 9].repeat(3), 5121, 3, "VEC4");
        f.attribute("WEIGHTS_0", weights);
        f.attribute("JOINTS_0", joints);
    });
    // Negative weights and those that are no numbers count as none; without any there is one joint.
    takes(0, &|f| {
        let weights = f.floats(&[2.0, -1.0, f32::NAN, 0.0].repeat(3), "VEC4");
        f.attribute("WEIGHTS_0", weights);
    });
    takes(1, &|f| {
        let weights = f.floats(&[0.0; 12], "VEC4");
        f.attribute("WEIGHTS_0", weights);
    });
    // A skinned node below several is drawn once.
    takes(2, &|f| {
        f.add("nodes", json!({"children": [0], "translation": [5, 5, 5]}));
        f.add("nodes", json!({"children": [0]}));
        f.json["scenes"][0]["nodes"] = json!([2, 3, 1]);
    });
    takes(1, &|f| {
        let colors = f.floats(&[0.5; 9], "VEC3");
        f.json["meshes"][0]["primitives"][0]["targets"][0]["COLOR_0"] = json!(colors);
    });
    // A joint of scale zero has no normals; those of the triangles take their place.
    let mut file = posed();
    file.json["nodes"][1]["scale"] = json!([0, 0, 0]);
    let scene = load(&file);
    assert!(scene.meshes[0].normals.iter().all(|normal| normal.is_normalized()));
    assert_near(&places(&scene, 0, 0.0), &[Vec3::Z * 2.0; 3]);
}

/// Copies of a mesh take what they hold, and not what it took to make them.
#[test]
fn a_crowd_may_share_a_mesh() {
    const VERTICES: usize = 5000;
    const MEMBERS: usize = 400;
    let mut file = lamp();
    let row = |i: usize| [i as f32, (i * i % 97) as f32, 0.0];
    let positions = file.floats(&(0..VERTICES).flat_map(row).collect::<Vec<_>>(), "VEC3");
    file.attribute("POSITION", positions);
    let corner = |i: usize| (i / 3 + i % 3).min(VERTICES - 1) as u32;
    let corners: Vec<u8> =
        (0..6 * VERTICES).flat_map(|i| corner(i % (3 * VERTICES)).to_le_bytes()).collect();
    let indices = file.array(&corners, 5125, 6 * VERTICES, "SCALAR");
    file.json["meshes"][0]["primitives"][0]["indices"] = json!(indices);
    file.add("nodes", json!({"name": "joint"}));
    bind(&mut file, &[1], None, &[vec![all((0, 1.0)); VERTICES]]);
    for member in 1..MEMBERS {
        let joint = file.add("nodes", json!({"translation": [0, 0, member]}));
        let skin = file.add("skins", json!({"joints": [joint]}));
        file.add("nodes", json!({"mesh": 0, "skin": skin}));
    }
    file.json["scenes"][0]["nodes"] = (0..2 * MEMBERS).collect();
    let scene = load(&file);
    assert_eq!((scene.meshes.len(), scene.notes.len()), (MEMBERS, 0));
}

#[test]
fn a_few_bytes_cannot_ask_for_endless_work() {
    let mut file = lamp();
    // A hundred thousand targets of a hundred thousand vertices each, in two megabytes.
    const MANY: usize = 100_000;
    let places = file.floats(&vec![0.5; 3 * MANY], "VEC3");
    file.attribute("POSITION", places);
    let corners: Vec<u8> = (0..MANY as u32).flat_map(|i| i.to_le_bytes()).collect();
    let corners = file.array(&corners, 5125, MANY, "SCALAR");
    file.json["meshes"][0]["primitives"][0]["indices"] = json!(corners);
    file.json["meshes"][0]["primitives"][0]["targets"] =
        vec![json!({"POSITION": places}); MANY].into();
    file.json["meshes"][0]["weights"] = vec![json!(1); MANY].into();
    let error = file.load().unwrap_err().to_string();
    assert!(error.contains("out of proportion"), "{error}");
}
