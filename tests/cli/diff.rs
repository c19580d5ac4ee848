//! `candelabra diff`: exit codes, text, JSON, folders of shots.

use crate::files::{SCENE, Shot};
use serde_json::{Value, json};

/// The scene with two punctual lights beside the lamp, as `before.gltf`; and with edits of them, as
/// `after.gltf`.
fn two_versions() -> Shot {
    let mut shot = Shot::still();
    shot.edit(|json| {
        json["extensionsUsed"] = json!(["KHR_materials_emissive_strength", "KHR_lights_punctual"]);
        json["extensions"] = json!({"KHR_lights_punctual": {"lights": [
            {"type": "point", "intensity": 40},
            {"type": "spot", "intensity": 20, "color": [1, 0.5, 0.25],
             "spot": {"innerConeAngle": 0.2, "outerConeAngle": 0.5}},
        ]}});
        let light = |name: &str, place: [f64; 3], number: u32| {
            json!({"name": name, "translation": place,
                "extensions": {"KHR_lights_punctual": {"light": number}}})
        };
        let nodes = json["nodes"].as_array_mut().unwrap();
        nodes.push(light("bulb", [1.0, 1.0, 2.0], 0));
        nodes.push(light("stage_light", [-1.0, 1.0, 2.0], 1));
        nodes.push(light("gone", [0.0, -1.0, 2.0], 0));
        json["scenes"][0]["nodes"] = json!([0, 1, 2, 3, 4, 5]);
    });
    shot.write("before.gltf", shot.json.to_string());
    let mut after = shot.json.clone();
    let lights = &mut after["extensions"]["KHR_lights_punctual"]["lights"];
    lights[1]["color"] = json!([1, 1, 1]);
    lights[1]["spot"]["outerConeAngle"] = json!(0.75);
    after["nodes"][1]["translation"] = json!([0, 0.25, 1]);
    after["nodes"][3]["name"] = json!("renamed");
    after["nodes"][5]["name"] = json!("new");
    after["nodes"][5]["translation"] = json!([0, 2, 2]);
    shot.write("after.gltf", after.to_string());
    shot
}

/// Numbers in four digits: the last ones are the machine's.
fn rounded(value: &mut Value) {
    match value {
        Value::Number(number) if number.is_f64() => {
            let short: f64 = format!("{:.3e}", number.as_f64().unwrap()).parse().unwrap();
            *value = json!(short);
        }
        Value::Array(values) => values.iter_mut().for_each(rounded),
        Value::Object(fields) => fields.values_mut().for_each(rounded),
        _ => {}
    }
}

#[test]
fn two_scenes_are_told_for_people() {
    let shot = two_versions();
    insta::assert_snapshot!(shot.candelabra("diff before.gltf after.gltf").ends(1).out);
}

#[test]
fn two_scenes_are_told_for_programs() {
    let shot = two_versions();
    let told = shot.candelabra("diff before.gltf after.gltf --json").ends(1);
    let mut json: Value = serde_json::from_str(&told.out).unwrap();
    rounded(&mut json);
    insta::assert_snapshot!(serde_json::to_string_pretty(&json).unwrap());
}

#[test]
fn two_trees_are_told_as_two_scenes() {
    let shot = two_versions();
    for version in ["before", "after"] {
        shot.candelabra(&format!("build {version}.gltf")).ends(0);
    }
    let told = shot.candelabra("diff before.ltree after.ltree").ends(1).out;
    insta::assert_snapshot!(told);
    shot.candelabra("diff before.ltree after.gltf").ends(1).says("renamed  /renamed");
    shot.candelabra("diff before.gltf after.ltree").ends(1).says("renamed  /renamed");
    for same in ["after.ltree after.gltf", "after.gltf after.ltree", "after.ltree after.ltree"] {
        shot.candelabra(&format!("diff {same}")).ends(0).says("the same 4 lights of 5 emitters");
    }
}

/// The tree does not depend on a hue, but one that is built again tells it.
#[test]
fn a_hue_alone_is_told_by_trees() {
    let mut shot = two_versions();
    shot.candelabra(&format!("build {SCENE} -o before.ltree")).ends(0);
    shot.candelabra(&format!("build {SCENE} -o after.ltree")).ends(0);
    shot.edit(|json| {
        let lights = &mut json["extensions"]["KHR_lights_punctual"]["lights"];
        lights[0]["color"] = json!([0, 1, 0]);
        // As bright as white is, to the last bit of `f32`.
        lights[0]["intensity"] = json!(f64::from(40.0f32 / 0.7152));
    });
    shot.candelabra(&format!("build {SCENE} -o after.ltree")).ends(0);
    let told = shot.candelabra("diff before.ltree after.ltree").ends(1);
    told.says("dirtied  /bulb").says("colour (1, 1, 1) -> (0, 1, 0)");
    // Only the look is new.
    shot.candelabra(&format!("build {SCENE} -o after.ltree")).ends(0).says("up to date");
}

#[test]
fn only_so_many_are_listed_unless_all_are_asked_for() {
    let mut shot = two_versions();
    shot.edit(|json| {
        for i in 0..30 {
            let light = json!({"KHR_lights_punctual": {"light": 0}});
            let node = json!({"name": format!("row_{i}"), "extensions": light});
            json["nodes"].as_array_mut().unwrap().push(node);
            json["scenes"][0]["nodes"].as_array_mut().unwrap().push(json!(6 + i));
        }
    });
    let listed = |out: &str| out.lines().filter(|line| line.contains("/row_")).count();
    let told = shot.candelabra(&format!("diff before.gltf {SCENE}")).ends(1);
    assert_eq!(listed(&told.says("and 10 more").out), 20);
    let told = shot.candelabra(&format!("diff before.gltf {SCENE} --all")).ends(1);
    assert_eq!(listed(&told.keeps_quiet_about("more").out), 30);
}

#[test]
fn folders_of_shots_are_matched_by_name() {
    let shot = two_versions();
    let (before, after) = (shot.read("before.gltf"), shot.read("after.gltf"));
    for folder in ["a/deep", "b/deep"] {
        std::fs::create_dir_all(shot.path(folder)).unwrap();
    }
    shot.write("a/s010.gltf", &before);
    shot.write("b/s010.gltf", &after);
    shot.write("a/deep/s020.gltf", &before);
    shot.write("b/deep/s020.gltf", &before);
    shot.write("a/s030.gltf", &before);
    shot.write("b/s040.gltf", &before);
    shot.write("b/notes.txt", "no shot");
    let told = shot.candelabra("diff a b --threads 1").ends(1);
    let told = told
        .says("a -> b: 3 of 4 shots differ")
        .says("dirtied  a/s010.gltf -> b/s010.gltf")
        .says("removed  s030.gltf")
        .says("added    s040.gltf")
        .keeps_quiet_about("s020")
        .keeps_quiet_about("notes");
    assert_eq!(shot.candelabra("diff a b --threads 2").ends(1).out, told.out);
    let json = shot.candelabra("diff a b --json").ends(1).out;
    let json: Value = serde_json::from_str(&json).unwrap();
    assert_eq!((&json["schema"], &json["version"]), (&json!("candelabra.diff"), &json!(1)));
    let outcomes = json["shots"].as_array().unwrap().iter().map(|shot| &shot["outcome"]);
    assert_eq!(outcomes.collect::<Vec<_>>(), ["same", "dirtied", "removed", "added"]);
    assert_eq!(json["shots"][1]["diff"]["totals"]["renamed"], 1);
    shot.candelabra("diff a a").ends(0).says("a -> a: the same 3 shots");

    // One that is broken does not hide the others.
    shot.write("b/s010.gltf", "{");
    shot.candelabra("diff a b").ends(2).says("trouble  b/s010.gltf").says("added    s040.gltf");
}

#[test]
fn what_cannot_be_compared_is_trouble() {
    let shot = two_versions();
    shot.write("broken.gltf", "{");
    shot.write("broken.ltree", "this is no tree");
    shot.write("shot.usda", "#usda 1.0");
    for file in ["broken.gltf", "broken.ltree", "missing.gltf", "missing.ltree", "shot.usda"] {
        for sides in [format!("{file} before.gltf"), format!("before.gltf {file}")] {
            let told = shot.candelabra(&format!("diff {sides}")).ends(2).complains(&[file]);
            assert!(told.out.is_empty());
        }
    }
    std::fs::create_dir(shot.path("folder")).unwrap();
    shot.candelabra("diff folder before.gltf").ends(2).complains(&["folder", "before.gltf"]);
    shot.candelabra("diff before.gltf").ends(2).complains(&["AFTER"]);
    // A tree that was damaged after it was built.
    shot.candelabra("build before.gltf").ends(0);
    let mut bytes = shot.read("before.ltree");
    *bytes.last_mut().unwrap() ^= 1;
    shot.write("before.ltree", bytes);
    shot.candelabra("diff before.ltree before.gltf").ends(2).complains(&["before.ltree"]);
}
