//! The way back: how probable it is that a viewer picks an emitter.
//!
//! When a reflected ray hits an emitter, its weight asks how often the emitter would have been picked
//! from the point before. The walk from the root to the emitter's leaf is known, because groups
//! stand in preorder: there is no bit trail to store, and no depth at which it ends. Along it every
//! decision is weighed by the code that picks, so both agree to the last bits.

use super::group::WIDTH;
use super::leaves::{Route, find_placed, lane_toward};
use super::sampling::{FrameTree, Next, Place, Weights};
use super::viewer::Viewer;

impl FrameTree<'_> {
    /// The probability with which [`sample`](FrameTree::sample), or
    /// [`sample_forced`](FrameTree::sample_forced) if its light is forced, picks an emitter for a
    /// viewer; 0 for one that it never picks.
    pub fn probability(&self, viewer: &impl Viewer, emitter: u32) -> f64 {
        let probability = if emitter >= self.unforced_count() {
            self.probability_of_forced(viewer, emitter)
        } else {
            let place = self.place_of_root(viewer);
            place.and_then(|place| self.walk(place, &self.route(emitter)?, 0))
        };
        probability.unwrap_or(0.0)
    }

    pub(super) fn route(&self, emitter: u32) -> Option<Route> {
        self.table.route(self.own.as_ref(), self.instances, emitter)
    }

    fn probability_of_forced(&self, viewer: &impl Viewer, emitter: u32) -> Option<f64> {
        let placed = find_placed(&self.forced, emitter)?;
        let light = self.forced.iter().position(|forced| forced.instance == placed.instance)?;
        let slot = self.table.in_shared(self.instances, placed, emitter)?;
        let route = Route { slots: [slot; 3], count: 1 };
        self.walk(self.place_of_forced(light, viewer)?, &route, 0)
    }

    /// The probability of a descent from a place to the end of a route, so many of whose legs lie
    /// behind.
    pub(super) fn walk<V: Viewer>(
        &self,
        mut place: Place<V>,
        route: &Route,
        legs: usize,
    ) -> Option<f64> {
        let mut probability = 1.0;
        for (leg, &slot) in route.slots[..route.count].iter().enumerate().skip(legs) {
            let target = slot / WIDTH as u32;
            loop {
                let group = self.group(&place)?;
                let is_last = place.at == target;
                let lane = match is_last {
                    true => slot as usize % WIDTH,
                    false => lane_toward(group, target.checked_sub(place.at)?)?,
                };
                probability *= Weights::of(group, &place.viewer)?.share(lane);
                match self.follow(&place, group.link(lane))? {
                    Next::Group(next) => place = next,
                    Next::Emitter(_) if is_last && leg + 1 == route.count => {
                        return Some(probability);
                    }
                    Next::Emitter(_) => return None,
                }
                if is_last {
                    break;
                }
            }
        }
        None
    }
}
