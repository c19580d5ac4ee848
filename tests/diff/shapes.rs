//! Lights that change their shape: the difference is told frame by frame.

use crate::street::{aspects, diff, edited, node, only, street};
use candelabra::diff::{Apart, Difference};
use candelabra::scene::{
    Channel, Deformation, Interpolation, Keys, Mesh, Scene, Shape, Target, Trs,
};
use glam::Vec3;
use std::sync::Arc;

/// The mesh of the panel, and that of the bulbs.
const PANEL: usize = 0;
const BULB: usize = 1;

/// Displaces a mesh, from nothing in frame 1 to all in frame 25.
fn morph(mesh: &mut Mesh, by: impl Fn(Vec3) -> Vec3) {
    let rest = Shape { positions: mesh.positions.clone(), ..Shape::default() };
    let positions = mesh.positions.iter().map(|&place| by(place)).collect();
    let targets = vec![Target { positions, ..Target::default() }];
    let (times_s, values) = (vec![0.0, 1.0], vec![Vec3::ZERO, Vec3::X]);
    let weights = [Keys { times_s, values, interpolation: Interpolation::Linear }].into();
    mesh.deformation = Some(Arc::new(Deformation { rest, targets, weights, skin: None }));
}

fn apart(difference: &Difference) -> Apart {
    match difference {
        Difference::OverTime { before: true, after: true, apart: Some(apart) } => *apart,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_light_that_begins_to_deform_begins_to_change() {
    for found in edited(|scene| morph(&mut scene.meshes[PANEL], |place| place)) {
        assert_eq!(aspects(&found, "panel"), ["over_time"]);
        let begins = Difference::OverTime { before: false, after: true, apart: None };
        assert_eq!(only(&found).differences, [begins]);
    }
}

/// A street whose panel grows, and moves by some metres while it does.
fn growing(grown: f32, moved: f32) -> Scene {
    let mut scene = street();
    morph(&mut scene.meshes[PANEL], |place| place * grown + Vec3::Y * moved);
    scene
}

#[test]
fn shapes_that_part_later_are_told_by_frames() {
    // It grows to twice and to three times its size, about the same middle.
    let found = diff(growing(1.0, 0.0), growing(2.0, 0.0));
    assert_eq!(aspects(&found, "panel"), ["over_time"]);
    let told = apart(&only(&found).differences[0]);
    assert_eq!((told.frames, told.reshaped, told.most_stops), (24, 24, 0.0));
    assert!(told.most_moved_m < 1e-5, "{told:?}");
    // And one that moves as well.
    let found = diff(growing(1.0, 0.0), growing(1.0, -0.5));
    let told = apart(&only(&found).differences[0]);
    assert_eq!((told.frames, told.reshaped), (24, 24));
    assert!((told.most_moved_m - 0.5).abs() < 1e-5, "{told:?}");
    assert!(diff(growing(1.0, 0.5), growing(1.0, 0.5)).is_same());
}

#[test]
fn a_shape_that_differs_from_the_first_is_told_once() {
    let mut other = street();
    let mesh = &mut other.meshes[PANEL];
    mesh.positions[0] += Vec3::Y * 0.25;
    morph(mesh, |place| place);
    let found = diff(growing(1.0, 0.0), other);
    let told = aspects(&found, "panel");
    assert!(told.contains(&"topology"), "{told:?}");
}

/// Each instance is its own light; and what deforms may move and vary too.
#[test]
fn all_instances_of_a_mesh_are_told() {
    let crowd = |by: f32| {
        let mut scene = street();
        morph(&mut scene.meshes[BULB], |place| place * by);
        scene
    };
    let found = diff(crowd(1.0), crowd(1.5));
    let paths: Vec<&str> = found.changes.iter().map(|change| change.path()).collect();
    assert_eq!(paths, ["/street/bulb_1", "/street/bulb_2"]);
    for change in &found.changes {
        assert_eq!(apart(&change.differences[0]).reshaped, 24);
    }
    // The same shapes on two ways: the way is told, and no shape.
    let [before, after] = [1.0, 3.0].map(|reach| {
        let mut scene = crowd(1.0);
        let Trs::Parts { translation, .. } = node(&mut scene, "bulb_1").local else { panic!() };
        let start = translation.as_vec3();
        let values = vec![start, start + Vec3::X * reach];
        let keys = Keys { times_s: vec![0.0, 1.0], values, interpolation: Interpolation::Linear };
        node(&mut scene, "bulb_1").channels.push(Channel::Translation(keys));
        scene
    });
    let found = diff(before, after);
    let told = apart(&only(&found).differences[0]);
    assert_eq!((told.frames, told.reshaped), (24, 0));
    assert!((told.most_moved_m - 2.0).abs() < 1e-5, "{told:?}");
}
