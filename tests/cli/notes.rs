//! Notes about a scene: told by both programs, and errors where a user wants them to be.

use crate::files::{SCENE, Shot, Told};
use serde_json::{Value, json};

/// A scene with a note about lights, one about materials and one about cameras.
fn noted() -> Shot {
    let mut shot = Shot::still();
    shot.edit(|json| {
        json["extensions"] = json!({"KHR_lights_punctual": {"lights": [{"type": "area"}]}});
        json["nodes"][0]["extensions"] = json!({"KHR_lights_punctual": {"light": 0}});
        json["materials"][0]["normalTexture"] = json!({"index": 0});
        json["textures"] = json!([{"source": 0}]);
        json["images"] = json!([{"uri": "gone.png"}]);
        json["cameras"].as_array_mut().unwrap().push(json!({"type": "perspective",
            "perspective": {"yfov": 4, "znear": 0.1}}));
        json["nodes"][0]["camera"] = json!(1);
    });
    shot
}

const TOLD: [&str; 3] = [
    "lights: light 0: is of an unknown type",
    "gone.png",
    "cameras: node 0 \"wall\": its camera's vertical field of view",
];

/// Asserts that standard error has a line with each text.
#[track_caller]
fn complains_of_all(told: Told, texts: &[&str]) {
    texts.iter().fold(told, |told, text| told.complains(&[text]));
}

#[test]
fn both_programs_tell_what_is_left_out_and_go_on() {
    let shot = noted();
    complains_of_all(shot.candelabra(&format!("build {SCENE}")).ends(0), &TOLD);
    let told = shot.candelabra(&format!("inspect {SCENE}")).ends(0);
    TOLD.iter().fold(told, |told, text| told.says(text));
    complains_of_all(shot.render("-o x.exr").ends(0), &TOLD);
    std::fs::remove_file(shot.path("x.exr")).unwrap();
    let report = shot.candelabra(&format!("inspect {SCENE} --json")).ends(0).out;
    let report: Value = serde_json::from_str(&report).unwrap();
    let categories: Vec<&Value> =
        report["notes"].as_array().unwrap().iter().map(|note| &note["category"]).collect();
    assert_eq!(categories, ["lights", "materials", "cameras"]);
}

#[test]
fn notes_are_errors_by_category_before_any_work() {
    let shot = noted();
    for strict in ["--strict", "--strict=lights", "--strict=animation,cameras"] {
        let error = "are errors under --strict=";
        let build = format!("build {SCENE} -o strict.ltree {strict}");
        complains_of_all(shot.candelabra(&build).ends(1).complains(&[error]), &TOLD);
        let inspect = format!("inspect {SCENE} {strict}");
        complains_of_all(shot.candelabra(&inspect).ends(1).complains(&[error]), &TOLD);
        let render = format!("-o x.exr {strict}");
        complains_of_all(shot.render(&render).ends(1).complains(&[error]), &TOLD);
    }
    assert!(shot.names().iter().all(|name| !name.ends_with(".exr") && !name.ends_with(".ltree")));
    for fine in ["--strict=geometry", "--strict=animation,other"] {
        shot.candelabra(&format!("build {SCENE} {fine}")).ends(0);
        shot.render(&format!("-o x.exr {fine}")).ends(0);
    }
    for usage in ["--strict=", "--strict=light", "--strict=lights,,cameras"] {
        shot.candelabra(&format!("inspect {SCENE} {usage}")).ends(2);
    }
    let whole = Shot::still();
    whole.candelabra(&format!("build {SCENE} --strict")).ends(0);
    whole.render("-o x.exr --strict").ends(0);
}
