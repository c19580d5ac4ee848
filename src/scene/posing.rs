//! Many poses of one scene, one after the other: what stands still is evaluated once.

use super::Scene;
use super::pose::{Instant, Keys, Pose, moving};
use glam::DAffine3;

/// A pose that is moved from time to time.
pub struct Posing<'a> {
    scene: &'a Scene,
    /// World transforms before they are rounded.
    exact: Vec<DAffine3>,
    pose: Pose,
    /// Nodes that move, parents first.
    moving: Vec<usize>,
    /// Rows of lights that vary.
    lights: Vec<usize>,
    /// Rows of instances that vary.
    instances: Vec<usize>,
}

impl<'a> Posing<'a> {
    /// A pose at second 0.
    pub fn new(scene: &'a Scene) -> Posing<'a> {
        let at = Instant { time_s: 0.0, timeline: scene.timeline };
        let mut exact: Vec<DAffine3> = Vec::with_capacity(scene.nodes.len());
        for node in &scene.nodes {
            let parent = node.parent.map(|parent| &exact[parent as usize]);
            exact.push(node.in_world(scene.origin, parent, at));
        }
        let pose = Pose::with(scene, exact.iter().map(DAffine3::as_affine3a).collect(), at);
        let varies = |values: Option<&Keys<_>>| values.is_some_and(Keys::varies);
        let rows = |rows: &mut dyn Iterator<Item = bool>| {
            rows.enumerate().filter_map(|(row, is)| is.then_some(row)).collect()
        };
        Posing {
            scene,
            exact,
            pose,
            moving: rows(&mut moving(&scene.nodes).into_iter()),
            lights: rows(&mut scene.lights.iter().map(|light| varies(light.values.as_deref()))),
            instances: rows(&mut scene.instances.iter().map(|row| varies(row.values.as_deref()))),
        }
    }

    /// The pose at a frame, which may be between two whole ones: what [`Scene::pose_at`] gives for its time.
    pub fn at_frame(&mut self, frame: f64) -> &Pose {
        let timeline = self.scene.timeline;
        let at = Instant { time_s: timeline.seconds_at(frame), timeline };
        let Posing { scene, exact, pose, .. } = self;
        for &row in &self.moving {
            let node = &scene.nodes[row];
            let parent = node.parent.map(|parent| &exact[parent as usize]);
            exact[row] = node.in_world(scene.origin, parent, at);
            pose.world[row] = exact[row].as_affine3a();
        }
        for &row in &self.lights {
            let values = scene.lights[row].values.as_ref();
            pose.light_rgb[row] = values.map(|keys| keys.blend_at(at).as_vec3());
        }
        for &row in &self.instances {
            let values = scene.instances[row].values.as_ref();
            pose.instance_rgb[row] = values.map(|keys| keys.blend_at(at).as_vec3());
        }
        pose.shapes.set_time(scene, at.time_s);
        pose
    }
}
