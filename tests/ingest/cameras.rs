//! Cameras: what is read of them, and what is mended or left out instead of the whole scene.

use crate::files::{File, lamp};
use candelabra::scene::{Camera, Projection, Scene};
use serde_json::{Value, json};

/// The lamp, with a camera at its node.
fn load(camera: Value, extras: Value) -> Scene {
    let mut file: File = lamp();
    file.add("cameras", camera);
    file.json["nodes"][0]["camera"] = json!(0);
    file.json["nodes"][0]["extras"] = extras;
    file.load().unwrap_or_else(|error| panic!("{error}"))
}

fn perspective(lens: Value) -> Value {
    json!({"type": "perspective", "perspective": lens})
}

fn orthographic(seen: Value) -> Value {
    json!({"type": "orthographic", "orthographic": seen})
}

fn usd(camera: Value) -> Scene {
    load(perspective(json!({"yfov": 0.5})), json!({"usdCamera": camera}))
}

/// The one camera of a scene that is read without a note.
#[track_caller]
fn only(scene: Scene) -> Camera {
    assert!(scene.notes.is_empty(), "{:?}", scene.notes);
    let [camera] = <[Camera; 1]>::try_from(scene.cameras).unwrap();
    camera
}

/// Asserts that there is one note, which names the node and says something.
#[track_caller]
fn notes(scene: &Scene, text: &str) {
    let [note] = scene.notes.as_slice() else { panic!("{:?}", scene.notes) };
    let note = note.to_string();
    assert!(note.contains("node 0") && note.contains(text), "{note}");
}

#[test]
fn an_orthographic_camera_sees_twice_its_magnification() {
    for (xmag, ymag) in [(3.0, 2.0), (-3.0, 2.0), (3.0, -2.0)] {
        let seen = json!({"xmag": xmag, "ymag": ymag, "znear": 0.1, "zfar": 5});
        let camera = only(load(orthographic(seen), json!({})));
        assert_eq!(camera.projection, Projection::Orthographic { height_m: 4.0 });
        assert_eq!(camera.aspect, Some(1.5));
        assert_eq!(camera.clip_m, [0.0, f32::INFINITY], "glTF's planes are not read");
    }
    // Clipping planes may be absent.
    assert_eq!(
        only(load(orthographic(json!({"xmag": 1, "ymag": 1})), json!({}))).aspect,
        Some(1.0)
    );
    let lens = json!({"usdCamera": {"fStop": 2, "focalLength_m": 0.05, "focusDistance_m": 3}});
    let scene = load(orthographic(json!({"xmag": 1, "ymag": 1})), lens);
    notes(&scene, "has no lens");
    assert_eq!(scene.cameras, [Camera { aspect: Some(1.0), ..Camera::orthographic(0, 2.0) }]);
    for seen in [json!({"xmag": 1, "ymag": 0}), json!({"xmag": 0, "ymag": 1}), json!({"xmag": 1})] {
        let scene = load(orthographic(seen), json!({}));
        notes(&scene, "sees no width or no height; left out");
        assert!(scene.cameras.is_empty() && scene.instances.len() == 1);
    }
}

#[test]
fn usd_says_how_the_picture_is_exposed_and_clipped() {
    let plain = only(usd(json!({})));
    assert_eq!((plain.exposure_scale, plain.clip_m), (1.0, [0.0, f32::INFINITY]));
    let camera = only(usd(json!({"exposureScale": 4, "clippingRange_m": [0.5, 100]})));
    assert_eq!((camera.exposure_scale, camera.clip_m), (4.0, [0.5, 100.0]));
    assert_eq!(only(usd(json!({"exposureScale": 0}))).exposure_scale, 0.0);
    assert_eq!(only(usd(json!({"clippingRange_m": [-1, 2]}))).clip_m, [0.0, 2.0]);
}

#[test]
fn what_makes_no_sense_is_mended_and_noted() {
    for (extras, text) in [
        (json!({"exposureScale": -1}), "exposure scale is negative"),
        (json!({"clippingRange_m": [2, 2]}), "clipping planes"),
        (json!({"clippingRange_m": [5, 1]}), "clipping planes"),
        (json!({"clippingRange_m": [-5, -1]}), "clipping planes"),
        (json!({"fStop": -2, "focalLength_m": 0.05, "focusDistance_m": 3}), "negative"),
        (json!({"fStop": 2, "focalLength_m": 0.05, "focusDistance_m": -3}), "negative"),
        (json!({"fStop": 2, "focalLength_m": -0.05, "focusDistance_m": 3}), "no possible radius"),
        (json!({"fStop": 1e-38, "focalLength_m": 1e3, "focusDistance_m": 3}), "no possible radius"),
        (json!({"fStop": "wide"}), "usdCamera is not read"),
        (json!([1, 2]), "usdCamera is not read"),
    ] {
        let scene = usd(extras);
        notes(&scene, text);
        let plain = Camera {
            focus_distance_m: scene.cameras[0].focus_distance_m,
            ..Camera::perspective(0, 0.5)
        };
        assert_eq!(scene.cameras, [plain], "{text}");
    }
}
