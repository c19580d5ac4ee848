//! `candelabra-render`: frames, names, cameras, exit codes.

use crate::files::{SCENE, Shot, picture};
use serde_json::json;
use std::path::Path;
use std::process::{Command, Stdio};

#[test]
fn a_still_scene_is_one_picture() {
    let shot = Shot::still();
    shot.candelabra(&format!("build {SCENE}")).ends(0);
    shot.render("--tree shot.ltree -o still.exr --png").ends(0).says("frame 1: ").says("still.exr");
    assert_eq!(shot.names(), [SCENE, "shot.ltree", "still.exr", "still.png"]);
    assert!(is_picture(&shot.path("still.exr")));
    // With a tree and without one: the same tree is built in memory.
    shot.render("-o built.exr").ends(0);
    let pixels = |name: &str| image_of(&shot, name);
    assert_eq!(pixels("still.exr"), pixels("built.exr"));
}

fn is_picture(path: &Path) -> bool {
    picture(path).is_some()
}

/// The pixels of a picture that is not black.
fn image_of(shot: &Shot, name: &str) -> Vec<[f32; 3]> {
    let pixels = picture(&shot.path(name)).unwrap();
    assert!(pixels.iter().any(|pixel| pixel[0] > 0.0), "{name} is black");
    pixels
}

#[test]
fn every_light_sampler_sees_the_lamp() {
    let shot = Shot::still();
    for sampler in ["uniform", "power", "distance", "tree", "exhaustive", "all"] {
        shot.render(&format!("--light-sampler {sampler} -o {sampler}.exr")).ends(0);
        image_of(&shot, &format!("{sampler}.exr"));
    }
}

#[test]
fn frames_are_numbered_as_the_pattern_says() {
    let shot = Shot::moving();
    shot.candelabra(&format!("build {SCENE} --frames 1-3")).ends(0);
    let tree = "--tree shot.ltree";
    shot.render(&format!("{tree} --frames 1-3x2 -o hash/a.####.exr")).ends(0);
    shot.render(&format!("{tree} --frames 2 -o c/a.%03d.exr")).ends(0);
    shot.render(&format!("{tree} --frames 3 -o plain.exr")).ends(0);
    shot.render(&format!("{tree} -o first.#.exr")).ends(0);
    for name in ["hash/a.0001.exr", "hash/a.0003.exr", "c/a.002.exr", "plain.exr", "first.1.exr"] {
        assert!(is_picture(&shot.path(name)), "{name}");
    }
    // One name for several frames is a mistake, and nothing is rendered.
    shot.render(&format!("{tree} --frames 1-3 -o same.exr")).ends(2).complains(&[
        "all 3 frames",
        "same.exr",
        "same.####.exr",
    ]);
    assert!(!shot.path("same.exr").exists());
}

#[test]
fn usage_is_exit_code_two() {
    let shot = Shot::still();
    for wrong in [
        "",
        "-o a.%x.exr",
        "-o a.exr --spp 0",
        "-o a.exr --res 12",
        "-o a.exr --res 0x8",
        "-o a.exr --frames 1-9:2",
        "-o a.exr --light-sampler best",
        "-o a.exr --what",
    ] {
        let told = shot.render(wrong).ends(2);
        assert!(told.out.is_empty() && !told.err.is_empty(), "{told:?}");
    }
    assert_eq!(shot.names(), [SCENE]);
}

#[test]
fn a_camera_is_found_by_path_or_number_or_listed() {
    let mut shot = Shot::still();
    shot.edit(|json| {
        let eye = json!({"name": "side eye", "camera": 0, "translation": [0.5, 0, 4]});
        json["nodes"].as_array_mut().unwrap().push(eye);
        json["scenes"][0]["nodes"] = json!([0, 1, 2, 3]);
    });
    shot.render("--camera /eye -o path.exr").ends(0);
    shot.render("--camera 0 -o number.exr").ends(0);
    shot.render("-o default.exr").ends(0);
    shot.render("--camera 1 -o other.exr").ends(0);
    let by_path = image_of(&shot, "path.exr");
    assert_eq!(by_path, image_of(&shot, "number.exr"));
    assert_eq!(by_path, image_of(&shot, "default.exr"));
    assert_ne!(by_path, image_of(&shot, "other.exr"));
    for unknown in ["/nose", "2"] {
        shot.render(&format!("--camera {unknown} -o a.exr"))
            .ends(1)
            .complains(&[SCENE, unknown, "/eye", "/side"]);
    }
    shot.edit(|json| {
        json["nodes"][2].as_object_mut().unwrap().remove("camera");
        json["nodes"][3].as_object_mut().unwrap().remove("camera");
    });
    shot.render("-o a.exr").ends(1).complains(&[SCENE, "no camera"]);
    shot.render("--camera /eye -o a.exr").ends(1).complains(&[SCENE, "no camera"]);
}

#[test]
fn one_bad_frame_does_not_stop_the_others() {
    let shot = Shot::moving();
    shot.candelabra(&format!("build {SCENE} --frames 1,3,5")).ends(0);
    shot.render("--tree shot.ltree --frames 1-5 -o a.#.exr")
        .ends(1)
        .says("frame 2: failed: the tree has no frame 2")
        .says("frame 4: failed")
        .says("--frames")
        .complains(&["2 frames failed; any others are done"]);
    assert_eq!(shot.names(), ["a.1.exr", "a.3.exr", "a.5.exr", SCENE, "shot.ltree"]);
    // A folder in the way of one picture.
    std::fs::create_dir(shot.path("b.3.exr")).unwrap();
    shot.render("--tree shot.ltree --frames 1,3,5 -o b.#.exr").ends(1).says("frame 3: failed");
    assert!(is_picture(&shot.path("b.1.exr")) && is_picture(&shot.path("b.5.exr")));
    assert!(shot.names().iter().all(|name| !name.contains(".part")), "{:?}", shot.names());
}

#[test]
fn threads_do_not_show_in_the_file() {
    let shot = Shot::moving();
    for threads in [1, 2] {
        // The default of `render` gives way to what comes first.
        shot.candelabra(&format!("build {SCENE} -o {threads}.ltree --threads {threads}")).ends(0);
    }
    assert!(shot.read("1.ltree") == shot.read("2.ltree"));
}

/// Whoever reads the log may stop reading (`| head -1`); the frames are rendered all the same.
#[test]
fn a_closed_pipe_stops_no_frame() {
    let shot = Shot::moving();
    let mut running = Command::new(env!("CARGO_BIN_EXE_candelabra-render"))
        .current_dir(shot.path(""))
        .args([SCENE, "--frames", "1-9", "-o", "a.#.exr", "--res", "12x8", "--spp", "2"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(running.stdout.take());
    let output = running.wait_with_output().unwrap();
    let complaint = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success() && complaint.is_empty(), "{}: {complaint}", output.status);
    assert!((1..=9).all(|frame| is_picture(&shot.path(&format!("a.{frame}.exr")))));
}
