//! Frame numbers and seconds.

/// How frame numbers map to seconds on the file's animation clock.
///
/// USD exports carry theirs (`startTimeCode`, `timeCodesPerSecond`); for any other file frame 1 is
/// second 0 at 24 frames per second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timeline {
    /// The frame that is second 0.
    pub first_frame: f64,
    /// Frames in a second.
    pub frames_per_second: f64,
    /// The last frame that the file speaks of, if it says so.
    pub last_frame: Option<f64>,
}

impl Default for Timeline {
    fn default() -> Self {
        Timeline { first_frame: 1.0, frames_per_second: 24.0, last_frame: None }
    }
}

impl Timeline {
    /// Seconds on the animation clock at a frame.
    pub fn seconds_at(&self, frame: f64) -> f64 {
        (frame - self.first_frame) / self.frames_per_second
    }
}
