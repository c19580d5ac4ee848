//! A camera's lens over time.

use super::pose::Instant;
use super::{Camera, Keys, Projection, Scene};
use crate::math::built_in;
use glam::Vec2;
use std::f32::consts::PI;

/// The narrowest field of view, and how far the widest is from pi: its half has a tangent that is positive.
const LEAST_YFOV_RAD: f32 = 1e-6;

/// What of a camera's lens varies, each part with keys of its own. `None` where the camera's constant holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LensKeys {
    /// What it sees from bottom to top: the full vertical field of view of a perspective camera, radians in (0, pi);
    /// the metres of an orthographic one, above 0.
    pub height: Option<Keys<f32>>,
    /// [`Camera::lens_radius_m`].
    pub lens_radius_m: Option<Keys<f32>>,
    /// [`Camera::focus_distance_m`].
    pub focus_distance_m: Option<Keys<f32>>,
    /// [`Camera::film_offset`].
    pub film_offset: Option<Keys<Vec2>>,
    /// [`Camera::exposure_scale`].
    pub exposure_scale: Option<Keys<f32>>,
    /// [`Camera::clip_m`].
    pub clip_m: Option<Keys<Vec2>>,
}

impl LensKeys {
    /// Whether no part varies.
    pub fn is_empty(&self) -> bool {
        *self == LensKeys::default()
    }

    /// How many bytes its keys take.
    pub fn byte_length(&self) -> u64 {
        fn of<T>(keys: &Option<Keys<T>>) -> usize {
            let of = |keys: &Keys<T>| size_of_val(&*keys.times_s) + size_of_val(&*keys.values);
            keys.as_ref().map_or(0, of)
        }
        let LensKeys { height, lens_radius_m, focus_distance_m, .. } = self;
        let numbers = [height, lens_radius_m, focus_distance_m, &self.exposure_scale].map(of);
        let pairs = [&self.film_offset, &self.clip_m].map(of);
        (numbers.iter().sum::<usize>() + pairs.iter().sum::<usize>()) as u64
    }

    /// The time of its last key, seconds.
    pub fn last_s(&self) -> Option<f32> {
        fn of<T>(keys: &Option<Keys<T>>) -> Option<f32> {
            keys.as_ref().and_then(|keys| keys.times_s.last().copied())
        }
        let LensKeys { height, lens_radius_m, focus_distance_m, .. } = self;
        let numbers = [height, lens_radius_m, focus_distance_m, &self.exposure_scale].map(of);
        let pairs = [&self.film_offset, &self.clip_m].map(of);
        numbers.into_iter().chain(pairs).flatten().reduce(f32::max)
    }
}

impl Camera {
    /// Whether it has a lens at any time.
    pub fn has_lens(&self) -> bool {
        let keys = self.over_time.as_ref().and_then(|lens| lens.lens_radius_m.as_ref());
        keys.map_or(self.lens_radius_m > 0.0, |keys| keys.values.iter().any(|&radius| radius > 0.0))
    }
}

impl Scene {
    /// A camera with the lens that it has at a frame, which may be between two whole ones, and with no keys.
    ///
    /// Between keys a spline may leave what a part can be; it is brought back.
    pub fn camera_at(&self, camera: &Camera, frame: f64) -> Camera {
        let Some(lens) = camera.over_time.as_deref().filter(|_| built_in::MOTION) else {
            return Camera { over_time: None, ..camera.clone() };
        };
        let at = Instant { time_s: self.timeline.seconds_at(frame), timeline: self.timeline };
        let number = |keys: &Option<Keys<f32>>, constant: f32| {
            keys.as_ref().map_or(constant, |keys| (keys.blend_at(at) as f32).max(0.0))
        };
        let pair = |keys: &Option<Keys<Vec2>>, constant: [f32; 2]| {
            keys.as_ref().map_or(constant, |keys| keys.blend_at(at).as_vec2().to_array())
        };
        let [near, far] = pair(&lens.clip_m, camera.clip_m);
        let projection = match camera.projection {
            Projection::Perspective { yfov_rad } => {
                let yfov_rad = number(&lens.height, yfov_rad);
                let yfov_rad = yfov_rad.clamp(LEAST_YFOV_RAD, PI - LEAST_YFOV_RAD);
                Projection::Perspective { yfov_rad }
            }
            Projection::Orthographic { height_m } => {
                let height_m = number(&lens.height, height_m).max(f32::MIN_POSITIVE);
                Projection::Orthographic { height_m }
            }
        };
        Camera {
            projection,
            lens_radius_m: number(&lens.lens_radius_m, camera.lens_radius_m),
            focus_distance_m: number(&lens.focus_distance_m, camera.focus_distance_m),
            film_offset: pair(&lens.film_offset, camera.film_offset),
            exposure_scale: number(&lens.exposure_scale, camera.exposure_scale),
            clip_m: [near.max(0.0), far.max(near.max(0.0))],
            over_time: None,
            ..camera.clone()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Interpolation, Timeline};
    use std::sync::Arc;

    fn keys<T: Copy>(interpolation: Interpolation, values: &[T]) -> Option<Keys<T>> {
        let per_key = if interpolation == Interpolation::Cubic { 3 } else { 1 };
        let times_s = (0..values.len() / per_key).map(|i| i as f32).collect();
        Some(Keys { times_s, values: values.to_vec(), interpolation })
    }

    /// A frame a second, from frame 10 on.
    fn scene() -> Scene {
        let timeline = Timeline {
            zero_frame: 10.0,
            first_frame: 10.0,
            frames_per_second: 1.0,
            last_frame: None,
        };
        Scene { timeline, ..Scene::default() }
    }

    fn with(camera: Camera, lens: LensKeys) -> Camera {
        Camera { over_time: Some(Arc::new(lens)), ..camera }
    }

    #[test]
    fn each_part_has_its_own_keys_and_holds_beyond_them() {
        let still =
            Camera { lens_radius_m: 0.25, exposure_scale: 3.0, ..Camera::perspective(4, 0.5) };
        let linear = Interpolation::Linear;
        let camera = with(
            still.clone(),
            LensKeys {
                height: keys(linear, &[0.5, 1.5]),
                focus_distance_m: keys(Interpolation::Step, &[2.0, 8.0]),
                film_offset: keys(linear, &[Vec2::ZERO, Vec2::new(0.5, -1.0)]),
                clip_m: keys(linear, &[Vec2::new(0.0, 1.0), Vec2::new(1.0, 3.0)]),
                ..LensKeys::default()
            },
        );
        for (frame, share, focus_distance_m) in [
            (-5.0, 0.0, 2.0),
            (10.0, 0.0, 2.0),
            (10.25, 0.25, 2.0),
            (11.0, 1.0, 8.0),
            (99.0, 1.0, 8.0),
        ] {
            let expected = Camera {
                projection: Projection::Perspective { yfov_rad: 0.5 + share },
                focus_distance_m,
                film_offset: [0.5 * share, -share],
                clip_m: [share, 1.0 + 2.0 * share],
                ..still.clone()
            };
            assert_eq!(scene().camera_at(&camera, frame), expected, "{frame}");
        }
        assert_eq!(scene().camera_at(&still, 10.5), still);
    }

    #[test]
    fn a_spline_never_leaves_what_a_lens_can_be() {
        // Its tangents carry it far below and above.
        let wild =
            |value: f32| keys(Interpolation::Cubic, &[0.0, value, -900.0, -900.0, value, 0.0]);
        let lens = LensKeys {
            height: wild(1.0),
            lens_radius_m: wild(0.1),
            focus_distance_m: wild(2.0),
            exposure_scale: wild(1.0),
            clip_m: keys(
                Interpolation::Cubic,
                &[0.0, 1.0, -900.0, 900.0, 1.0, 0.0].map(|x| Vec2::new(x, 2.0 - x)),
            ),
            ..LensKeys::default()
        };
        for camera in [Camera::perspective(0, 1.0), Camera::orthographic(0, 1.0)] {
            let camera = with(camera, lens.clone());
            for step in 0..=64 {
                let at = scene().camera_at(&camera, 10.0 + f64::from(step) / 64.0);
                match at.projection {
                    Projection::Perspective { yfov_rad } => {
                        assert!(yfov_rad > 0.0 && (0.5 * yfov_rad).tan() > 0.0, "{yfov_rad}");
                    }
                    Projection::Orthographic { height_m } => assert!(height_m > 0.0),
                }
                let parts =
                    [at.lens_radius_m, at.focus_distance_m, at.exposure_scale, at.clip_m[0]];
                assert!(parts.iter().all(|part| *part >= 0.0), "{at:?}");
                assert!(at.clip_m[1] >= at.clip_m[0]);
            }
        }
    }
}
