//! Decides the passes of a frame: by number of samples, error, time or plan.

use super::checkpoint::Checkpoint;
use super::clock::Deadline;
use super::effort::Effort;
use crate::render::noise::{Allotment, Grey};
use crate::render::passes::{ErrorGoal, Planned, ToError, Uniform, spread};
use crate::render::{Control, Film};

/// Samples of each pixel in the first pass of a frame that has a time. It is not interrupted: a picture
/// without samples is none.
pub(super) const FIRST_IN_TIME: u32 = 2;

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
                None => Way::Time(Allotment { least: FIRST_IN_TIME.min(most), most }, grey),
            },
            _ => Way::Uniform(Uniform(most)),
        };
        FrameControl { way, deadline, checkpoint }
    }

    /// How many samples the frame must have before its time may interrupt it: as many as the first pass
    /// gives it.
    pub fn least_samples(&self, film: &Film) -> u64 {
        let each = match &self.way {
            Way::Uniform(Uniform(most)) => FIRST_IN_TIME.min(*most),
            Way::Planned(_) => FIRST_IN_TIME,
            Way::Error(control) => FIRST_IN_TIME.min(control.goal().most),
            Way::Time(allotment, _) => allotment.least,
        };
        u64::from(each) * film.taken().len() as u64
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
        if !deadline.knows_rate() {
            // How long samples take is learnt from few of them.
            let few = |(&wish, taken): (&u32, &u32)| wish.min(taken + FIRST_IN_TIME);
            deadline.begin(film.samples());
            return Some(wish.iter().zip(film.taken()).map(few).collect());
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
