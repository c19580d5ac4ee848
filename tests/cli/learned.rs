//! Tables of what is hidden: learned, verified, used, refused.

use crate::files::{Shot, picture};
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
    shot.render("--learned a.lvis -o a.exr").ends(0).complains(&["a.lvis", "another version"]);
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
