//! Trees that are stale or broken are refused, in words that tell what to do, with exit code 3.

use crate::files::{SCENE, Shot, Told};
use serde_json::json;

const RENDER: &str = "--tree shot.ltree -o a.exr";

fn built() -> Shot {
    let shot = Shot::still();
    shot.candelabra(&format!("build {SCENE}")).ends(0);
    shot
}

/// A tree file that is not what was built.
fn damaged(change: impl FnOnce(&mut Vec<u8>)) -> Told {
    let shot = built();
    let mut bytes = shot.read("shot.ltree");
    change(&mut bytes);
    shot.write("shot.ltree", bytes);
    let told = shot.render(RENDER);
    assert!(!shot.path("a.exr").exists());
    told
}

#[test]
fn a_stale_tree_names_what_changed_and_the_remedy() {
    let mut shot = built();
    shot.edit(|json| json["nodes"][1]["translation"] = json!([0, 0.25, 1]));
    shot.render(RENDER).ends(3).complains(&[
        "shot.ltree",
        "the tree is stale",
        "dirtied: /lamp",
        "Build it again: candelabra build shot.gltf -o shot.ltree",
    ]);
    shot.edit(|json| json["nodes"][1]["name"] = json!("lantern"));
    shot.render(RENDER).ends(3).complains(&["added: /lantern", "removed: /lamp"]);
    assert!(!shot.path("a.exr").exists());
    shot.candelabra(&format!("build {SCENE}")).ends(0);
    shot.render(RENDER).ends(0);
}

/// The command in the message, carried out as it stands, is the remedy.
#[test]
fn the_remedy_can_be_pasted() {
    let mut shot = Shot::moving();
    let options = "--force-light /lamp";
    shot.candelabra(&format!("build {SCENE} {options} --frames 3-9x2 -o it's.ltree")).ends(0);
    shot.edit(|json| json["nodes"][1]["scale"] = json!([0.5, 0.25, 1]));
    let render = format!("--tree it's.ltree -o a.exr --frames 5 {options}");
    let told = shot.render(&render).ends(3);
    let command = told.err.lines().find_map(|line| line.split("again: candelabra ").nth(1));
    let command = command.unwrap_or_else(|| panic!("{told:#?}"));
    assert!(command.contains("--frames 3-9x2 --force-light /lamp"), "{command}");
    let program = env!("CARGO_BIN_EXE_candelabra");
    let mut shell = std::process::Command::new("sh");
    shell.current_dir(shot.path("")).args(["-c", &format!("'{program}' {command}")]);
    assert!(shell.output().unwrap().status.success(), "{command}");
    shot.render(&render).ends(0);
}

#[test]
fn a_change_of_anything_but_light_keeps_the_tree() {
    let mut shot = built();
    shot.edit(|json| {
        json["nodes"][0]["translation"] = json!([0, 0, -1]);
        json["nodes"][2]["translation"] = json!([0, 1, 4]);
        json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = json!([1, 0, 0, 1]);
    });
    shot.render(RENDER).ends(0);
}

#[test]
fn a_tree_of_a_still_scene_does_not_fit_a_moving_one() {
    let shot = Shot::moving();
    let still = built();
    shot.write("shot.ltree", still.read("shot.ltree"));
    shot.render(RENDER).ends(3).complains(&["stale", "dirtied: /lamp"]);
}

#[test]
fn every_kind_of_damage_is_refused() {
    damaged(Vec::clear).ends(3).complains(&["shot.ltree"]);
    damaged(|bytes| bytes.truncate(bytes.len() / 2))
        .ends(3)
        .complains(&["shot.ltree", "cut short"]);
    damaged(|bytes| bytes.truncate(20)).ends(3).complains(&["shot.ltree"]);
    damaged(|bytes| bytes.push(0)).ends(3).complains(&["shot.ltree", "promises"]);
    damaged(|bytes| *bytes = b"this is a text file\n".repeat(100))
        .ends(3)
        .complains(&["shot.ltree", "not a Candelabra tree file"]);
    damaged(|bytes| bytes.retain(|&byte| byte != b'\r'))
        .ends(3)
        .complains(&["shot.ltree", "text mode"]);
    damaged(|bytes| bytes[8] = 99).ends(3).complains(&["shot.ltree", "format version 99"]);
}

/// `verify` reads every byte. A render reads what its frame samples: it refuses what is wrong there, and what
/// is wrong elsewhere does not show in the picture.
#[test]
fn one_flipped_bit_anywhere_is_refused_or_does_no_harm() {
    let shot = built();
    shot.render(RENDER).ends(0);
    let (picture, whole) = (shot.read("a.exr"), shot.read("shot.ltree"));
    let mut refused = 0;
    // A prime step: header, table, and every section is met.
    for bit in (0..whole.len() * 8).step_by(397) {
        let mut bytes = whole.clone();
        bytes[bit / 8] ^= 1 << (bit % 8);
        shot.write("shot.ltree", bytes);
        shot.candelabra("verify shot.ltree").ends(1);
        let told = shot.render(RENDER);
        if told.code == Some(3) {
            told.complains(&["shot.ltree"]);
            refused += 1;
        } else {
            told.ends(0);
            assert!(shot.read("a.exr") == picture, "bit {bit}");
        }
    }
    assert!(refused > 10, "{refused}");
}

#[test]
fn what_is_no_file_is_refused() {
    let shot = Shot::still();
    shot.render(RENDER).ends(1).complains(&["shot.ltree", "No such file"]);
    std::fs::create_dir(shot.path("shot.ltree")).unwrap();
    shot.render(RENDER).ends(1).complains(&["shot.ltree", "not a regular file"]);
    // And building over it says why it cannot.
    shot.candelabra(&format!("build {SCENE}")).ends(1).complains(&["shot.ltree"]);
    assert_eq!(shot.names(), [SCENE, "shot.ltree"]);
}

/// A user who says so gets what the bytes give: wrong light perhaps, but an end and no panic.
#[test]
fn unverified_damage_is_survived() {
    for shot in [Shot::still(), Shot::moving()] {
        shot.candelabra(&format!("build {SCENE} --frames 1,2")).ends(0);
        let whole = shot.read("shot.ltree");
        let samplers = ["tree", "power", "exhaustive"].into_iter().cycle();
        for (bit, sampler) in (0..whole.len() * 8).step_by(127).zip(samplers) {
            let mut bytes = whole.clone();
            bytes[bit / 8] ^= 1 << (bit % 8);
            shot.write("shot.ltree", bytes);
            let told = shot.render(&format!("{RENDER} --no-verify --light-sampler {sampler}"));
            let survived = matches!(told.code, Some(0 | 1 | 3)) && !told.err.contains("panicked");
            assert!(survived, "bit {bit}: {told:#?}");
        }
    }
}
