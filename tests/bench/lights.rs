//! Lights to build trees over: the same every time.

use candelabra::math::random::hash;
use candelabra::scene::{Light, LightKind, Node, Scene, Trs};
use glam::{DQuat, DVec3, Vec3};

/// The `n`th number of stream `i`, in `[0, 1)`.
pub fn random(i: u32, n: u32) -> f32 {
    (hash(i, n) >> 8) as f32 / 16_777_216.0
}

/// A place in a box of 100 x 20 x 100 metres.
pub fn place(i: u32) -> Vec3 {
    Vec3::new(random(i, 0), 0.2 * random(i, 1), random(i, 2)) * 100.0
}

/// A scene of point lights, each a prim of its own.
pub fn points(count: u32) -> Scene {
    let mut scene = Scene::default();
    for i in 0..count {
        let translation = place(i).as_dvec3();
        let place = Trs::Parts { translation, rotation: DQuat::IDENTITY, scale: DVec3::ONE };
        scene.nodes.push(Node::fixed(format!("/World/Lights/light_{i:07}"), None, place));
        let kind = LightKind::Point { intensity_cd: Vec3::splat(0.5 + random(i, 7)) };
        scene.lights.push(Light {
            node: i,
            kind,
            values: None,
            range_m: None,
            forced: false,
            visibility: Default::default(),
        });
    }
    scene
}

/// Makes one light in the middle of the list a tenth brighter.
pub fn change_one(scene: &mut Scene) {
    let middle = scene.lights.len() / 2;
    let LightKind::Point { intensity_cd } = &mut scene.lights[middle].kind else { unreachable!() };
    *intensity_cd *= 1.1;
}
