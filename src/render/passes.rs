//! Passes: a frame is rendered in several, each of which gives some pixels further samples.
//!
//! A [`Control`] decides how many samples each pixel is to have, from what the film shows so far. What
//! it may look at decides what a picture depends on: [`Uniform`] looks at nothing, [`ToError`] at the
//! noise, so that their pictures can be repeated. Between passes, and where a frame is stopped, a control
//! may save the film.

use super::Film;
use super::noise::{Allotment, FrameError, Grey, mask};

/// Receives the progress of a frame.
pub trait Progress: Sync {
    /// A pass begins. The frame has so many samples, and is expected to get so many in all.
    fn expects(&self, taken: u64, all: u64) {
        let _ = (taken, all);
    }

    /// Some samples have been taken.
    fn samples_taken(&self, samples: u64) {
        let _ = samples;
    }

    /// Whether the frame is to be given up. Asked often, from all threads.
    fn is_stopped(&self) -> bool {
        false
    }
}

/// Ignores progress.
impl Progress for () {}

/// Decides what a frame's passes are.
pub trait Control {
    /// How many samples each pixel is to have after the next pass; `None` if the frame is done.
    fn next(&mut self, film: &Film) -> Option<Vec<u32>>;

    /// How many samples the frame is expected to have in the end. Asked when a pass begins.
    fn expected(&self, film: &Film) -> u64;

    /// Whether a frame that is stopped in the midst of a pass is done as it is.
    fn is_done_if_stopped(&self) -> bool {
        false
    }

    /// A pass is done, or the frame is stopped in the midst of one.
    fn passed(&mut self, film: &Film) {
        let _ = film;
    }
}

/// Every pixel gets the same number of samples.
#[derive(Clone, Copy, Debug)]
pub struct Uniform(pub u32);

/// Samples of each pixel in the first pass.
pub const FIRST: u32 = 8;
/// The aim is lowered so often at most before all that can have more samples has them.
const TIGHTER: usize = 16;

impl Control for Uniform {
    fn next(&mut self, film: &Film) -> Option<Vec<u32>> {
        let least = film.taken().iter().copied().min().unwrap_or(self.0);
        let next = least.saturating_mul(2).clamp(FIRST.min(self.0), self.0);
        (least < self.0).then(|| vec![next; film.taken().len()])
    }

    fn expected(&self, film: &Film) -> u64 {
        u64::from(self.0) * film.taken().len() as u64
    }
}

/// Exactly the counts of an earlier picture.
#[derive(Clone, Debug)]
pub struct Planned(pub Vec<u32>);

impl Control for Planned {
    fn next(&mut self, film: &Film) -> Option<Vec<u32>> {
        let is_short = film.taken().iter().zip(&self.0).any(|(taken, planned)| taken < planned);
        is_short.then(|| {
            let pairs = film.taken().iter().zip(&self.0);
            pairs.map(|(taken, planned)| (2 * taken).clamp(FIRST.min(*planned), *planned)).collect()
        })
    }

    fn expected(&self, _: &Film) -> u64 {
        self.0.iter().map(|&count| u64::from(count)).sum()
    }
}

/// What is asked of a frame's noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorGoal {
    /// Error of the frame; see [`noise`](super::noise).
    pub error: f64,
    /// The grey floor.
    pub grey: Grey,
    /// No pixel gets more samples.
    pub most: u32,
}

/// Samples go where the error is, until the frame's is as small as asked, with 95 % certainty.
#[derive(Clone, Debug)]
pub struct ToError {
    goal: ErrorGoal,
    needed: f64,
}

/// What a frame's noise has come to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reached {
    /// Of the frame.
    pub frame: FrameError,
    /// Noisy pixels whose error is above twice the goal and that have as many samples as they may.
    pub capped: usize,
    /// Pixels with samples that were left out.
    pub spoilt: usize,
}

impl ErrorGoal {
    /// How samples are allotted for it.
    pub fn allotment(&self) -> Allotment {
        Allotment { least: FIRST.min(self.most), most: self.most }
    }

    /// What a film has reached of it.
    pub fn reached(&self, film: &Film) -> Reached {
        let estimate = film.estimate(self.grey);
        let pixels = || 0..estimate.pixels();
        let is_capped = |i: &usize| {
            estimate.samples(*i) >= f64::from(self.most) && estimate.error(*i) > 2.0 * self.error
        };
        Reached {
            frame: estimate.of_frame(),
            capped: pixels().filter(is_capped).count(),
            spoilt: pixels().filter(|&i| estimate.is_spoilt(i)).count(),
        }
    }
}

impl ToError {
    /// Towards a goal.
    pub fn new(goal: ErrorGoal) -> ToError {
        ToError { goal, needed: 0.0 }
    }

    /// What is asked for.
    pub fn goal(&self) -> ErrorGoal {
        self.goal
    }
}

impl Control for ToError {
    fn next(&mut self, film: &Film) -> Option<Vec<u32>> {
        let allotment = self.goal.allotment();
        if film.taken().contains(&0) {
            return Some(vec![allotment.least; film.taken().len()]);
        }
        let estimate = film.estimate(self.goal.grey);
        let bound = estimate.of_frame().bound;
        // Lower than the goal if that does not prove enough. It begins with the goal each time: a
        // frame that is gone on with must decide as one that was never stopped.
        let mut aim = self.goal.error;
        for _ in 0..TIGHTER {
            let needed = allotment.needed(&estimate, aim);
            self.needed = needed.iter().sum();
            let next = allotment.next(&estimate, &needed);
            if next.as_slice() != film.taken() {
                return Some(next);
            }
            if bound <= self.goal.error {
                return None;
            }
            aim *= 0.97 * (self.goal.error / bound).clamp(0.8, 1.0);
        }
        None
    }

    fn expected(&self, film: &Film) -> u64 {
        (self.needed as u64).max(film.samples() + film.missing())
    }
}

/// A pass of about so many samples, spread evenly over the pixels that a wish gives more.
pub fn spread(film: &Film, wish: &[u32], samples: f64) -> Vec<u32> {
    let pairs = || film.taken().iter().zip(wish);
    let open = pairs().filter(|(taken, wish)| taken < wish).count();
    let each = samples / open.max(1) as f64;
    let width = film.window().width() as usize;
    let more = |i: usize| each.floor() as u32 + u32::from(mask(i, width) < each.fract());
    pairs().enumerate().map(|(i, (&taken, &wish))| (taken + more(i)).min(wish).max(taken)).collect()
}
