//! What the disk does to a tree file while it is written: two writers, a full disk, a killed writer, and
//! readers that have it mapped. Whoever looks at the name sees a whole file.
#![cfg(target_os = "linux")]

use crate::files::{SCENE, Shot};
use candelabra::math::random::hash;
use candelabra::pipeline;
use serde_json::json;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

const PROGRAM: &str = env!("CARGO_BIN_EXE_candelabra");
const OTHER: &str = "other.gltf";

/// Two scenes that move, in one folder, and the bytes of their trees.
fn two_scenes() -> (Shot, [Vec<u8>; 2]) {
    let shot = Shot::moving();
    let mut other = shot.json.clone();
    other["nodes"][1]["name"] = json!("lantern");
    shot.write(OTHER, other.to_string());
    let trees = [SCENE, OTHER].map(|scene| {
        shot.candelabra(&format!("build {scene} -o alone.ltree")).ends(0);
        shot.read("alone.ltree")
    });
    fs::remove_file(shot.path("alone.ltree")).unwrap();
    assert_ne!(trees[0], trees[1]);
    (shot, trees)
}

/// Begins to build a scene's tree into `shot.ltree`.
fn begin(shot: &Shot, scene: &str) -> Child {
    Command::new(PROGRAM)
        .current_dir(shot.path(""))
        .args(["build", scene, "-o", "shot.ltree", "--force", "--threads", "1"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

/// What a writer leaves under a name of its own until it is done.
fn unfinished(folder: &Path) -> Vec<String> {
    let names = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name());
    let names = names.map(|name| name.into_string().unwrap());
    names.filter(|name| name.ends_with(".part")).collect()
}

#[test]
fn of_two_writers_at_once_one_wins_whole() {
    let (shot, trees) = two_scenes();
    for _ in 0..12 {
        let writers = [SCENE, OTHER].map(|scene| begin(&shot, scene));
        for mut writer in writers {
            assert!(writer.wait().unwrap().success());
        }
        assert!(trees.contains(&shot.read("shot.ltree")));
        assert!(unfinished(&shot.path("")).is_empty());
    }
}

/// At whatever moment a writer dies, the name shows the old file or the new one. What it was writing
/// stays under a hidden name that nothing reads, until the next writer removes it.
#[test]
fn a_killed_writer_leaves_a_whole_file() {
    let (shot, trees) = two_scenes();
    shot.write("shot.ltree", &trees[0]);
    let started = Instant::now();
    begin(&shot, OTHER).wait().unwrap();
    let whole_run = started.elapsed().max(Duration::from_millis(1));
    let mut killed = 0;
    for attempt in 0..60 {
        let mut writer = begin(&shot, [SCENE, OTHER][attempt as usize % 2]);
        let share = f64::from(hash(attempt, 1)) / f64::from(u32::MAX);
        std::thread::sleep(whole_run.mul_f64(1.2 * share));
        writer.kill().unwrap();
        killed += u32::from(!writer.wait().unwrap().success());
        assert!(trees.contains(&shot.read("shot.ltree")), "attempt {attempt}");
    }
    assert!(killed > 0, "all {killed} writers were done before they were killed");
    assert!(begin(&shot, SCENE).wait().unwrap().success());
    assert_eq!(shot.read("shot.ltree"), trees[0]);
    assert!(unfinished(&shot.path("")).is_empty());
}

/// Writes a tree where there is no room for it; the old one stays, and the message helps.
#[track_caller]
fn assert_fails_for_want_of_room(output: &std::process::Output, folder: &Path, old: &[u8]) {
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{complaint}");
    for text in ["candelabra: ", "shot.ltree", "free some space, or choose another output"] {
        assert!(complaint.contains(text), "no '{text}' in {complaint}");
    }
    assert_eq!(fs::read(folder.join("shot.ltree")).unwrap(), old);
    assert!(unfinished(folder).is_empty());
}

/// A disk of our own, while it is mounted.
struct SmallDisk<'a>(&'a Path);

impl SmallDisk<'_> {
    /// Too small for a second file. `None` where we may not mount.
    fn mount(at: &Path) -> Option<SmallDisk<'_>> {
        let mut mount = Command::new("mount");
        let mount = mount.args(["-t", "tmpfs", "-o", "size=8k", "tmpfs"]).arg(at);
        let status = mount.stderr(Stdio::null()).status();
        status.is_ok_and(|status| status.success()).then_some(SmallDisk(at))
    }
}

impl Drop for SmallDisk<'_> {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(self.0).status();
    }
}

#[test]
fn a_full_disk_keeps_the_old_file() {
    let (shot, trees) = two_scenes();
    let folder = shot.path("disk");
    fs::create_dir(&folder).unwrap();
    let Some(_disk) = SmallDisk::mount(&folder) else {
        eprintln!("no disk can be mounted here: skipped");
        return;
    };
    fs::write(folder.join("shot.ltree"), &trees[0][..4000]).unwrap();
    let mut build = Command::new(PROGRAM);
    build.current_dir(shot.path("")).args(["build", OTHER, "-o", "disk/shot.ltree"]);
    assert_fails_for_want_of_room(&build.output().unwrap(), &folder, &trees[0][..4000]);
}

/// The same for a user whose files may not grow so large; that needs no rights.
#[test]
fn a_limit_on_files_keeps_the_old_one() {
    let (shot, trees) = two_scenes();
    shot.write("shot.ltree", &trees[0]);
    // In blocks of 512 or 1024 bytes; the signal that comes with it is ignored, as batch systems do.
    let limited = "trap '' XFSZ; ulimit -f 1; exec \"$0\" \"$@\"";
    let mut build = Command::new("sh");
    build.current_dir(shot.path("")).args([
        "-c",
        limited,
        PROGRAM,
        "build",
        OTHER,
        "-o",
        "shot.ltree",
    ]);
    assert_fails_for_want_of_room(&build.output().unwrap(), &shot.path(""), &trees[0]);
}

#[test]
fn a_reader_keeps_the_file_that_it_has_mapped() {
    let (shot, trees) = two_scenes();
    shot.write("shot.ltree", &trees[0]);
    let mapped = pipeline::open_tree(&shot.path("shot.ltree"), false).unwrap();
    assert!(begin(&shot, OTHER).wait().unwrap().success());
    assert_eq!(shot.read("shot.ltree"), trees[1]);
    // Nothing of it has been looked at but the header.
    mapped.verify().unwrap();
    assert!(mapped.data().as_ref() == trees[0]);
}
