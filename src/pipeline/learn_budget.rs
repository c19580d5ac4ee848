//! How much is learned: rays, or as many as a time allows.
//!
//! A table depends on its number of rays and never on a clock. A time is turned into a number first: small
//! lessons, each [`LARGER`] times the one before, tell what a ray takes here. The number stands in the table, and
//! as a budget of its own it gives the same table anywhere.

/// How much is learned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Budget {
    /// Rays to lights.
    Rays(u64),
    /// As many as fit into so many seconds from the start of the job: reading the scene is part of them.
    Seconds(f64),
}

impl Default for Budget {
    fn default() -> Budget {
        Budget::Rays(Budget::RAYS)
    }
}

impl Budget {
    /// Rays that pay for themselves in one frame of final quality.
    pub const RAYS: u64 = 1 << 22;
    /// The fewest and the most rays.
    pub const RANGE: [u64; 2] = [STEP, 4_000_000_000];
}

/// Numbers that come from a time are multiples of it, so that people can write them down.
const STEP: u64 = 1000;
/// Rays of the first small lesson.
const FIRST: u64 = 16_000;
/// How many times as many rays the next small lesson has.
const LARGER: u64 = 8;
/// The share of what is left that a small lesson may take.
const SHARE: f64 = 0.1;
/// The share of what is left then that the table is made for: a ray may take longer than expected.
const AIM: f64 = 0.9;

/// Small lessons, and how long they took.
#[derive(Debug, Default)]
pub(super) struct Trials {
    /// Of each lesson its rays, and seconds.
    done: Vec<(u64, f64)>,
}

impl Trials {
    /// The rays of the next small lesson; `None` if enough is known, or too little time is left, which is in
    /// seconds.
    pub fn next(&self, left: f64) -> Option<u64> {
        let Some(&(rays, seconds)) = self.done.last() else { return Some(FIRST) };
        let next = rays * LARGER;
        (seconds * LARGER as f64 <= SHARE * left && next <= Budget::RANGE[1]).then_some(next)
    }

    /// A small lesson of so many rays took so many seconds. If it found out at once that nothing is hidden, it
    /// traced only a part of its rays, and `rays` are those.
    pub fn add(&mut self, rays: u64, seconds: f64) {
        self.done.push((rays.max(1), seconds));
    }

    /// The rays that fit into what is left, seconds.
    pub fn fitting(&self, left: f64) -> u64 {
        let [least, most] = Budget::RANGE;
        // What a lesson takes however few its rays are, and what each ray adds.
        let (fixed, of_ray) = match *self.done.as_slice() {
            [] => return least,
            [.., (few, short), (many, long)] if many > few && long > short => {
                let of_ray = (long - short) / (many - few) as f64;
                ((short - of_ray * few as f64).max(0.0), of_ray)
            }
            [.., (rays, seconds)] => (0.0, seconds / rays as f64),
        };
        let rays = (AIM * left - fixed) / of_ray;
        // Not a number, if no time was measured.
        let rays = if rays.is_nan() { most as f64 } else { rays.clamp(0.0, most as f64) };
        (rays as u64 / STEP * STEP).clamp(least, most)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Small lessons, for a time, on a machine where each takes `fixed` seconds and `of_ray` a ray.
    fn learn_for(seconds: f64, fixed: f64, of_ray: f64) -> (u64, f64) {
        let mut trials = Trials::default();
        let mut spent = 0.0;
        while let Some(rays) = trials.next(seconds - spent) {
            let own = fixed + of_ray * rays as f64;
            spent += own;
            trials.add(rays, own);
        }
        (trials.fitting(seconds - spent), spent)
    }

    proptest! {
        /// Whatever the machine is, the whole takes no longer than asked. Most of it goes into the table, if the time
        /// is enough for anything and is not eaten up by what each lesson takes beside its rays.
        #[test]
        fn a_time_is_kept_and_used(
            log_seconds in -1.0..5f64, log_of_ray in -9.0..-3f64, fixed_share in 0.0..0.1f64
        ) {
            let (seconds, of_ray) = (10f64.powf(log_seconds), 10f64.powf(log_of_ray));
            let fixed = fixed_share * seconds;
            let (rays, spent) = learn_for(seconds, fixed, of_ray);
            prop_assert_eq!(rays % STEP, 0);
            let last = fixed + of_ray * rays as f64;
            let is_enough = seconds > 4.0 * of_ray * FIRST as f64;
            if is_enough {
                prop_assert!(spent + last <= seconds, "{spent} + {last} of {seconds}");
                let all = rays == Budget::RANGE[1];
                let is_used = last > 0.5 * seconds || all || fixed_share > 0.001;
                prop_assert!(is_used, "{spent} + {last} of {seconds}");
            }
        }

        /// A clock may tell anything.
        #[test]
        fn any_times_give_a_budget(
            times in prop::collection::vec((any::<u64>(), any::<f64>()), 0..4), left in any::<f64>()
        ) {
            let mut trials = Trials::default();
            times.into_iter().for_each(|(rays, seconds)| trials.add(rays, seconds));
            let [least, most] = Budget::RANGE;
            prop_assert!((least..=most).contains(&trials.fitting(left)));
        }
    }
}
