//! Where a walk stands, and the one function that weighs what it can choose from there.
//!
//! A walk crosses spaces: it begins in world space, and below a leaf that stands for an instance it
//! goes on in the space of the instance's own tree. There lengths have another unit, and the energies
//! are those at which the tree was built, not those at which this instance shines. Neither matters
//! for a choice between siblings; both matter as soon as importances of different spaces are
//! compared, as [the cut](super::cut) does. So a [`Place`] carries the factor that turns importances
//! of its space into the world's, and [`FrameTree::weigh`] applies it. Nothing else weighs lanes:
//! sampling, probabilities, cuts and variances cannot disagree.

use super::group::{Group, WIDTH};
use super::node::Link;
use super::sampling::FrameTree;
use super::splitting::BELOW_ONE;
use super::veil::Cell;
use super::viewer::Viewer;
use crate::math::built_in;

/// A group of a tree, and the viewer in that tree's space.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place<V> {
    /// Row of the tree.
    pub row: u32,
    /// Number of the group.
    pub at: u32,
    /// The tree's emitters are numbered from here on.
    pub first_emitter: u32,
    /// What an importance in this space is worth in world space.
    pub unit: f64,
    /// The weight of a lane of which no more is known: that of the last one on the way of which more is.
    pub veil: f32,
    pub viewer: V,
}

/// Where a lane leads.
pub(super) enum Next<V> {
    Emitter(u32),
    Group(Place<V>),
}

/// The same, before anything is done to go there: no viewer is copied, and no instance entered.
pub(super) enum Step {
    Emitter(u32),
    Cluster(Way),
}

/// The way to a cluster from a place in the tree that its parent is in.
#[derive(Clone, Copy, Debug)]
pub(super) enum Way {
    /// The group of that number, in the same tree.
    Group(u32),
    /// Into an instance of an earlier tree, by its row and the energy of the leaf that stands for it.
    Instance(u32, f32),
}

/// The children of a cluster as one viewer sees them.
pub(super) struct Weighed<'a> {
    pub group: &'a Group,
    /// In world space's unit; 0 only where provably no light arrives, or only from lights that do not light the
    /// viewer's class.
    pub importances: [f64; WIDTH],
    /// How uncertain each is: the squared relative deviation of what its emitters send.
    pub spreads: [f32; WIDTH],
    /// The weight of what is known to be hidden, which the two contain; if anything is known.
    pub veils: Option<[f32; WIDTH]>,
}

impl FrameTree<'_> {
    /// Weighs the lanes of the group at a place; `None` if there is no such group, which only an
    /// unverified file can make happen.
    #[inline]
    pub(super) fn weigh<V: Viewer>(&self, place: &Place<V>) -> Option<Weighed<'_>> {
        let group = self.groups.get(place.at as usize)?;
        let (mut importances, spreads) = group.weigh(&place.viewer);
        if V::IS_ORIENTED
            && built_in::PROFILES
            && let Some(fields) = &self.fields
        {
            fields.weigh(self, place, &mut importances);
        }
        if built_in::INSTANCES && place.unit != 1.0 {
            importances.iter_mut().for_each(|importance| *importance *= place.unit);
        }
        let veils = self
            .veils
            .filter(|_| built_in::VISIBILITY && place.viewer.cell() != Cell::NONE)
            .map(|veils| {
                let weights = veils.weights(place.viewer.cell(), place.at);
                let weights = weights.unwrap_or([place.veil; WIDTH]);
                for (lane, weight) in weights.into_iter().enumerate() {
                    importances[lane] *= f64::from(weight);
                }
                weights
            });
        if V::IS_LINKED
            && let Some(links) = &self.links
        {
            links.weigh(place.viewer.class(), place.at, &mut importances);
        }
        Some(Weighed { group, importances, spreads, veils })
    }

    pub(super) fn place_of_root<V: Viewer>(&self, viewer: &V) -> Option<Place<V>> {
        self.place_in(self.root?, viewer)
    }

    /// The root of a tree in world space.
    pub(super) fn place_in<V: Viewer>(&self, row: u32, viewer: &V) -> Option<Place<V>> {
        let at = self.trees.get(row as usize)?.first_group;
        Some(Place { row, at, first_emitter: 0, unit: 1.0, veil: 1.0, viewer: *viewer })
    }

    /// The root of a forced light. No importance there is ever compared with one elsewhere, so its
    /// unit stays its own.
    /// `None` if the light does not light the viewer's class.
    pub(super) fn place_of_forced<V: Viewer>(&self, light: usize, viewer: &V) -> Option<Place<V>> {
        if V::IS_LINKED
            && let Some(links) = &self.links
        {
            links.lights_from_forced(viewer.class(), light).then_some(())?;
        }
        let instance = self.instances.get(self.forced.get(light)?.instance as usize)?;
        let tree = self.trees.get(instance.tree as usize)?;
        Some(Place {
            row: instance.tree,
            at: tree.first_group,
            first_emitter: instance.first_emitter,
            unit: 1.0,
            veil: 1.0,
            viewer: viewer.within(&instance.to_local),
        })
    }

    /// All places of the tree whose root a walk stands at, that one first, each before those below it.
    pub(super) fn groups_below<V: Viewer>(
        &self,
        root: &Place<V>,
    ) -> impl Iterator<Item = Place<V>> + use<V> {
        let root = *root;
        let count = self.trees[root.row as usize].group_count;
        (0..count).map_while(move |ahead| Some(Place { at: root.at.checked_add(ahead)?, ..root }))
    }

    /// Where a lane of the group at a place leads; `None` if its link lies. Every walk ends, whatever
    /// the bytes: links lead onwards within a tree, and to earlier trees.
    #[inline]
    pub(super) fn follow<V: Viewer>(
        &self,
        place: &Place<V>,
        group: &Group,
        lane: usize,
    ) -> Option<Next<V>> {
        match self.step(place, group, lane)? {
            Step::Emitter(emitter) => Some(Next::Emitter(emitter)),
            Step::Cluster(way) => self.go(place, way).map(Next::Group),
        }
    }

    /// The first half of [`follow`](Self::follow).
    #[inline]
    pub(super) fn step<V>(&self, place: &Place<V>, group: &Group, lane: usize) -> Option<Step> {
        match group.link(lane) {
            Link::Inner(ahead) => Some(Step::Cluster(Way::Group(place.at.checked_add(ahead)?))),
            Link::Emitter(own) => {
                let emitter = place.first_emitter.checked_add(own)?;
                (emitter < self.emitter_count).then_some(Step::Emitter(emitter))
            }
            Link::Instance(row) if built_in::INSTANCES => {
                Some(Step::Cluster(Way::Instance(row, group.energy(lane))))
            }
            Link::Instance(_) | Link::Nothing => None,
        }
    }

    /// The other half, from any place in the tree.
    #[inline]
    pub(super) fn go<V: Viewer>(&self, from: &Place<V>, way: Way) -> Option<Place<V>> {
        match way {
            Way::Group(at) => Some(Place { at, ..*from }),
            Way::Instance(row, energy) => self.enter(from, row, energy),
        }
    }

    /// The root of an instance of an earlier tree, given the energy of the leaf that stands for it.
    fn enter<V: Viewer>(&self, from: &Place<V>, instance: u32, energy: f32) -> Option<Place<V>> {
        let instance = self.instances.get(instance as usize)?;
        let row = Some(instance.tree).filter(|&row| row < from.row)?;
        let tree = self.trees.get(row as usize)?;
        // An energy is a radiance times an area: in a space whose lengths are `scale` times as long
        // it is `scale^2` times as large.
        let scale = f64::from(instance.to_local.scale());
        let brighter = f64::from(energy) * scale * scale / f64::from(tree.root.energy());
        let unit = from.unit * brighter * from.viewer.unit_of_importance(scale);
        let viewer = from.viewer.within(&instance.to_local);
        (unit > 0.0 && unit.is_finite()).then_some(Place {
            row,
            at: tree.first_group,
            first_emitter: instance.first_emitter,
            unit,
            veil: from.veil,
            viewer,
        })
    }
}

/// A choice between the lanes of a group, of which at least one has an importance.
pub(super) struct Choice<'a> {
    pub group: &'a Group,
    pub of_lane: [f64; WIDTH],
    /// Where each lane's stretch ends, all laid out along a line.
    ends: [f64; WIDTH],
}

impl<'a> Weighed<'a> {
    /// The choice between the lanes; `None` if nothing arrives from any.
    #[inline]
    pub fn choice(self) -> Option<Choice<'a>> {
        let Weighed { group, importances: of_lane, .. } = self;
        let ends = running_sums(&of_lane);
        let total = ends[WIDTH - 1];
        (total > 0.0 && total.is_finite()).then_some(Choice { group, of_lane, ends })
    }
}

impl Choice<'_> {
    /// The probability of a lane.
    #[inline]
    pub fn share(&self, lane: usize) -> f64 {
        self.of_lane[lane] / self.ends[WIDTH - 1]
    }

    /// Chooses a lane by its share, and returns what is left of the random number.
    #[inline]
    pub fn choose(&self, u: f64) -> (usize, f64) {
        let target = u * self.ends[WIDTH - 1];
        // The first that ends beyond the target has a weight; rounding may leave none.
        let before: usize = self.ends.iter().map(|&end| usize::from(end <= target)).sum();
        let lane = if before < WIDTH { before } else { self.last() };
        let begin = self.ends[lane] - self.of_lane[lane];
        (lane, ((target - begin) / self.of_lane[lane]).clamp(0.0, BELOW_ONE))
    }

    #[cold]
    fn last(&self) -> usize {
        self.of_lane.iter().rposition(|&weight| weight > 0.0).unwrap_or(0)
    }
}

/// The sums of the first one, two, ... eight numbers, none negative: by halves, which wait for three
/// additions and not for eight. They never fall, and stay where a number is zero.
#[inline(always)]
fn running_sums(of: &[f64; WIDTH]) -> [f64; WIDTH] {
    let [a, b, c, d, e, f, g, h] = *of;
    let (ab, cd, ef, gh) = (a + b, c + d, e + f, g + h);
    let abcd = ab + cd;
    [a, ab, ab + c, abcd, abcd + e, abcd + ef, abcd + (ef + g), abcd + (ef + gh)]
}
