//! Decides the passes of a frame: by number of samples, error, time or plan.

use super::checkpoint::Checkpoint;
use super::clock::Deadline;
use super::effort::Effort;
use crate::render::noise::{Allotment, Grey};
use crate::render::passes::{ErrorGoal, FIRST, Planned, Reached, ToError, Uniform, spread};
use crate::render::{Control, Film};

/// The control of one frame.
pub(super) struct FrameControl<'a> {
    way: Way,
    deadline: Option<Deadline>,
    /// Where the film is kept between passes, if it is.
    checkpoint: Option<Checkpoint<'a>>,
}

/// What the passes lead to.
enum Way {
    Uniform(Uniform),
    Planned(Planned),
    Error(ToError),
    /// As little noise as the time allows.
    Time(Allotment, Grey),
}

impl<'a> FrameControl<'a> {
    /// For an effort. `plan` has the counts of each pixel, if they are given; `grey` must be there if the
    /// effort looks at noise.
    pub fn new(
        effort: &Effort,
        plan: Option<Vec<u32>>,
        grey: Option<Grey>,
        deadline: Option<Deadline>,
        checkpoint: Option<Checkpoint<'a>>,
    ) -> FrameControl<'a> {
        let most = effort.samples;
        let way = match (plan, grey) {
            (Some(counts), _) => Way::Planned(Planned(counts)),
            (None, Some(grey)) if effort.looks() => match effort.error {
                Some(error) => Way::Error(ToError::new(ErrorGoal { error, grey, most })),
                // A first pass of two: nothing is known about the time that samples take.
                None => Way::Time(Allotment { least: 2.min(most), most }, grey),
            },
            _ => Way::Uniform(Uniform(most)),
        };
        FrameControl { way, deadline, checkpoint }
    }

    /// What was reached of the noise that was asked for.
    pub fn reached(&self) -> Option<Reached> {
        match &self.way {
            Way::Error(control) => Some(control.reached()),
            _ => None,
        }
    }

    /// The next pass if time did not matter.
    fn wish(&mut self, film: &Film) -> Option<Vec<u32>> {
        match &mut self.way {
            Way::Uniform(control) => control.next(film),
            Way::Planned(control) => control.next(film),
            Way::Error(control) => control.next(film),
            Way::Time(Allotment { least, most }, _) => {
                let is_blank = film.taken().contains(&0);
                let count = if is_blank { *least } else { *most };
                film.taken()
                    .iter()
                    .any(|&taken| taken < count)
                    .then(|| vec![count; film.taken().len()])
            }
        }
    }

    /// A pass of at most so many samples towards what is wished.
    fn within(&self, film: &Film, wish: Vec<u32>, samples: f64) -> Vec<u32> {
        let (allotment, grey) = match &self.way {
            Way::Uniform(_) | Way::Planned(_) => {
                return spread(film, &wish, samples);
            }
            Way::Error(control) => (control.goal().allotment(), control.goal().grey),
            Way::Time(allotment, grey) => (*allotment, *grey),
        };
        let estimate = film.estimate(grey);
        let needed = allotment.affordable(&estimate, film.samples() + samples as u64);
        let next = allotment.next(&estimate, &needed);
        next.into_iter().zip(wish).map(|(next, wish)| next.min(wish)).collect()
    }
}

impl Control for FrameControl<'_> {
    fn next(&mut self, film: &Film) -> Option<Vec<u32>> {
        let wish = self.wish(film)?;
        let Some(deadline) = &mut self.deadline else { return Some(wish) };
        if film.samples() == 0 {
            let first = wish.iter().map(|&wish| wish.min(FIRST_IN_TIME)).collect();
            deadline.begin(film.samples());
            return Some(first);
        }
        let samples = deadline.samples_of_next_pass()?;
        let missing: u64 =
            wish.iter().zip(film.taken()).map(|(w, t)| u64::from(w.saturating_sub(*t))).sum();
        let next =
            if (missing as f64) <= samples { wish } else { self.within(film, wish, samples) };
        let deadline = self.deadline.as_mut()?;
        deadline.begin(film.samples());
        (next.as_slice() != film.taken()).then_some(next)
    }

    fn expected(&self, film: &Film) -> u64 {
        let wish = match &self.way {
            Way::Uniform(control) => control.expected(film),
            Way::Planned(control) => control.expected(film),
            Way::Error(control) => control.expected(film),
            Way::Time(..) => u64::MAX,
        };
        let in_time = self.deadline.as_ref().and_then(|deadline| deadline.expected(film.samples()));
        wish.min(in_time.unwrap_or(u64::MAX)).max(film.samples() + film.missing())
    }

    fn is_done_if_stopped(&self) -> bool {
        self.deadline.as_ref().is_some_and(Deadline::is_over)
    }

    fn passed(&mut self, film: &Film) {
        if let Some(deadline) = &mut self.deadline {
            deadline.end(film.samples());
        }
        if let Some(checkpoint) = &self.checkpoint {
            checkpoint.write(film);
        }
    }
}

/// Samples of each pixel in the first pass of a frame that has a time.
const FIRST_IN_TIME: u32 = FIRST / 4;
