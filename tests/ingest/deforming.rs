//! Skins and morph targets at every time of the shot.

use crate::files::{File, lamp};
use crate::posing::{all, animate, assert_near, bar, bind, load, places, shaded, target};
use candelabra::emitter::Emitters;
use candelabra::pipeline;
use candelabra::scene::Scene;
use glam::{Mat4, Quat, Vec3};
use serde_json::json;
use std::f32::consts::FRAC_PI_2;

/// Without light.
fn dark(mut file: File) -> File {
    file.json["materials"][0]["emissiveFactor"] = json!([0, 0, 0]);
    file
}

/// That the shape of the first frame is the mesh as it was read, to the last bit.
fn assert_first_is_mesh(scene: &Scene) {
    let timeline = scene.timeline;
    let first = scene.pose_at(timeline.seconds_at(timeline.first_frame));
    for (number, mesh) in (0..).zip(&scene.meshes) {
        let shape = first.shape(scene, number).expect("it deforms");
        assert_eq!(shape.positions, mesh.positions);
        assert_eq!((&shape.normals, &shape.tangents), (&mesh.normals, &mesh.tangents));
    }
}

#[test]
fn weights_are_those_of_the_time() {
    // The number of targets is and is not a multiple of three.
    for count in [1, 3, 4, 7] {
        for (how, share) in [("LINEAR", 0.25), ("STEP", 0.0), ("CUBICSPLINE", 0.25 * 0.25 * 2.5)] {
            let mut file = dark(shaded());
            for number in 0..count {
                let way = [number as f32, 1.0, -2.0 * number as f32];
                let turn = [0.0, 1.0 + number as f32, 0.0];
                target(&mut file, &[("POSITION", &way.repeat(3)), ("NORMAL", &turn.repeat(3))]);
            }
            let from: Vec<f32> = (0..count).map(|number| 0.5 * number as f32).collect();
            let to: Vec<f32> = (0..count).map(|number| 1.0 - number as f32).collect();
            let flat = vec![0.0; count];
            let values = match how {
                "CUBICSPLINE" => {
                    [&flat, &from, &flat, &flat, &to, &flat].map(Vec::as_slice).concat()
                }
                _ => [&*from, &*to].concat(),
            };
            animate(&mut file, 0, "weights", &[0.0, 2.0], &values, how);
            let scene = load(&file);
            assert_eq!(scene.notes, [], "{how}");
            assert_first_is_mesh(&scene);
            let rest = load(&dark(shaded()));
            for (second, share) in [(0.0, 0.0), (0.5, share), (2.0, 1.0), (9.0, 1.0)] {
                let by = (0..count).fold(Vec3::ZERO, |by, number| {
                    let weight = from[number] + share * (to[number] - from[number]);
                    by + weight * Vec3::new(number as f32, 1.0, -2.0 * number as f32)
                });
                let expected: Vec<Vec3> =
                    rest.meshes[0].positions.iter().map(|&place| place + by).collect();
                let pose = scene.pose_at(second);
                assert_near(pose.positions(&scene, 0), &expected);
                let shape = pose.shape(&scene, 0).unwrap();
                assert!(shape.normals.iter().all(|normal| normal.is_normalized()));
            }
        }
    }
}

#[test]
fn a_bar_bends_more_and_more() {
    let mut file = dark(bar());
    // From 90 degrees to none.
    let half = FRAC_PI_2 / 2.0;
    let values = [0.0, 0.0, half.sin(), half.cos(), 0.0, 0.0, 0.0, 1.0];
    animate(&mut file, 1, "rotation", &[0.0, 1.0], &values, "LINEAR");
    // Above the skeleton is what carries all of it.
    file.add("nodes", json!({"name": "cart", "children": [2]}));
    file.json["scenes"][0]["nodes"] = json!([0, 3]);
    animate(&mut file, 3, "translation", &[0.0, 1.0], &[0.0, 0.0, 0.0, 0.0, 0.0, 8.0], "LINEAR");
    let scene = load(&file);
    assert_eq!(scene.notes, []);
    assert_first_is_mesh(&scene);
    for second in [0.0, 0.25, 0.5, 1.0] {
        let bent = Quat::from_rotation_z(FRAC_PI_2 * (1.0 - second));
        let rest = (0..6).map(|i| Vec3::new((i % 3) as f32, (i / 3) as f32 * 0.25, 0.0));
        let expected = rest.map(|rest| {
            let turned = Vec3::X + bent * (rest - Vec3::X);
            let place = match rest.x {
                0.0 => rest,
                1.0 => 0.5 * (rest + turned),
                _ => turned,
            };
            place + second * 8.0 * Vec3::Z
        });
        assert_near(&places(&scene, 0, second.into()), &expected.collect::<Vec<_>>());
    }
}

/// What the joints of a mesh have in common is a joint itself.
#[test]
fn a_joint_may_be_where_the_mesh_hangs() {
    let mut file = dark(lamp());
    target(&mut file, &[("POSITION", &[0.0, 0.0, 2.0].repeat(3))]);
    animate(&mut file, 0, "weights", &[0.0, 1.0], &[0.0, 1.0], "LINEAR");
    let joint = file.add("nodes", json!({"name": "joint", "translation": [0, 5, 0]}));
    file.json["scenes"][0]["nodes"] = json!([0, joint]);
    let path = [0.0, 5.0, 0.0, 1.0, 5.0, 0.0];
    animate(&mut file, joint, "translation", &[0.0, 1.0], &path, "LINEAR");
    let matrix = Mat4::from_translation(Vec3::Y * -2.0);
    bind(&mut file, &[joint], Some(&[matrix]), &[vec![all((0, 1.0)); 3]]);
    let scene = load(&file);
    assert_eq!(scene.notes, []);
    assert_first_is_mesh(&scene);
    let at = |second: f64| places(&scene, 0, second)[0] - places(&scene, 0, 0.0)[0];
    // The morph goes up, the joint sideways.
    assert_near(&[at(0.5), at(1.0)], &[Vec3::new(0.5, 0.0, 1.0), Vec3::new(1.0, 0.0, 2.0)]);
}

/// Two nodes show one mesh, each with weights of its own.
#[test]
fn nodes_deform_a_mesh_each_in_its_own_way() {
    let mut file = dark(lamp());
    target(&mut file, &[("POSITION", &[0.0, 0.0, 1.0].repeat(3))]);
    let other = file.add("nodes", json!({"mesh": 0}));
    let third = file.add("nodes", json!({"mesh": 0}));
    file.json["scenes"][0]["nodes"] = json!([0, other, third]);
    animate(&mut file, 0, "weights", &[0.0, 1.0], &[0.0, 1.0], "LINEAR");
    animate(&mut file, other, "weights", &[0.0, 1.0], &[0.0, -3.0], "LINEAR");
    let scene = load(&file);
    let way = |instance| (places(&scene, instance, 1.0)[0] - places(&scene, instance, 0.0)[0]).z;
    assert_eq!([way(0), way(1), way(2)], [1.0, -3.0, 0.0]);
    // Its own motion is all that there is: it tells how long the shot is.
    assert_eq!(pipeline::frames_of(&scene), (1..=25).collect::<Vec<_>>());
}

/// Weights of a mesh are those of its nodes, but for nodes that have their own.
#[test]
fn weights_of_a_mesh_deform_it_at_all_its_nodes() {
    let mut file = dark(lamp());
    target(&mut file, &[("POSITION", &[0.0, 0.0, 1.0].repeat(3))]);
    let other = file.add("nodes", json!({"mesh": 0}));
    let still = file.add("nodes", json!({"mesh": 0, "weights": [0.5]}));
    let own = file.add("nodes", json!({"mesh": 0}));
    file.json["scenes"][0]["nodes"] = json!([0, other, still, own]);
    animate(&mut file, own, "weights", &[0.0, 1.0], &[0.0, -3.0], "LINEAR");
    file.animate("/meshes/0/weights", &[0.0, 1.0], &[0.0, 2.0], "LINEAR");
    let scene = load(&file);
    assert_eq!(scene.notes, []);
    let way = |instance| (places(&scene, instance, 1.0)[0] - places(&scene, instance, 0.0)[0]).z;
    assert_eq!([way(0), way(1), way(2), way(3)], [2.0, 2.0, 0.0, -3.0]);
    // Nodes that show it alike share it.
    assert_eq!(scene.instances[0].mesh, scene.instances[1].mesh);
}

/// A bar that bends, gives light, and is carried along.
fn glowing_bar() -> File {
    let mut file = bar();
    let goes = [0.0, 0.0, 0.0, 0.0, 0.0, 3.0];
    animate(&mut file, 2, "translation", &[0.0, 1.0], &goes, "LINEAR");
    animate(&mut file, 1, "translation", &[0.0, 1.0], &[1.0, 0.0, 0.0, 5.0, 0.0, 0.0], "LINEAR");
    file
}

/// A lamp with a morph target that grows.
fn glowing_lamp() -> File {
    let mut file = lamp();
    target(&mut file, &[("POSITION", &[0.0, 0.0, 1.0, 2.0, 0.0, 0.0, 0.0, 3.0, 0.0])]);
    animate(&mut file, 0, "weights", &[0.0, 1.0], &[0.0, 1.0], "LINEAR");
    file
}

/// What gives light by its material, or by what is said of its node.
#[test]
fn what_gives_light_deforms_as_what_gives_none() {
    for make in [glowing_bar, glowing_lamp] {
        let of_node = |mut file: File| {
            let values = json!({"times": [0.0, 1.0], "rgb": [[1.0, 1.0, 1.0], [2.0, 2.0, 2.0]]});
            file.lux(json!({"type": "MeshLight", "inputs": {}, "values": values}));
            dark(file)
        };
        let [lit, unlit, by_node] = [make(), dark(make()), of_node(make())].map(|file| load(&file));
        assert_eq!((&lit.notes, &by_node.notes), (&unlit.notes, &unlit.notes));
        assert_eq!(lit.notes, []);
        assert_first_is_mesh(&lit);
        let peak = |scene: &Scene| scene.peak_rgb_of_instance(0).max_element();
        assert!(peak(&lit) > 0.0 && peak(&by_node) > 0.0 && peak(&unlit) == 0.0);
        for scene in [&lit, &by_node] {
            assert!(scene.changes_shape(0) && scene.has_lights_that_change());
            for second in [0.0, 0.3, 1.0, 7.0] {
                assert_eq!(places(scene, 0, second), places(&unlit, 0, second));
            }
        }
        assert_ne!(places(&lit, 0, 0.0), places(&lit, 0, 1.0));
        assert!(!unlit.has_lights_that_change());
    }
}

/// A triangle that has no area at first may have one later; one whose corners are never apart has none.
#[test]
fn what_may_have_an_area_is_an_emitter() {
    let collected = |file: &File| Emitters::collect(&load(file)).len();
    let flat = |moves: [f32; 9], weights: [f32; 2]| {
        let mut file = lamp();
        let positions = file.floats(&[0.0; 9], "VEC3");
        file.attribute("POSITION", positions);
        target(&mut file, &[("POSITION", &moves)]);
        animate(&mut file, 0, "weights", &[0.0, 1.0], &weights, "LINEAR");
        file
    };
    let grown = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    assert_eq!(collected(&flat(grown, [0.0, 1.0])), 1);
    assert_eq!(collected(&flat([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0], [0.0, 1.0])), 0);
    assert_eq!(collected(&flat(grown, [0.0, 0.0])), 0);
}
