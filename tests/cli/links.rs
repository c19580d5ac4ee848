//! Linked lights, from the file to the picture, as the programs tell of them.

use crate::files::{SCENE, Shot, picture};
use serde_json::{Value, json};

/// A wall, a lamp that lights it and one that does not.
fn linked() -> Shot {
    let mut shot = Shot::still();
    shot.edit(|json| {
        let mut other = json["nodes"][1].clone();
        other["name"] = json!("other");
        other["translation"] = json!([0.5, 0, 1]);
        other["extras"] = json!({"usdLux": {"type": "MeshLight", "lightLink": 4}});
        json["nodes"].as_array_mut().unwrap().push(other);
        json["nodes"][0]["extras"] = json!({"usdLinks": {"outside": [4]}});
        json["scenes"][0]["nodes"] = json!([0, 1, 2, 3]);
    });
    shot
}

#[test]
fn links_are_told_verified_and_obeyed() {
    let shot = linked();
    shot.candelabra(&format!("build {SCENE}")).ends(0);
    let verified = shot.candelabra(&format!("verify shot.ltree --scene {SCENE}")).ends(0).out;
    assert!(verified.contains("1 link set"), "{verified}");
    let told = shot.candelabra("inspect shot.ltree").ends(0).out;
    assert!(
        told.contains("section LINK") && told.contains("1 light not for everything, in 1 link set"),
        "{told}"
    );
    let report: Value =
        serde_json::from_str(&shot.candelabra("inspect shot.ltree --json").ends(0).out).unwrap();
    assert_eq!((&report["linked"], &report["link_sets"]), (&json!(1), &json!(1)));
    let scene: Value =
        serde_json::from_str(&shot.candelabra(&format!("inspect {SCENE} --json")).ends(0).out)
            .unwrap();
    let features = scene["features"].as_array().unwrap();
    let of = |name: &str| features.iter().find(|feature| feature["name"] == name).unwrap();
    assert_eq!(
        (&of("light links")["found"], &of("light links")["state"]),
        (&json!(1), &json!("on"))
    );
    assert_eq!(
        (&of("shadow links")["found"], &of("shadow links")["state"]),
        (&json!(0), &json!("off"))
    );
    shot.render("--tree shot.ltree -o linked.exr --frames 1").ends(0);
    // The other lamp gives the wall nothing: without it, the picture is the same but for noise, and is dark alone.
    let mut alone = linked();
    alone.edit(|json| json["scenes"][0]["nodes"] = json!([0, 2, 3]));
    alone.candelabra(&format!("build {SCENE}")).ends(0);
    alone.render("--tree shot.ltree -o alone.exr --frames 1").ends(0);
    let brightest = |shot: &Shot, name: &str| {
        let pixels = picture(&shot.path(name)).unwrap();
        pixels.iter().flatten().fold(0f32, |most, &value| most.max(value))
    };
    assert!(brightest(&shot, "linked.exr") > 0.1);
    assert_eq!(brightest(&alone, "alone.exr"), 0.0);
}

#[test]
fn a_tree_of_other_links_is_stale() {
    let mut shot = linked();
    shot.candelabra(&format!("build {SCENE}")).ends(0);
    shot.edit(|json| {
        json["nodes"][3].as_object_mut().unwrap().remove("extras");
    });
    shot.render("--tree shot.ltree -o a.exr").ends(3).complains(&["stale", "dirtied: /other"]);
    let told = shot.candelabra(&format!("verify shot.ltree --scene {SCENE}")).ends(1);
    assert!(told.out.contains("stale"), "{}", told.out);
    shot.candelabra(&format!("build {SCENE}")).ends(0);
    shot.candelabra(&format!("verify shot.ltree --scene {SCENE}")).ends(0);
    let sections = shot.candelabra("inspect shot.ltree").ends(0).out;
    assert!(!sections.contains("LINK"), "{sections}");
}

#[test]
fn changed_links_are_told() {
    let shot = linked();
    std::fs::copy(shot.path(SCENE), shot.path("before.gltf")).unwrap();
    let mut shot = shot;
    shot.edit(|json| {
        json["nodes"][0].as_object_mut().unwrap().remove("extras");
    });
    let told = shot.candelabra(&format!("diff before.gltf {SCENE}")).ends(1).out;
    assert!(told.contains("/other") && told.contains("lights 1 more (/wall)"), "{told}");
}

#[test]
fn broken_links_are_refused_with_a_remedy() {
    let mut shot = linked();
    shot.edit(|json| json["nodes"][0]["extras"] = json!({"usdLinks": {"outside": [4, 4]}}));
    let refused = shot.candelabra(&format!("build {SCENE}")).ends(1);
    let told = &refused.err;
    assert!(
        told.contains(SCENE) && told.contains("node 0 \"wall\"") && told.contains("do not ascend"),
        "{told}"
    );
}
