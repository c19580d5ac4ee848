//! The cut: the clusters that a viewer samples from.
//!
//! The cut starts as the root. A cluster whose estimate is too uncertain is *opened*: its children
//! take its place. Opening is graded, so that noise has no seams. A cluster whose uncertainty only
//! just exceeds the threshold is barely open: its children share the weight that it had closed. The
//! more it exceeds the threshold, the more the children's own importances count.
//!
//! The cut depends on the viewer and the knob alone, not on a random number. So the probability of an
//! emitter is found by making the same cut again. Infinite lights stand in the cut as clusters that
//! cannot be opened: they compete with the tree, and with each other, by estimated contribution.

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

/// The part of the relative variance that no opening removes: shadows, textures, whatever no estimate
/// of the tree accounts for.
const UNKNOWN: f64 = 0.04;

/// Buffers for a cut and for walks below it, to be reused.
#[derive(Debug)]
pub struct Scratch<V> {
    pub(super) entries: Vec<Entry<V>>,
    /// Of each entry: its importance.
    weights: Vec<f64>,
    /// Of each entry: the most samples that it may get.
    caps: Vec<f64>,
    pub(super) low: Vec<f64>,
    pub(super) high: Vec<f64>,
    open: Vec<Opened<V>>,
    /// Groups weighed since it was made: what picking costs.
    pub weighed: u64,
}

impl<V> Default for Scratch<V> {
    fn default() -> Self {
        let (weights, caps, low, high) = Default::default();
        let (entries, open) = Default::default();
        Scratch { entries, weights, caps, low, high, open, weighed: 0 }
    }
}

impl<V> Scratch<V> {
    fn clear(&mut self) {
        self.entries.clear();
        self.weights.clear();
        self.caps.clear();
        self.open.clear();
    }

    fn push(&mut self, entry: Entry<V>, weight: f64, cap: f64) {
        self.entries.push(entry);
        self.weights.push(weight);
        self.caps.push(cap);
    }
}

/// A cluster of the cut, or a light.
#[derive(Clone, Copy, Debug)]
pub(super) enum Entry<V> {
    Light(Picked),
    Cluster(Place<V>),
}

/// An opened cluster whose children are still to be looked at.
#[derive(Clone, Copy, Debug)]
struct Opened<V> {
    place: Place<V>,
    /// How many legs of the wanted route lie behind; `None` off the route.
    leg: Option<usize>,
    /// Its importance while it was closed.
    weight: f64,
    /// From 0, barely open, to 1: how much the children's own importances count.
    opened: f64,
    /// The most samples it could get while it was closed.
    cap: f64,
}

/// A cut with its samples allotted.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cut {
    /// How many samples the viewer gets. The chances of the entries are in the scratch: `low` if it
    /// is the lower whole number, `high` if it is one more.
    pub rounded: Rounded,
    /// The entry that leads to the wanted emitter, and how many legs of its route lie behind.
    pub wanted: Option<(usize, usize)>,
}

impl FrameTree<'_> {
    /// Opens the tree for a viewer and allots samples to the entries of the cut. `None` if nothing
    /// can arrive. Given a route, tells which entry leads along it.
    pub(super) fn cut<V: Viewer>(
        &self,
        viewer: &V,
        beside: &[f64],
        how: &Splitting,
        route: Option<&Route>,
        scratch: &mut Scratch<V>,
    ) -> Option<Cut> {
        scratch.clear();
        for (row, &importance) in (0..).zip(beside) {
            scratch.push(Entry::Light(Picked::Beside(row)), importance, 1.0);
        }
        let (mut variance, mut wanted) = (0.0, None);
        let weight = self.total_importance(viewer);
        if let Some(place) = self.place_of_root(viewer)
            && weight > 0.0
        {
            let leg = route.map(|_| 0);
            if how.is_off() {
                wanted = leg.map(|leg| (scratch.entries.len(), leg));
                // What is hidden, not linked or measured is known of the root's children, not of the root.
                let is_known = (V::IS_LINKED && self.links.is_some()) || self.fields.is_some();
                let may_be = self.veils.is_some() || is_known;
                let known = if may_be { self.weigh(&place) } else { None };
                let known = known.filter(|weighed| weighed.veils.is_some() || is_known);
                let weight = known.map_or(weight, |weighed| weighed.importances.iter().sum());
                scratch.push(Entry::Cluster(place), weight, 1.0);
            } else {
                scratch.open.push(Opened { place, leg, weight, opened: 1.0, cap: 1.0 });
                (variance, wanted) = self.open_clusters(beside, how, route, scratch);
            }
        }
        let Scratch { weights, caps, low, high, .. } = scratch;
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

    /// Works off the opened clusters: opens further, or adds entries. Returns the variance that the
    /// entries leave, in the unit of importances, and the entry that leads along the route.
    fn open_clusters<V: Viewer>(
        &self,
        beside: &[f64],
        how: &Splitting,
        route: Option<&Route>,
        scratch: &mut Scratch<V>,
    ) -> (f64, Option<(usize, usize)>) {
        let (mut variance, mut wanted) = (0.0, None);
        let mut may_open = true;
        // The sum of everything's importance; the root's children know it better than the root.
        let mut total = None;
        while let Some(Opened { place, leg, weight, opened, cap }) = scratch.open.pop() {
            let Some(Weighed { group, importances, spreads, veils }) = self.weigh(&place) else {
                continue;
            };
            scratch.weighed += 1;
            let sum: f64 = importances.iter().sum();
            if !(sum > 0.0 && sum.is_finite()) {
                continue;
            }
            let total = *total.get_or_insert_with(|| sum + beside.iter().sum::<f64>());
            let scale = if opened < 1.0 { opened + (1.0 - opened) * weight / sum } else { 1.0 };
            let on_route = leg.and_then(|leg| {
                let slot = route?.slots[leg];
                match (slot / WIDTH as u32).checked_sub(place.at)? {
                    0 => Some((slot as usize % WIDTH, leg + 1)),
                    distance => Some((lane_toward(group, distance)?, leg)),
                }
            });
            for lane in (0..WIDTH).filter(|&lane| importances[lane] > 0.0) {
                let weight = importances[lane] * scale;
                // Barely open, the children together get no more samples than their parent could.
                let cap = opened + (1.0 - opened) * cap * importances[lane] / sum;
                let leg = on_route.filter(|&(own, _)| own == lane).map(|(_, leg)| leg);
                let entry = match self.follow(&place, group, lane) {
                    None => continue,
                    Some(Next::Emitter(emitter)) => Entry::Light(Picked::Emitter(emitter)),
                    Some(Next::Group(mut below)) => {
                        below.veil = veils.map_or(1.0, |veils| veils[lane]);
                        let part = weight * f64::from(spreads[lane]);
                        let excess = match how.test {
                            _ if how.is_full() => 1.0,
                            SplitTest::Variance => part / (how.threshold() * total) - 1.0,
                            SplitTest::SolidAngle => {
                                let glare = place.viewer.glare(&group.cluster(lane));
                                f64::from(u8::from(glare > how.threshold()))
                            }
                        };
                        if may_open && excess > 0.0 {
                            let further = opened * excess.min(1.0);
                            variance += (opened - further) * part;
                            let opened = further;
                            scratch.open.push(Opened { place: below, leg, weight, opened, cap });
                            continue;
                        }
                        variance += opened * part;
                        Entry::Cluster(below)
                    }
                };
                if let Some(leg) = leg {
                    wanted = Some((scratch.entries.len(), leg));
                }
                scratch.push(entry, weight, cap);
            }
            // The seed's rule samples all of the cut: there its size is what is capped.
            may_open &= how.test == SplitTest::Variance
                || scratch.entries.len() + WIDTH * (scratch.open.len() + 1) <= how.most as usize;
        }
        (variance, wanted)
    }
}

impl Cut {
    /// The chances of all entries in a draw of `low` samples, or of one more.
    pub fn chances<'s, V>(&self, scratch: &'s Scratch<V>, more: bool) -> &'s [f64] {
        if more { &scratch.high } else { &scratch.low }
    }

    /// What a sample of an entry is divided by, given the entry's chance in the draw. Normally that
    /// chance: it adds no noise of its own. Where one sample more would at least double the chance,
    /// it is the mean of both draws instead: no sample then weighs more than twice its mean weight.
    /// Either way the estimate keeps its mean.
    pub fn divisor<V>(&self, scratch: &Scratch<V>, entry: usize, chance: f64) -> f64 {
        let is_even =
            self.rounded.chance_of_more <= 0.0 || 2.0 * scratch.low[entry] >= scratch.high[entry];
        if is_even { chance } else { self.expected(scratch, entry) }
    }

    /// The chance of an entry over both draws.
    pub fn expected<V>(&self, scratch: &Scratch<V>, entry: usize) -> f64 {
        let more = self.rounded.chance_of_more;
        let high = if more > 0.0 { more * scratch.high[entry] } else { 0.0 };
        (1.0 - more) * scratch.low[entry] + high
    }
}
