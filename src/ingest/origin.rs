//! Where the origin of calculation is: near what the scene is made of.
//!
//! Positions are kept in 32 bits, which is too little for a lamp of 10 cm in map coordinates. So a
//! scene that lies far from the origin is calculated around one of its own, [`Scene::origin`]. It
//! follows from the scene alone, at rest: every program and every frame has the same. It is a
//! multiple of a large power of two, so that it stays where it is while the scene is edited, and it
//! is 0 for every scene that is near enough.

use super::notes::Notes;
use crate::scene::{Category, LightKind, Pose, Scene};
use glam::{DVec3, Vec3};
use std::sync::Arc;

/// The origin is a multiple of the power of two that follows on so many reaches: no scene is farther
/// from its origin than about that, and no scene nearer than half of it has another than 0.
const REACHES: f64 = 256.0;
/// A note is due if rounding a position may move it by more than this share of a prim's size.
const NOTED: f64 = 1e-2;

/// Something that stands somewhere.
struct Thing {
    middle: Vec3,
    radius_m: f32,
    /// The path of a prim whose corners are rounded.
    path: Option<Arc<str>>,
}

/// Moves the origin of a scene to where it belongs, and notes what is too far from it.
pub(super) fn settle(scene: &mut Scene) {
    let mut seen = things(scene, &scene.pose_at(0.0));
    scene.origin = choose(&seen);
    if scene.origin != DVec3::ZERO {
        seen = things(scene, &scene.pose_at(0.0));
    }
    let mut notes = Notes::default();
    let mut worst: f64 = 0.0;
    let mut small = Vec::new();
    for thing in seen {
        let rounding = 0.5 * f64::from(f32::EPSILON * thing.middle.abs().max_element());
        let share = rounding / f64::from(thing.radius_m);
        if let Some(path) = thing.path.filter(|_| share > NOTED) {
            worst = worst.max(share);
            small.push(path);
        }
    }
    let DVec3 { x, y, z } = scene.origin;
    for path in small {
        notes.add(
            Category::Geometry,
            &*path,
            format!(
                "is small and far from most of the scene, which is calculated around ({x}, {y}, \
                 {z}): rounding moves its corners by up to {:.2} % of its size; put it into a file \
                 of its own, or nearer",
                100.0 * worst
            ),
        );
    }
    scene.notes.extend(notes.into_list());
}

/// All meshes, finite lights and cameras, in the space of the pose.
fn things(scene: &Scene, pose: &Pose) -> Vec<Thing> {
    let bounds = |positions: &[Vec3]| {
        let (low, high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        positions.iter().fold((low, high), |(low, high), &p| (low.min(p), high.max(p)))
    };
    let boxes: Vec<_> = scene.meshes.iter().map(|mesh| bounds(&mesh.positions)).collect();
    let instances = scene.instances.iter().filter_map(|instance| {
        let (low, high) = boxes[instance.mesh as usize];
        let world = pose.world(instance.node);
        low.cmple(high).all().then(|| Thing {
            middle: world.transform_point3(0.5 * low + 0.5 * high),
            radius_m: world.transform_vector3(0.5 * high - 0.5 * low).length(),
            path: Some(instance.path.clone()),
        })
    });
    let finite = scene.lights.iter().filter(|light| !light.kind.is_infinite());
    let lights = finite.map(|light| {
        let radius = match light.kind {
            LightKind::Sphere { radius, .. } => Some(pose.world_radius(light.node, radius)),
            _ => None,
        };
        Thing {
            middle: pose.world(light.node).translation.into(),
            radius_m: radius.unwrap_or(0.0),
            path: radius.map(|_| scene.nodes[light.node as usize].path.clone()),
        }
    });
    let cameras = scene.cameras.iter().map(|camera| Thing {
        middle: pose.world(camera.node).translation.into(),
        radius_m: 0.0,
        path: None,
    });
    instances.chain(lights).chain(cameras).collect()
}

/// The median of the middles, rounded. The reach is the median distance from there that things
/// extend to; so neither a far mountain nor a huge ground decides.
fn choose(things: &[Thing]) -> DVec3 {
    let median = |mut values: Vec<f64>| {
        let half = values.len() / 2;
        *values.select_nth_unstable_by(half, f64::total_cmp).1
    };
    if things.is_empty() {
        return DVec3::ZERO;
    }
    let along = |axis: usize| median(things.iter().map(|t| f64::from(t.middle[axis])).collect());
    let middle = DVec3::new(along(0), along(1), along(2));
    let extends = |t: &Thing| (t.middle.as_dvec3() - middle).length() + f64::from(t.radius_m);
    let reach = median(things.iter().map(extends).collect());
    if !(reach > 0.0 && reach.is_finite()) {
        return DVec3::ZERO;
    }
    let step = (REACHES * reach).log2().ceil().exp2();
    // Adding 0 makes no zero negative.
    (middle / step).round() * step + DVec3::ZERO
}

#[cfg(test)]
mod tests {
    use super::*;

    fn thing(middle: Vec3, radius_m: f32) -> Thing {
        Thing { middle, radius_m, path: None }
    }

    #[test]
    fn a_scene_near_the_origin_keeps_it() {
        for scale in [1e-6, 1.0, 1e6] {
            let room =
                [thing(Vec3::ZERO, 3.0 * scale), thing(Vec3::X * 100.0 * scale, 1.0 * scale)];
            assert_eq!(choose(&room), DVec3::ZERO);
        }
        assert_eq!(choose(&[]), DVec3::ZERO);
        assert_eq!(choose(&[thing(Vec3::splat(1e6), 0.0)]), DVec3::ZERO);
    }

    #[test]
    fn a_scene_far_away_has_an_origin_near_it() {
        for decade in 3..9 {
            let far = Vec3::new(1.0, -0.3, 0.0) * 10_f32.powi(decade);
            let room: Vec<_> = (0..9)
                .map(|i| thing(far + Vec3::splat(i as f32 * 0.1), 2.0))
                // A ground that reaches everywhere, and something at the old origin.
                .chain([thing(Vec3::ZERO, 1e7), thing(Vec3::ZERO, 1.0)])
                .collect();
            let origin = choose(&room);
            assert!((origin - far.as_dvec3()).abs().max_element() <= 1024.0, "{origin}");
            // The origin is exact in 32 bits, and so is what is subtracted from it.
            assert_eq!(origin.as_vec3().as_dvec3(), origin);
        }
    }

    #[test]
    fn editing_the_scene_keeps_the_origin() {
        let far = Vec3::splat(1e6);
        let of = |count: usize| {
            let lamp = |i: usize| thing(far + Vec3::splat(i as f32 * 0.3), 2.0);
            choose(&(0..count).map(lamp).collect::<Vec<_>>())
        };
        assert!((6..9).all(|count| of(count) == of(5)), "{}", of(5));
    }
}
