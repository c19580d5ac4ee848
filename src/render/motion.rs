//! Motion vectors: how far what a pixel sees moves on the picture, to the next frame and from the last.
//!
//! In pixels, to the right and up, as Nuke's layers `forward` and `backward` have it: `forward` leads to
//! the place in the next frame, `backward` to the place in the last one. Camera, its lens, motion and deformation at the
//! first hit count; reflections do not. Both ends are projected through the middle of the lens, so what
//! stands still has exactly zero. What is infinitely far turns with the camera. Beyond the shot's keys
//! nothing moves. In a frame that is blurred, the motion is that of the middle of the time.

use super::camera::CameraRays;
use super::path::PathSample;
use super::rays::{Hit, HitSurface};
use crate::scene::{Camera, Instance, Pose, Scene};
use glam::{Affine3A, DAffine3, DVec2, DVec3, Vec2, Vec3};

/// A frame and its neighbours.
pub struct Motion<'a> {
    scene: &'a Scene,
    pose: &'a Pose,
    camera: CameraRays,
    /// The next frame and the last.
    neighbours: [(Pose, CameraRays); 2],
}

impl<'a> Motion<'a> {
    /// Poses the scene one frame after and one before `frame`, whose pose is given. It may be between two whole
    /// ones.
    pub fn new(
        scene: &'a Scene,
        pose: &'a Pose,
        camera: &Camera,
        frame: f64,
        size: [u32; 2],
    ) -> Motion<'a> {
        let rays =
            |pose: &Pose, frame| CameraRays::new(&scene.camera_at(camera, frame), pose, size);
        let neighbours = [1.0, -1.0].map(|step| {
            let pose = scene.pose_at(scene.timeline.seconds_at(frame + step));
            let rays = rays(&pose, frame + step);
            (pose, rays)
        });
        Motion { scene, pose, camera: rays(pose, frame), neighbours }
    }

    /// `forward` and `backward` of what a path has hit first in a pose of the frame. Zero where a neighbour does not
    /// have it in front of the camera.
    pub fn of(&self, sample: &PathSample, pose: &Pose) -> [DVec2; 2] {
        let Some(hit) = &sample.hit else {
            let at = |camera: &CameraRays| camera.project_direction(sample.direction);
            let here = at(&self.camera);
            return self.neighbours.each_ref().map(|(_, camera)| moved(here, at(camera)));
        };
        let here = self.camera.project(self.carried(hit, pose, self.pose));
        self.neighbours
            .each_ref()
            .map(|(there, camera)| moved(here, camera.project(self.carried(hit, pose, there))))
    }

    /// Where what was hit in one pose is in another.
    fn carried(&self, hit: &Hit, from: &Pose, to: &Pose) -> DVec3 {
        let node = match hit.surface {
            HitSurface::Triangle { instance, triangle, barycentric } => {
                if self.scene.deforms(instance) {
                    return self.on_shape(to, (instance, triangle), barycentric);
                }
                self.scene.instances[instance as usize].node
            }
            HitSurface::Sphere { light } => self.scene.lights[light as usize].node,
        };
        carried(hit.anchor.position, from.world(node), to.world(node))
    }

    /// A point of a triangle of an instance that deforms.
    fn on_shape(&self, pose: &Pose, (instance, triangle): (u32, u32), at: Vec2) -> DVec3 {
        let Instance { node, mesh, .. } = self.scene.instances[instance as usize];
        let positions = pose.positions(self.scene, mesh);
        let corners = self.scene.meshes[mesh as usize].triangles[triangle as usize];
        let [a, b, c] = corners.map(|corner| positions[corner as usize].as_dvec3());
        let [u, v] = at.as_dvec2().to_array();
        double(pose.world(node)).transform_point3(a + u * (b - a) + v * (c - a))
    }
}

/// Where a point that is fixed to a node is in another pose.
fn carried(point: Vec3, from: Affine3A, to: Affine3A) -> DVec3 {
    let point = point.as_dvec3();
    if from == to {
        return point;
    }
    let there = (double(to) * double(from).inverse()).transform_point3(point);
    // A node that is flat has no inverse.
    if there.is_finite() { there } else { point }
}

fn double(world: Affine3A) -> DAffine3 {
    let translation = Vec3::from(world.translation).as_dvec3();
    DAffine3 { matrix3: world.matrix3.as_dmat3(), translation }
}

fn moved(here: Option<DVec2>, there: Option<DVec2>) -> DVec2 {
    let (Some(here), Some(there)) = (here, there) else { return DVec2::ZERO };
    let motion = there - here;
    if motion.is_finite() { motion } else { DVec2::ZERO }
}
