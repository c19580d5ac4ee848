//! Lenses over time: `extras.usdCamera.values`, and animations of a field of view.

use crate::files::{File, lamp};
use candelabra::scene::{Camera, Interpolation, LensKeys, Projection, Scene};
use glam::Vec2;
use serde_json::{Value, json};

const YFOV: &str = "/cameras/0/perspective/yfov";
const YMAG: &str = "/cameras/0/orthographic/ymag";

/// The lamp, with a camera at its node.
fn file(lens: Value, extras: Value) -> File {
    let mut file = lamp();
    file.add("cameras", lens);
    file.json["nodes"][0]["camera"] = json!(0);
    file.json["nodes"][0]["extras"] = json!({ "usdCamera": extras });
    file
}

fn perspective() -> Value {
    json!({"type": "perspective", "perspective": {"yfov": 0.5}})
}

fn orthographic() -> Value {
    json!({"type": "orthographic", "orthographic": {"xmag": 2, "ymag": 1}})
}

#[track_caller]
fn load(file: &File) -> Scene {
    file.load().unwrap_or_else(|error| panic!("{error}"))
}

#[track_caller]
fn usd(lens: Value, extras: Value) -> Scene {
    load(&file(lens, extras))
}

/// The one camera of a scene that is read without a note.
#[track_caller]
fn only(scene: Scene) -> Camera {
    assert!(scene.notes.is_empty(), "{:?}", scene.notes);
    let [camera] = <[Camera; 1]>::try_from(scene.cameras).unwrap();
    camera
}

fn lens(camera: &Camera) -> &LensKeys {
    camera.over_time.as_ref().unwrap_or_else(|| panic!("constant: {camera:?}"))
}

#[test]
fn all_parts_of_a_lens_are_read_over_time() {
    let camera = only(usd(
        perspective(),
        json!({
            "fStop": 2, "focalLength_m": 0.05, "focusDistance_m": 3, "exposureScale": 1,
            "values": {
                "times": [0, 0.5, 2],
                "yfov": [0.5, 0.6, 0.7],
                "fStop": [2, 0, 4],
                "focalLength_m": [0.05, 0.1, 0.2],
                "focusDistance_m": [3, 4, 5],
                "filmOffset": [[0, 0], [0.25, -0.5], [0, 1]],
                "exposureScale": [1, 0, 8],
                "clippingRange_m": [[0, 9], [-1, 5], [2, 7]],
            },
        }),
    ));
    let keys = lens(&camera);
    assert_eq!(keys.height.as_ref().unwrap().times_s, [0.0, 0.5, 2.0]);
    assert_eq!(keys.height.as_ref().unwrap().values, [0.5, 0.6, 0.7]);
    assert_eq!(keys.height.as_ref().unwrap().interpolation, Interpolation::Linear);
    assert_eq!(keys.lens_radius_m.as_ref().unwrap().values, [0.05 / 4.0, 0.0, 0.2 / 8.0]);
    assert_eq!(keys.focus_distance_m.as_ref().unwrap().values, [3.0, 4.0, 5.0]);
    let offsets = [Vec2::ZERO, Vec2::new(0.25, -0.5), Vec2::Y];
    assert_eq!(keys.film_offset.as_ref().unwrap().values, offsets);
    assert_eq!(keys.exposure_scale.as_ref().unwrap().values, [1.0, 0.0, 8.0]);
    let ranges = [Vec2::new(0.0, 9.0), Vec2::new(0.0, 5.0), Vec2::new(2.0, 7.0)];
    assert_eq!(keys.clip_m.as_ref().unwrap().values, ranges);
    assert!(camera.has_lens());
}

/// The radius follows from three numbers, of which any may vary.
#[test]
fn a_lens_follows_from_what_varies_of_it() {
    let read = |values: Value| {
        let mut extras = json!({"fStop": 2, "focalLength_m": 0.08, "focusDistance_m": 3});
        extras["values"] = values;
        let camera = only(usd(perspective(), extras));
        let radii = lens(&camera).lens_radius_m.as_ref().map(|keys| keys.values.clone());
        let focus = lens(&camera).focus_distance_m.as_ref().map(|keys| keys.values.clone());
        (radii, focus)
    };
    let (radii, focus) = read(json!({"times": [0, 1], "fStop": [4, 1]}));
    assert_eq!((radii, focus), (Some(vec![0.01, 0.04]), None));
    let (radii, focus) = read(json!({"times": [0, 1], "focalLength_m": [0.04, 0.08]}));
    assert_eq!((radii, focus), (Some(vec![0.01, 0.02]), None));
    let (radii, focus) = read(json!({"times": [0, 1], "focusDistance_m": [3, 5]}));
    assert_eq!((radii, focus), (None, Some(vec![3.0, 5.0])));
    // A focus of 0 is a pinhole, not a lens that is focused on itself.
    let (radii, focus) = read(json!({"times": [0, 1, 2, 3], "focusDistance_m": [0, 5, 0, 7]}));
    assert_eq!(radii, Some(vec![0.0, 0.02, 0.0, 0.02]));
    assert_eq!(focus, Some(vec![5.0, 5.0, 5.0, 7.0]));
}

#[test]
fn an_orthographic_camera_has_a_height_over_time() {
    let values = json!({"times": [0, 1], "ymag": [1, 3], "yfov": [0.1, 0.2]});
    let camera = only(usd(orthographic(), json!({ "values": values })));
    assert_eq!(lens(&camera).height.as_ref().unwrap().values, [2.0, 6.0]);
    let scene = usd(orthographic(), json!({"values": {"times": [0, 1], "fStop": [0, 3]}}));
    assert!(scene.notes[0].to_string().contains("has no lens"), "{:?}", scene.notes);
    assert_eq!(scene.cameras[0].over_time, None);
}

#[test]
fn what_does_not_vary_is_a_constant() {
    let values = json!({
        "times": [1, 2], "yfov": [0.75, 0.75], "fStop": [4, 4], "exposureScale": [2, 2],
        "filmOffset": [[0.5, 0], [0.5, 0]], "clippingRange_m": [[1, 2], [1, 2]],
    });
    let lens = json!({"focalLength_m": 0.08, "focusDistance_m": 3, "values": values});
    let camera = only(usd(perspective(), lens));
    let expected = Camera {
        lens_radius_m: 0.01,
        focus_distance_m: 3.0,
        exposure_scale: 2.0,
        film_offset: [0.5, 0.0],
        clip_m: [1.0, 2.0],
        ..Camera::perspective(camera.node, 0.75)
    };
    assert_eq!(camera, expected);
    assert!(camera.has_lens());
}

#[test]
fn a_table_that_makes_no_sense_is_left_out_and_noted() {
    for (values, text) in [
        (json!({"times": [], "yfov": []}), "0 times are not 1 to"),
        (json!({"times": [0, 0], "yfov": [0.5, 0.6]}), "do not ascend"),
        (json!({"times": [1, 0], "yfov": [0.5, 0.6]}), "do not ascend"),
        (json!({"times": [0, 1e-60], "yfov": [0.5, 0.6]}), "do not ascend"),
        (json!({"times": [0, 1], "yfov": [0.5]}), "2 times and 1 of yfov; constant"),
        (json!({"times": [0], "filmOffset": [[0, 0], [1, 1]]}), "1 times and 2 of filmOffset"),
        (json!({"times": [0, 1], "yfov": [0.5, 0]}), "yfov has values that it cannot have"),
        (json!({"times": [0, 1], "yfov": [0.5, 3.2]}), "yfov has values"),
        (json!({"times": [0, 1], "exposureScale": [0.5, -1]}), "exposureScale has values"),
        (json!({"times": [0, 1], "clippingRange_m": [[1, 2], [2, 2]]}), "clippingRange_m has"),
        (json!({"times": [0, 1], "clippingRange_m": [[1, 2], [-3, -1]]}), "clippingRange_m has"),
        (json!({"times": [0, 1], "fStop": [1, -1]}), "negative"),
        (json!({"times": [0, 1], "focusDistance_m": [1, -1]}), "negative"),
        (
            json!({"times": [0, 1], "focalLength_m": [0.1, -0.1], "fStop": [2, 2]}),
            "no possible radius",
        ),
        (
            json!({"times": [0, 1], "fStop": [1, 1e-39], "focalLength_m": [1, 1]}),
            "no possible radius",
        ),
        (json!({"times": [0, 1e39], "yfov": [0.5, 0.6]}), "its lens is constant"),
        (json!({"times": [0, 1], "yfov": ["a", "b"]}), "its lens is constant"),
        (json!([0, 1]), "its lens is constant"),
        (json!({"yfov": [0.5, 0.6]}), "its lens is constant"),
    ] {
        let extras = json!({"focusDistance_m": 2, "values": values.clone()});
        let scene = usd(perspective(), extras);
        let [note] = scene.notes.as_slice() else { panic!("{values}: {:?}", scene.notes) };
        let note = note.to_string();
        assert!(note.contains("node 0") && note.contains(text), "{values}: {note}");
        assert_eq!(scene.cameras[0].over_time, None, "{values}");
        assert_eq!(scene.cameras[0].projection, Projection::Perspective { yfov_rad: 0.5 });
    }
    // What is wrong with one part is nothing of the others.
    let values = json!({"times": [0, 1], "yfov": [0.5, 9], "exposureScale": [1, 2]});
    let scene = usd(perspective(), json!({ "values": values }));
    assert_eq!(scene.notes.len(), 1);
    let keys = lens(&scene.cameras[0]);
    assert!(keys.height.is_none() && keys.exposure_scale.is_some());
}

#[test]
fn a_field_of_view_is_animated_by_a_pointer() {
    for (how, values) in [
        ("LINEAR", &[0.5, 1.0][..]),
        ("STEP", &[0.5, 1.0]),
        ("CUBICSPLINE", &[0.0, 0.5, 0.25, -7.0, 1.0, 0.0]),
    ] {
        let mut file = file(perspective(), json!({"exposureScale": 2}));
        // A camera may stand at several nodes.
        let node = json!({"camera": 0, "name": "other"});
        let number = file.add("nodes", node);
        file.json["scenes"][0]["nodes"].as_array_mut().unwrap().push(json!(number));
        file.animate(YFOV, &[0.0, 2.0], values, how);
        let scene = load(&file);
        assert!(scene.notes.is_empty(), "{:?}", scene.notes);
        let [one, other] = &scene.cameras[..] else { panic!() };
        assert_eq!(lens(one), lens(other));
        assert_eq!((one.exposure_scale, other.exposure_scale), (2.0, 1.0));
        assert_eq!(lens(one).height.as_ref().unwrap().values, values, "{how}");
        // Frame 25 is second 1, and the last key is the last frame.
        let at = |frame: f64| match scene.camera_at(one, frame).projection {
            Projection::Perspective { yfov_rad } => yfov_rad,
            Projection::Orthographic { .. } => unreachable!(),
        };
        let middle = match how {
            "LINEAR" => 0.75,
            "STEP" => 0.5,
            _ => 0.5 * (0.5 + 1.0) + 2.0 * (0.25 + 7.0) / 8.0,
        };
        assert_eq!((at(1.0), at(49.0)), (0.5, 1.0), "{how}");
        assert!((at(25.0) - middle).abs() < 1e-6, "{how}: {}", at(25.0));
        assert_eq!(candelabra::pipeline::frames_of(&scene).len(), 49);
    }
}

#[test]
fn an_orthographic_height_is_animated_by_a_pointer() {
    let mut file = file(orthographic(), json!({}));
    file.animate(YMAG, &[0.0, 1.0], &[1.0, 4.0], "LINEAR");
    let camera = only(load(&file));
    assert_eq!(lens(&camera).height.as_ref().unwrap().values, [2.0, 8.0]);
}

#[test]
fn an_animation_that_says_one_thing_is_a_constant() {
    let mut file = file(perspective(), json!({}));
    file.animate(YFOV, &[0.0, 1.0], &[0.75, 0.75], "LINEAR");
    let camera = only(load(&file));
    assert_eq!(camera, Camera::perspective(camera.node, 0.75));
}

#[test]
fn extras_take_the_place_of_an_animation_and_leave_the_rest() {
    let with = |values: Value| {
        let mut file = file(perspective(), json!({ "values": values }));
        file.animate(YFOV, &[0.0, 1.0], &[0.5, 0.75], "LINEAR");
        lens(&only(load(&file))).height.as_ref().unwrap().values.clone()
    };
    assert_eq!(with(json!({"times": [0, 1], "yfov": [0.1, 0.2]})), [0.1, 0.2]);
    assert_eq!(with(json!({"times": [0, 1], "exposureScale": [1, 2]})), [0.5, 0.75]);
}

#[test]
fn animations_of_lenses_that_are_broken() {
    type Break = fn(&mut File);
    let cases: [(Break, &str); 8] = [
        (|f| f.animate(YFOV, &[0.0, 1.0], &[0.5, 4.0], "LINEAR"), "not between 0 and pi"),
        (|f| f.animate(YFOV, &[0.0, 1.0], &[0.5, 0.0], "STEP"), "not between 0 and pi"),
        (|f| f.animate(YMAG, &[0.0, 1.0], &[1.0, 2.0], "LINEAR"), "could move"),
        (|f| f.animate("/cameras/7/perspective/yfov", &[0.0], &[0.5], "STEP"), "could move"),
        (|f| f.animate("/cameras/0/perspective/zfar", &[0.0], &[0.5], "STEP"), "part of a lens"),
        (|f| f.animate("/cameras/x/perspective/yfov", &[0.0], &[0.5], "STEP"), "part of a lens"),
        (|f| f.animate(YFOV, &[0.0, 1.0], &[0.5], "LINEAR"), "2 keys, but 1"),
        (
            |f| {
                f.animate(YFOV, &[0.0, 1.0], &[0.5, 0.75], "LINEAR");
                let accessors = f.json["accessors"].as_array_mut().unwrap();
                let last = accessors.last_mut().unwrap();
                (last["type"], last["count"]) = (json!("VEC2"), json!(1));
            },
            "type that they cannot have",
        ),
    ];
    for (change, text) in cases {
        let mut file = file(perspective(), json!({}));
        change(&mut file);
        let scene = load(&file);
        let [note] = scene.notes.as_slice() else { panic!("{text}: {:?}", scene.notes) };
        assert!(note.to_string().contains(text), "{note}");
        assert_eq!(scene.cameras[0], Camera::perspective(scene.cameras[0].node, 0.5), "{text}");
    }
    // Of two animations the first is read.
    let mut file = file(perspective(), json!({}));
    file.animate(YFOV, &[0.0, 1.0], &[0.5, 0.75], "LINEAR");
    file.animate(YFOV, &[0.0, 1.0], &[0.25, 0.75], "LINEAR");
    let scene = load(&file);
    assert!(scene.notes[0].to_string().contains("only the first animation"), "{:?}", scene.notes);
    assert_eq!(lens(&scene.cameras[0]).height.as_ref().unwrap().values[0], 0.5);
}

#[test]
fn hidden_cameras_are_looked_through_last() {
    let cameras = |first: Value, second: Value, third: Value| {
        let mut file = file(perspective(), json!({}));
        file.json["nodes"][0] = json!({});
        let mut nodes = Vec::new();
        for mut node in [first, second, third] {
            node["camera"] = json!(0);
            nodes.push(file.add("nodes", node));
        }
        file.json["scenes"][0]["nodes"] = json!(nodes);
        let scene = load(&file);
        let camera = scene.default_camera().unwrap();
        scene.nodes[camera.node as usize].path.to_string()
    };
    let named = |name: &str| json!({ "name": name });
    let hidden = |name: &str| json!({"name": name, "extras": {"usdCamera": {"hidden": true}}});
    let unseen = |name: &str| json!({"name": name, "extensions": {"KHR_node_visibility": {"visible": false}}});
    assert_eq!(cameras(named("a"), named("b"), named("c")), "/a");
    assert_eq!(cameras(hidden("a"), named("b"), named("c")), "/b");
    assert_eq!(cameras(hidden("a"), unseen("b"), named("c")), "/c");
    assert_eq!(cameras(hidden("a"), unseen("b"), hidden("c")), "/a");
    // As usdrecord has it.
    assert_eq!(cameras(named("a"), named("main_cam"), named("c")), "/main_cam");
    assert_eq!(cameras(named("a"), hidden("main_cam"), named("c")), "/a");
    assert_eq!(cameras(hidden("a"), hidden("main_cam"), hidden("c")), "/main_cam");
    assert_eq!(cameras(named("a"), named("my_main_cam"), named("c")), "/a");
}
