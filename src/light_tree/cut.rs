//! The cut: the clusters that a viewer samples from, found by opening the tree where it is uncertain.
//!
//! A cluster that is only just opened still weighs what it weighed unopened, and only then, the more it
//! exceeds the threshold, what its parts say: so nothing jumps where a decision changes.
//!
//! Which clusters these are depends on the viewer and the knob alone, so the way back from an emitter
//! finds the same cut again. Lights beside the tree, suns and domes, stand in it like clusters that
//! cannot be opened: they compete with the tree, and with each other, by the light that they are
//! estimated to send.

use super::group::WIDTH;
use super::leaves::{Route, lane_toward};
use super::place::{Next, Place, Weighed};
use super::sampling::FrameTree;
use super::splitting::{Rounded, SplitTest, Splitting, allot};
use super::viewer::Viewer;

/// What was picked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Picked {
    /// An emitter of the tree, by number.
    Emitter(u32),
    /// A light beside the tree, by its place in the list.
    Beside(u32),
}

impl Picked {
    /// The number of the emitter, if it is one.
    pub fn emitter(self) -> Option<u32> {
        match self {
            Picked::Emitter(emitter) => Some(emitter),
            Picked::Beside(_) => None,
        }
    }
}

/// The part in the relative variance that no opening removes: shadows, and whatever else no estimate
/// knows of.
const UNKNOWN: f64 = 0.04;

/// Room for a cut and for walks below it, to be used again and again.
#[derive(Debug)]
pub struct Scratch<V> {
    pub(super) entries: Vec<Entry<V>>,
    weights: Vec<f64>,
    caps: Vec<f64>,
    pub(super) low: Vec<f64>,
    pub(super) high: Vec<f64>,
    open: Vec<Opened<V>>,
}

impl<V> Default for Scratch<V> {
    fn default() -> Self {
        let (weights, caps, low, high) = Default::default();
        Scratch { entries: Vec::new(), weights, caps, low, high, open: Vec::new() }
    }
}

/// A cluster of the cut, or a light.
#[derive(Clone, Copy, Debug)]
pub(super) enum Entry<V> {
    Light(Picked),
    Cluster(Place<V>),
}

/// A group whose lanes are still to be looked at.
#[derive(Clone, Copy, Debug)]
struct Opened<V> {
    place: Place<V>,
    /// How many legs of the wanted route lie behind; `None` off the route.
    leg: Option<usize>,
    /// What the cluster weighed before it was opened.
    weight: f64,
    /// How far it is opened, from 0 to 1: how much of what its parts say counts.
    opened: f64,
    /// At most so many samples it had before it was opened.
    cap: f64,
}

/// A cut, allotted.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cut {
    /// How many samples it is worth. Their chances, by entry, are in the scratch: `low` for the lower
    /// whole number of samples and `high` for the one above.
    pub rounded: Rounded,
    /// The entry that leads to the wanted emitter, and how many legs of its route lie behind.
    pub wanted: Option<(usize, usize)>,
}

impl FrameTree<'_> {
    /// Opens the tree for a viewer and allots samples to the clusters that this leaves. `None` if
    /// nothing can arrive. Given a route, says which of them leads along it.
    pub(super) fn cut<V: Viewer>(
        &self,
        viewer: &V,
        beside: &[f64],
        how: &Splitting,
        route: Option<&Route>,
        scratch: &mut Scratch<V>,
    ) -> Option<Cut> {
        let Scratch { entries, weights, caps, low, high, open } = scratch;
        entries.clear();
        weights.clear();
        caps.clear();
        open.clear();
        let mut variance = 0.0;
        for (row, &importance) in (0..).zip(beside) {
            entries.push(Entry::Light(Picked::Beside(row)));
            weights.push(importance);
            caps.push(1.0);
        }
        let mut wanted = None;
        let root = self.total_importance(viewer);
        if let Some(place) = self.place_of_root(viewer)
            && root > 0.0
        {
            let leg = route.map(|_| 0);
            // What shares are of, until more is known: the root's own estimate.
            let mut total = root + beside.iter().sum::<f64>();
            let mut may_open = !how.is_off();
            if may_open {
                open.push(Opened { place, leg, weight: root, opened: 1.0, cap: 1.0 });
            } else {
                entries.push(Entry::Cluster(place));
                weights.push(root);
                caps.push(1.0);
                wanted = leg.map(|leg| (entries.len() - 1, leg));
            }
            let mut is_first = true;
            while let Some(Opened { place, leg, weight, opened, cap }) = open.pop() {
                let Some(weighed) = self.weigh(&place) else { continue };
                let Weighed { group, mut importances, spreads } = weighed;
                let sum: f64 = importances.iter().sum();
                if !(sum > 0.0 && sum.is_finite()) {
                    continue;
                }
                if is_first {
                    total = sum + beside.iter().sum::<f64>();
                    is_first = false;
                }
                let weighed = importances;
                if opened < 1.0 {
                    let scale = opened + (1.0 - opened) * weight / sum;
                    importances.iter_mut().for_each(|importance| *importance *= scale);
                }
                let threshold = how.threshold() * total;
                let on_route = leg.and_then(|leg| {
                    let target = route?.slots[leg] / WIDTH as u32;
                    match target.checked_sub(place.at)? {
                        0 => Some((route?.slots[leg] as usize % WIDTH, leg + 1)),
                        distance => Some((lane_toward(group, distance)?, leg)),
                    }
                });
                for lane in 0..WIDTH {
                    let importance = importances[lane];
                    if importance <= 0.0 {
                        continue;
                    }
                    // Barely opened, all parts together still have no more than what they are part of.
                    let cap = opened + (1.0 - opened) * cap * weighed[lane] / sum;
                    let leg = on_route.filter(|&(own, _)| own == lane).map(|(_, leg)| leg);
                    let (entry, part) = match self.follow(&place, group, lane) {
                        None => continue,
                        Some(Next::Emitter(emitter)) => {
                            (Entry::Light(Picked::Emitter(emitter)), 0.0)
                        }
                        Some(Next::Group(below)) => {
                            let part = importance * f64::from(spreads[lane]);
                            let excess = match how.test {
                                _ if how.is_full() => 1.0,
                                SplitTest::Variance => part / threshold - 1.0,
                                SplitTest::SolidAngle => {
                                    let glare = place.viewer.glare(&group.cluster(lane));
                                    f64::from(u8::from(glare > how.threshold()))
                                }
                            };
                            if may_open && excess > 0.0 {
                                let further = opened * excess.min(1.0);
                                variance += (opened - further) * part;
                                let weight = importance;
                                open.push(Opened {
                                    place: below,
                                    leg,
                                    weight,
                                    opened: further,
                                    cap,
                                });
                                continue;
                            }
                            (Entry::Cluster(below), opened * part)
                        }
                    };
                    if let Some(leg) = leg {
                        wanted = Some((entries.len(), leg));
                    }
                    entries.push(entry);
                    weights.push(importance);
                    caps.push(cap);
                    variance += part;
                }
                // The seed's rule samples all of the cut: then its size is what is capped.
                may_open &= how.test == SplitTest::Variance
                    || entries.len() + WIDTH * (open.len() + 1) <= how.most as usize;
            }
        }
        let total: f64 = weights.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        let alive = weights.iter().filter(|&&weight| weight > 0.0).count();
        let rounded = Rounded::new(how.worth(variance / total + UNKNOWN, alive));
        allot(weights, caps, rounded.low, low);
        if rounded.chance_of_more > 0.0 {
            allot(weights, caps, rounded.low + 1, high);
        }
        Some(Cut { rounded, wanted })
    }
}

impl Cut {
    /// The chances of all entries if so many samples are drawn.
    pub fn chances<'s, V>(&self, scratch: &'s Scratch<V>, more: bool) -> &'s [f64] {
        if more { &scratch.high } else { &scratch.low }
    }

    /// What a sample of an entry is divided by, if the entry had some chance in the draw. That chance,
    /// unless it would have been a much better one with one sample more: then its mean over both
    /// draws, so that no sample weighs more than twice what it does in the mean. Either keeps the
    /// mean; the first adds no noise of its own, the second no outliers.
    pub fn divisor<V>(&self, scratch: &Scratch<V>, entry: usize, chance: f64) -> f64 {
        let is_even =
            self.rounded.chance_of_more <= 0.0 || 2.0 * scratch.low[entry] >= scratch.high[entry];
        if is_even { chance } else { self.expected(scratch, entry) }
    }

    /// The chance of an entry to be sampled, whatever is drawn.
    pub fn expected<V>(&self, scratch: &Scratch<V>, entry: usize) -> f64 {
        let more = self.rounded.chance_of_more;
        let high = if more > 0.0 { more * scratch.high[entry] } else { 0.0 };
        (1.0 - more) * scratch.low[entry] + high
    }
}
