//! Emission that animations change, by `KHR_animation_pointer`.

use crate::files::{File, lamp, png};
use candelabra::emitter::Emitters;
use candelabra::scene::{Interpolation, Keys, LightKind, Scene};
use glam::{DVec3, Vec3};
use serde_json::json;

const FACTOR: &str = "/materials/0/emissiveFactor";
const STRENGTH: &str = "/materials/0/extensions/KHR_materials_emissive_strength/emissiveStrength";
/// The lamp's.
const COLOR: Vec3 = Vec3::new(1.0, 0.5, 0.25);

#[track_caller]
fn load(file: &File) -> Scene {
    let scene = file.load().unwrap_or_else(|error| panic!("{error}"));
    assert!(scene.notes.is_empty(), "{:?}", scene.notes);
    scene
}

#[track_caller]
fn keys(scene: &Scene) -> &Keys<Vec3> {
    scene.instances[0].values.as_ref().expect("it is constant")
}

#[test]
fn a_strength_or_a_factor_is_animated() {
    for (how, interpolation) in [("LINEAR", Interpolation::Linear), ("STEP", Interpolation::Step)] {
        let mut file = lamp();
        file.animate(STRENGTH, &[0.0, 0.5, 2.0], &[2.0, 6.0, 0.0], how);
        let scene = load(&file);
        let found = keys(&scene);
        assert_eq!(found.values, [2.0 * COLOR, 6.0 * COLOR, Vec3::ZERO]);
        assert_eq!(found.interpolation, interpolation);
        // A quarter of a second in, as it is and as it shines.
        let share = if how == "STEP" { 2.0 } else { 4.0 };
        assert_eq!(scene.rgb_of_instance(0, &scene.pose_at(0.25)), share * COLOR);
        assert!(scene.has_lights_that_change());
        assert_eq!(candelabra::pipeline::frames_of(&scene).len(), 49);
        assert_eq!(scene.peak_rgb_of_instance(0), 6.0 * COLOR);
    }
    let mut file = lamp();
    file.animate(FACTOR, &[0.0, 1.0], &[1.0, 0.0, 0.0, 0.0, 0.5, 1.0], "LINEAR");
    assert_eq!(keys(&load(&file)).values, [Vec3::X * 8.0, Vec3::new(0.0, 4.0, 8.0)]);
}

/// At each frame the emission is the product of both, a spline of the one and a line of the other.
#[test]
fn factor_and_strength_are_multiplied_frame_by_frame() {
    let mut file = lamp();
    file.animate(FACTOR, &[0.0, 1.0], &[1.0, 0.0, 0.0, 1.0, 0.0, 1.0], "LINEAR");
    file.animate(STRENGTH, &[0.0, 1.0], &[0.0, 4.0, -9.0, -40.0, 1.0, 0.0], "CUBICSPLINE");
    let scene = load(&file);
    let mut dark = 0;
    for frame in 0..=24 {
        let t = f64::from(frame) / 24.0;
        let (t2, t3) = (t * t, t * t * t);
        let spline = (2.0 * t3 - 3.0 * t2 + 1.0) * 4.0 - 9.0 * (t3 - 2.0 * t2 + t)
            + (3.0 * t2 - 2.0 * t3)
            - 40.0 * (t3 - t2);
        let expected = DVec3::new(1.0, 0.0, t) * spline.max(0.0);
        let value = keys(&scene).at(t, scene.timeline);
        assert!((value - expected).length() < 2e-5, "{frame}: {value} {expected}");
        dark += usize::from(spline < 0.0);
    }
    assert!(dark < 20);
}

/// What is dark in the file and shines later is a light with its texture, in the tree of the frames at which it shines.
#[test]
fn what_is_dark_at_rest_shines_with_its_texture() {
    for strength in ["STEP", "LINEAR"] {
        let mut file = lamp();
        file.json["materials"][0]["emissiveFactor"] = json!([0, 0, 0]);
        let picture = png(4, 4, [255, 0, 255, 255]);
        let view = file.view(&picture);
        file.json["images"] = json!([{"bufferView": view, "mimeType": "image/png"}]);
        file.json["textures"] = json!([{"source": 0}]);
        file.json["materials"][0]["emissiveTexture"] = json!({"index": 0});
        let uv = file.floats(&[0.5; 6], "VEC2");
        file.attribute("TEXCOORD_0", uv);
        file.animate(FACTOR, &[0.0, 1.0], &[0.0, 0.0, 0.0, 1.0, 1.0, 1.0], strength);
        let scene = load(&file);
        assert!(scene.materials[0].emission_texture.is_some());
        let emitters = Emitters::collect(&scene);
        assert_eq!(emitters.len(), 1);
        // Without its texture it would be far too bright.
        file.json["images"][0]["bufferView"] = json!(99);
        let scene = file.load().unwrap();
        assert!(scene.notes[0].text.contains("its light is left out"), "{:?}", scene.notes);
        assert_eq!(Emitters::collect(&scene).len(), 0);
        assert!(scene.instances[0].values.is_none());
    }
}

/// A mesh that is there twice, another of the same material, and one of another.
#[test]
fn every_mesh_of_the_material_shines() {
    let mut file = lamp();
    let other_material = file.add("materials", json!({"emissiveFactor": [1, 1, 1]}));
    let first = file.json["meshes"][0]["primitives"][0].clone();
    let mut other = first.clone();
    other["material"] = json!(other_material);
    let both = file.add("meshes", json!({"primitives": [first, other]}));
    file.add("nodes", json!({"name": "b", "mesh": 0}));
    file.add("nodes", json!({"name": "c", "mesh": both}));
    file.json["scenes"][0]["nodes"] = json!([0, 1, 2]);
    file.animate(STRENGTH, &[0.0, 1.0], &[1.0, 2.0], "LINEAR");
    let scene = load(&file);
    let varies: Vec<bool> = scene.instances.iter().map(|one| one.values.is_some()).collect();
    assert_eq!(varies, [true, true, true, false]);
}

#[test]
fn values_of_extras_take_the_place_of_emission_over_time() {
    let mut file = lamp();
    file.animate(STRENGTH, &[0.0, 1.0], &[1.0, 2.0], "LINEAR");
    let values = json!({"times": [0, 1], "rgb": [[7, 7, 7], [8, 8, 8]]});
    file.lux(json!({"type": "MeshLight", "inputs": {}, "values": values}));
    assert_eq!(keys(&load(&file)).values[0], Vec3::splat(7.0));
    // A sphere light that a mesh stands for has that of its material.
    let mut file = lamp();
    file.animate(STRENGTH, &[0.0, 1.0], &[1.0, 2.0], "LINEAR");
    file.lux(json!({"type": "SphereLight", "inputs": {}, "radius": 0.5}));
    let scene = load(&file);
    assert!(matches!(scene.lights[0].kind, LightKind::Sphere { .. }));
    assert_eq!(scene.lights[0].values.as_ref().unwrap().values, [COLOR, 2.0 * COLOR]);
}

#[test]
fn emission_over_time_that_is_broken() {
    type Break = fn(&mut File);
    let cases: [(Break, &str); 5] = [
        (|f| f.animate(STRENGTH, &[0.0, 1.0], &[1.0, -1.0], "LINEAR"), "that are negative"),
        (|f| f.animate(FACTOR, &[0.0], &[1.0, -1.0, 0.0], "STEP"), "negative in part"),
        (|f| f.animate("/materials/9/emissiveFactor", &[0.0], &[1.0; 3], "STEP"), "could move"),
        (|f| f.animate(STRENGTH, &[0.0, 1.0], &[3e38, 1.0], "STEP"), "too strong"),
        (
            |f| {
                let part = "/materials/0/emissiveTexture/extensions/KHR_texture_transform/scale";
                f.animate(part, &[0.0], &[1.0, 1.0], "STEP");
            },
            "this part of an emission is not read",
        ),
    ];
    for (change, text) in cases {
        let mut file = lamp();
        file.json["materials"][0]["emissiveFactor"] = json!([9, 1, 1]);
        change(&mut file);
        let scene = file.load().unwrap();
        let [note] = scene.notes.as_slice() else { panic!("{text}: {:?}", scene.notes) };
        assert!(note.to_string().contains(text), "{note}");
        assert!(text == "could move" || note.category == candelabra::scene::Category::Lights);
        assert!(scene.instances[0].values.is_none(), "{text}");
        assert_eq!(scene.rgb_of_instance(0, &scene.pose_at(0.0)), Vec3::new(72.0, 8.0, 8.0));
    }
}
