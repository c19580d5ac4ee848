//! Picking several lights for a viewer: the samples that its cut allots.

use super::cut::{Cut, Entry, Picked, Scratch};
use super::sampling::{FrameTree, Pick};
use super::splitting::{Splitting, comb};
use super::viewer::Viewer;
use crate::math::random::hash;

impl FrameTree<'_> {
    /// Calls `visit` with the picks for a viewer: emitters of the tree, and lights beside it, given by
    /// their importances. None is picked twice, and there are at most [`most`](Splitting::most).
    ///
    /// `u` is a random number in `[0, 1)`. Each cluster shifts it by a hash of `salt`. Use one salt for
    /// all samples of a place, so that they stay stratified within each cluster, and another salt for
    /// another place.
    pub fn for_each_pick<V: Viewer>(
        &self,
        viewer: &V,
        beside: &[f64],
        how: &Splitting,
        (u, salt): (f64, u32),
        scratch: &mut Scratch<V>,
        mut visit: impl FnMut(Pick),
    ) {
        let Some(cut) = self.cut(viewer, beside, how, None, scratch) else { return };
        let scratch = &*scratch;
        let (count, u) = cut.rounded.draw(u);
        let chances = cut.chances(scratch, count > cut.rounded.low);
        let one = count == 1 && scratch.late.is_empty();
        for (entry, leftover) in comb(chances, &scratch.late, u) {
            let u = if one { leftover } else { another(leftover, salt, entry as u32) };
            if let Some(pick) = self.pick_in(&cut, scratch, entry, chances[entry], u) {
                visit(pick);
            }
        }
    }

    /// Picks a light of an entry that has been taken with some chance.
    fn pick_in<V: Viewer>(
        &self,
        cut: &Cut,
        scratch: &Scratch<V>,
        entry: usize,
        chance: f64,
        u: f64,
    ) -> Option<Pick> {
        let expected = cut.expected(scratch, entry);
        let probability = cut.divisor(scratch, entry, chance);
        match scratch.entries[entry] {
            Entry::Light(light) => {
                Some(Pick { light, probability, expected, leftover: u, weighed: 0 })
            }
            Entry::Cluster(stop) => {
                let pick = self.descend(self.place_at(stop, scratch)?, u)?;
                Some(Pick {
                    probability: pick.probability * probability,
                    expected: pick.probability * expected,
                    ..pick
                })
            }
        }
    }

    /// The expected number of samples that [`for_each_pick`](Self::for_each_pick) takes of a light. A
    /// forced light is not among its picks: for an emitter of one, this is the probability of the
    /// emitter within its light.
    pub fn expected<V: Viewer>(
        &self,
        viewer: &V,
        beside: &[f64],
        how: &Splitting,
        light: Picked,
        scratch: &mut Scratch<V>,
    ) -> f64 {
        self.try_expected(viewer, beside, how, light, scratch).unwrap_or(0.0)
    }

    fn try_expected<V: Viewer>(
        &self,
        viewer: &V,
        beside: &[f64],
        how: &Splitting,
        light: Picked,
        scratch: &mut Scratch<V>,
    ) -> Option<f64> {
        let emitter = match light {
            Picked::Beside(row) => {
                let cut = self.cut(viewer, beside, how, None, scratch)?;
                return Some(cut.expected(scratch, row as usize));
            }
            Picked::Emitter(emitter) if emitter >= self.unforced_count() => {
                return Some(self.probability(viewer, emitter));
            }
            Picked::Emitter(emitter) => emitter,
        };
        let route = self.route(emitter)?;
        let cut = self.cut(viewer, beside, how, Some(&route), scratch)?;
        let (entry, leg) = cut.wanted?;
        let below = match scratch.entries[entry] {
            Entry::Light(found) => f64::from(u8::from(found == light)),
            Entry::Cluster(stop) => self.walk(self.place_at(stop, scratch)?, &route, leg)?,
        };
        Some(cut.expected(scratch, entry) * below)
    }
}

/// Shifts a number for one cluster, modulo 1 (a Cranley-Patterson rotation). The shift depends on the
/// place alone, so that stratified numbers stay stratified.
#[inline]
fn another(u: f64, salt: u32, entry: u32) -> f64 {
    let turned = u + f64::from(hash(salt, entry)) / 4_294_967_296.0;
    if turned >= 1.0 { turned - 1.0 } else { turned }
}
