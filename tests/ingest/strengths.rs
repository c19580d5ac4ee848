//! Lights that animations make brighter, darker or of another colour.

use crate::files::{File, lamp};
use candelabra::scene::{Interpolation, Keys, Scene, Timeline};
use glam::{DVec3, Vec3};
use serde_json::json;

const COLOR: &str = "/extensions/KHR_lights_punctual/lights/0/color";
const INTENSITY: &str = "/extensions/KHR_lights_punctual/lights/0/intensity";

/// A lamp, and a point light of 2 candela times a colour at a node of its own.
fn file() -> File {
    let mut file = lamp();
    file.light(json!({"type": "point", "color": [1, 0.5, 0.25], "intensity": 2}));
    file
}

#[track_caller]
fn load(file: &File) -> Scene {
    file.load().unwrap_or_else(|error| panic!("{error}"))
}

/// The keys of the light of a scene that is read without a note.
#[track_caller]
fn keys(scene: &Scene) -> &Keys<Vec3> {
    assert!(scene.notes.is_empty(), "{:?}", scene.notes);
    assert_eq!(scene.lights.len(), 1);
    scene.lights[0].values.as_ref().expect("it is constant")
}

#[test]
fn an_intensity_or_a_colour_is_animated() {
    for (how, interpolation) in [("LINEAR", Interpolation::Linear), ("STEP", Interpolation::Step)] {
        let mut file = file();
        file.animate(INTENSITY, &[0.0, 0.5, 2.0], &[2.0, 8.0, 0.0], how);
        let scene = load(&file);
        let found = keys(&scene);
        assert_eq!(
            (&found.times_s[..], found.interpolation),
            (&[0.0, 0.5, 2.0][..], interpolation)
        );
        let color = Vec3::new(1.0, 0.5, 0.25);
        assert_eq!(found.values, [2.0 * color, 8.0 * color, Vec3::ZERO]);
        assert_eq!(candelabra::pipeline::frames_of(&scene).len(), 49);
        assert!(scene.has_lights_that_change());
    }
    let mut file = file();
    file.animate(COLOR, &[0.0, 1.0], &[1.0, 0.0, 0.0, 0.0, 0.5, 1.0], "LINEAR");
    let scene = load(&file);
    assert_eq!(keys(&scene).values, [Vec3::X * 2.0, Vec3::new(0.0, 1.0, 2.0)]);
}

#[test]
fn what_does_not_vary_is_constant() {
    let mut file = file();
    file.animate(INTENSITY, &[0.0, 1.0], &[5.0, 5.0], "LINEAR");
    let scene = load(&file);
    assert_eq!(keys(&scene).values, [Vec3::new(5.0, 2.5, 1.25)]);
    assert!(!scene.has_lights_that_change());
}

/// The value of a spline from one key to the next, by its definition.
fn hermite(t: f64, [a, out, b, into]: [f64; 4]) -> f64 {
    let (t2, t3) = (t * t, t * t * t);
    (2.0 * t3 - 3.0 * t2 + 1.0) * a
        + (t3 - 2.0 * t2 + t) * out
        + (3.0 * t2 - 2.0 * t3) * b
        + (t3 - t2) * into
}

/// Colour and intensity each have their own keys and ways between them; at each frame the light is their product.
#[test]
fn colour_and_intensity_are_multiplied_frame_by_frame() {
    let blue = |second: f64| second.clamp(0.0, 1.0);
    for how in ["LINEAR", "STEP", "CUBICSPLINE"] {
        let mut file = file();
        file.animate(COLOR, &[0.0, 1.0], &[1.0, 0.0, 0.0, 1.0, 0.0, 1.0], "LINEAR");
        let values: &[f32] = match how {
            "CUBICSPLINE" => &[0.0, 4.0, -9.0, -40.0, 1.0, 0.0],
            _ => &[4.0, 1.0],
        };
        file.animate(INTENSITY, &[0.25, 1.25], values, how);
        let scene = load(&file);
        let found = keys(&scene);
        assert!(found.times_s.is_sorted_by(|a, b| a < b));
        for frame in -3..60 {
            let second = f64::from(frame) / 24.0;
            let share = (second - 0.25).clamp(0.0, 1.0);
            let intensity = match how {
                "LINEAR" => 4.0 - 3.0 * share,
                "STEP" => {
                    if share < 1.0 {
                        4.0
                    } else {
                        1.0
                    }
                }
                _ => hermite(share, [4.0, -9.0, 1.0, -40.0]).max(0.0),
            };
            let value = found.at(second, scene.timeline);
            let expected = DVec3::new(1.0, 0.0, blue(second)) * intensity;
            assert!((value - expected).length() < 2e-5, "{how} {frame}: {value} {expected}");
        }
    }
    // Both held: held as ever.
    let mut file = file();
    file.animate(COLOR, &[0.0, 1.0], &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0], "STEP");
    file.animate(INTENSITY, &[0.5, 2.0], &[3.0, 1.0], "STEP");
    let scene = load(&file);
    let found = keys(&scene);
    assert_eq!(found.interpolation, Interpolation::Step);
    assert_eq!(found.times_s, [0.0, 0.5, 1.0, 2.0]);
    assert_eq!(found.values, [Vec3::X * 3.0, Vec3::X * 3.0, Vec3::Y * 3.0, Vec3::Y]);
}

/// Times are rounded by who writes them, and by 32 bits: what counts as at a frame jumps at that frame, whatever the other part does.
#[test]
fn a_part_that_jumps_at_a_frame_jumps_there() {
    let frame = |number: i32| f64::from(number) / 24.0;
    for number in [1, 2, 5, 7, 100, 1001, 100_001] {
        let nearest = frame(number) as f32;
        let decimals = ((frame(number) * 1e6).round() / 1e6) as f32;
        let mut times = vec![nearest, nearest.next_up(), nearest.next_down(), decimals];
        times.retain(|&time| Timeline::default().is_same(frame(number), time.into()));
        for (early, late) in times.iter().flat_map(|&a| times.iter().map(move |&b| (a, b))) {
            for how in ["LINEAR", "STEP"] {
                let mut file = file();
                let colors = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
                file.animate(COLOR, &[0.0, early], &colors, how);
                file.animate(INTENSITY, &[0.0, late], &[3.0, 5.0], "STEP");
                let scene = load(&file);
                let at = |number| keys(&scene).at(frame(number), scene.timeline);
                let (before, after) = (at(number - 1), at(number));
                assert!((after - DVec3::Y * 5.0).length() < 1e-5, "{number} {how}: {after}");
                // Red and green are one in all, and before the jump three times as strong.
                assert!((before.element_sum() - 3.0).abs() < 1e-4, "{number} {how}: {before}");
            }
        }
    }
}

#[test]
fn a_spline_that_goes_below_zero_is_dark() {
    let mut file = file();
    file.animate(INTENSITY, &[0.0, 2.0], &[0.0, 1.0, -50.0, 0.0, 1.0, 0.0], "CUBICSPLINE");
    let scene = load(&file);
    let found = keys(&scene);
    assert!(found.values.iter().all(|value| value.min_element() >= 0.0));
    assert!(found.values.contains(&Vec3::ZERO) && found.times_s.len() > 40);
}

#[test]
fn values_of_extras_take_the_place_of_animations() {
    let mut file = file();
    file.animate(INTENSITY, &[0.0, 1.0], &[1.0, 5.0], "LINEAR");
    let values = json!({"times": [0, 1], "rgb": [[7, 7, 7], [8, 8, 8]]});
    file.lux(json!({"type": "SphereLight", "inputs": {}, "values": values}));
    let scene = load(&file);
    let light = scene.lights.iter().find(|light| light.values.is_some()).unwrap();
    assert_eq!(light.values.as_ref().unwrap().values[0], Vec3::splat(7.0));
}

#[test]
fn animations_of_lights_that_are_broken() {
    type Break = fn(&mut File);
    let cases: [(Break, &str); 6] = [
        (
            |f| f.animate(INTENSITY, &[0.0, 1.0], &[1.0, -1.0], "LINEAR"),
            "intensities that are negative",
        ),
        (|f| f.animate(COLOR, &[0.0], &[1.0, -1.0, 0.0], "STEP"), "negative in part"),
        (|f| f.animate(INTENSITY, &[0.0, 1.0], &[1.0], "LINEAR"), "2 keys, but 1"),
        (|f| f.animate(INTENSITY, &[0.0, 1.0], &[1.0, f32::NAN], "LINEAR"), "not finite"),
        (
            |f| {
                let pointer = "/extensions/KHR_lights_punctual/lights/9/intensity";
                f.animate(pointer, &[0.0], &[1.0], "STEP");
            },
            "could move",
        ),
        (
            |f| {
                let pointer = "/extensions/KHR_lights_punctual/lights/0/extras/x";
                f.animate(pointer, &[0.0], &[1.0], "STEP");
            },
            "this part of a light is not read",
        ),
    ];
    for (change, text) in cases {
        let mut file = file();
        change(&mut file);
        let scene = load(&file);
        let [note] = scene.notes.as_slice() else { panic!("{text}: {:?}", scene.notes) };
        assert!(note.to_string().contains(text), "{note}");
        let varies = scene.lights[0].values.as_deref().is_some_and(Keys::varies);
        assert!(!varies, "{text}");
    }
    let mut file = file();
    file.animate(INTENSITY, &[0.0, 1.0], &[1.0, 3e38], "LINEAR");
    file.json["extensions"]["KHR_lights_punctual"]["lights"][0]["color"] = json!([9, 1, 1]);
    let scene = load(&file);
    assert!(scene.notes[0].to_string().contains("too strong"), "{:?}", scene.notes);
}

/// Keys at each frame of a long time, of many lights by the same few bytes: more memory than the file may ask for.
#[test]
fn strengths_at_many_frames_are_refused_before_they_are_made() {
    let mut file = file();
    file.animate(COLOR, &[0.0, 1e6], &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0], "LINEAR");
    file.animate(INTENSITY, &[0.0, 1e6], &[1.0, 2.0], "LINEAR");
    let light = file.json["extensions"]["KHR_lights_punctual"]["lights"][0].clone();
    let animations = file.json["animations"].as_array().unwrap().clone();
    for number in 1..400 {
        let lights = &mut file.json["extensions"]["KHR_lights_punctual"]["lights"];
        lights.as_array_mut().unwrap().push(light.clone());
        for animation in &animations {
            let own = animation.to_string().replace("/lights/0/", &format!("/lights/{number}/"));
            file.add("animations", serde_json::from_str(&own).unwrap());
        }
    }
    let error = file.load().unwrap_err().to_string();
    assert!(error.contains("light ") && error.contains("more bytes of memory"), "{error}");
}
