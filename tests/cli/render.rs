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
        "-o a.exr --split nan",
        "-o a.exr --split -0.1",
        "-o a.exr --exposure 1",
        "-o a.exr --png --exposure nan",
        "-o a.exr --png --exposure -inf",
        "-o a.exr --png --exposure 1e9",
        "-o a.exr --fog nan",
        "-o a.exr --fog 1,2",
        "-o a.exr --fog 1,1,inf",
        "-o a.exr --fov 40",
        "-o a.exr --fit --fov nan",
        "-o a.exr --fit --fov 0",
        "-o a.exr --fit --fov 180",
        "-o a.exr --fit --camera /eye",
        "-o a.exr --fit --look-from 1,2,3",
        "-o a.exr --look-at 1,2,3",
        "-o a.exr --look-from 1,2",
        "-o a.exr --look-from 1,2,nan",
        "-o a.exr --look-from 1,2,inf",
        "-o a.exr --look-from 1,2,3 --camera 0",
        "-o a.exr --look-from 1,2,3 --look-at 1,2,3",
        "-o a.exr --look-from 0,2,0 --look-at 0,0,0 --up 0,-9,0",
        "-o a.exr --aov beauty,colour",
        "-o a.exr --light-group /lamp",
        "-o a.exr --light-group a.b=/lamp",
        "-o a.exr --crop 0 0 4",
        "-o a.exr --crop 0 0 4 -4",
        "-o a.exr --res 8x6 --crop 0 0 9 6",
        "-o a.exr --res 8x6 --crop 4 0 4 6",
        "-o a.####_##.exr",
        "-o a.%d%04d.exr",
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
}

/// Folders are taken as they are written, and `%#` is a number sign.
#[test]
fn only_the_files_own_name_has_a_place_for_the_number() {
    let shot = Shot::still();
    shot.render("-o shot#12/f.####.exr --frames 7").ends(0);
    shot.render("-o %04d/take%#1_%d.exr --frames 7").ends(0);
    for name in ["shot#12/f.0007.exr", "%04d/take#1_7.exr"] {
        assert!(is_picture(&shot.path(name)), "{name}");
    }
    assert_eq!(shot.names(), ["%04d", "shot#12", SCENE]);
    shot.render("-o ####/f.exr --frames 1-2")
        .ends(2)
        .complains(&["all 2 frames", "####/f.####.exr"]);
}

/// What takes hours must not end in "cannot be written". Nothing is rendered: no samples could be.
#[test]
fn what_cannot_be_written_is_refused_before_anything_is_rendered() {
    let shot = Shot::still();
    std::fs::create_dir(shot.path("taken.exr")).unwrap();
    std::fs::create_dir(shot.path("look.png")).unwrap();
    shot.write("file", "no folder");
    let never = "--spp 4000000000 --res 4096x4096";
    for (output, named) in [
        ("taken.exr", "taken.exr"),
        ("look.exr --png", "look.png"),
        ("file/a.exr", "file/a.exr"),
        ("file/deep/a.####.exr --frames 1-3", "file/deep/a.0001.exr"),
        #[cfg(target_os = "linux")]
        ("/proc/nope/a.####.exr --frames 1-3", "/proc/nope/a.0001.exr"),
    ] {
        let told = shot.render(&format!("{never} -o {output}")).ends(1);
        assert!(told.out.is_empty(), "{told:?}");
        told.complains(&[named, "cannot be written", "choose another output"]);
    }
    assert_eq!(shot.names(), ["file", "look.png", SCENE, "taken.exr"]);
    // One frame of several is said at its turn, and not rendered either.
    std::fs::create_dir(shot.path("b.2.exr")).unwrap();
    let told = shot.render("-o b.#.exr --frames 1-3").ends(1).says("b.1.exr").says("b.3.exr");
    told.complains(&["frame 2: failed: b.2.exr"]);
    // A shot that is done needs no writing.
    let done = "-o still.exr --resume";
    shot.render(done).ends(0);
    shot.render(done).ends(0).says("up to date");
}

#[test]
fn one_bad_frame_does_not_stop_the_others() {
    let shot = Shot::moving();
    shot.candelabra(&format!("build {SCENE} --frames 1,3,5")).ends(0);
    shot.render("--tree shot.ltree --frames 1-5 -o a.#.exr")
        .ends(1)
        .complains(&["frame 2: failed", "shot.ltree", "the tree has no frame 2", "--frames"])
        .complains(&["frame 4: failed"])
        .complains(&["2 frames failed; any others are done"]);
    assert_eq!(shot.names(), ["a.1.exr", "a.3.exr", "a.5.exr", SCENE, "shot.ltree"]);
    // A folder in the way of one picture.
    std::fs::create_dir(shot.path("b.3.exr")).unwrap();
    let told = shot.render("--tree shot.ltree --frames 1,3,5 -o b.#.exr").ends(1);
    told.complains(&["frame 3: failed"]);
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
