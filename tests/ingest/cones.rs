//! Cones and ranges of lights that animations change, by `KHR_animation_pointer`.

use crate::files::{File, lamp};
use candelabra::emitter::Emitters;
use candelabra::scene::{Light, LightKind, Scene, Shaping};
use glam::Vec3;
use serde_json::json;

const LIGHT: &str = "/extensions/KHR_lights_punctual/lights/0/";

/// A lamp, and a spot of 2 candela at a node of its own.
fn file() -> File {
    let mut file = lamp();
    file.light(json!({"type": "spot", "color": [1, 0.5, 0.25], "intensity": 2, "range": 50,
        "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.5}}));
    file
}

fn animate(file: &mut File, part: &str, times: &[f32], values: &[f32], how: &str) {
    file.animate(&format!("{LIGHT}{part}"), times, values, how);
}

#[track_caller]
fn load(file: &File) -> Scene {
    let scene = file.load().unwrap_or_else(|error| panic!("{error}"));
    assert!(scene.notes.is_empty(), "{:?}", scene.notes);
    scene
}

/// The lights that shine at a time, with how strong they are.
fn lit(scene: &Scene, time_s: f64) -> Vec<(&Light, Vec3)> {
    let pose = scene.pose_at(time_s);
    let lights = scene.lights.iter().zip(0..);
    let lights = lights.map(|(light, row)| (light, scene.rgb_of_light(row, &pose)));
    lights.filter(|(_, rgb)| rgb.max_element() > 0.0).collect()
}

fn angles(light: &Light) -> [f32; 2] {
    match light.kind.shaping() {
        Some(Shaping::Khr { inner_rad, outer_rad }) => [inner_rad, outer_rad],
        other => panic!("{other:?}"),
    }
}

/// At each frame one light shines, with the cone of that frame and all of the strength.
#[test]
fn each_frame_has_its_cone() {
    for how in ["LINEAR", "STEP", "CUBICSPLINE"] {
        let mut file = file();
        let outer: &[f32] = match how {
            "CUBICSPLINE" => &[0.0, 0.4, 1.0, 0.0, 1.2, 0.0],
            _ => &[0.4, 1.2],
        };
        animate(&mut file, "spot/outerConeAngle", &[0.0, 1.0], outer, how);
        animate(&mut file, "spot/innerConeAngle", &[0.5, 1.5], &[0.1, 0.3], "LINEAR");
        animate(&mut file, "intensity", &[0.0, 1.0], &[2.0, 6.0], "LINEAR");
        let scene = load(&file);
        for frame in -2..40 {
            let second = f64::from(frame) / 24.0;
            let t = second.clamp(0.0, 1.0);
            let outer = match how {
                "LINEAR" => 0.4 + 0.8 * t,
                "STEP" if t < 1.0 => 0.4,
                "STEP" => 1.2,
                _ => {
                    let (t2, t3) = (t * t, t * t * t);
                    (2.0 * t3 - 3.0 * t2 + 1.0) * 0.4
                        + (t3 - 2.0 * t2 + t)
                        + (3.0 * t2 - 2.0 * t3) * 1.2
                }
            };
            let inner = 0.1 + 0.2 * (second - 0.5).clamp(0.0, 1.0);
            let shining = lit(&scene, second);
            let [(light, rgb)] = shining[..] else { panic!("{how} {frame}: {shining:?}") };
            let [own_inner, own_outer] = angles(light).map(f64::from);
            assert!((own_outer - outer).abs() < 1e-5, "{how} {frame}: {own_outer} {outer}");
            assert!((own_inner - inner).abs() < 1e-5, "{how} {frame}: {own_inner} {inner}");
            let strength = (2.0 + 4.0 * t) as f32 * Vec3::new(1.0, 0.5, 0.25);
            assert!((rgb - strength).length() < 1e-4, "{how} {frame}: {rgb} {strength}");
        }
        // Between two frames the light is theirs, all of it.
        let half = lit(&scene, 0.5 + 0.5 / 24.0);
        let sum: Vec3 = half.iter().map(|(_, rgb)| *rgb).sum();
        let strength = (4.0 + 2.0 / 24.0) * Vec3::new(1.0, 0.5, 0.25);
        assert!((sum - strength).length() < 1e-4 && half.len() == 2, "{how}: {half:?}");
        // All stand where the light does; each has a name of its own.
        let nodes: Vec<_> =
            scene.lights.iter().map(|light| &scene.nodes[light.node as usize]).collect();
        assert_eq!(&*nodes[0].path, "/lamp");
        assert!(nodes[1..].iter().all(|node| node.parent == Some(scene.lights[0].node)));
        assert!(nodes[1..].iter().all(|node| node.path.starts_with("/lamp[shaping ")));
    }
}

#[test]
fn what_is_held_jumps_at_its_keys() {
    let mut file = file();
    animate(&mut file, "spot/outerConeAngle", &[0.0, 0.5, 1.0], &[0.4, 1.2, 0.4], "STEP");
    let scene = load(&file);
    // As often as it has the first cone again, it is one light.
    assert_eq!(scene.lights.len(), 2);
    for (second, outer) in
        [(-1.0, 0.4), (0.0, 0.4), (0.49, 0.4), (0.5, 1.2), (0.99, 1.2), (1.0, 0.4), (9.0, 0.4)]
    {
        let shining = lit(&scene, second);
        let [(light, rgb)] = shining[..] else { panic!("{second}: {shining:?}") };
        assert_eq!((angles(light)[1], rgb), (outer, Vec3::new(2.0, 1.0, 0.5)), "{second}");
    }
    // Keys that say one thing are a constant.
    let mut file = self::file();
    animate(&mut file, "spot/outerConeAngle", &[0.0, 1.0], &[0.4, 0.4], "LINEAR");
    let scene = load(&file);
    assert_eq!((scene.lights.len(), angles(&scene.lights[0])), (1, [0.1, 0.4]));
    assert!(!scene.has_lights_that_change());
}

#[test]
fn a_range_is_animated_and_a_cone_opens_from_nothing() {
    let mut file = file();
    animate(&mut file, "range", &[0.0, 1.0], &[10.0, 34.0], "LINEAR");
    let scene = load(&file);
    assert_eq!(scene.lights.len(), 25);
    for frame in 0..=24 {
        let shining = lit(&scene, f64::from(frame) / 24.0);
        assert_eq!(shining.len(), 1);
        let range = shining[0].0.range_m.unwrap();
        assert!((range - (10.0 + frame as f32)).abs() < 1e-4, "{frame}: {range}");
    }
    // A point has a range as well.
    let mut file = lamp();
    file.light(json!({"type": "point", "intensity": 2}));
    animate(&mut file, "range", &[0.0, 1.0], &[1.0, 2.0], "STEP");
    assert_eq!(load(&file).lights.iter().map(|light| light.range_m.unwrap()).sum::<f32>(), 3.0);

    let mut file = self::file();
    file.json["extensions"]["KHR_lights_punctual"]["lights"][0]["spot"] =
        json!({"innerConeAngle": 0.0, "outerConeAngle": 0.0});
    animate(&mut file, "spot/outerConeAngle", &[0.0, 1.0], &[0.0, 1.0], "LINEAR");
    let scene = load(&file);
    assert!(lit(&scene, 0.0).is_empty());
    let shining = lit(&scene, 0.5);
    assert_eq!((angles(shining[0].0), shining[0].1.x), ([0.0, 0.5], 2.0));
    // All of them are lights of the tree.
    assert_eq!(Emitters::collect(&scene).len(), 1 + scene.lights.len());
}

/// What `extras` say of strength and shaping counts; the range is still the animation's.
#[test]
fn extras_are_stronger() {
    let mut file = file();
    animate(&mut file, "spot/outerConeAngle", &[0.0, 1.0], &[0.4, 1.2], "LINEAR");
    let shaping = json!({"coneAngle": 30, "coneSoftness": 0, "focus": 0, "focusTint": [0, 0, 0]});
    let values = json!({"times": [0, 1], "rgb": [[7, 7, 7], [9, 9, 9]]});
    file.lux(json!({"type": "SphereLight", "inputs": {}, "shaping": shaping, "values": values}));
    let scene = load(&file);
    assert_eq!(scene.lights.len(), 1);
    assert_eq!(lit(&scene, 0.5)[0].1, Vec3::splat(8.0));
    animate(&mut file, "range", &[0.0, 1.0], &[3.0, 4.0], "STEP");
    let scene = load(&file);
    assert_eq!(scene.lights.len(), 2);
    assert!(
        scene.lights.iter().all(|light| matches!(
            light.kind,
            LightKind::Spot { shaping: Shaping::Usd { .. }, .. }
        ))
    );
    assert_eq!(lit(&scene, 0.5)[0].1, Vec3::splat(8.0));
    assert_eq!(lit(&scene, 1.0)[0].1, Vec3::splat(9.0));
}

#[test]
fn links_and_groups_are_those_of_the_light() {
    let mut file = file();
    animate(&mut file, "spot/outerConeAngle", &[0.0, 1.0], &[0.4, 1.2], "STEP");
    file.lux(json!({"type": "SphereLight", "inputs": {}, "lightLink": 1, "group": "key"}));
    file.json["nodes"][0]["extras"]["usdLinks"] = json!({"outside": [1]});
    let scene = load(&file);
    assert_eq!(scene.lights.len(), 2);
    let links: Vec<_> = (0..2).map(|row| scene.linking.of_light(row).light).collect();
    assert_eq!(links[0], links[1]);
    assert!(links[0].is_some());
    let above = scene.nodes[scene.lights[1].node as usize].parent.unwrap();
    assert_eq!(scene.light_groups[&above], "key");
}

#[test]
fn cones_over_time_that_are_broken() {
    type Break = fn(&mut File);
    let cases: [(Break, &str); 6] = [
        (
            |f| animate(f, "range", &[0.0, 1.0], &[1.0, 0.0], "LINEAR"),
            "ranges that are not positive",
        ),
        (|f| animate(f, "spot/outerConeAngle", &[0.0], &[-1.0], "LINEAR"), "that are negative"),
        (|f| animate(f, "spot/innerConeAngle", &[0.0], &[0.9], "STEP"), "its edge is hard"),
        (
            |f| animate(f, "spot/outerConeAngle", &[0.0, 1.0], &[0.5, 3.0], "STEP"),
            "larger than pi/2",
        ),
        (
            |f| animate(f, "spot/outerConeAngle", &[0.0, 1000.0], &[0.5, 1.5], "LINEAR"),
            "more than 2000",
        ),
        (
            |f| {
                f.json["extensions"]["KHR_lights_punctual"]["lights"][0]["type"] = json!("point");
                animate(f, "spot/outerConeAngle", &[0.0], &[0.5], "STEP");
            },
            "could move",
        ),
    ];
    for (change, text) in cases {
        let mut file = file();
        change(&mut file);
        let scene = file.load().unwrap();
        let [note] = scene.notes.as_slice() else { panic!("{text}: {:?}", scene.notes) };
        assert!(note.to_string().contains(text), "{note}");
        assert!(scene.lights.len() <= 2);
    }
}

/// Thousands of cones of thousands of lights by the same few bytes: more memory than the file may ask for.
#[test]
fn cones_at_many_frames_are_refused_before_they_are_made() {
    let mut file = file();
    animate(&mut file, "spot/outerConeAngle", &[0.0, 1e6], &[0.5, 1.5], "LINEAR");
    for number in 1..2000 {
        file.add(
            "nodes",
            json!({"name": format!("n{number}"),
                "extensions": {"KHR_lights_punctual": {"light": 0}}}),
        );
        file.json["scenes"][0]["nodes"].as_array_mut().unwrap().push(json!(number));
    }
    let error = file.load().unwrap_err().to_string();
    assert!(error.contains("light ") && error.contains("more bytes of memory"), "{error}");
}
