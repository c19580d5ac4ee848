//! The switches that say how lights are sampled: forced lights, fog, splitting.

use crate::files::{SCENE, Shot, picture};

/// The pixels of a render with some arguments.
#[track_caller]
fn pixels(shot: &Shot, arguments: &str) -> Vec<[f32; 3]> {
    shot.render(&format!("{arguments} -o a.exr --spp 16")).ends(0);
    picture(&shot.path("a.exr")).unwrap()
}

fn mean(pixels: &[[f32; 3]]) -> f32 {
    pixels.iter().map(|pixel| pixel[1]).sum::<f32>() / pixels.len() as f32
}

#[test]
fn splitting_and_its_cap_are_knobs() {
    let shot = Shot::still();
    let plain = pixels(&shot, "--split 0");
    assert_ne!(pixels(&shot, ""), plain);
    let split = pixels(&shot, "--split 1");
    assert_ne!(split, plain);
    assert!((mean(&split) / mean(&plain) - 1.0).abs() < 0.2);
    // A lamp of two triangles: a cap of two is no cap.
    assert_eq!(pixels(&shot, "--split 1 --max-lights 2"), split);
    assert_eq!(pixels(&shot, "--split 1 --split-by solid-angle").len(), split.len());
    for sampler in ["distance", "all"] {
        let seen = pixels(&shot, &format!("--light-sampler {sampler}"));
        assert!((mean(&seen) / mean(&plain) - 1.0).abs() < 0.2, "{sampler}");
    }
}

#[test]
fn fog_is_put_in_by_three_numbers() {
    let shot = Shot::still();
    let clear = pixels(&shot, "");
    assert_eq!(pixels(&shot, "--fog 0"), clear);
    // So thick that nothing comes through, and black.
    assert!(mean(&pixels(&shot, "--fog 50,0")) < 1e-3 * mean(&clear));
    let white = pixels(&shot, "--fog 0.5");
    assert_eq!(pixels(&shot, "--fog 0.5,1,0"), white);
    let grey = pixels(&shot, "--fog 0.5,0.2,0.3");
    assert!(mean(&grey) < mean(&white), "{} {}", mean(&grey), mean(&white));
    assert_ne!(pixels(&shot, "--fog 0.5,0.2,-0.3"), grey);
    // Fog does not change the lights: the tree stays fresh.
    shot.candelabra(&format!("build {SCENE}")).ends(0);
    assert_eq!(pixels(&shot, "--tree shot.ltree --fog 0.5,0.2,0.3"), grey);
}

#[test]
fn what_is_no_number_of_the_kind_is_usage() {
    let shot = Shot::still();
    for (wrong, told) in [
        ("--split 1.5", "0 to 1"),
        ("--split=-0.1", "0 to 1"),
        ("--split nan", "0 to 1"),
        ("--split much", "0 to 1"),
        ("--max-lights 0", "--max-lights"),
        ("--max-lights=-3", "--max-lights"),
        ("--max-lights 1.5", "--max-lights"),
        ("--split-by noise", "variance"),
        ("--fog thick", "0.02,0.9,0.3"),
        ("--fog 0.1,0.9,0.3,4", "0.02,0.9,0.3"),
        ("--fog 0.1,,0.3", "0.02,0.9,0.3"),
        ("--fog inf", "extinction"),
        ("--fog nan", "extinction"),
        ("--fog=-0.1", "extinction"),
        ("--fog 0.1,1.5", "albedo"),
        ("--fog 0.1,nan", "albedo"),
        ("--fog 0.1,0.9,1", "g is not"),
        ("--fog 0.1,0.9,-1", "g is not"),
        ("--force-light", "--force-light"),
    ] {
        let asked = shot.render(&format!("-o a.exr {wrong}")).ends(2);
        assert!(asked.out.is_empty() && asked.err.contains(told), "{wrong}: {asked:#?}");
    }
    assert_eq!(shot.names(), [SCENE]);
}

#[test]
fn a_light_is_forced_by_its_path_in_build_and_render_alike() {
    let shot = Shot::still();
    let plain = pixels(&shot, "");
    let forced = pixels(&shot, "--force-light /lamp");
    assert!((mean(&forced) / mean(&plain) - 1.0).abs() < 0.2);
    shot.candelabra(&format!("build {SCENE} -o forced.ltree --force-light /lamp")).ends(0);
    assert_eq!(pixels(&shot, "--tree forced.ltree --force-light /lamp"), forced);
    shot.candelabra("inspect forced.ltree").ends(0).says("/lamp");

    // One without is stale for one with, and the other way round.
    std::fs::remove_file(shot.path("a.exr")).unwrap();
    shot.candelabra(&format!("build {SCENE} -o plain.ltree")).ends(0);
    for stale in ["--tree plain.ltree --force-light /lamp", "--tree forced.ltree"] {
        shot.render(&format!("{stale} -o a.exr")).ends(3).complains(&["stale", "dirtied: /lamp"]);
    }
    assert!(!shot.path("a.exr").exists());
    // Building with it over one without it is not left alone as up to date.
    shot.candelabra(&format!("build {SCENE} -o plain.ltree --force-light /lamp"))
        .ends(0)
        .keeps_quiet_about("up to date");
    assert!(shot.read("plain.ltree") == shot.read("forced.ltree"));
}

#[test]
fn a_path_without_a_light_is_named() {
    let shot = Shot::still();
    for path in ["/candle", "/wall", "/lam"] {
        let named = [SCENE, path, "candelabra inspect"];
        shot.render(&format!("-o a.exr --force-light {path}")).ends(1).complains(&named);
        shot.candelabra(&format!("build {SCENE} --force-light {path}")).ends(1).complains(&named);
    }
    assert_eq!(shot.names(), [SCENE]);
}

#[test]
fn a_scene_without_light_is_said_to_be_black() {
    let mut shot = Shot::still();
    let note = "nothing in the scene gives light";
    assert!(!shot.render("-o a.exr").ends(0).err.contains(note));
    shot.edit(|scene| scene["nodes"][1] = serde_json::json!({"name": "lamp"}));
    shot.render("-o a.exr").ends(0).complains(&[note, SCENE]);
}

/// What a render puts in must not be what trees are built of.
#[test]
fn a_published_tree_serves_renders_with_fog() {
    let mut shot = Shot::still();
    shot.edit(|scene| {
        let lux = serde_json::json!({"type": "MeshLight", "diffuse": 0.25, "specular": 0});
        scene["nodes"][1]["extras"]["usdLux"] = lux;
    });
    shot.candelabra(&format!("build {SCENE} -o shot.ltree")).ends(0);
    for fog in ["", "--fog 0.1"] {
        shot.render(&format!("--tree shot.ltree {fog} -o a.exr")).ends(0);
    }
}
