//! `candelabra build` and `candelabra inspect`.

use crate::files::{SCENE, Shot};
use serde_json::json;
use std::io::Read;
use std::process::{Command, Stdio};

#[test]
fn a_scene_becomes_a_tree_beside_it() {
    let shot = Shot::still();
    shot.candelabra(&format!("build {SCENE}"))
        .ends(0)
        .says("1 lights, 2 emitters (0 change)")
        .says("shot.ltree");
    assert_eq!(shot.names(), [SCENE, "shot.ltree"], "no temporary files are left");
    shot.candelabra("inspect shot.ltree").ends(0).says("sound").says("/lamp");
    shot.candelabra(&format!("inspect {SCENE}")).ends(0).says("mesh lights").says("/eye");
}

#[test]
fn a_tree_that_is_up_to_date_is_left_alone() {
    let mut shot = Shot::still();
    let build = format!("build {SCENE} --output deep/er/it.ltree");
    shot.candelabra(&build).ends(0).keeps_quiet_about("up to date");
    let written = || std::fs::metadata(shot.path("deep/er/it.ltree")).unwrap().modified().unwrap();
    let first = written();
    shot.candelabra(&build).ends(0).says("deep/er/it.ltree: up to date");
    assert_eq!(written(), first);
    shot.candelabra(&format!("{build} --force")).ends(0).keeps_quiet_about("up to date");
    assert_ne!(written(), first);
    // Damaged or for another scene, it is built anew.
    let whole = shot.read("deep/er/it.ltree");
    shot.write("deep/er/it.ltree", &whole[..whole.len() - 1]);
    shot.candelabra(&build).ends(0).keeps_quiet_about("up to date");
    assert_eq!(shot.read("deep/er/it.ltree"), whole);
    shot.edit(|json| json["nodes"][1]["translation"] = json!([0, 0, 2]));
    shot.candelabra(&build).ends(0).keeps_quiet_about("up to date");
    assert_ne!(shot.read("deep/er/it.ltree"), whole);
}

#[test]
fn a_moving_light_has_a_tree_for_every_frame() {
    let shot = Shot::moving();
    shot.candelabra(&format!("build {SCENE}")).ends(0).says("2 emitters (2 change)");
    shot.candelabra("inspect shot.ltree").ends(0).says("25 trees, 0 instances, 25 frames");
    shot.candelabra(&format!("build {SCENE} --frames 5,1,9")).ends(0).says("(2 change)");
    shot.candelabra("inspect shot.ltree").ends(0).says("3 trees, 0 instances, 3 frames");
}

#[test]
fn a_scene_that_cannot_be_read_is_named() {
    let shot = Shot::still();
    shot.candelabra("build nothing.gltf").ends(1).complains(&["candelabra:", "nothing.gltf"]);
    shot.write("broken.gltf", "{\"asset\": ");
    shot.candelabra("build broken.gltf").ends(1).complains(&["broken.gltf"]);
    shot.candelabra("build shot.usda").ends(1).complains(&["shot.usda"]);
    shot.candelabra(&format!("build {SCENE} -o {SCENE}/below.ltree"))
        .ends(1)
        .complains(&["below.ltree"]);
    assert_eq!(shot.names(), ["broken.gltf", SCENE]);
}

#[test]
fn usage_is_exit_code_two() {
    let shot = Shot::still();
    for wrong in ["", "burn", "build", "build shot.gltf --frames 1-x", "inspect a b"] {
        let told = shot.candelabra(wrong).ends(2);
        assert!(told.out.is_empty() && !told.err.is_empty(), "{told:?}");
    }
    shot.candelabra("--version").ends(0).says(env!("CARGO_PKG_VERSION"));
}

#[test]
fn a_file_that_is_no_tree_is_not_inspected() {
    let shot = Shot::still();
    shot.write("empty.ltree", "");
    shot.write("notes.ltree", "these are notes");
    std::fs::create_dir(shot.path("folder.ltree")).unwrap();
    for name in ["empty", "notes", "folder", "absent"] {
        let file = format!("{name}.ltree");
        shot.candelabra(&format!("inspect {file}")).ends(1).complains(&["candelabra:", &file]);
    }
}

/// `candelabra inspect SCENE | head -c 1`: a reader that has seen enough is no failure.
#[test]
fn a_closed_pipe_is_fine() {
    let mut shot = Shot::still();
    // More than any pipe holds.
    shot.edit(|json| {
        for i in 0..3000 {
            let name = format!("{}{i}", "a long name of a camera ".repeat(4));
            json["nodes"].as_array_mut().unwrap().push(json!({"name": name, "camera": 0}));
            json["scenes"][0]["nodes"].as_array_mut().unwrap().push(json!(3 + i));
        }
    });
    let mut running = Command::new(env!("CARGO_BIN_EXE_candelabra"))
        .args(["inspect".as_ref(), shot.path(SCENE).as_os_str()])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut out = running.stdout.take().unwrap();
    out.read_exact(&mut [0]).unwrap();
    drop(out);
    let output = running.wait_with_output().unwrap();
    let complaint = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success() && complaint.is_empty(), "{}: {complaint}", output.status);
}

/// Whatever a user mistypes, the scene survives it.
#[test]
fn inputs_are_never_overwritten() {
    let shot = Shot::still();
    let scene = shot.read(SCENE);
    shot.candelabra(&format!("build {SCENE} -o {SCENE}")).ends(1).complains(&["own file"]);
    shot.render(&format!("-o {SCENE}")).ends(2).complains(&[".exr"]);
    assert_eq!(shot.read(SCENE), scene);
}
