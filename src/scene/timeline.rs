//! Frame numbers and seconds, and when two times are the same.

/// How frame numbers map to seconds on the file's animation clock.
///
/// USD exports carry theirs (`startTimeCode`, `timeCodesPerSecond`); for any other file frame 1 is
/// second 0 at 24 frames per second.
///
/// Files store key times in 32 bits. A key on the fourth frame is at 0.125 s exactly, but one on the
/// third is stored a little after 1/12 s, and a stepped value would come a frame late. So a key counts
/// as *at* a time if it is within one step of its 32-bit number, or within 1e-4 of a frame, which covers
/// times that a file gives with six decimals. It is a step and not half of one, because many programs
/// multiply by a frame's duration that is rounded already. A key never counts for a frame that is not
/// the nearest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timeline {
    /// The frame that is second 0. It is before the first if a shutter opens before its frame: files have no
    /// negative times.
    pub zero_frame: f64,
    /// The first frame of the shot.
    pub first_frame: f64,
    /// Frames in a second.
    pub frames_per_second: f64,
    /// The last frame that the file speaks of, if it says so.
    pub last_frame: Option<f64>,
}

impl Default for Timeline {
    fn default() -> Self {
        Timeline { zero_frame: 1.0, first_frame: 1.0, frames_per_second: 24.0, last_frame: None }
    }
}

impl Timeline {
    /// Seconds on the animation clock at a frame.
    pub fn seconds_at(&self, frame: f64) -> f64 {
        (frame - self.zero_frame) / self.frames_per_second
    }

    /// The frame at which the animation clock shows some seconds: a whole number if it is the
    /// [same time](Self::is_same) as that of a whole frame.
    pub fn frame_at(&self, time_s: f64) -> f64 {
        let frame = self.zero_frame + time_s * self.frames_per_second;
        let whole = frame.round();
        if self.is_same(self.seconds_at(whole), time_s) { whole } else { frame }
    }

    /// Whether a key is meant to be at a time; both in seconds. [`Timeline`] says by what rule.
    pub fn is_same(&self, time_s: f64, key_s: f64) -> bool {
        let in_frames = |frames: f64| frames / self.frames_per_second;
        let step = key_s.abs() * f64::from(f32::EPSILON);
        (time_s - key_s).abs() <= step.max(in_frames(1e-4)).min(in_frames(0.5))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{
        Channel, Interpolation, Keys, Light, LightKind, Node, Scene, Trs, Visibility,
    };
    use glam::Vec3;

    const RATES: [f64; 7] = [24.0, 24000.0 / 1001.0, 23.976, 25.0, 30000.0 / 1001.0, 30.0, 60.0];
    const FRAMES: u32 = 100_000;

    /// How programs come by the 32-bit time of a frame.
    fn times(frame: u32, rate: f64) -> [f32; 4] {
        let exact = f64::from(frame) / rate;
        let decimals = (exact * 1e6).round() / 1e6;
        let single = frame as f32;
        [exact as f32, single / rate as f32, single * (1.0 / rate) as f32, decimals as f32]
    }

    #[test]
    fn a_key_is_at_its_frame_and_at_no_other() {
        for rate in RATES {
            for first in [1.0, 1001.0, -86_400.0] {
                let timeline = Timeline {
                    zero_frame: first,
                    first_frame: first,
                    frames_per_second: rate,
                    last_frame: None,
                };
                for frame in 0..FRAMES {
                    for key_s in times(frame, rate).map(f64::from) {
                        let number = f64::from(frame) + first;
                        assert!(timeline.is_same(timeline.seconds_at(number), key_s), "{number}");
                        assert!(!timeline.is_same(timeline.seconds_at(number - 1.0), key_s));
                        assert!(!timeline.is_same(timeline.seconds_at(number + 1.0), key_s));
                        assert_eq!(timeline.frame_at(key_s), number);
                    }
                }
            }
        }
        let timeline = Timeline::default();
        assert_eq!(timeline.frame_at(0.5 / 24.0), 1.5);
        assert!(!timeline.is_same(0.501 / 24.0, 0.5 / 24.0));
    }

    /// A node that goes, and a light that gets brighter, by one each frame.
    fn counting(
        way: usize,
        rate: f64,
        first: f64,
        from: u32,
        interpolation: Interpolation,
    ) -> Scene {
        let frames = || from..from + FRAMES;
        let times_s: Vec<f32> = frames().map(|frame| times(frame, rate)[way]).collect();
        let values: Vec<Vec3> = frames().map(|frame| Vec3::splat(frame as f32)).collect();
        let keys = Keys { times_s, values, interpolation };
        let mut node = Node::fixed("/counter", None, Trs::default());
        node.channels = vec![Channel::Translation(keys.clone())];
        let kind = LightKind::Point { intensity_cd: Vec3::ONE };
        let light = Light {
            node: 0,
            kind,
            values: Some(keys.into()),
            range_m: None,
            forced: false,
            visibility: Visibility::default(),
        };
        let timeline = Timeline {
            zero_frame: first,
            first_frame: first,
            frames_per_second: rate,
            last_frame: None,
        };
        Scene { nodes: vec![node], lights: vec![light], timeline, ..Default::default() }
    }

    #[test]
    fn every_frame_shows_the_key_that_is_on_it() {
        for rate in RATES {
            // Keys counted from the first frame, or from frame 0 of a shot that begins later.
            for (first, from, stride) in
                [(1.0, 0, 1), (1001.0, 0, 7), (0.0, 1001, 7), (0.0, 86_400, 7)]
            {
                let step = (0..4).map(|way| (way, Interpolation::Step));
                for (way, interpolation) in step.chain([(0, Interpolation::Linear)]) {
                    let scene = counting(way, rate, first, from, interpolation);
                    for frame in (from..from + FRAMES).step_by(stride) {
                        let time_s = scene.timeline.seconds_at(f64::from(frame) + first);
                        let pose = scene.pose_at(time_s);
                        assert_eq!(pose.world(0).translation.x, frame as f32, "{rate} {way}");
                        assert_eq!(scene.rgb_of_light(0, &pose).x, frame as f32);
                    }
                }
            }
        }
    }

    /// Two keys a hair apart are a jump: the nearer one is meant, from either side.
    #[test]
    fn a_jump_of_two_close_keys_is_seen_from_the_right_side() {
        let at_frame = 5.0f32 / 24.0;
        for (before, after, expected) in
            [(at_frame - 1e-6, at_frame, 2.0), (at_frame, at_frame + 1e-6, 1.0)]
        {
            for interpolation in [Interpolation::Step, Interpolation::Linear] {
                let keys = Keys {
                    times_s: vec![0.0, before, after, 1.0],
                    values: [1.0, 1.0, 2.0, 2.0].map(Vec3::splat).into(),
                    interpolation,
                };
                let mut scene = counting(0, 24.0, 0.0, 0, interpolation);
                scene.nodes[0].channels = vec![Channel::Translation(keys)];
                for (frame, value) in [(4.0, 1.0), (5.0, expected), (6.0, 2.0)] {
                    let pose = scene.pose_at(scene.timeline.seconds_at(frame));
                    assert_eq!(pose.world(0).translation.x, value, "{frame}");
                }
            }
        }
    }
}
