//! `--error`, `--time`, `--plan`, `--audit`, `--checkpoint`: work that is asked for by what it gives.

use crate::files::{Shot, picture};
use candelabra::pipeline::{FrameNoise, Stamp};
use candelabra::render::Knobs;
use serde_json::json;
use std::time::Duration;

fn noise_of(shot: &Shot, name: &str) -> FrameNoise {
    Stamp::of_picture(&shot.path(name)).unwrap().noise.unwrap()
}

#[test]
fn an_error_is_reached_and_told() {
    let shot = Shot::still();
    let mut samples = Vec::new();
    for (asked, error) in [("draft", 0.1), ("0.04", 0.04)] {
        let told =
            shot.render(&format!("--error {asked} --light-sampler uniform -o a.exr")).ends(0);
        told.says("with 95 % certainty").says(&format!("{error} asked"));
        let noise = noise_of(&shot, "a.exr");
        assert_eq!(noise.asked, Some(error));
        assert!(noise.bound <= error && noise.error <= noise.bound, "{noise:?}");
        assert_eq!((noise.capped, noise.spoilt, noise.audit), (0, 0, None));
        samples.push(noise.samples);
    }
    assert!(samples[0] <= samples[1], "{samples:?}");
}

#[test]
fn a_frame_that_may_not_have_the_samples_says_for_how_many_pixels() {
    let shot = Shot::still();
    shot.render("--error 0.0001 --max-spp 8 -o a.exr").ends(0).says("are not settled (--max-spp)");
    let noise = noise_of(&shot, "a.exr");
    assert!(noise.capped > 0 && noise.most == 8 && noise.bound > 0.0001, "{noise:?}");
}

#[test]
fn an_audit_agrees_with_what_was_told() {
    let shot = Shot::still();
    shot.render("--error 0.05 --audit 200 -o a.exr").ends(0).says("audit: ");
    let noise = noise_of(&shot, "a.exr");
    let audit = noise.audit.unwrap();
    assert!(audit.pixels > 20 && audit.from <= audit.error && audit.error <= audit.to, "{audit:?}");
    // Far apart, in standard errors, are a wrong seed, a wrong floor, a wrong square.
    let width = audit.to - audit.from;
    assert!((noise.error - audit.error).abs() < 2.0 * width, "{noise:?}");
    // The picture is that without an audit, and is up to date for one who does not ask for any.
    let audited = picture(&shot.path("a.exr"));
    shot.render("--error 0.05 -o b.exr").ends(0);
    assert!(audited == picture(&shot.path("b.exr")));
    shot.render("--error 0.05 --resume -o a.exr").ends(0).says("is up to date");
}

#[test]
fn a_picture_that_was_limited_by_time_is_repeated_by_its_plan() {
    let shot = Shot::moving();
    shot.render("--frames 1-2 --time 0.4 -o a.#.exr").ends(0);
    shot.render("--frames 1-2 --plan a.#.exr -o b.#.exr").ends(0);
    for frame in [1, 2] {
        let [a, b] = ["a", "b"].map(|name| picture(&shot.path(&format!("{name}.{frame}.exr"))));
        assert!(a == b && a.is_some(), "frame {frame}");
    }
    // Another plan is another picture, and what does not fit is refused.
    shot.render("--frames 1-2 --plan a.#.exr -o b.#.exr --resume").ends(0).says("up to date");
    shot.render("--frames 1 --plan b.1.exr --res 5x4 -o c.exr")
        .ends(1)
        .complains(&["b.1.exr", "other pixels"]);
    shot.render("--frames 1 --spp 4 --aov beauty -o d.exr").ends(0);
    shot.render("--frames 1 --plan d.exr -o c.exr").ends(1).complains(&[
        "d.exr",
        "sampleCount",
        "--aov",
    ]);
}

/// Knobs are chosen for the error that is asked for. A plan has no error, and takes those of the picture.
#[test]
fn a_plan_repeats_the_knobs_of_the_picture() {
    let mut shot = Shot::still();
    shot.edit(|scene| {
        let lamp = scene["nodes"][1].clone();
        for i in 0..64 {
            let mut lamp = lamp.clone();
            lamp["name"] = json!(format!("lamp {i}"));
            lamp["translation"] = json!([0.1 * f64::from(i) - 3.2, 1.0, 0.5]);
            let number = scene["nodes"].as_array().unwrap().len();
            scene["nodes"].as_array_mut().unwrap().push(lamp);
            scene["scenes"][0]["nodes"].as_array_mut().unwrap().push(json!(number));
        }
    });
    shot.render("--res 64x36 --error 0.04 -o a.exr").ends(0);
    shot.render("--res 64x36 --plan a.exr -o b.exr").ends(0);
    let [a, b] = ["a.exr", "b.exr"].map(|name| Stamp::of_picture(&shot.path(name)).unwrap().knobs);
    assert!(a == b && a != Some(Knobs::default()), "{a:?} {b:?}");
    let [a, b] = ["a.exr", "b.exr"].map(|name| picture(&shot.path(name)));
    assert!(a == b && a.is_some());
}

/// However short the time, every pixel has samples, and the user hears of it. An audit is beside the time.
#[test]
fn a_time_that_is_too_short_gives_a_picture_and_a_note() {
    let shot = Shot::still();
    let arguments = "--time 0.01 --audit 20 --res 96x64 -o a.exr";
    shot.render(arguments).ends(0).complains(&["frame 1", "--time"]);
    assert!(picture(&shot.path("a.exr")).unwrap().iter().any(|pixel| pixel[0] > 0.0));
    let noise = noise_of(&shot, "a.exr");
    assert!(noise.samples >= 2.0 && noise.audit.is_some(), "{noise:?}");
}

#[test]
fn a_frame_that_was_stopped_goes_on_from_its_checkpoint() {
    let shot = Shot::still();
    let arguments = "--spp 3000 --res 64x36 --checkpoint -o a.exr";
    shot.render("--spp 3000 --res 64x36 -o whole.exr").ends(0);
    let mut stops = 0;
    loop {
        // Longer each time, so that it ends on any machine.
        let patience = Duration::from_millis(400 * (1 + stops));
        if shot.render_for(arguments, patience) == Some(0) {
            break;
        }
        stops += 1;
        assert!(stops < 300, "it never ends");
        assert!(!shot.path("a.exr").exists());
    }
    assert!(stops > 0, "it was never stopped");
    assert!(shot.read("a.exr") == shot.read("whole.exr"), "after {stops} stops");
    assert!(!shot.path("a.exr.checkpoint").exists());
}

#[test]
fn a_checkpoint_of_something_else_is_not_gone_on_with() {
    let shot = Shot::still();
    shot.render("--spp 64 -o whole.exr").ends(0);
    for other in
        ["candelabra film\n", "", "something else that has nothing to do with films at all....."]
    {
        shot.write("a.exr.checkpoint", other);
        let told = shot.render("--spp 64 --checkpoint -o a.exr").ends(0);
        told.complains(&["a.exr.checkpoint", "begun anew"]);
        assert!(shot.read("a.exr") == shot.read("whole.exr"));
    }
}

#[test]
fn nonsense_is_a_usage_error() {
    let shot = Shot::still();
    for wrong in [
        "--error 0",
        "--error -1",
        "--error nan",
        "--error best",
        "--time 0",
        "--time 5x",
        "--time inf",
        "--grey 0",
        "--grey inf",
        "--audit 0",
        "--max-spp 0",
        "--plan a.exr --error 0.1",
        "--plan a.png",
    ] {
        shot.render(&format!("{wrong} -o a.exr")).ends(2);
    }
}
