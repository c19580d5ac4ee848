//! Tables of what is hidden: learned, verified, used, refused.

use crate::files::{SCENE, Shot, picture};
use serde_json::{Value, json};

/// Two lamps before a wall, and a screen between them: what one lights the other does not.
fn two_halves() -> Shot {
    let mut shot = Shot::still();
    shot.edit(|json| {
        let nodes = json["nodes"].as_array_mut().unwrap();
        nodes.push(json!({"name": "other", "mesh": 1, "translation": [2.5, 0, 1],
            "rotation": [0, 1, 0, 0], "scale": [0.25, 0.25, 1]}));
        nodes.push(json!({"name": "screen", "mesh": 0, "translation": [1.5, 0, 1],
            "rotation": [0, 0.5_f64.sqrt(), 0, 0.5_f64.sqrt()], "scale": [1, 4, 1]}));
        let count = nodes.len();
        json["scenes"][0]["nodes"] = (0..count).map(Value::from).collect();
    });
    shot
}

const LEARN: &str = "learn shot.gltf --rays 0.02 -o";

#[test]
fn a_table_is_learned_verified_and_used() {
    let shot = two_halves();
    shot.candelabra(&format!("{LEARN} a.lvis")).ends(0).says("picks are hidden");
    shot.candelabra(&format!("{LEARN} b.lvis")).ends(0);
    assert!(shot.read("a.lvis") == shot.read("b.lvis"), "the same input, other bytes");
    shot.candelabra("verify a.lvis").ends(0).says("sound");
    shot.candelabra("inspect a.lvis").ends(0).says("cells");
    let told = shot.render("--learned a.lvis --split 0 -o a.exr").ends(0);
    assert_eq!(told.err, "");
    shot.render("--split 0 -o b.exr").ends(0);
    assert!(
        picture(&shot.path("a.exr")) != picture(&shot.path("b.exr")),
        "other lights are picked"
    );
    // A picture by another table is another picture.
    shot.render("--learned a.lvis --split 0 --resume -o a.exr").ends(0).says("is up to date");
    shot.render("--split 0 --resume -o a.exr").ends(0).keeps_quiet_about("is up to date");
}

#[test]
fn where_nothing_is_hidden_a_table_is_empty_and_changes_nothing() {
    let shot = Shot::still();
    shot.candelabra(&format!("{LEARN} a.lvis")).ends(0).says("nothing is hidden here");
    shot.candelabra("verify a.lvis").ends(0).says("sound");
    shot.render("--learned a.lvis -o a.exr").ends(0);
    shot.render("-o b.exr").ends(0);
    assert!(picture(&shot.path("a.exr")) == picture(&shot.path("b.exr")));
}

#[test]
fn a_table_of_something_else_is_told_and_never_wrong() {
    let mut shot = two_halves();
    shot.candelabra(&format!("{LEARN} a.lvis")).ends(0);
    shot.edit(|json| json["nodes"][4]["translation"] = json!([1.4, 0, 1]));
    shot.render("--learned a.lvis -o a.exr")
        .ends(0)
        .complains(&["a.lvis", "out of date (geometry)"]);
    shot.edit(|json| json["nodes"][3]["translation"] = json!([2.4, 0, 1]));
    shot.render("--learned a.lvis -o a.exr").ends(0).complains(&["a.lvis", "candelabra learn"]);
    shot.render("-o b.exr").ends(0);
    assert!(picture(&shot.path("a.exr")) == picture(&shot.path("b.exr")), "not used");
}

#[test]
fn a_damaged_table_is_refused_and_no_other_file_is_overwritten_by_one() {
    let shot = two_halves();
    shot.candelabra(&format!("{LEARN} a.lvis")).ends(0);
    let whole = shot.read("a.lvis");
    for at in [0, 9, 70, whole.len() / 2, whole.len() - 1] {
        let mut bytes = whole.clone();
        bytes[at] ^= 0x10;
        shot.write("b.lvis", &bytes);
        shot.render("--learned b.lvis -o a.exr").ends(1).complains(&["b.lvis"]);
        let told = shot.candelabra("verify b.lvis");
        assert!(matches!(told.code, Some(1 | 2)), "{told:#?}");
        assert!((told.out.clone() + &told.err).contains("b.lvis: "), "{told:#?}");
    }
    shot.write("b.lvis", &whole[..whole.len() - 64]);
    shot.render("--learned b.lvis -o a.exr").ends(1).complains(&["b.lvis", "cut short"]);
    shot.render("--learned shot.gltf -o a.exr").ends(1).complains(&["shot.gltf", "no table"]);
    shot.render("--learned none.lvis -o a.exr").ends(1).complains(&["none.lvis"]);
    let scene = shot.read("shot.gltf");
    shot.candelabra(&format!("{LEARN} shot.gltf")).ends(1).complains(&["shot.gltf", "no table"]);
    assert!(shot.read("shot.gltf") == scene, "the scene is as it was");
}

/// What `diff --json` says of a table.
fn standing(shot: &Shot, arguments: &str, code: i32) -> Value {
    let told = shot.candelabra(&format!("diff {arguments} --json")).ends(code);
    let json: Value = serde_json::from_str(&told.out).unwrap();
    assert_eq!((&json["schema"], &json["version"]), (&json!("candelabra.diff"), &json!(1)));
    json["table"].clone()
}

#[test]
fn a_table_that_is_out_of_date_is_told_with_the_reason() {
    let mut shot = two_halves();
    shot.candelabra(&format!("build {SCENE}")).ends(0);
    shot.candelabra(&format!("{LEARN} a.lvis --tree shot.ltree")).ends(0);
    let first = shot.json.clone();
    let up_to_date = |arguments: &str| {
        shot.candelabra(&format!("diff {arguments}")).ends(0).says("the table is up to date");
    };
    up_to_date("a.lvis shot.gltf");
    up_to_date("shot.gltf a.lvis");
    up_to_date("a.lvis shot.ltree");
    shot.candelabra("diff a.lvis shot.ltree").ends(0).says("as far as a tree tells");
    assert_eq!(standing(&shot, "a.lvis shot.gltf", 0)["outdated"], json!([]));
    let of_tree = standing(&shot, "a.lvis shot.ltree", 0);
    assert_eq!(of_tree["unknown"], json!(["lights_at_infinity", "geometry", "camera"]));

    // What changes, and what is to be said of it: nothing of colours, names and the order of nodes.
    type Edit = fn(&mut Value);
    let edits: [(Edit, &[&str]); 9] = [
        (|json| json["nodes"][4]["translation"] = json!([1.4, 0, 1]), &["geometry"]),
        (|json| json["nodes"][3]["translation"] = json!([2.4, 0, 1]), &["lights", "geometry"]),
        (|json| json["nodes"][2]["translation"] = json!([0, 0.5, 4]), &["camera"]),
        (|json| json["cameras"][0]["perspective"]["yfov"] = json!(0.7), &["camera"]),
        (|json| json["materials"][0]["alphaMode"] = json!("MASK"), &["geometry"]),
        (
            |json| {
                let light = json!({"type": "directional", "intensity": 2});
                json["extensions"] = json!({"KHR_lights_punctual": {"lights": [light]}});
                json["extensionsUsed"].as_array_mut().unwrap().push(json!("KHR_lights_punctual"));
                json["nodes"][4]["extensions"] = json!({"KHR_lights_punctual": {"light": 0}});
            },
            &["lights_at_infinity"],
        ),
        (|json| json["nodes"][4]["name"] = json!("curtain"), &[]),
        (
            |json| {
                let plaster = &mut json["materials"][0]["pbrMetallicRoughness"];
                plaster["baseColorFactor"] = json!([0.5, 0.25, 1, 1]);
            },
            &[],
        ),
        (
            |json| {
                // The camera stands first in the list of nodes.
                let eye = json["nodes"].as_array_mut().unwrap().remove(2);
                json["nodes"].as_array_mut().unwrap().insert(0, eye);
            },
            &[],
        ),
    ];
    for (edit, expected) in edits {
        shot.edit(edit);
        let code = i32::from(!expected.is_empty());
        let told = standing(&shot, "a.lvis shot.gltf", code);
        assert_eq!(told["outdated"], json!(expected));
        assert_eq!(told["is_used"], json!(!expected.contains(&"lights")));
        // A renderer says the same.
        let told = shot.render("--learned a.lvis -o a.exr").ends(0);
        match expected {
            [] => assert_eq!(told.err, ""),
            ["lights", ..] => _ = told.complains(&["a.lvis", "not used"]),
            all => {
                _ = told.complains(&["a.lvis", &format!("({})", all.join(", ")).replace('_', " ")])
            }
        }
        shot.json = first.clone();
    }
}

#[test]
fn a_table_is_told_beside_what_changed_and_against_another_table() {
    let mut shot = two_halves();
    shot.candelabra(&format!("{LEARN} a.lvis")).ends(0);
    shot.write("before.gltf", shot.json.to_string());
    let told = shot.candelabra(&format!("diff before.gltf {SCENE} --learned a.lvis")).ends(0);
    told.says("the same 2 lights").says("table     a.lvis: up to date");
    shot.edit(|json| json["nodes"][4]["translation"] = json!([1.4, 0, 1]));
    let compare = format!("before.gltf {SCENE}");
    // What sheds no light is no difference of lights.
    shot.candelabra(&format!("diff {compare}")).ends(0).keeps_quiet_about("table");
    let told = shot.candelabra(&format!("diff {compare} --learned a.lvis")).ends(1);
    told.says("the same 2 lights").says("a.lvis: out of date (geometry); a renderer uses it");
    assert_eq!(standing(&shot, &format!("{compare} --learned a.lvis"), 1)["file"], "a.lvis");

    shot.candelabra(&format!("{LEARN} b.lvis")).ends(0);
    shot.candelabra("diff a.lvis a.lvis").ends(0).says("the same table");
    let told = shot.candelabra("diff a.lvis b.lvis").ends(1);
    told.says("learned from other geometry");
    shot.candelabra("learn shot.gltf --rays 0.03 -o c.lvis").ends(0);
    let told = shot.candelabra("diff b.lvis c.lvis").ends(1);
    told.says("learned from the same, but not the same table");

    shot.write("broken.lvis", "no table");
    for sides in ["broken.lvis shot.gltf", "shot.gltf none.lvis", "a.lvis broken.lvis"] {
        let told = shot.candelabra(&format!("diff {sides}")).ends(2);
        told.complains(&[".lvis"]);
    }
    let told = shot.candelabra(&format!("diff {compare} --learned broken.lvis")).ends(2);
    told.complains(&["broken.lvis"]);
    shot.candelabra("diff a.lvis b.lvis --html page.html").ends(2).complains(&["a.lvis", "--html"]);
    shot.candelabra("diff . . --learned a.lvis").ends(2).complains(&["folder"]);
}

/// A clock decides how many rays there are, and nothing else: their number repeats the table.
#[test]
fn a_time_becomes_a_number_of_rays_that_repeats_the_table() {
    let shot = two_halves();
    let told = shot.candelabra("learn shot.gltf --time 2s -o a.lvis").ends(0);
    let (_, rest) = told.out.split_once("--rays ").unwrap();
    let rays = rest.split(' ').next().unwrap();
    shot.candelabra(&format!("learn shot.gltf --rays {rays} --threads 1 -o b.lvis")).ends(0);
    assert!(shot.read("a.lvis") == shot.read("b.lvis"), "{rays} million rays");
    let told = shot.candelabra("inspect a.lvis --json").ends(0);
    let json: Value = serde_json::from_str(&told.out).unwrap();
    let budget = json["learned"]["budget"].as_u64().unwrap();
    assert_eq!(budget, (rays.parse::<f64>().unwrap() * 1e6).round() as u64);
    for usage in ["--time 2s --rays 1", "--time never", "--rays 5000"] {
        shot.candelabra(&format!("learn shot.gltf {usage} -o c.lvis")).ends(2);
    }
}

#[test]
fn a_table_is_drawn() {
    let shot = two_halves();
    shot.candelabra(&format!("{LEARN} a.lvis")).ends(0);
    shot.candelabra("inspect a.lvis --html page.html").ends(0);
    let html = String::from_utf8(shot.read("page.html")).unwrap();
    // Plan and elevation.
    assert_eq!(html.matches("<image href=\"data:image/png").count(), 2, "{html}");
    assert!(html.contains("of the light is hidden") && html.contains("class=\"key\""), "{html}");
    shot.candelabra("inspect a.lvis --html b.html").ends(0);
    assert_eq!(html.as_bytes(), shot.read("b.html"));
    shot.candelabra("inspect a.lvis --html a.lvis").ends(1).complains(&["a.lvis", "another name"]);
    shot.candelabra("inspect a.lvis --dot").ends(1).complains(&["a.lvis", "--dot"]);
    // Where nothing is hidden there is nothing to draw.
    let shot = Shot::still();
    shot.candelabra(&format!("{LEARN} a.lvis")).ends(0);
    shot.candelabra("inspect a.lvis --html page.html").ends(0);
    let html = String::from_utf8(shot.read("page.html")).unwrap();
    assert!(html.contains("Nothing is hidden") && !html.contains("<image"), "{html}");
}
