//! Trees that keep every rule and yet say of lights what their scene does not: only the scene shows it.

use crate::files::{SCENE, Shot};
use crate::probe::repaired;

/// The tree of the shot, and beside it one whose lights reach less than a nanometre.
fn with_lie() -> Shot {
    let shot = Shot::still();
    shot.candelabra(&format!("build {SCENE} -o honest.ltree")).ends(0);
    let mut bytes = shot.read("honest.ltree");
    let number = |bytes: &[u8], at: usize| {
        u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap()) as usize
    };
    for row in (64..).step_by(32).take(bytes[24].into()) {
        let (from, to) =
            (number(&bytes, row + 8), number(&bytes, row + 8) + number(&bytes, row + 16));
        match &bytes[row..row + 4] {
            b"TREE" => (from..to).step_by(48).for_each(|tree| bytes[tree + 16 + 27] = 1),
            b"GRUP" => {
                for group in (from..to).step_by(256) {
                    for lane in 0..8 {
                        let link = group + 224 + 4 * lane;
                        if bytes[link..link + 4] != [0; 4] {
                            bytes[group + 216 + lane] = 1;
                        }
                    }
                }
            }
            _ => {}
        }
    }
    shot.write("shot.ltree", repaired(&bytes).as_ref());
    shot
}

#[test]
fn a_lie_is_refused_wherever_the_scene_is_at_hand() {
    let shot = with_lie();
    shot.candelabra("verify shot.ltree").ends(0).says("shot.ltree: sound");
    let what = "contradicts the scene: light /lamp: its range";
    let remedy = "Build it again: candelabra build shot.gltf -o shot.ltree";
    let verify = format!("verify --scene {SCENE}");
    shot.candelabra(&format!("{verify} shot.ltree")).ends(1).says(what).says(remedy);
    shot.candelabra(&format!("{verify} honest.ltree"))
        .ends(0)
        .says("honest.ltree: every leaf is what the scene gives");
    shot.render("--tree shot.ltree -o a.exr").ends(3).complains(&["shot.ltree", what, remedy]);
    assert!(!shot.path("a.exr").exists());
    shot.candelabra(&format!("diff shot.ltree {SCENE}")).ends(2).complains(&["shot.ltree", what]);
    shot.candelabra(&format!("diff {SCENE} shot.ltree")).ends(2).complains(&["shot.ltree", what]);
    shot.candelabra("diff shot.ltree honest.ltree").ends(2).complains(&[
        "shot.ltree",
        "honest.ltree",
        "verify --scene",
    ]);
    // Who does not verify gets what the bytes give.
    shot.render("--tree shot.ltree -o a.exr --no-verify").ends(0);
}

#[test]
fn a_lie_is_not_built_upon() {
    let shot = with_lie();
    let honest = shot.read("honest.ltree");
    shot.candelabra(&format!("build {SCENE} -o new.ltree --base shot.ltree"))
        .ends(0)
        .complains(&["note: not built upon shot.ltree: it contradicts the scene"])
        .keeps_quiet_about("taken over");
    assert!(shot.read("new.ltree") == honest);
    shot.candelabra(&format!("build {SCENE}"))
        .ends(0)
        .complains(&["note: shot.ltree: contradicts the scene: light /lamp: its range"])
        .keeps_quiet_about("up to date");
    assert!(shot.read("shot.ltree") == honest);
    shot.candelabra(&format!("build {SCENE}")).ends(0).says("up to date");
}

#[test]
fn verify_tells_a_stale_tree_from_a_fresh_one() {
    let mut shot = with_lie();
    shot.edit(|json| json["nodes"][1]["translation"] = serde_json::json!([0, 0.25, 1]));
    shot.candelabra(&format!("verify honest.ltree --scene {SCENE}"))
        .ends(1)
        .says("honest.ltree: sound")
        .says("the tree is stale; dirtied: /lamp");
    shot.candelabra("verify honest.ltree --scene absent.gltf").ends(2).complains(&["absent.gltf"]);
    shot.candelabra("verify honest.ltree --force-light /lamp").ends(2);
}
