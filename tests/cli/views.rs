//! What a scene is looked at through: `--camera`, `--fit`, `--look-from` and their like, in every
//! command that looks at a scene.

use crate::files::{SCENE, Shot, picture};
use serde_json::{Value, json};

/// The scene with cameras, as `eye.gltf`, and without any.
fn blind() -> Shot {
    let mut shot = Shot::still();
    shot.write("eye.gltf", shot.json.to_string());
    shot.edit(|json| {
        json["nodes"][2].as_object_mut().unwrap().remove("camera");
        json["nodes"][2]["translation"] = json!([9, 9, 9]);
    });
    shot
}

/// The pixels of a picture that is not black.
#[track_caller]
fn pixels(shot: &Shot, name: &str) -> Vec<[f32; 3]> {
    let pixels = picture(&shot.path(name)).unwrap();
    assert!(pixels.iter().any(|pixel| pixel[0] > 0.0), "{name} is black");
    pixels
}

const NOTE: &str = "note: shot.gltf: it has no camera; the view is --look-from ";

#[test]
fn a_scene_without_a_camera_is_framed_and_told_so() {
    let shot = blind();
    let told = shot.render("-o default.exr").ends(0).complains(&[NOTE, "--look-at", "--fov 40"]);
    shot.render("--fit -o fit.exr").ends(0).complains(&["note: shot.gltf: --fit is --look-from"]);
    assert_eq!(pixels(&shot, "default.exr"), pixels(&shot, "fit.exr"));
    // The note is the options for the same view, but for the last digits.
    let options = told.err.lines().find(|line| line.starts_with(NOTE)).unwrap();
    let options = options.split(" the view is ").nth(1).unwrap();
    let told = shot.render(&format!("{options} -o same.exr")).ends(0);
    assert!(told.err.is_empty(), "{told:?}");
    let (fit, same) = (pixels(&shot, "fit.exr"), pixels(&shot, "same.exr"));
    let sum = |pixels: &[[f32; 3]]| pixels.iter().map(|pixel| pixel[0]).sum::<f32>();
    assert!((sum(&fit) / sum(&same) - 1.0).abs() < 0.02, "{fit:?} {same:?}");
    // A camera of its own is looked through without a word.
    let told = Shot::still().render("-o a.exr").ends(0);
    assert!(told.err.is_empty(), "{told:?}");
}

#[test]
fn a_camera_of_another_file_is_looked_through() {
    let shot = blind();
    let own = Shot::still();
    own.render("-o own.exr").ends(0);
    let own = pixels(&own, "own.exr");
    for camera in ["eye.gltf", "eye.gltf:0", "eye.gltf:/eye", "./eye.gltf:/eye"] {
        let told = shot.render(&format!("--camera {camera} -o a.exr")).ends(0);
        assert!(told.err.is_empty(), "{told:?}");
        assert_eq!(pixels(&shot, "a.exr"), own, "{camera}");
    }
    shot.render("--camera gone.gltf -o a.exr").ends(1).complains(&["gone.gltf"]);
    shot.render("--camera eye.gltf:/nose -o a.exr")
        .ends(1)
        .complains(&["eye.gltf", "/nose", "/eye"]);
    shot.render("--camera /eye -o a.exr").ends(1).complains(&[SCENE, "no camera"]);
    shot.render(&format!("--camera {SCENE} -o a.exr")).ends(1).complains(&[SCENE, "no camera"]);
    // It is an input, and part of what the picture was rendered from.
    std::fs::copy(shot.path("eye.gltf"), shot.path("eye.exr")).unwrap();
    let resume = "--camera eye.gltf -o b.exr --resume";
    shot.render(resume).ends(0);
    shot.render(resume).ends(0).says("up to date");
    let mut moved: Value = serde_json::from_slice(&shot.read("eye.gltf")).unwrap();
    moved["nodes"][2]["translation"] = json!([0, 0, 5]);
    shot.write("eye.gltf", moved.to_string());
    shot.render(resume).ends(0).keeps_quiet_about("up to date");
}

#[test]
fn a_place_to_look_from_is_part_of_the_picture() {
    let shot = Shot::still();
    let resume = "-o a.exr --resume";
    shot.render(&format!("--look-from 0,0,4 {resume}")).ends(0);
    shot.render(&format!("--look-from 0,0,4 {resume}")).ends(0).says("up to date");
    for other in [
        "--look-from 0,0,5",
        "--look-from 0,0,4 --look-at 0.5,0,0",
        "--look-from 0,0,4 --fov 30",
        "--look-from 0,0,4 --up 1,0,0",
        "--look-from -1,-0.5,4",
        "--fit",
        "",
    ] {
        shot.render(&format!("{other} {resume}")).ends(0).keeps_quiet_about("up to date");
        shot.render(&format!("{other} {resume}")).ends(0).says("up to date");
    }
}

/// However a shot is divided among processes, and whether a tree is at hand or not, the view is the same.
#[test]
fn every_chunk_of_a_shot_has_the_same_view() {
    let mut shot = Shot::moving();
    shot.edit(|json| drop(json["nodes"][2].as_object_mut().unwrap().remove("camera")));
    let view = |arguments: &str| {
        let told = shot.render(&format!("{arguments} -o a.#.exr")).ends(0);
        told.err.lines().find(|line| line.starts_with(NOTE)).unwrap().to_owned()
    };
    let whole = view("--frames 1-25x8");
    let pictures: Vec<_> = (1..=25).step_by(8).map(|i| shot.read(&format!("a.{i}.exr"))).collect();
    for (frame, picture) in (1..=25).step_by(8).zip(pictures) {
        assert_eq!(view(&format!("--frames {frame}")), whole);
        assert!(shot.read(&format!("a.{frame}.exr")) == picture, "frame {frame}");
    }
    // The camera that is added changes no light: a tree of the scene is fresh.
    shot.candelabra(&format!("build {SCENE} --frames 1-25x8")).ends(0);
    assert_eq!(view("--tree shot.ltree --frames 9"), whole);
}

#[test]
fn measure_and_diff_take_the_same_options() {
    let shot = blind();
    let measure = format!("measure {SCENE} --exact --probes 8 --json -");
    let pictures = format!("measure {SCENE} tree@2 --res 8x6 --seeds 1 --cache cache --json -");
    let pilot = format!("measure {SCENE} --shot --res 8x6 --error 1 --json -");
    for command in [&measure, &pictures, &pilot] {
        shot.candelabra(command).ends(0).complains(&[NOTE]);
        for view in ["--camera eye.gltf", "--look-from 0,0,4 --look-at 0,0,0 --fov 50", "--fit"] {
            shot.candelabra(&format!("{command} {view}")).ends(0);
        }
        for wrong in ["--fov 50", "--look-from 1,2", "--fit --camera 0"] {
            shot.candelabra(&format!("{command} {wrong}")).ends(2);
        }
        shot.candelabra(&format!("{command} --look-from 1,1,1 --look-at 1,1,1")).ends(2);
        shot.candelabra(&format!("{command} --camera /eye")).ends(1).complains(&["no camera"]);
    }
    shot.candelabra(&format!("{measure} --split 0.1,nan")).ends(2);
    shot.candelabra(&format!("measure {SCENE} tree:nan@2")).ends(2).complains(&["from 0 to 1"]);
    // What is measured is what is seen.
    let variance = |view: &str| {
        let told = shot.candelabra(&format!("{measure} {view}")).ends(0);
        let report: Value = serde_json::from_str(&told.out).unwrap();
        report["exact"]["strategies"][0]["variance"].as_f64().unwrap()
    };
    assert_eq!(variance("--camera eye.gltf"), variance("--camera eye.gltf:/eye"));
    assert_ne!(variance("--camera eye.gltf"), variance("--look-from 3,0,1"));

    let mut other = shot.json.clone();
    other["nodes"][1]["translation"] = json!([1, 0, 1]);
    shot.write("other.gltf", other.to_string());
    let told = shot.candelabra(&format!("diff {SCENE} other.gltf")).ends(1);
    told.says("on camera paths").complains(&["note: other.gltf: it has no camera; the view is"]);
    for view in ["--camera eye.gltf", "--fit", "--look-from 0,0,4"] {
        shot.candelabra(&format!("diff {SCENE} other.gltf {view}")).ends(1).says("on camera paths");
    }
    // One version's camera serves both, without a note.
    let told = shot.candelabra("diff eye.gltf other.gltf --html page.html").ends(1);
    assert!(told.err.is_empty(), "{told:?}");
    assert!(String::from_utf8(shot.read("page.html")).unwrap().contains("class=\"heat\""));
    shot.candelabra(&format!("diff {SCENE} other.gltf --camera /eye")).ends(2);
    shot.candelabra(&format!("build {SCENE}")).ends(0);
    shot.candelabra("diff shot.ltree shot.ltree --fit")
        .ends(2)
        .complains(&["a view is one of scenes"]);
    // Trees are compared with scenes, and seen as these are.
    shot.candelabra("diff shot.ltree other.gltf --fit").ends(1).says("on camera paths");
}

#[test]
fn an_orthographic_camera_is_told_and_rendered() {
    let mut shot = Shot::still();
    shot.edit(|json| {
        json["cameras"] = json!([{"type": "orthographic",
            "orthographic": {"xmag": 3, "ymag": 2, "znear": 0, "zfar": 9}}]);
    });
    shot.candelabra(&format!("inspect {SCENE}")).ends(0).says("/eye, orthographic, 4 m high");
    let report = shot.candelabra(&format!("inspect {SCENE} --json")).ends(0).out;
    let report: Value = serde_json::from_str(&report).unwrap();
    assert_eq!(report["cameras"], json!([{"path": "/eye", "height_m": 4.0}]));
    shot.render("-o a.exr").ends(0);
    pixels(&shot, "a.exr");
}

/// Pages and trees that cannot be written are refused before there is anything to write.
#[test]
fn outputs_are_checked_first() {
    let shot = Shot::still();
    std::fs::create_dir(shot.path("taken")).unwrap();
    shot.write("file", "no folder");
    for output in ["taken", "file/below"] {
        let told = shot.candelabra(&format!("build {SCENE} -o {output}")).ends(1);
        assert!(told.out.is_empty(), "{told:?}");
        told.complains(&[output, "cannot be written", "choose another output"]);
        for (command, code) in [("diff shot.gltf shot.gltf", 2), ("inspect shot.gltf", 1)] {
            let told = shot.candelabra(&format!("{command} --html {output}")).ends(code);
            assert!(told.out.is_empty(), "{told:?}");
            told.complains(&[output, "cannot be written", "choose another output"]);
        }
    }
    assert_eq!(shot.names(), ["file", SCENE, "taken"]);
}
