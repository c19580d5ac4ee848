//! The last promise of a scene: everything in it has a place that can be calculated with.

use super::error::Fault;
use crate::scene::{FARTHEST_M, Scene};
use glam::Vec3;

/// Checks the world transform of every node, and the world coordinates of every mesh, at rest.
pub(super) fn check(scene: &Scene) -> Result<(), Fault> {
    let too_far = |path: &str| {
        Err(Fault::new(path, format!("is farther than {FARTHEST_M:e} m, or infinitely large"))
            .remedy("check its scale and translation, and those above it"))
    };
    let pose = scene.pose_at(0.0);
    for (i, node) in scene.nodes.iter().enumerate() {
        let world = pose.world(i as u32);
        if !(world.is_finite() && world.translation.abs().max_element() < FARTHEST_M) {
            return too_far(&node.path);
        }
    }
    let radii: Vec<f32> = scene
        .meshes
        .iter()
        .map(|mesh| mesh.positions.iter().fold(Vec3::ZERO, |far, p| far.max(p.abs())).length())
        .collect();
    for instance in &scene.instances {
        let axes = pose.world(instance.node).matrix3;
        let stretch = axes.x_axis.length() + axes.y_axis.length() + axes.z_axis.length();
        let reach = radii[instance.mesh as usize] * stretch;
        if reach.is_nan() || reach >= FARTHEST_M {
            return too_far(&instance.path);
        }
    }
    Ok(())
}
