//! Lights that files animate: each frame is the picture of a still scene with the values of that moment.

use crate::files::{File, lamp};
use crate::stage::{Set, direct};
use candelabra::scene::Scene;
use serde_json::{Value, json};

/// Frame 1 is second 0, frame 25 second 1.
const FRAMES: [i32; 4] = [1, 7, 13, 25];
const TIMES: [f32; 2] = [0.0, 1.0];
const GLOW: &str = "/materials/0/emissiveFactor";
const STRENGTH: &str = "/materials/0/extensions/KHR_materials_emissive_strength/emissiveStrength";
const SPOT: &str = "/extensions/KHR_lights_punctual/lights/0/spot/";

/// A matt floor below a triangle of light or a spot, seen from between them.
fn room(spot: Option<Value>) -> File {
    let mut file = lamp();
    let matt = json!({"pbrMetallicRoughness": {"metallicFactor": 0}, "extensions": {
        "KHR_materials_specular": {"specularFactor": 0}}});
    file.add("materials", matt);
    let part = json!({"attributes": {"POSITION": 0}, "indices": 1, "material": 1});
    file.add("meshes", json!({"primitives": [part]}));
    let half = std::f64::consts::FRAC_1_SQRT_2;
    file.add(
        "cameras",
        json!({"type": "perspective", "perspective":
        {"yfov": 1.2, "aspectRatio": 1, "znear": 0.01}}),
    );
    let mut above =
        json!({"mesh": 0, "translation": [-0.3, 2, -0.3], "rotation": [half, 0, 0, half]});
    if let Some(spot) = spot {
        file.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [spot]}});
        above = json!({"translation": [0, 2, 0], "rotation": [-half, 0, 0, half],
            "extensions": {"KHR_lights_punctual": {"light": 0}}});
    }
    file.json["nodes"] = json!([above,
        {"mesh": 1, "scale": [20, 20, 1], "translation": [-5, 0, 5], "rotation": [-half, 0, 0, half]},
        {"camera": 0, "translation": [0, 1, 0], "rotation": [-half, 0, 0, half]}]);
    file.json["scenes"][0]["nodes"] = json!([0, 1, 2]);
    file
}

fn seen(scene: &Scene, frame: i32) -> Vec<f32> {
    let picture = Set::of(scene, &FRAMES).render(&direct(16, 64), frame);
    picture.beauty().flat_map(|beauty| beauty.to_array()).collect()
}

/// Asserts that frames of an animated file are those of still files, and differ from one another.
#[track_caller]
fn assert_frames(animated: &File, still: impl Fn(f32) -> File) {
    let load = |file: &File| {
        let scene = file.load().unwrap_or_else(|error| panic!("{error}"));
        assert!(scene.notes.is_empty(), "{:?}", scene.notes);
        scene
    };
    let scene = load(animated);
    assert!(scene.has_lights_that_change());
    let mut before: Option<Vec<f32>> = None;
    for frame in FRAMES {
        let own = seen(&scene, frame);
        let held = load(&still((frame - 1) as f32 / 24.0));
        assert!(!held.has_lights_that_change());
        let expected = seen(&held, frame);
        let most = expected.iter().fold(0f32, |most, &value| most.max(value));
        assert!(most > 0.01, "frame {frame} is dark");
        let apart = |a: &[f32], b: &[f32]| {
            a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0f32, f32::max) / most
        };
        let off = apart(&own, &expected);
        assert!(off < 1e-3, "frame {frame} is off by {off}");
        assert!(before.is_none_or(|before| apart(&own, &before) > 0.02), "frame {frame} is still");
        before = Some(own);
    }
}

#[test]
fn the_emission_of_a_mesh_light_is_that_of_each_frame() {
    let mut animated = room(None);
    animated.animate(GLOW, &TIMES, &[1.0, 0.5, 0.25, 0.0, 0.5, 1.0], "LINEAR");
    assert_frames(&animated, |t| {
        let mut file = room(None);
        file.json["materials"][0]["emissiveFactor"] = json!([1.0 - t, 0.5, 0.25 + 0.75 * t]);
        file
    });
    let mut animated = room(None);
    animated.animate(STRENGTH, &TIMES, &[2.0, 10.0], "LINEAR");
    assert_frames(&animated, |t| {
        let mut file = room(None);
        file.json["materials"][0]["extensions"] = json!({"KHR_materials_emissive_strength":
            {"emissiveStrength": 2.0 + 8.0 * t}});
        file
    });
}

#[test]
fn the_cone_of_a_spot_is_that_of_each_frame() {
    let spot = |inner: f32, outer: f32| {
        json!({"type": "spot", "intensity": 20,
            "spot": {"innerConeAngle": inner, "outerConeAngle": outer}})
    };
    let mut animated = room(Some(spot(0.1, 0.3)));
    animated.animate(&format!("{SPOT}innerConeAngle"), &TIMES, &[0.1, 0.2], "LINEAR");
    animated.animate(&format!("{SPOT}outerConeAngle"), &TIMES, &[0.3, 0.8], "LINEAR");
    assert_frames(&animated, |t| room(Some(spot(0.1 + 0.1 * t, 0.3 + 0.5 * t))));
}

/// The triangle is drawn out, and bent towards the floor.
#[test]
fn the_shape_of_a_mesh_light_is_that_of_each_frame() {
    let with_target = |weight: f32| {
        let mut file = room(None);
        let moved = file.floats(&[0.0, 0.0, 0.5, 2.0, 0.0, 0.0, 0.0, 1.0, 0.25], "VEC3");
        file.json["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": moved}]);
        file.json["meshes"][0]["weights"] = json!([weight]);
        file
    };
    let mut animated = with_target(0.0);
    let (input, output) = (animated.times(&TIMES), animated.floats(&[0.0, 1.0], "SCALAR"));
    animated.add(
        "animations",
        json!({"samplers": [{"input": input, "output": output}],
            "channels": [{"sampler": 0, "target": {"node": 0, "path": "weights"}}]}),
    );
    assert_frames(&animated, with_target);
}
