//! The exact variance of an estimator that samples lights through the tree, without drawing a number.
//!
//! Given the contribution of each light, the variance of the sum over the picks has a closed form.
//! Let an entry of the cut contribute `F_c`, with a variance `V_c` within it, and let it be taken with
//! the chance `n_c` and divided by `q_c`. It adds `n_c V_c / q_c^2`. To this comes the variance of the sum
//! of `F_c / q_c` over the choice of entries. A comb takes them, so that sum is a step function of one
//! number, which is integrated exactly. The two counts of samples mix by the law of total variance.
//! Below an entry, one descent has the second moment `sum of (V + F^2) / p`, group by group.

use super::cut::{Entry, Picked, Scratch};
use super::group::WIDTH;
use super::place::{Choice, Next, Place};
use super::sampling::FrameTree;
use super::splitting::{Splitting, comb, on_the_line};
use super::viewer::Viewer;

/// Mean and variance of an estimator.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    /// The sum of all contributions that can be picked.
    pub mean: f64,
    /// Its variance.
    pub variance: f64,
    /// The expected number of samples.
    pub lights: f64,
}

impl FrameTree<'_> {
    /// The moments of an estimator of the sum over all lights by its
    /// [picks](FrameTree::for_each_pick). `contribution` takes a light and the expected number of
    /// samples of it. Forced lights are left out.
    pub fn moments<V: Viewer>(
        &self,
        viewer: &V,
        beside: &[f64],
        how: &Splitting,
        contribution: &impl Fn(Picked, f64) -> f64,
    ) -> Moments {
        let mut scratch = Scratch::default();
        let Some(cut) = self.cut(viewer, beside, how, None, &mut scratch) else {
            return Moments::default();
        };
        let of_entry: Vec<(f64, f64)> = scratch
            .entries
            .iter()
            .enumerate()
            .map(|(number, entry)| {
                let expected = cut.expected(&scratch, number);
                match *entry {
                    _ if expected <= 0.0 => (0.0, 0.0),
                    Entry::Light(light) => (contribution(light, expected), 0.0),
                    Entry::Cluster(stop) => {
                        let place = self.place_at(stop, &scratch);
                        place.map_or((0.0, 0.0), |place| self.below(place, expected, contribution))
                    }
                }
            })
            .collect();
        let share = cut.rounded.chance_of_more;
        let of_draw = |more: bool| {
            let chances = cut.chances(&scratch, more);
            let scaled = |(entry, (mean, variance)): (usize, &(f64, f64))| {
                let divisor = cut.divisor(&scratch, entry, chances[entry]);
                (mean / divisor, variance / (divisor * divisor))
            };
            of_comb(
                chances,
                &scratch.late,
                &of_entry.iter().enumerate().map(scaled).collect::<Vec<_>>(),
            )
        };
        let low = of_draw(false);
        let high = if share > 0.0 { of_draw(true) } else { low };
        Moments {
            mean: of_entry.iter().map(|(mean, _)| mean).sum(),
            variance: (1.0 - share) * low.1
                + share * high.1
                + share * (1.0 - share) * (high.0 - low.0).powi(2),
            lights: (0..of_entry.len()).map(|entry| cut.expected(&scratch, entry)).sum(),
        }
    }

    /// Mean and variance of what one descent from a place finds, divided by its probability;
    /// `expected` is the number of descents. Levels are kept in a list: a tree may be deeper than the
    /// stack.
    fn below<V: Viewer>(
        &self,
        place: Place<V>,
        expected: f64,
        contribution: &impl Fn(Picked, f64) -> f64,
    ) -> (f64, f64) {
        let mut levels: Vec<Level<V>> = self.level(place, expected).into_iter().collect();
        let mut found = (0.0, 0.0);
        while let Some(level) = levels.last_mut() {
            let alive = |lane: &usize| level.choice.of_lane[*lane] > 0.0;
            let Some(lane) = (level.next..WIDTH).find(alive) else {
                let Level { mean, second, .. } = *level;
                found = (mean, (second - mean * mean).max(0.0));
                levels.pop();
                if let Some(above) = levels.last_mut() {
                    above.add(above.next - 1, found);
                }
                continue;
            };
            level.next = lane + 1;
            let expected = level.expected * level.choice.share(lane);
            match self.follow(&level.place, level.choice.group, lane) {
                None => {}
                Some(Next::Group(place)) => levels.extend(self.level(place, expected)),
                Some(Next::Emitter(emitter)) => {
                    level.add(lane, (contribution(Picked::Emitter(emitter), expected), 0.0));
                }
            }
        }
        found
    }

    fn level<V: Viewer>(&self, place: Place<V>, expected: f64) -> Option<Level<'_, V>> {
        let choice = self.weigh(&place)?.choice()?;
        Some(Level { place, choice, expected, next: 0, mean: 0.0, second: 0.0 })
    }
}

/// A group of a depth-first walk over all that a descent may find.
struct Level<'a, V> {
    place: Place<V>,
    choice: Choice<'a>,
    /// The expected number of descents that come here.
    expected: f64,
    /// The next lane to look at.
    next: usize,
    /// Mean and second moment over the lanes before it.
    mean: f64,
    second: f64,
}

impl<V> Level<'_, V> {
    /// Adds a lane, by its mean and variance.
    fn add(&mut self, lane: usize, (mean, variance): (f64, f64)) {
        self.mean += mean;
        self.second += (variance + mean * mean) / self.choice.share(lane);
    }
}

/// Mean and variance of the sum over the entries that a comb takes, given those of each entry.
fn of_comb(chances: &[f64], late: &[bool], of_entry: &[(f64, f64)]) -> (f64, f64) {
    let alive = || chances.iter().zip(of_entry).filter(|(chance, _)| **chance > 0.0);
    let mean: f64 = alive().map(|(chance, (mean, _))| chance * mean).sum();
    let within: f64 = alive().map(|(chance, (_, variance))| chance * variance).sum();
    // The comb takes the same entries for all numbers between two neighbouring ends, modulo 1.
    let is_open = |chance: f64| chance > 0.0 && chance < 1.0;
    let (mut end, mut expected) = (0.0, 0.0);
    let mut steps = vec![1.0];
    for at in on_the_line(chances.len(), late) {
        let chance = chances[at];
        if is_open(chance) {
            end += chance;
            expected += chance * of_entry[at].0;
            steps.push(f64::fract(end));
        }
    }
    steps.sort_unstable_by(f64::total_cmp);
    let (mut from, mut between) = (0.0, 0.0);
    for to in steps {
        if to > from {
            let taken = comb(chances, late, 0.5 * (from + to))
                .filter(|&(entry, _)| is_open(chances[entry]));
            let sum: f64 = taken.map(|(entry, _)| of_entry[entry].0).sum();
            between += (to - from) * (sum - expected).powi(2);
            from = to;
        }
    }
    (mean, within + between)
}
