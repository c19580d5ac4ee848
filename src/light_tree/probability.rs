//! The probability with which a viewer picks a given emitter.
//!
//! Multiple importance sampling asks for it when a reflected ray hits an emitter. The walk from the
//! root to the emitter's leaf is known, because groups stand in preorder: the next child is the last
//! one that begins at or before the leaf. No bit trail is stored, and depth has no limit. Every
//! decision on the way is weighed by the function that picks, so both agree to the last bit.

use super::group::WIDTH;
use super::leaves::{Route, find_placed, lane_toward};
use super::node::Link;
use super::place::{Next, Place, Weighed};
use super::sampling::FrameTree;
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

    /// Calls `visit` with every emitter that may be picked for a viewer, and its
    /// [`probability`](FrameTree::probability). One walk finds all. Forced lights are left out.
    pub fn for_each_probability(&self, viewer: &impl Viewer, mut visit: impl FnMut(u32, f64)) {
        let mut open: Vec<_> =
            self.place_of_root(viewer).map(|root| (root, 1.0)).into_iter().collect();
        let mut reached = Vec::new();
        while let Some((root, probability)) = open.pop() {
            reached.clear();
            reached.push(probability);
            // Groups stand in preorder: when one is met, the way to it has been.
            for (at, place) in self.groups_below(&root).enumerate() {
                let before = reached.get(at).copied().unwrap_or(0.0);
                if before <= 0.0 {
                    continue;
                }
                let Some(choice) = self.weigh(&place).and_then(Weighed::choice) else { continue };
                for lane in (0..WIDTH).filter(|&lane| choice.of_lane[lane] > 0.0) {
                    let probability = before * choice.share(lane);
                    if let Link::Inner(ahead) = choice.group.link(lane) {
                        let below = at + ahead as usize;
                        if below < self.groups.len() {
                            reached.resize(reached.len().max(below + 1), 0.0);
                            reached[below] = probability;
                        }
                        continue;
                    }
                    match self.follow(&place, choice.group, lane) {
                        Some(Next::Emitter(emitter)) => visit(emitter, probability),
                        Some(Next::Group(below)) => open.push((below, probability)),
                        None => {}
                    }
                }
            }
        }
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

    /// The probability of a descent from a place to the end of a route, of which `legs` legs lie behind.
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
                let choice = self.weigh(&place)?.choice()?;
                let is_last = place.at == target;
                let lane = match is_last {
                    true => slot as usize % WIDTH,
                    false => lane_toward(choice.group, target.checked_sub(place.at)?)?,
                };
                probability *= choice.share(lane);
                match self.follow(&place, choice.group, lane)? {
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
