//! `diffuse` and `specular` in `extras.usdLux`.

use crate::files::{File, lamp};
use candelabra::scene::{LightKind, Response, Scene};
use serde_json::json;

fn load(file: &File) -> Scene {
    file.load().unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn multipliers_are_read_of_every_kind_of_light() {
    let quarter = Response { diffuse: 0.25, specular: 1.0 };
    let mut file = lamp();
    file.lux(json!({"type": "MeshLight", "diffuse": 0.25}));
    let scene = load(&file);
    assert_eq!(scene.light_responses.of_instance(0), quarter);
    assert_eq!(scene.requirements().lights_with_multipliers, 1);
    assert_eq!((scene.effect_of_instance(0), scene.notes.len()), (1.0, 0));

    file.lux(json!({"type": "SphereLight", "radius": 0.5, "diffuse": 0.25}));
    let scene = load(&file);
    assert!(matches!(scene.lights[0].kind, LightKind::Sphere { .. }));
    assert_eq!(scene.light_responses.of_light(0), quarter);

    file.light(json!({"type": "point"}));
    file.lux(json!({"type": "SphereLight", "specular": 0}));
    let scene = load(&file);
    let none = Response { diffuse: 1.0, specular: 0.0 };
    // The light at the node, and the mesh at it.
    assert_eq!(scene.light_responses.of_light(0), none);
    assert_eq!(scene.light_responses.of_instance(0), none);

    file.lux(json!({"type": "DomeLight", "diffuse": 2, "specular": 0.5}));
    let scene = load(&file);
    assert_eq!(scene.light_responses.of_light(0), Response { diffuse: 2.0, specular: 0.5 });
    assert_eq!(scene.effect_of_light(0), 2.0);
}

/// What is reflected as it is has no row: nothing is paid for it.
#[test]
fn multipliers_of_one_are_none() {
    let mut file = lamp();
    assert!(load(&file).light_responses.is_empty());
    file.lux(json!({"type": "MeshLight", "diffuse": 1, "specular": 1.0}));
    let scene = load(&file);
    assert!(scene.light_responses.is_empty());
    assert_eq!(scene.requirements().lights_with_multipliers, 0);
}

#[test]
fn multipliers_that_make_no_sense_are_refused() {
    for lux in [json!({"diffuse": -1}), json!({"specular": -0.5}), json!({"specular": "much"})] {
        let mut file = lamp();
        let mut whole = lux.clone();
        whole["type"] = json!("MeshLight");
        file.lux(whole);
        let error = file.load().unwrap_err().to_string();
        assert!(error.contains("usdLux"), "{lux}: {error}");
    }
}
