//! What `extras` carry from USD: `src/ingest/carriers.md`, row by row.

use crate::files;
use crate::files::{File, lamp};
use candelabra::pipeline::frames_of;
use candelabra::scene::{
    LightKind, Pixels, Projection, Scene, Shaping, Shutter, Timeline, Visibility,
};
use glam::{DVec3, Vec3};
use serde_json::{Value, json};
use std::f32::consts::{FRAC_PI_3, FRAC_PI_6};

fn load(edit: impl FnOnce(&mut File)) -> Scene {
    let mut file = lamp();
    edit(&mut file);
    file.load().unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn a_sphere_replaces_the_mesh_that_stands_for_it() {
    let scene = load(|file| {
        file.lux(json!({"type": "SphereLight", "radius": 0.5, "force": true}));
        file.json["nodes"][0]["scale"] = json!([2, -2, 2]);
    });
    assert!(scene.instances.is_empty() && scene.meshes.is_empty());
    let expected =
        LightKind::Sphere { radiance_nits: Vec3::new(8.0, 4.0, 2.0), radius: 0.5, shaping: None };
    assert_eq!((&scene.lights[0].kind, scene.lights[0].forced), (&expected, true));
    assert_eq!(scene.light_path(0), "/lamp");
}

#[test]
fn a_stretched_sphere_stays_a_mesh() {
    let stretched = |file: &mut File| {
        file.lux(json!({"type": "SphereLight", "radius": 0.5, "force": true}));
        file.json["nodes"][0]["scale"] = json!([1, 2, 1]);
    };
    let below_stretched = |file: &mut File| {
        file.lux(json!({"type": "SphereLight", "radius": 0.5, "force": true}));
        let matrix = json!([1, 0, 0, 0, 0.5, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
        file.add("nodes", json!({"matrix": matrix, "children": [0]}));
        file.json["scenes"][0]["nodes"] = json!([1]);
    };
    let animated = |file: &mut File| {
        file.lux(json!({"type": "SphereLight", "radius": 0.5, "force": true}));
        let times = file.times(&[0.0, 1.0]);
        let scales = file.floats(&[1.0, 1.0, 1.0, 1.0, 2.0, 1.0], "VEC3");
        file.add(
            "animations",
            json!({
                "samplers": [{"input": times, "output": scales}],
                "channels": [{"sampler": 0, "target": {"node": 0, "path": "scale"}}],
            }),
        );
    };
    for scene in [load(stretched), load(below_stretched), load(animated)] {
        assert!(scene.lights.is_empty());
        assert!(scene.instances[0].forced);
        assert!(scene.notes[0].text.contains("sphere is stretched"), "{:?}", scene.notes);
    }
}

#[test]
fn shaping_is_usds() {
    let shaping = json!({"coneAngle": 60, "coneSoftness": 0.5, "focus": 2, "focusTint": [1, 0, 0]});
    let expected = Shaping::Usd {
        cone_rad: FRAC_PI_3,
        softness: 0.5,
        focus: 2.0,
        focus_tint: [1.0, 0.0, 0.0],
        profile: None,
    };
    let mesh = load(|file| file.lux(json!({"type": "RectLight", "shaping": shaping})));
    assert_eq!(mesh.instances[0].shaping, Some(expected));
    let spot = load(|file| {
        file.light(json!({"type": "spot", "intensity": 5, "spot": {}}));
        file.lux(json!({"type": "SphereLight", "shaping": shaping}));
        file.json["nodes"][0].as_object_mut().unwrap().remove("mesh");
    });
    let intensity_cd = Vec3::splat(5.0);
    assert_eq!(spot.lights[0].kind, LightKind::Spot { intensity_cd, shaping: expected });
    let sphere = load(|file| {
        file.lux(json!({"type": "SphereLight", "radius": 1, "shaping": {}}));
    });
    let LightKind::Sphere { shaping: Some(Shaping::Usd { cone_rad, softness, .. }), .. } =
        sphere.lights[0].kind
    else {
        panic!("{:?}", sphere.lights);
    };
    assert_eq!((cone_rad, softness), (std::f32::consts::FRAC_PI_2, 0.0), "UsdLux's defaults");
}

const IES: &str = "data:,IESNA91%0ATILT=NONE%0A1 1 1 3 1 1 1 0 0 0%0A1 1 1%0A0 60 90%0A0%0A8 8 8";

#[test]
fn a_photometric_profile_is_read_once_for_all_lights() {
    let shaping = |ies: serde_json::Value| json!({"type": "RectLight", "shaping": {"coneAngle": 180, "ies": ies}});
    let scene = load(|file| {
        file.lux(shaping(json!({"file": IES})));
        for ies in [
            json!({"file": IES}),
            json!({"file": IES, "angleScale": 0.5}),
            json!({"file": IES, "normalize": true}),
        ] {
            let node = file.add("nodes", json!({"mesh": 0, "extras": {"usdLux": shaping(ies)}}));
            file.json["scenes"][0]["nodes"].as_array_mut().unwrap().push(json!(node));
        }
    });
    let profiles: Vec<_> = scene
        .instances
        .iter()
        .map(|instance| match instance.shaping {
            Some(Shaping::Usd { profile, .. }) => profile,
            _ => None,
        })
        .collect();
    assert_eq!(profiles, [Some(0), Some(0), Some(1), Some(2)]);
    let at = |row: usize, degrees: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        scene.profiles[row].factor(DVec3::new(sin, 0.0, -cos))
    };
    // Dark beyond its last angle; scaled; and of the mean 1 over the hemisphere that it has.
    assert_eq!((at(0, 80.0), at(0, 95.0)), (8.0, 0.0));
    assert_eq!((at(1, 40.0), at(1, 50.0)), (8.0, 0.0));
    assert!((at(2, 80.0) - 1.0).abs() < 1e-6);
    assert_eq!(scene.requirements().photometric_lights, 4);
    assert!(scene.notes.is_empty(), "{:?}", scene.notes);
}

#[test]
fn a_profile_that_cannot_be_read_is_noted_and_left_out() {
    let bad = IES.replace("0 60 90", "0 60 60");
    for (uri, expected) in [
        (
            bad.as_str(),
            "line 5: a vertical angle, 60, does not ascend from 60; its lights shine without it",
        ),
        ("gone.ies", "cannot be read"),
        ("../lamp.ies", "outside the scene's folder"),
        ("data:,nothing", "no line TILT="),
    ] {
        let lux = json!({"type": "RectLight", "shaping": {"coneAngle": 40, "ies": {"file": uri}}});
        let scene = load(|file| file.lux(lux));
        let Some(Shaping::Usd { profile: None, .. }) = scene.instances[0].shaping else {
            panic!("{:?}", scene.instances[0].shaping);
        };
        let note = &scene.notes[0];
        assert!(note.text.contains(expected), "{note:?}");
        assert!(note.text.contains("IES profile"), "{note:?}");
    }
}

#[test]
fn a_sun_has_an_angle() {
    let scene = load(|file| {
        file.light(json!({"type": "directional", "intensity": 100}));
        file.lux(json!({"type": "DistantLight", "angle": 30}));
    });
    let sun = LightKind::Distant { irradiance_lux: Vec3::splat(100.0), angle_rad: FRAC_PI_6 };
    assert_eq!(scene.lights[0].kind, sun);
}

#[test]
fn who_meets_a_light_follows_from_its_type_and_what_it_says() {
    let of = |lux: serde_json::Value| {
        let scene = load(|file| file.json["nodes"][0]["extras"] = json!({"usdLux": lux}));
        let spheres = scene.lights.iter().map(|light| light.visibility);
        let meshes = scene.instances.iter().map(|instance| instance.visibility);
        let all: Vec<Visibility> = spheres.chain(meshes).collect();
        assert_eq!(all.len(), 1);
        all[0]
    };
    for kind in ["RectLight", "DiskLight", "CylinderLight"] {
        assert_eq!(of(json!({"type": kind})), Visibility::LAMP);
    }
    assert_eq!(of(json!({"type": "SphereLight", "radius": 0.5})), Visibility::LAMP);
    assert_eq!(of(json!({"type": "MeshLight"})), Visibility::ALL);
    assert_eq!(load(|_| ()).instances[0].visibility, Visibility::ALL);
    let seen = json!({"type": "RectLight", "visibility": {"camera": true}});
    assert_eq!(of(seen), Visibility { camera: true, ..Visibility::LAMP });
    let hidden =
        json!({"type": "MeshLight", "visibility": {"reflections": false, "shadows": false}});
    let camera_alone = Visibility { camera: true, reflections: false, shadows: false };
    assert_eq!(of(hidden), camera_alone);
    let dome = json!({"type": "DomeLight", "visibility": {"camera": false}});
    let scene = load(|file| {
        file.add("nodes", json!({"extras": {"usdLux": dome}}));
        file.json["scenes"][0]["nodes"] = json!([0, 1]);
    });
    assert_eq!(scene.lights[0].visibility, Visibility { camera: false, ..Visibility::ALL });
}

#[test]
fn a_dome_has_a_picture() {
    let folder = tempfile::tempdir().unwrap();
    let sky = |x: usize, y: usize| match (x, y) {
        (1, 0) => (f32::INFINITY, -1.0, f32::NAN),
        _ => (x as f32, y as f32, 70000.0),
    };
    exr::prelude::write_rgb_file(folder.path().join("sky.exr"), 4, 2, sky).unwrap();
    std::fs::write(folder.path().join("sky.png"), files::png(4, 2, [255; 4])).unwrap();
    let dome = |texture: &str| {
        let mut file = lamp();
        file.add(
            "nodes",
            json!({"name": "sky", "extras": {"usdLux": {
                "type": "DomeLight", "radiance": [1, 2, 3], "texture": texture,
            }}}),
        );
        file.json["scenes"][0]["nodes"] = json!([0, 1]);
        file.load_in(folder.path()).unwrap()
    };
    let scene = dome("sky.exr");
    let expected = LightKind::Dome { radiance_nits: Vec3::new(1.0, 2.0, 3.0), texture: Some(0) };
    assert_eq!(scene.lights[0].kind, expected);
    let Pixels::Float(pixels) = &scene.textures[0].pixels else { panic!() };
    assert_eq!((scene.textures[0].width, scene.textures[0].height), (4, 2));
    assert_eq!(pixels[4 + 2], [2.0, 1.0, 70000.0]);
    assert_eq!(pixels[1], [65504.0, 0.0, 0.0], "light is neither negative nor infinite");
    assert!(matches!(dome("sky.png").textures[0].pixels, Pixels::Srgb8(_)));
}

#[test]
fn a_camera_has_a_lens() {
    let camera = |usd: serde_json::Value| {
        let scene = load(|file| {
            let lens = json!({"yfov": 0.5, "aspectRatio": 1.5});
            file.add("cameras", json!({"type": "perspective", "perspective": lens}));
            file.add("cameras", json!({"type": "orthographic"}));
            file.json["nodes"][0]["camera"] = json!(0);
            file.json["nodes"][0]["extras"] = json!({"usdCamera": usd});
            file.add("nodes", json!({"camera": 1}));
            file.json["scenes"][0]["nodes"] = json!([0, 1]);
        });
        assert_eq!(scene.notes.len(), 1, "a camera without a projection: {:?}", scene.notes);
        scene.cameras[0].clone()
    };
    let lens = camera(json!({
        "fStop": 2, "focalLength_m": 0.05, "focusDistance_m": 3, "filmOffset": [0.1, -0.2],
    }));
    assert_eq!(lens.projection, Projection::Perspective { yfov_rad: 0.5 });
    assert_eq!(lens.aspect, Some(1.5));
    assert_eq!((lens.lens_radius_m, lens.focus_distance_m), (0.0125, 3.0));
    assert_eq!(lens.film_offset, [0.1, -0.2]);
    let pinhole = camera(json!({"fStop": 0, "focalLength_m": 0.05, "focusDistance_m": 3}));
    assert_eq!(pinhole.lens_radius_m, 0.0);
}

#[test]
fn the_clock_is_the_stages() {
    assert_eq!(load(|_| ()).timeline, Timeline::default());
    let scene = load(|file| {
        file.json["asset"]["extras"] = json!({"usd": {
            "timeCodesPerSecond": 25, "startTimeCode": 1001, "endTimeCode": 1048,
        }});
    });
    let expected = Timeline {
        zero_frame: 1001.0,
        first_frame: 1001.0,
        frames_per_second: 25.0,
        last_frame: Some(1048.0),
    };
    assert_eq!(scene.timeline, expected);
    // A shutter that opens before its frame: the frames are the same, and come later.
    let scene = load(|file| {
        file.json["asset"]["extras"] = json!({"usd": {
            "timeCodesPerSecond": 25, "startTimeCode": 1001, "endTimeCode": 1048, "zeroTimeCode": 1000,
        }});
    });
    assert_eq!(scene.timeline, Timeline { zero_frame: 1000.0, ..expected });
    assert_eq!(frames_of(&scene), (1001..=1048).collect::<Vec<_>>());
}

#[test]
fn a_shutter_is_open_between_two_times() {
    let shutter = |shutter: Value| {
        let scene = load(|file| {
            let camera = json!({"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}});
            file.add("cameras", camera);
            file.json["nodes"][0]["camera"] = json!(0);
            file.json["nodes"][0]["extras"] = json!({"usdCamera": {"shutter": shutter}});
        });
        (scene.cameras[0].shutter, scene.notes.len())
    };
    assert_eq!(shutter(json!([-0.25, 0.25])), (Shutter::new(-0.25, 0.25), 0));
    for closed in [json!([0.5, 0.5]), json!([0.5, -0.5]), json!([1e39, 1e39])] {
        assert_eq!(shutter(closed), (None, 1));
    }
}

#[test]
fn what_is_not_carried_is_noted() {
    let scene = load(|file| {
        file.add("nodes", json!({"extras": {"usdLux": {"type": "PortalLight"}}}));
        file.json["scenes"][0]["nodes"] = json!([0, 1]);
    });
    assert_eq!(scene.notes.len(), 1, "{:?}", scene.notes);
    assert!(
        scene
            .notes
            .iter()
            .any(|note| note.text.contains("node 1") && note.text.contains("PortalLight"))
    );
}

/// Values at 0 and 1 seconds.
fn fading() -> serde_json::Value {
    json!({"times": [0, 1], "rgb": [[0, 0, 0], [2, 4, 0]]})
}

#[test]
fn a_mesh_light_varies() {
    let scene = load(|file| file.lux(json!({"type": "RectLight", "values": fading()})));
    let at = |time_s| scene.rgb_of_instance(0, &scene.pose_at(time_s));
    assert_eq!((at(-1.0), at(0.25)), (Vec3::ZERO, Vec3::new(0.5, 1.0, 0.0)));
    assert_eq!((at(1.0), at(9.0)), (Vec3::new(2.0, 4.0, 0.0), Vec3::new(2.0, 4.0, 0.0)));
    assert_eq!(scene.peak_rgb_of_instance(0), Vec3::new(2.0, 4.0, 0.0));
    assert_eq!(scene.requirements().varying_lights, 1);
    let instanced = load(|file| {
        file.lux(json!({"type": "RectLight", "values": fading()}));
        let places = file.floats(&[0.0; 6], "VEC3");
        file.json["nodes"][0]["extensions"] =
            json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}});
    });
    assert_eq!(instanced.instances.len(), 2);
    assert!(instanced.instances.iter().all(|instance| instance.values.is_some()));
}

#[test]
fn a_light_that_is_dark_at_first_is_one() {
    let scene = load(|file| {
        file.json["materials"][0].as_object_mut().unwrap().remove("emissiveFactor");
        file.lux(json!({"type": "RectLight", "values": fading()}));
    });
    assert_eq!(scene.requirements().mesh_lights, 1);
    let emitters = candelabra::emitter::Emitters::collect(&scene);
    assert_eq!((emitters.len(), emitters.changing_count()), (1, 1));
    assert!(emitters.lights()[0].varies);
    let dark = load(|file| {
        let values = json!({"times": [0, 1], "rgb": [[0, 0, 0], [0, 0, 0]]});
        file.lux(json!({"type": "RectLight", "values": values}));
    });
    assert!(candelabra::emitter::Emitters::collect(&dark).is_empty());
}

#[test]
fn every_kind_of_light_varies() {
    let punctual = |light: serde_json::Value, kind: &str| {
        let (light, kind) = (light.clone(), kind.to_owned());
        load(move |file| {
            file.light(light);
            file.lux(json!({"type": kind, "values": fading()}));
        })
    };
    let point = punctual(json!({"type": "point"}), "SphereLight");
    let sun = punctual(json!({"type": "directional"}), "DistantLight");
    let dome = load(|file| file.lux(json!({"type": "DomeLight", "values": fading()})));
    let sphere = load(|file| {
        file.lux(json!({"type": "SphereLight", "radius": 0.5, "values": fading()}));
    });
    for scene in [&point, &sun, &dome, &sphere] {
        let pose = scene.pose_at(0.5);
        assert_eq!(pose.light_rgb(0), Some(Vec3::new(1.0, 2.0, 0.0)), "{:?}", scene.lights);
        assert_eq!(scene.notes, []);
    }
    // One node has one light: the values are not those of a mesh beside it.
    assert_eq!(point.instances.len(), 1);
    assert_eq!(point.pose_at(0.5).instance_rgb(0), None);
    assert_eq!(point.rgb_of_instance(0, &point.pose_at(0.5)), Vec3::new(8.0, 4.0, 2.0));
    assert!(sphere.instances.is_empty());
    assert_eq!(candelabra::pipeline::frames_of(&sphere), (1..=25).collect::<Vec<_>>());
}

#[test]
fn a_light_group_is_of_the_node_that_names_it() {
    let mut file = lamp();
    assert!(file.load().unwrap().light_groups.is_empty());
    file.json["nodes"][0]["extras"] = json!({"usdLux": {"type": "MeshLight", "group": "key 1"}});
    let scene = file.load().unwrap();
    let node = scene.instances[0].node;
    assert_eq!(scene.light_groups.into_iter().collect::<Vec<_>>(), [(node, "key 1".to_string())]);
    file.json["nodes"][0]["extras"]["usdLux"]["group"] = json!(7);
    assert!(file.load().unwrap_err().to_string().contains("usdLux"));
}
