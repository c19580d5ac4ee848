//! Lights to build trees over: the same every time.

use candelabra::bounds::{Aabb, Cone, LightBounds};
use candelabra::math::random::hash;
use candelabra::scene::{Light, LightKind, Node, Scene, Trs};
use glam::{DQuat, DVec3, Vec3};

/// The `n`th number of stream `i`, in `[0, 1)`.
pub fn random(i: u32, n: u32) -> f32 {
    (hash(i, n) >> 8) as f32 / 16_777_216.0
}

fn direction(i: u32, n: u32) -> Vec3 {
    let (z, phi) = (1.0 - 2.0 * random(i, n), std::f32::consts::TAU * random(i, n + 1));
    let radius = (1.0 - z * z).sqrt();
    Vec3::new(radius * phi.cos(), radius * phi.sin(), z)
}

/// A place in a box of 100 x 20 x 100 metres.
fn place(i: u32) -> Vec3 {
    Vec3::new(random(i, 0), 0.2 * random(i, 1), random(i, 2)) * 100.0
}

/// Small triangles facing every way.
pub fn triangles(count: u32) -> Vec<LightBounds> {
    (0..count)
        .map(|i| {
            let a = place(i);
            let (b, c) = (a + 0.05 * direction(i, 3), a + 0.05 * direction(i, 5));
            let normal = (b - a).cross(c - a);
            LightBounds {
                aabb: Aabb::around([a, b, c]),
                cone: Cone::flat(normal.normalize_or(Vec3::Z), false),
                energy: normal.length() * (0.5 + random(i, 7)) + 1e-9,
                range_m: f32::INFINITY,
            }
        })
        .collect()
}

/// A scene of point lights, each a prim of its own.
pub fn points(count: u32) -> Scene {
    let mut scene = Scene::default();
    for i in 0..count {
        let translation = place(i).as_dvec3();
        let place = Trs::Parts { translation, rotation: DQuat::IDENTITY, scale: DVec3::ONE };
        scene.nodes.push(Node::fixed(format!("/World/Lights/light_{i:07}"), None, place));
        let kind = LightKind::Point { intensity_cd: Vec3::splat(0.5 + random(i, 7)) };
        scene.lights.push(Light { node: i, kind, values: None, range_m: None, forced: false });
    }
    scene
}

/// Makes one light in the middle of the list a tenth brighter.
pub fn change_one(scene: &mut Scene) {
    let middle = scene.lights.len() / 2;
    let LightKind::Point { intensity_cd } = &mut scene.lights[middle].kind else { unreachable!() };
    *intensity_cd *= 1.1;
}
