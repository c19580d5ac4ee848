//! Scenes far from the origin of their world: the pictures are those of the same scenes near it.

use crate::stage::{Stage, at, direct, facing, glow, lambert};
use crate::statistics::Estimate;
use candelabra::ingest::load;
use candelabra::scene::Trs;
use glam::{DVec3, Vec3};
use std::fmt::Write;

/// A floor of 4 m, a lamp of 10 cm above it and a camera, somewhere.
fn file(folder: &std::path::Path, far: DVec3) -> std::path::PathBuf {
    let mut data = Vec::new();
    for half in [2.0_f32, 0.05] {
        for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
            data.extend([x * half, y * half, 0.0].map(f32::to_le_bytes).as_flattened());
        }
    }
    data.extend([0_u16, 1, 2, 0, 2, 3].map(u16::to_le_bytes).as_flattened());
    std::fs::write(folder.join("far.bin"), &data).unwrap();
    let mesh = |positions: u32, material: u32| {
        serde_json::json!({"primitives": [
            {"attributes": {"POSITION": positions}, "indices": 2, "material": material},
        ]})
    };
    let positions = |view: u32, half: f32| {
        serde_json::json!({"bufferView": view, "componentType": 5126, "count": 4, "type": "VEC3",
            "min": [-half, -half, 0.0], "max": [half, half, 0.0]})
    };
    let json = serde_json::json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [
            {"translation": far.to_array(), "children": [1, 2, 3]},
            {"mesh": 0},
            {"mesh": 1, "translation": [0, 0, 1], "rotation": [1, 0, 0, 0]},
            {"camera": 0, "translation": [0, 0, 0.8]},
        ],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.05, "znear": 0.01}}],
        "meshes": [mesh(0, 0), mesh(1, 1)],
        "materials": [
            {"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1], "metallicFactor": 0}},
            {"emissiveFactor": [1, 1, 1],
             "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 100}}},
        ],
        "accessors": [
            positions(0, 2.0), positions(1, 0.05),
            {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 48},
            {"buffer": 0, "byteOffset": 96, "byteLength": 12},
        ],
        "buffers": [{"uri": "far.bin", "byteLength": 108}],
        "extensionsUsed": ["KHR_materials_emissive_strength"],
    });
    let path = folder.join("far.gltf");
    std::fs::write(&path, json.to_string()).unwrap();
    path
}

#[test]
fn a_small_lamp_far_away_gives_all_its_light() {
    let folder = tempfile::tempdir().unwrap();
    let mean = |far: DVec3| {
        let scene = load(&file(folder.path(), far)).unwrap();
        assert!(scene.notes.is_empty(), "{:?}", scene.notes);
        let stage = Stage { scene };
        Estimate::of_picture(&stage.render(&direct(8, 64))).mean.x
    };
    let near = mean(DVec3::ZERO);
    for decade in 1..=7 {
        let far = DVec3::new(1.0, -0.3, 0.01) * 10_f64.powi(decade);
        let found = mean(far);
        assert!((found / near - 1.0).abs() < 2e-3, "1e{decade} m: {found}, not {near}");
    }
}

#[test]
fn what_cannot_be_near_every_origin_is_noted() {
    let folder = tempfile::tempdir().unwrap();
    let path = file(folder.path(), DVec3::ZERO);
    let mut json: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
    // The lamp alone is far away.
    json["nodes"][2]["translation"] = serde_json::json!([1e6, 0, 1]);
    json["nodes"][2]["name"] = serde_json::json!("beacon");
    std::fs::write(&path, json.to_string()).unwrap();
    let scene = load(&path).unwrap();
    assert_eq!(scene.notes.len(), 1, "{:?}", scene.notes);
    let mut expected = String::new();
    write!(expected, "{:.2} %", 100.0 * 0.5 * f64::from(f32::EPSILON) * 1e6 / 0.0707).unwrap();
    assert!(scene.notes[0].text.contains("beacon"), "{}", scene.notes[0]);
    assert!(
        scene.notes[0].text.contains(expected.split('.').next().unwrap()),
        "{}",
        scene.notes[0]
    );
}

#[test]
fn the_origin_is_what_positions_are_counted_from() {
    let lamp = |place: Trs| {
        let mut stage = Stage::default();
        stage.look([1e6, 2.0, 3.0], [1e6, 0.0, 0.0], 0.5);
        stage.quad([4.0, 4.0], lambert(Vec3::splat(0.5)), facing([1e6, 0.0, 0.0], [1e6, 1.0, 0.0]));
        stage.quad([0.1, 0.1], glow(Vec3::splat(50.0)), place);
        stage.scene.origin = DVec3::new(1e6, 0.0, 0.0);
        stage.scene
    };
    let scene = lamp(at([1e6 + 0.125, 1.0, 0.0]));
    let pose = scene.pose_at(0.0);
    let node = scene.instances[1].node;
    assert_eq!(Vec3::from(pose.world(node).translation), Vec3::new(0.125, 1.0, 0.0));
}
