//! What a shot will take at an error, from small pictures of some of its frames.
//!
//! Each small picture is rendered as the whole frame will be, samples where the error is, but stops at few. What a
//! pixel needs for the error follows from its noise so far, as in every pass of a render; how many samples that
//! is depends little on the size of the picture, and what a sample costs hardly. It errs on the side of caution:
//! the noise of well stratified samples falls faster than is assumed, and broad pixels have more to average.

use super::picture::Subject;
use super::trade::{Account, Onlooker};
use crate::render::noise::Grey;
use crate::render::passes::{ErrorGoal, ToError};
use crate::render::{RenderError, RenderSettings};
use serde::Serialize;
use std::time::Instant;

/// Rows of the small pictures.
const HEIGHT: u32 = 54;
/// A pixel of a small picture gets no more samples.
const MOST: u32 = 64;

/// What a frame will take.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FrameCost {
    /// The frame.
    pub frame: i32,
    /// Samples of a pixel, in the mean.
    pub samples: f64,
    /// Seconds for the whole frame, on this machine.
    pub seconds: f64,
    /// The share of pixels that will have as many samples as they may.
    pub capped: f64,
}

/// What a shot will take.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ShotCost {
    /// The error that is asked for.
    pub error: f64,
    /// The grey floor of the shot.
    pub grey: Grey,
    /// The frames that were looked at.
    pub pilots: Vec<FrameCost>,
    /// Seconds of each frame of the shot: in between, those of the frames looked at are interpolated.
    pub frames: Vec<(i32, f64)>,
    /// Seconds of all of them.
    pub seconds: f64,
}

impl<D: AsRef<[u8]>> Subject<'_, '_, D> {
    /// The settings of a small picture of the frame.
    fn small(&self) -> RenderSettings {
        let RenderSettings { width, height, .. } = self.base;
        let rows = HEIGHT.min(height);
        let columns = u64::from(width) * u64::from(rows) / u64::from(height);
        let columns = columns.clamp(1, 4 * u64::from(HEIGHT)) as u32;
        RenderSettings {
            width: columns,
            height: rows,
            aovs: Vec::new(),
            crop: None,
            ..self.base.clone()
        }
    }

    /// What the frame will take to reach a goal.
    ///
    /// # Errors
    /// If the tree lacks the frame, the settings do not fit the scene, or the onlooker stops it.
    pub fn pilot(
        &mut self,
        goal: ErrorGoal,
        onlooker: &dyn Onlooker,
    ) -> Result<FrameCost, RenderError> {
        self.delegate.set_settings(self.small());
        // Posing the scene takes as long for a small picture as for a large one.
        let started = Instant::now();
        self.delegate.prepare(self.tree, self.frame)?;
        let before = started.elapsed().as_secs_f64();
        let mut film = self.delegate.film(self.frame)?;
        let mut control = ToError::new(ErrorGoal { most: goal.most.min(MOST), ..goal });
        let started = Instant::now();
        let account = Account::new(onlooker, 0.0);
        self.delegate.expose(self.tree, self.frame, &mut film, &mut control, &account)?;
        let tracing = (started.elapsed().as_secs_f64() - before).max(0.0);
        let per_sample = tracing / film.samples().max(1) as f64;
        let needed = goal.allotment().needed(&film.estimate(goal.grey), goal.error);
        let small = needed.len() as f64;
        let samples = needed.iter().sum::<f64>() / small;
        let pixels = f64::from(self.base.width) * f64::from(self.base.height);
        let most = f64::from(goal.most);
        Ok(FrameCost {
            frame: self.frame,
            samples,
            seconds: before + per_sample * samples * pixels,
            capped: needed.iter().filter(|&&count| count >= most).count() as f64 / small,
        })
    }
}

impl ShotCost {
    /// Of a shot's frames, from some of them; both ascend, and there is at least one of each.
    pub fn new(goal: ErrorGoal, pilots: Vec<FrameCost>, frames: &[i32]) -> ShotCost {
        let frames: Vec<(i32, f64)> =
            frames.iter().map(|&frame| (frame, between(&pilots, frame))).collect();
        let seconds = frames.iter().map(|frame| frame.1).sum();
        let ErrorGoal { error, grey, .. } = goal;
        ShotCost { error, grey, pilots, frames, seconds }
    }
}

/// The seconds of a frame, by its neighbours that were looked at.
fn between(pilots: &[FrameCost], frame: i32) -> f64 {
    let next = pilots.partition_point(|pilot| pilot.frame < frame);
    let last = next.checked_sub(1).and_then(|i| pilots.get(i));
    match (last, pilots.get(next)) {
        (Some(a), Some(b)) => {
            let share = f64::from(frame - a.frame) / f64::from(b.frame - a.frame);
            a.seconds + share * (b.seconds - a.seconds)
        }
        (Some(only), None) | (None, Some(only)) => only.seconds,
        (None, None) => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_in_between_are_interpolated() {
        let pilot = |frame, seconds| FrameCost { frame, samples: 8.0, seconds, capped: 0.0 };
        let goal = ErrorGoal { error: 0.05, grey: Grey::below(1.0), most: 64 };
        let pilots = vec![pilot(10, 1.0), pilot(14, 3.0)];
        let cost = ShotCost::new(goal, pilots, &[9, 10, 11, 12, 14, 20]);
        let seconds: Vec<f64> = cost.frames.iter().map(|frame| frame.1).collect();
        assert_eq!(seconds, [1.0, 1.0, 1.5, 2.0, 3.0, 3.0]);
        assert_eq!(cost.seconds, 11.5);
    }
}
