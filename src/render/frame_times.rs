//! A frame at the times at which its camera sees it.

use super::camera::CameraRays;
use crate::scene::{Camera, Pose, Posing, Scene};

/// What a camera sees at one time, or while its shutter is open.
pub struct FrameTimes {
    /// The middle of the time, as a frame number.
    pub time: f64,
    /// One pose for all views, or one for each.
    poses: Vec<Pose>,
    /// Where the camera stands, time after time.
    pub views: Vec<CameraRays>,
}

impl FrameTimes {
    /// A frame, which may be between two whole ones, at that instant. The size is that of the picture in pixels.
    pub fn instant(scene: &Scene, camera: &Camera, frame: f64, size: [u32; 2]) -> FrameTimes {
        let pose = scene.pose_at(scene.timeline.seconds_at(frame));
        let views = vec![CameraRays::new(&scene.camera_at(camera, frame), &pose, size)];
        FrameTimes { time: frame, poses: vec![pose], views }
    }

    /// A frame while the camera's shutter is open, or at its instant if there is none. What does not change in that time
    /// is posed once.
    pub fn of_shutter(scene: &Scene, camera: &Camera, frame: i32, size: [u32; 2]) -> FrameTimes {
        let Some(shutter) = camera.shutter else {
            return FrameTimes::instant(scene, camera, frame.into(), size);
        };
        let times = scene.times_of(camera, frame);
        let mut posing = Posing::new(scene);
        let first = posing.at_frame(times[0]).clone();
        let is_still = times.iter().all(|&time| scene.is_alike(&first, posing.at_frame(time)));
        let times = if is_still { shutter.times_of_view(frame) } else { times };
        let time = times[times.len() / 2];
        if !is_still {
            let poses: Vec<Pose> = times.iter().map(|&at| posing.at_frame(at).clone()).collect();
            let view = |(&at, pose)| CameraRays::new(&scene.camera_at(camera, at), pose, size);
            let views = times.iter().zip(&poses).map(view).collect();
            return FrameTimes { time, poses, views };
        }
        let view =
            |&at: &f64| CameraRays::new(&scene.camera_at(camera, at), posing.at_frame(at), size);
        let mut views: Vec<CameraRays> = times.iter().map(view).collect();
        if views.iter().all(|view| *view == views[0]) {
            views.truncate(1);
        }
        FrameTimes { time, poses: vec![posing.at_frame(time).clone()], views }
    }

    /// The poses: one for all views, or one for each.
    pub fn poses(&self) -> &[Pose] {
        &self.poses
    }

    /// Which pose belongs to a view.
    pub fn pose_of(&self, view: usize) -> usize {
        view.min(self.poses.len() - 1)
    }

    /// The pose in the middle of the time.
    pub fn middle(&self) -> &Pose {
        &self.poses[self.poses.len() / 2]
    }
}
