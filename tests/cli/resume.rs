//! `--resume`: what is there, whole, and of the same scene, tree and settings is not done again.

use crate::files::{SCENE, Shot, picture};
use serde_json::json;

const SHOT: &str = "--resume --frames 1-2 -o a.#.exr";

/// Asserts which of the two frames are rendered, and that both are there afterwards.
#[track_caller]
fn assert_rendered(shot: &Shot, arguments: &str, rendered: &[u32]) {
    let told = shot.render(arguments).ends(0);
    for frame in [1, 2] {
        let skipped = told.out.contains(&format!("frame {frame}: a.{frame}.exr is up to date"));
        assert_eq!(skipped, !rendered.contains(&frame), "frame {frame}: {told:#?}");
        assert!(picture(&shot.path(&format!("a.{frame}.exr"))).is_some());
    }
}

#[test]
fn whole_pictures_of_the_same_are_kept() {
    let shot = Shot::moving();
    assert_rendered(&shot, SHOT, &[1, 2]);
    let before = shot.read("a.1.exr");
    assert_rendered(&shot, SHOT, &[]);
    assert!(shot.read("a.1.exr") == before);
    // Without the flag all is done again.
    let told = shot.render("--frames 1-2 -o a.#.exr").ends(0);
    assert!(!told.out.contains("up to date"), "{told:?}");
    assert!(shot.read("a.1.exr") == before, "the same input gives the same bytes");
}

#[test]
fn broken_pictures_are_rendered_again() {
    let shot = Shot::moving();
    assert_rendered(&shot, SHOT, &[1, 2]);
    let whole = shot.read("a.2.exr");
    std::fs::remove_file(shot.path("a.2.exr")).unwrap();
    assert_rendered(&shot, SHOT, &[2]);
    for length in [0, 4, 300, whole.len() / 2, whole.len() - 1] {
        shot.write("a.2.exr", &whole[..length]);
        assert_rendered(&shot, SHOT, &[2]);
        assert!(shot.read("a.2.exr") == whole, "cut at {length}");
    }
    shot.write("a.2.exr", "a text");
    assert_rendered(&shot, SHOT, &[2]);
    // A picture of another frame under this one's name.
    std::fs::copy(shot.path("a.1.exr"), shot.path("a.2.exr")).unwrap();
    assert_rendered(&shot, SHOT, &[2]);
}

#[test]
fn a_missing_preview_is_made() {
    let shot = Shot::moving();
    assert_rendered(&shot, SHOT, &[1, 2]);
    let with_previews = format!("{SHOT} --png --exposure 0");
    assert_rendered(&shot, &with_previews, &[1, 2]);
    assert_rendered(&shot, &with_previews, &[]);
    std::fs::remove_file(shot.path("a.1.png")).unwrap();
    assert_rendered(&shot, &with_previews, &[1]);
    assert!(shot.path("a.1.png").exists());
}

#[test]
fn other_settings_are_another_picture() {
    let mut shot = Shot::moving();
    shot.edit(|json| json["cameras"][0]["perspective"]["yfov"] = json!(0.7));
    assert_rendered(&shot, SHOT, &[1, 2]);
    for other in
        ["--spp 3", "--depth 2", "--seed 9", "--res 12x9", "--float", "--light-sampler power"]
    {
        let arguments = format!("{SHOT} {other}");
        assert_rendered(&shot, &arguments, &[1, 2]);
        assert_rendered(&shot, &arguments, &[]);
        assert_rendered(&shot, SHOT, &[1, 2]);
    }
    // What does not change the picture does not matter.
    shot.candelabra(&format!("build {SCENE} --frames 1-2")).ends(0);
    assert_rendered(&shot, &format!("{SHOT} --tree shot.ltree"), &[]);
    // What an unproven tree may have done to a picture, nobody knows.
    assert_rendered(&shot, &format!("{SHOT} --tree shot.ltree --no-verify"), &[1, 2]);
}

#[test]
fn another_scene_is_another_picture() {
    let mut shot = Shot::moving();
    assert_rendered(&shot, SHOT, &[1, 2]);
    // The camera moves: no light does, so the tree stays.
    shot.edit(|json| json["nodes"][2]["translation"] = json!([0, 0.5, 4]));
    assert_rendered(&shot, SHOT, &[1, 2]);
    assert_rendered(&shot, SHOT, &[]);
}

#[test]
fn files_that_the_scene_refers_to_belong_to_it() {
    let shot = Shot::still().with_buffer_file().with_picture_file();
    let arguments = "--resume -o a.1.exr";
    let is_rendered = || !shot.render(arguments).ends(0).out.contains("up to date");
    assert!(is_rendered() && !is_rendered());
    shot.write_picture([200, 100, 51]);
    assert!(is_rendered() && !is_rendered(), "a texture changed");
    let mut buffer = shot.read("shot.bin");
    buffer[3] ^= 0x80;
    shot.write("shot.bin", &buffer);
    // The lamp's mesh changed too: a tree is built in memory, and is another.
    assert!(is_rendered() && !is_rendered(), "a buffer changed");
}

#[test]
fn a_longer_shot_keeps_the_frames_it_has() {
    let shot = Shot::moving();
    assert_rendered(&shot, SHOT, &[1, 2]);
    // Neither a tree in memory nor one in a file is the same for more frames; the pictures are.
    shot.render("--resume --frames 1-4 -o a.#.exr").ends(0).says("frame 3: ");
    assert_rendered(&shot, SHOT, &[]);
    for frames in ["1-4", "1-8"] {
        shot.candelabra(&format!("build {SCENE} --frames {frames}")).ends(0);
        assert_rendered(&shot, &format!("{SHOT} --tree shot.ltree"), &[]);
    }
}
