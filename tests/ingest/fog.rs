//! `extras.usdFog`: the fog that a scene is in.

use crate::files::{File, lamp};
use candelabra::scene::{FogBox, Medium};
use glam::Vec3;
use serde_json::{Value, json};

/// The lamp below a root, the lamp in this fog.
fn foggy(fog: Value) -> File {
    let mut file = lamp();
    file.json["nodes"][0]["extras"] = json!({"usdFog": fog});
    file.add("nodes", json!({"name": "root", "scale": [2, 1, 1], "children": [0]}));
    file.json["scenes"][0]["nodes"] = json!([1]);
    file
}

#[test]
fn a_box_of_fog_stands_at_its_node() {
    let scene = foggy(json!({
        "extinction": [1, 2, 4], "albedo": [0.5, 1, 0], "anisotropy": -0.25,
        "min": [-1, 0, 2], "max": [1, 0.5, 3],
    }))
    .load()
    .unwrap();
    let region = FogBox { node: 1, min: Vec3::new(-1.0, 0.0, 2.0), max: Vec3::new(1.0, 0.5, 3.0) };
    let expected = Medium {
        scattering: Vec3::new(0.5, 2.0, 0.0),
        absorption: Vec3::new(0.5, 0.0, 4.0),
        anisotropy: -0.25,
        region: Some(region),
    };
    assert_eq!(scene.medium, Some(expected));
    assert_eq!(&*scene.nodes[1].path, "/root/lamp");
    assert_eq!(scene.requirements().fog, 1);
    assert_eq!(scene.instances.len(), 1, "the node keeps its mesh");
    assert_eq!(scene.notes, []);
}

#[test]
fn fog_without_a_box_is_everywhere() {
    let everywhere = Medium {
        scattering: Vec3::splat(0.5),
        absorption: Vec3::ZERO,
        anisotropy: 0.0,
        region: None,
    };
    let at_a_node = foggy(json!({"extinction": 0.5})).load().unwrap();
    assert_eq!(at_a_node.medium, Some(everywhere.clone()));
    let mut file = lamp();
    file.json["scenes"][0]["extras"] = json!({"usdFog": {"extinction": 0.5}});
    assert_eq!(file.load().unwrap().medium, Some(everywhere));
}

#[test]
fn fog_that_is_none_costs_nothing() {
    for scene in [lamp().load().unwrap(), foggy(json!({"extinction": [0, 0, 0]})).load().unwrap()] {
        assert_eq!((scene.medium.is_none(), scene.requirements().fog), (true, 0));
    }
}

#[test]
fn a_second_fog_is_noted() {
    let mut file = foggy(json!({"extinction": 3}));
    file.json["scenes"][0]["extras"] = json!({"usdFog": {"extinction": 0.5}});
    let scene = file.load().unwrap();
    assert_eq!(scene.medium.unwrap().scattering, Vec3::splat(0.5), "the scene's own comes first");
    assert_eq!(scene.notes.len(), 1);
    assert!(scene.notes[0].text.contains("node 0 \"lamp\""), "{:?}", scene.notes);
}

#[test]
fn hidden_fog_is_noted() {
    let mut file = lamp();
    let hidden = json!({"KHR_node_visibility": {"visible": false}});
    let fog = json!({"usdFog": {"extinction": 1}});
    file.add("nodes", json!({"name": "mist", "extensions": hidden, "extras": fog}));
    file.json["scenes"][0]["nodes"] = json!([0, 1]);
    let scene = file.load().unwrap();
    assert_eq!(scene.medium, None);
    assert!(scene.notes[0].text.contains("mist"), "{:?}", scene.notes);
}

#[test]
fn fog_that_makes_no_sense_is_refused() {
    let broken = |problem: &str, fog: Value| {
        let error = foggy(fog).load().expect_err(problem);
        assert!(error.object.contains("node 0 \"lamp\""), "{error}");
        assert!(error.problem.contains(problem), "{problem:?} is not in: {error}");
    };
    let boxed = |min: Value, max: Value| json!({"extinction": 1, "min": min, "max": max});
    broken("missing field `extinction`", json!({}));
    broken("extinction is negative", json!({"extinction": [1, -1, 1]}));
    broken("neither", json!({"extinction": 1e39}));
    broken("neither", json!({"extinction": [1, 2]}));
    broken("albedo", json!({"extinction": 1, "albedo": [0, 1.5, 0]}));
    broken("albedo", json!({"extinction": 1, "albedo": [0, -0.5, 0]}));
    broken("anisotropy", json!({"extinction": 1, "anisotropy": 1}));
    broken("anisotropy", json!({"extinction": 1, "anisotropy": -0.999999999}));
    broken("min is not below max", boxed(json!([0, 0, 0]), json!([1, 0, 1])));
    broken("min is not below max", boxed(json!([0, 0, 0]), json!([1, 1e-60, 1])));
    broken("without the other", json!({"extinction": 1, "min": [0, 0, 0]}));
    let mut file = lamp();
    file.json["scenes"][0]["extras"] =
        json!({"usdFog": {"extinction": 1, "min": [0, 0, 0], "max": [1, 1, 1]}});
    let error = file.load().unwrap_err();
    assert!(error.object.contains("scene 0") && error.remedy.contains("node"), "{error}");
}
