//! Splitting: how far the tree is opened for a viewer, and how many samples the viewer gets.
//!
//! The seed splits a cluster where one sample of it is not enough, and samples every part once. Each
//! decision then costs a shadow ray, and noise has seams where decisions change. Looking at a cluster
//! is cheaper than tracing a ray. So here the tree is first [opened](super::cut) where its estimates
//! are uncertain, and no sample is taken yet. What this leaves is the *cut*. The relative variance that
//! remains in the cut decides how many samples it gets, as a real number. Clusters are sampled in
//! proportion to their importance, and none twice. One sample is a plain descent of the tree, as many
//! samples as clusters takes them all, and everything between varies smoothly. (Cuts: Walter et al.
//! 2005. Sampling them: Yuksel 2019, "Stochastic Lightcuts".) The seed's own rule stays for comparison.

use crate::math::built_in;

/// How splitting is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Splitting {
    /// In `[0, 1]`: 0 takes one sample at a point, 1 takes every emitter that may light it. Its meaning
    /// does not depend on the scale of lengths or energies.
    pub knob: f32,
    /// The most samples at a point.
    pub most: u32,
    /// The test that decides what is opened.
    pub test: SplitTest,
}

/// The test that decides whether a cluster is opened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SplitTest {
    /// The cluster's part in the relative variance of one sample: its share of all importance times
    /// the squared relative deviation within it. The relative variance that remains in the cut
    /// decides the number of samples.
    #[default]
    Variance,
    /// The seed's: the cluster's solid angle times the peak of the BSDF towards it. Every cluster of
    /// the cut is sampled.
    SolidAngle,
}

/// At knob 0.5, a cluster is opened if its part in the relative variance is above this.
const OPENED_ABOVE: f64 = 0.04;
/// At knob 0.5, so much relative variance is worth one more sample.
const WORTH_A_SAMPLE: f64 = 0.08;
/// At knob 0.5, the seed's rule splits a cluster whose measure is above this.
const GLARE: f64 = 2.0;

impl Splitting {
    /// One sample at a point, by a plain descent.
    pub const NONE: Splitting = Splitting { knob: 0.0, most: u32::MAX, test: SplitTest::Variance };

    /// Every emitter that may light a point, once.
    pub const ALL: Splitting = Splitting { knob: 1.0, ..Splitting::NONE };

    /// Whether the tree is not opened at all.
    pub fn is_off(&self) -> bool {
        !built_in::SPLITTING || self.knob <= 0.0
    }

    /// Whether it is opened to the last emitter.
    pub(super) fn is_full(&self) -> bool {
        self.knob >= 1.0
    }

    /// The factor of the knob on thresholds: infinite at knob 0, zero at knob 1.
    fn ease(&self) -> f64 {
        let knob = f64::from(self.knob).clamp(0.0, 1.0);
        (1.0 - knob) / knob
    }

    /// A cluster is opened if its measure is above this.
    pub(super) fn threshold(&self) -> f64 {
        self.ease() * if self.test == SplitTest::SolidAngle { GLARE } else { OPENED_ABOVE }
    }

    /// How many samples a cut of some clusters gets, given the relative variance of one sample.
    pub(super) fn worth(&self, variance: f64, clusters: usize) -> f64 {
        let all = (clusters as f64).min(f64::from(self.most)).max(1.0);
        if self.is_full() || self.test == SplitTest::SolidAngle {
            return all;
        }
        (1.0 + variance / (self.ease() * WORTH_A_SAMPLE)).min(all)
    }
}

/// The largest number below 1.
pub(super) const BELOW_ONE: f64 = 1.0 - f64::EPSILON / 2.0;

/// Allots `count` samples: each cluster gets a chance in proportion to its weight, but not above its
/// cap, which is at most 1. The chances add up to the count, or to the caps of all weights above zero
/// if those are less.
pub(super) fn allot(weights: &[f64], caps: &[f64], count: f64, chances: &mut Vec<f64>) {
    chances.clear();
    if weights.iter().filter(|&&weight| weight > 0.0).count() as f64 <= count {
        let all = weights.iter().zip(caps);
        chances.extend(all.map(|(&weight, &cap)| if weight > 0.0 { cap } else { 0.0 }));
        return;
    }
    chances.resize(weights.len(), 0.0);
    // Clusters at their caps keep them. The rest of the count goes to the others.
    let mut left = count;
    loop {
        let alive = || weights.iter().zip(caps).zip(chances.iter());
        let sum: f64 = alive().filter(|((_, cap), chance)| chance < cap).map(|((w, _), _)| w).sum();
        if sum <= 0.0 || left <= 0.0 {
            return;
        }
        let each = left / sum;
        let mut more = false;
        for ((&weight, &cap), chance) in weights.iter().zip(caps).zip(chances.iter_mut()) {
            if weight > 0.0 && *chance < cap {
                *chance = weight * each;
                if *chance >= cap {
                    (*chance, more) = (cap, true);
                    left -= cap;
                }
            }
        }
        if !more {
            return;
        }
    }
}

/// Takes clusters by one number in `[0, 1)`. Clusters whose chance is 1 are always taken. The chances of
/// the others are laid end to end on a line, and a comb whose teeth are 1 apart takes those that it
/// meets. This is systematic sampling: neighbours in the tree are neighbours on the line, so the
/// samples are stratified over the scene. Each cluster comes with a fresh number in `[0, 1)`, stretched
/// from the first; one that is always taken gets the number itself.
///
/// Clusters that are `late` are laid behind the others. If what the others have adds up to a whole number, they
/// are met by as many teeth whatever the first number is, and late clusters by more teeth, now and then.
pub(super) fn comb<'a>(
    chances: &'a [f64],
    late: &'a [bool],
    u: f64,
) -> impl Iterator<Item = (usize, f64)> + 'a {
    let mut end = 0.0;
    // The teeth stand at u, u + 1, ...; `next` is the first that no cluster has met. There are no more
    // teeth than the chances add up to, even where rounding would leave room for one.
    let mut next = u;
    let open: f64 = chances.iter().filter(|&&chance| chance < 1.0).sum();
    // Late clusters may have less than any rounding.
    let last = u + (open - if late.is_empty() { 1e-9 } else { 0.0 }).ceil();
    on_the_line(chances.len(), late).filter_map(move |i| {
        let chance = chances[i];
        if chance <= 0.0 {
            return None;
        }
        if chance >= 1.0 {
            return Some((i, u));
        }
        let start = end;
        end += chance;
        if next >= end || next >= last {
            return None;
        }
        let leftover = ((next - start) / chance).clamp(0.0, BELOW_ONE);
        next += 1.0;
        Some((i, leftover))
    })
}

/// So many clusters in the order in which they are laid on the line.
pub(super) fn on_the_line(count: usize, late: &[bool]) -> impl Iterator<Item = usize> + '_ {
    let is_late = |at: usize| late.get(at).copied().unwrap_or(false);
    let behind = if late.is_empty() { 0..0 } else { 0..count };
    (0..count).filter(move |&at| !is_late(at)).chain(behind.filter(move |&at| is_late(at)))
}

/// A real number of samples, rounded at random to one of its two neighbours.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rounded {
    pub low: u32,
    /// The chance of `low + 1`.
    pub chance_of_more: f64,
}

impl Rounded {
    pub fn new(worth: f64) -> Rounded {
        let low = worth.floor();
        Rounded { low: low as u32, chance_of_more: worth - low }
    }

    /// Draws one of the two by a number in `[0, 1)`; also returns a fresh number stretched from it.
    pub fn draw(&self, u: f64) -> (u32, f64) {
        let more = self.chance_of_more;
        if u < more {
            (self.low + 1, (u / more).min(BELOW_ONE))
        } else {
            (self.low, ((u - more) / (1.0 - more)).clamp(0.0, BELOW_ONE))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Weights and caps.
    fn clusters() -> impl Strategy<Value = (Vec<f64>, Vec<f64>)> {
        let weight = prop_oneof![1 => Just(0.0), 4 => 1e-6..1.0, 1 => 1.0..1e6];
        let cap = prop_oneof![3 => Just(1.0), 1 => 0.01..1.0];
        prop::collection::vec((weight, cap), 1..40).prop_map(|pairs| pairs.into_iter().unzip())
    }

    proptest! {
        #[test]
        fn chances_add_up_to_the_count((weights, caps) in clusters(), count in 1u32..50) {
            let alive = weights.iter().zip(&caps).filter(|(w, _)| **w > 0.0);
            let most: f64 = alive.map(|(_, cap)| cap).sum();
            let mut chances = Vec::new();
            allot(&weights, &caps, count.into(), &mut chances);
            let sum: f64 = chances.iter().sum();
            prop_assert!((sum - f64::from(count).min(most)).abs() < 1e-9, "{sum}");
            for ((chance, weight), cap) in chances.iter().zip(weights).zip(caps) {
                prop_assert!((0.0..=cap).contains(chance) && (*chance > 0.0) == (weight > 0.0));
            }
        }

        /// An even comb of numbers finds every cluster as often as its chance says, and never more
        /// clusters than the count.
        #[test]
        fn clusters_are_taken_as_often_as_their_chance(
            (weights, caps) in clusters(), count in 1u32..50,
            late in prop::collection::vec(any::<bool>(), 40), has_late in any::<bool>()
        ) {
            const DRAWS: u32 = 2048;
            let mut chances = Vec::new();
            allot(&weights, &caps, count.into(), &mut chances);
            let late = if has_late { &late[..chances.len()] } else { &[] };
            let mut taken = vec![0u32; weights.len()];
            for i in 0..DRAWS {
                let u = (f64::from(i) + 0.5) / f64::from(DRAWS);
                let found: Vec<_> = comb(&chances, late, u).collect();
                prop_assert!(found.len() as u32 <= count);
                for (at, leftover) in found {
                    taken[at] += 1;
                    prop_assert!((0.0..1.0).contains(&leftover));
                }
            }
            for (taken, chance) in taken.iter().zip(chances) {
                prop_assert!((f64::from(*taken) - chance * f64::from(DRAWS)).abs() <= 2.0 + 1e-6);
            }
        }

        /// Whatever the late ones have, the others are as many for every number.
        #[test]
        fn late_clusters_leave_the_number_of_the_others(
            (weights, _) in clusters(), count in 1u32..20, late in prop::collection::vec(0.0..1f64, 1..5)
        ) {
            let caps = vec![1.0; weights.len()];
            let mut chances = Vec::new();
            allot(&weights, &caps, count.into(), &mut chances);
            let early = chances.len();
            let count = weights.iter().filter(|weight| **weight > 0.0).count().min(count as usize);
            chances.extend(&late);
            let is_late: Vec<bool> = (0..chances.len()).map(|at| at >= early).collect();
            let behind: f64 = late.iter().sum();
            let mut met = 0;
            for i in 0..1024 {
                let u = (f64::from(i) + 0.5) / 1024.0;
                let found: Vec<_> = comb(&chances, &is_late, u).collect();
                prop_assert_eq!(found.iter().filter(|(at, _)| *at < early).count(), count);
                met += found.len() - count;
            }
            prop_assert!((met as f64 / 1024.0 - behind).abs() < 5e-3, "{met} of {behind}");
        }

        #[test]
        fn rounding_keeps_the_mean(worth in 1f64..80.0) {
            let rounded = Rounded::new(worth);
            let mean = f64::from(rounded.low) + rounded.chance_of_more;
            prop_assert!((mean - worth).abs() < 1e-12);
            let (count, leftover) = rounded.draw(rounded.chance_of_more * 0.5);
            prop_assert!((0.0..1.0).contains(&leftover));
            prop_assert!(count == rounded.low || count == rounded.low + 1);
        }
    }
}
