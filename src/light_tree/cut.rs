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
//!
//! Where it is known what is [hidden](super::veil), entries of which next to nothing is seen keep a chance, since
//! nobody can be sure. But they mostly give nothing, so a sample that goes there is missing elsewhere, by chance: noise
//! that the same scene without the hidden light does not have. So they are *late*: the others get a whole number of
//! samples, and the late ones get theirs beyond it.

use super::group::WIDTH;
use super::leaves::{Route, lane_toward};
use super::place::{Place, Step, Way, Weighed};
use super::sampling::FrameTree;
use super::splitting::{Rounded, SplitTest, Splitting, allot};
use super::veil::Cell;
use super::viewer::Viewer;
use crate::math::built_in;

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
/// An entry with a smaller weight is late: less than a quarter of it is seen. By measurement: see `docs/visibility.md`.
const LATE: f64 = 0.5;

/// Buffers for a cut and for walks below it, to be reused.
#[derive(Debug)]
pub struct Scratch<V> {
    pub(super) entries: Vec<Entry>,
    /// The spaces of the entries: in each, the place where the walk came into it. Entries refer to them, because a
    /// viewer is large, and few clusters are ever looked into.
    spaces: Vec<Place<V>>,
    /// Of each entry: its importance.
    weights: Vec<f64>,
    /// Of each entry: the most samples that it may get.
    caps: Vec<f64>,
    pub(super) low: Vec<f64>,
    pub(super) high: Vec<f64>,
    /// Of each entry whether it is late; nothing if none is.
    pub(super) late: Vec<bool>,
    /// Of each entry its weight, or 0 if it is late; and its chance if none were late.
    early: Vec<f64>,
    shared: Vec<f64>,
    open: Vec<Opened>,
    /// Groups weighed since it was made: what picking costs.
    pub weighed: u64,
}

impl<V> Default for Scratch<V> {
    fn default() -> Self {
        let (weights, caps, low, high) = Default::default();
        let (entries, spaces, late, early, shared, open) = Default::default();
        let weighed = 0;
        Scratch { entries, spaces, weights, caps, low, high, late, early, shared, open, weighed }
    }
}

impl<V> Scratch<V> {
    fn clear(&mut self) {
        self.entries.clear();
        self.spaces.clear();
        self.weights.clear();
        self.caps.clear();
        self.late.clear();
        self.open.clear();
    }

    fn push(&mut self, entry: Entry, weight: f64, cap: f64) {
        self.entries.push(entry);
        self.weights.push(weight);
        self.caps.push(cap);
    }
}

impl<V> Scratch<V> {
    /// Allots about `worth` samples: to each late entry what it would get if none was late, to the others a whole
    /// number, which is drawn. Late entries have the same chance in either draw. `None` if there are no others, or
    /// there may be more than `most` samples.
    fn allot_early(&mut self, worth: f64, most: u32) -> Option<Rounded> {
        let Scratch { weights, caps, low, high, late, early, shared, .. } = self;
        early.clear();
        early.extend(weights.iter().zip(&*late).map(|(&w, &late)| if late { 0.0 } else { w }));
        early.iter().any(|&weight| weight > 0.0).then_some(())?;
        allot(weights, caps, worth, shared);
        let [mut of_early, mut of_late] = [0.0; 2];
        for (chance, &late) in shared.iter().zip(&*late) {
            *(if late { &mut of_late } else { &mut of_early }) += chance;
        }
        let rounded = Rounded::new(of_early.max(1.0));
        if f64::from(rounded.low) + 1.0 + of_late.ceil() > f64::from(most) {
            return None;
        }
        for (count, chances) in [(rounded.low, low), (rounded.low + 1, high)] {
            allot(early, caps, count.into(), chances);
            for (at, chance) in chances.iter_mut().enumerate().filter(|(at, _)| late[*at]) {
                *chance = shared[at];
            }
        }
        Some(rounded)
    }
}

/// A cluster of the cut, or a light.
#[derive(Clone, Copy, Debug)]
pub(super) enum Entry {
    Light(Picked),
    Cluster(Stop),
}

/// Where a cluster of the cut is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stop {
    /// The space of its parent.
    space: u32,
    /// The [weight](Place::veil) of its lanes of which no more is known.
    veil: f32,
    /// From there.
    way: Way,
}

/// An opened cluster whose children are still to be looked at.
#[derive(Clone, Copy, Debug)]
struct Opened {
    stop: Stop,
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
        let knows = !how.is_off() && self.veils.is_some() && viewer.cell() != Cell::NONE;
        for (row, &importance) in (0..).zip(beside) {
            scratch.push(Entry::Light(Picked::Beside(row)), importance, 1.0);
            if knows {
                scratch.late.push(self.weight_beside(viewer.cell(), row as usize) < LATE);
            }
        }
        let (mut variance, mut wanted) = (0.0, None);
        if let Some(place) = self.place_of_root(viewer) {
            let leg = route.map(|_| 0);
            let stop = Stop { space: 0, veil: place.veil, way: Way::Group(place.at) };
            scratch.spaces.push(place);
            if !how.is_off() {
                scratch.open.push(Opened { stop, leg, weight: 1.0, opened: 1.0, cap: 1.0 });
                (variance, wanted) = self.open_clusters(beside, how, route, scratch);
            } else {
                let weight = self.weight_of_root(&place);
                if weight > 0.0 {
                    wanted = leg.map(|leg| (scratch.entries.len(), leg));
                    scratch.push(Entry::Cluster(stop), weight, 1.0);
                }
            }
        }
        let total: f64 = scratch.weights.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        let alive = scratch.weights.iter().filter(|&&weight| weight > 0.0).count();
        let worth = how.worth(variance / total + UNKNOWN, alive);
        if scratch.late.contains(&true)
            && worth < alive as f64
            && let Some(rounded) = scratch.allot_early(worth, how.most)
        {
            return Some(Cut { rounded, wanted });
        }
        scratch.late.clear();
        let Scratch { weights, caps, low, high, .. } = scratch;
        let rounded = Rounded::new(worth);
        allot(weights, caps, rounded.low.into(), low);
        if rounded.chance_of_more > 0.0 {
            allot(weights, caps, (rounded.low + 1).into(), high);
        }
        Some(Cut { rounded, wanted })
    }

    /// The importance of everything in the tree; 0 if nothing of it can arrive.
    fn weight_of_root<V: Viewer>(&self, place: &Place<V>) -> f64 {
        // What is hidden, not linked or measured is known of the root's children, not of the root.
        let is_known =
            (V::IS_LINKED && self.links.is_some()) || (built_in::PROFILES && self.fields.is_some());
        let may_be = (built_in::VISIBILITY && self.veils.is_some()) || is_known;
        let known = if may_be { self.weigh(place) } else { None };
        let known = known.filter(|weighed| weighed.veils.is_some() || is_known);
        known.map_or_else(
            || self.total_importance(&place.viewer),
            |weighed| weighed.importances.iter().sum(),
        )
    }

    /// The place of a cluster of the cut; `None` only in an unverified file.
    #[inline]
    pub(super) fn place_at<V: Viewer>(&self, stop: Stop, scratch: &Scratch<V>) -> Option<Place<V>> {
        let from = &scratch.spaces[stop.space as usize];
        let place = self.go(from, stop.way)?;
        Some(Place { veil: stop.veil, ..place })
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
        while let Some(Opened { stop, leg, weight, opened, cap }) = scratch.open.pop() {
            let Some(place) = self.place_at(stop, scratch) else { continue };
            let mut space = stop.space;
            if let Way::Instance(..) = stop.way {
                space = scratch.spaces.len() as u32;
                scratch.spaces.push(place);
            }
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
                let entry = match self.step(&place, group, lane) {
                    None => continue,
                    Some(Step::Emitter(emitter)) => Entry::Light(Picked::Emitter(emitter)),
                    Some(Step::Cluster(way)) => {
                        let stop =
                            Stop { space, veil: veils.map_or(1.0, |veils| veils[lane]), way };
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
                            scratch.open.push(Opened { stop, leg, weight, opened, cap });
                            continue;
                        }
                        variance += opened * part;
                        Entry::Cluster(stop)
                    }
                };
                if let Some(leg) = leg {
                    wanted = Some((scratch.entries.len(), leg));
                }
                scratch.push(entry, weight, cap);
                if let Some(veils) = veils {
                    scratch.late.push(f64::from(veils[lane]) < LATE);
                }
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
