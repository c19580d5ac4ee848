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

/// Previews are made of what the picture keeps, so that one made later is the one made at once.
#[test]
fn a_preview_that_is_missing_or_not_of_the_picture_is_made_without_rendering() {
    let shot = Shot::moving();
    for float in ["", " --float"] {
        let with_previews = format!("{SHOT} --png{float}");
        assert_rendered(&shot, &format!("{with_previews} --seed 1"), &[1, 2]);
        let other = shot.read("a.1.png");
        assert_rendered(&shot, &with_previews, &[1, 2]);
        let at_once = shot.read("a.1.png");
        assert!(at_once != other);
        assert_rendered(&shot, &with_previews, &[]);
        std::fs::remove_file(shot.path("a.1.png")).unwrap();
        assert_rendered(&shot, &with_previews, &[]);
        assert!(shot.read("a.1.png") == at_once);
        // That of another picture, and one with rot in it.
        let mut rotten = at_once.clone();
        rotten[at_once.len() / 2] ^= 1;
        for wrong in [&other, &rotten, &at_once[..40].to_vec()] {
            shot.write("a.1.png", wrong);
            assert_rendered(&shot, &with_previews, &[]);
            assert!(shot.read("a.1.png") == at_once);
        }
        // Of another exposure, there and back.
        let brighter = format!("{with_previews} --exposure 3");
        assert_rendered(&shot, &brighter, &[]);
        assert!(shot.read("a.1.png") != at_once);
        assert_rendered(&shot, &with_previews, &[]);
        assert!(shot.read("a.1.png") == at_once);
    }
}

/// What is written does not depend on which frames a process renders.
#[test]
fn a_shot_in_chunks_is_the_shot() {
    let mut shot = Shot::moving();
    // It gets darker from frame to frame, so that each frame alone would choose another exposure.
    shot.edit(|json| {
        json["animations"][0]["channels"][0]["target"]["path"] = json!("scale");
    });
    shot.render("--frames 1-4 -o whole.#.exr --png").ends(0);
    for frames in ["4", "2-3", "1"] {
        shot.render(&format!("--frames {frames} -o part.#.exr --png")).ends(0);
    }
    for name in (1..=4).flat_map(|frame| [format!("{frame}.exr"), format!("{frame}.png")]) {
        assert!(
            shot.read(&format!("whole.{name}")) == shot.read(&format!("part.{name}")),
            "{name}"
        );
    }
}

#[test]
fn rot_anywhere_in_a_picture_is_noticed() {
    let shot = Shot::still();
    let arguments = "--resume --float --res 64x64 -o a.exr";
    shot.render(arguments).ends(0);
    let whole = shot.read("a.exr");
    for part in 1..6 {
        let mut rotten = whole.clone();
        let from = whole.len() * part / 6;
        rotten[from..from + 40].fill(0);
        shot.write("a.exr", rotten);
        shot.render(arguments).ends(0).keeps_quiet_about("up to date");
        assert!(shot.read("a.exr") == whole);
    }
    shot.render(arguments).ends(0).says("up to date");
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
