//! Lenses over time and hidden cameras, through the programs.

use crate::files::{Shot, picture};
use serde_json::json;

/// A shot of three frames in which nothing changes but the lens.
fn zoom() -> Shot {
    let mut shot = Shot::still();
    shot.edit(|json| {
        json["asset"]["extras"] = json!({"usd": {
            "timeCodesPerSecond": 24, "startTimeCode": 1, "endTimeCode": 3,
        }});
        json["nodes"][2]["extras"] = json!({"usdCamera": {"values": {
            "times": [0, 2.0 / 24.0], "yfov": [0.8, 0.3], "exposureScale": [1, 4],
        }}});
    });
    shot
}

#[test]
fn each_frame_has_its_lens_whoever_renders_it() {
    let shot = zoom();
    shot.render("--frames 1-3 -o all.#.exr").ends(0);
    let frames = [1, 2, 3].map(|frame| shot.read(&format!("all.{frame}.exr")));
    for frame in [3, 1, 2] {
        shot.render(&format!("--frames {frame} -o one.#.exr")).ends(0);
        assert!(shot.read(&format!("one.{frame}.exr")) == frames[frame - 1], "frame {frame}");
    }
    let pixels = [1, 2, 3].map(|frame| picture(&shot.path(&format!("all.{frame}.exr"))).unwrap());
    assert!(pixels[0] != pixels[1] && pixels[1] != pixels[2] && pixels[0] != pixels[2]);
    // What is told of the picture is of its frame.
    let text = |frame: usize| String::from_utf8_lossy(&frames[frame - 1]).into_owned();
    assert!(
        text(3).contains(r#""exposure_scale":4.0"#) && text(1).contains(r#""exposure_scale":1.0"#)
    );
    // A shot of another file's camera.
    let blind = Shot::still();
    blind.write("eye.gltf", shot.json.to_string());
    blind.render("--camera eye.gltf --frames 1-3 -o eye.#.exr").ends(0);
    for (frame, pixels) in (1..).zip(&pixels) {
        assert_eq!(picture(&blind.path(&format!("eye.{frame}.exr"))).as_ref(), Some(pixels));
    }
}

#[test]
fn pictures_of_another_lens_are_rendered_again() {
    let mut shot = zoom();
    shot.render("--resume --frames 1-3 -o a.#.exr").ends(0);
    let again = shot.render("--resume --frames 1-3 -o a.#.exr").ends(0);
    assert_eq!(again.out.matches("up to date").count(), 3, "{again:?}");
    shot.edit(|json| {
        json["nodes"][2]["extras"]["usdCamera"]["values"]["yfov"] = json!([0.8, 0.31]);
    });
    shot.render("--resume --frames 1-3 -o a.#.exr").ends(0).keeps_quiet_about("up to date");
}

#[test]
fn inspect_tells_of_a_lens_that_varies() {
    let shot = zoom();
    shot.candelabra("inspect shot.gltf")
        .ends(0)
        .says("camera 0    /eye, 45.8 to 17.2 degrees high, its lens varies\n");
    let told = shot.candelabra("inspect --json shot.gltf").ends(0);
    let report: serde_json::Value = serde_json::from_str(&told.out).unwrap();
    assert_eq!(report["cameras"][0]["lens_varies"], true);
    assert_eq!(report["requires"]["lenses_over_time"], 1);
    let still = Shot::still().candelabra("inspect --json shot.gltf").ends(0);
    assert!(!still.out.contains("lens_varies") && !still.out.contains("last_height"));
}

#[test]
fn a_hidden_camera_is_not_looked_through_unless_it_is_named() {
    let mut shot = Shot::still();
    shot.render("-o eye.exr").ends(0);
    shot.edit(|json| {
        // Before the one that is seen, looking elsewhere.
        let off = json!({"name": "off", "camera": 0, "translation": [1, 0, 9],
            "extras": {"usdCamera": {"hidden": true}}});
        json["nodes"].as_array_mut().unwrap().push(off);
        json["scenes"][0]["nodes"] = json!([3, 0, 1, 2]);
    });
    shot.candelabra("inspect shot.gltf")
        .ends(0)
        .says("camera 0    /off, 45.8 degrees high, hidden\n");
    shot.render("-o default.exr").ends(0);
    shot.render("--camera /off -o off.exr").ends(0);
    shot.render("--camera 0 -o first.exr").ends(0);
    let seen = |name: &str| picture(&shot.path(name)).unwrap();
    assert_eq!(seen("default.exr"), seen("eye.exr"));
    assert_eq!(seen("off.exr"), seen("first.exr"));
    assert_ne!(seen("off.exr"), seen("eye.exr"));
}
