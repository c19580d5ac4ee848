//! Picking one emitter for a viewer.
//!
//! A descent starts at the root. At each group a child is chosen with probability `I / sum of I`, and
//! the one random number is stretched after each choice (seed, "Method overview"). Taking more than
//! one sample is in [`picks`](super::picks). [`probability`](super::probability) tells how likely a
//! pick was. Depth has no limit.

use super::cut::Picked;
use super::far_field::FrameFields;
use super::group::Group;
use super::leaves::{LeafTable, Leaves, Placed};
use super::linking::FrameLinks;
use super::node::{Link, Node};
use super::place::{Next, Place, Weighed};
use super::records::{InstanceRow, LightRow, TreeRow};
use super::tree::{LightTree, NoSuchFrame};
use super::veil::{Cell, Veils};
use super::viewer::Viewer;
use crate::math::built_in;
use std::sync::Arc;

/// One light, picked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pick {
    /// Which.
    pub light: Picked,
    /// The divisor of its contribution: the probability of the pick, given the number of samples that
    /// was drawn. Positive.
    pub probability: f64,
    /// The expected number of samples of it over all draws: the weight of light sampling in multiple
    /// importance sampling. Positive; equals `probability` without splitting.
    pub expected: f64,
    /// The rest of the random number: uniform in `[0, 1)` and independent of the pick.
    pub leftover: f64,
    /// Groups that the descent weighed.
    pub weighed: u32,
}

/// The tree of one frame, ready to be sampled.
#[derive(Clone)]
pub struct FrameTree<'a> {
    pub(super) groups: &'a [Group],
    pub(super) trees: &'a [TreeRow],
    pub(super) instances: &'a [InstanceRow],
    pub(super) root: Option<u32>,
    /// The tree of what stands still.
    pub(super) still: Option<u32>,
    pub(super) table: &'a LeafTable,
    /// The leaves of the frame's own tree, if things change.
    pub(super) own: Option<Leaves>,
    /// Forced lights, in the order of their emitters.
    pub(super) forced: Vec<Placed>,
    pub(super) emitter_count: u32,
    /// What is known to be hidden.
    pub(super) veils: Option<Veils<'a>>,
    /// Which lights light which receivers.
    pub(super) links: Option<Arc<FrameLinks>>,
    /// Which lights tell their intensity by direction.
    pub(super) fields: Option<FrameFields<'a>>,
    /// The first emitter of a forced light, if there is one.
    unforced_count: u32,
}

impl<D: AsRef<[u8]>> LightTree<D> {
    /// The tree of a frame.
    ///
    /// # Errors
    /// [`NoSuchFrame`] if lights change and the file was built without this frame.
    pub fn at_frame(&self, frame: i32) -> Result<FrameTree<'_>, NoSuchFrame> {
        let (root, forced) = self.roots_at(frame)?;
        let root = root.filter(|&row| (row as usize) < self.trees().len());
        let changing = self.first_of_class(LightRow::CHANGES);
        let placed = self.first_of_class(LightRow::CHANGES | LightRow::PLACED);
        let own = root.filter(|_| built_in::MOTION && !self.frames().is_empty());
        let own = own.map(|row| self.leaves_of(&self.trees()[row as usize], changing..placed));
        let forced = forced.iter().filter_map(|&instance| {
            let row = self.instances().get(instance as usize)?;
            Some(Placed { first_emitter: row.first_emitter, instance, slot: 0 })
        });
        Ok(FrameTree {
            groups: self.groups(),
            trees: self.trees(),
            instances: self.instances(),
            root,
            still: self.still_tree(),
            table: self.leaf_table(),
            own,
            forced: forced.collect(),
            emitter_count: self.emitter_count() as u32,
            veils: None,
            links: None,
            fields: None,
            unforced_count: self.first_of_class(LightRow::FORCED),
        })
    }
}

impl<'a> FrameTree<'a> {
    /// The same tree, weighed by what is known to be hidden from [veiled](super::Veiled) viewers.
    pub fn veiled(self, veils: Veils<'a>) -> FrameTree<'a> {
        FrameTree { veils: Some(veils), ..self }
    }

    /// The weight of a light beside the tree in a cell: 1 if nothing is known.
    #[inline]
    pub fn weight_beside(&self, cell: Cell, row: usize) -> f64 {
        self.veils.map_or(1.0, |veils| veils.weight_beside(cell, row))
    }
}

impl FrameTree<'_> {
    /// Picks an emitter with a random number in `[0, 1)`; `None` where nothing can arrive. A descent
    /// may find that out only at a leaf, whose bounds are tighter than those above it.
    pub fn sample(&self, viewer: &impl Viewer, u: f64) -> Option<Pick> {
        self.descend(self.place_of_root(viewer)?, u)
    }

    /// Picks an emitter of a forced light, by its number among the forced lights; `None` if nothing can arrive.
    pub fn sample_forced(&self, light: usize, viewer: &impl Viewer, u: f64) -> Option<Pick> {
        self.descend(self.place_of_forced(light, viewer)?, u)
    }

    /// The number of emitters that are not forced. Forced ones are numbered after them.
    pub fn unforced_count(&self) -> u32 {
        self.unforced_count
    }

    /// The number of forced lights: each is sampled at every point, besides what is picked.
    pub fn forced_count(&self) -> usize {
        self.forced.len()
    }

    pub(super) fn descend<V: Viewer>(&self, mut place: Place<V>, mut u: f64) -> Option<Pick> {
        let (mut probability, mut weighed) = (1.0, 0);
        loop {
            let choice = self.weigh(&place)?.choice()?;
            weighed += 1;
            let (lane, leftover) = choice.choose(u);
            u = leftover;
            probability *= choice.share(lane);
            match self.follow(&place, choice.group, lane)? {
                Next::Group(next) => place = next,
                Next::Emitter(emitter) => {
                    let light = Picked::Emitter(emitter);
                    let expected = probability;
                    return Some(Pick { light, probability, expected, leftover: u, weighed });
                }
            }
        }
    }

    /// The node of everything; `None` if nothing shines.
    pub fn root(&self) -> Option<&Node> {
        self.root.map(|row| &self.trees[row as usize].root)
    }

    /// The importance of everything at a viewer; 0 if nothing shines.
    pub fn total_importance(&self, viewer: &impl Viewer) -> f64 {
        self.root().map_or(0.0, |root| root.importance(viewer))
    }

    /// Calls `visit` with every emitter that is not forced, its importance to the viewer and its
    /// energy in world space: what a perfect traversal would weigh. In a tree that nobody verified,
    /// some may be missing and some come twice.
    pub fn for_each_leaf(&self, viewer: &impl Viewer, mut visit: impl FnMut(u32, f64, f64)) {
        let Some(place) = self.place_of_root(viewer) else { return };
        let mut open = vec![(place, 1.0)];
        while let Some((root, energy_factor)) = open.pop() {
            for place in self.groups_below(&root) {
                let Some(Weighed { group, importances, .. }) = self.weigh(&place) else { continue };
                for (lane, importance) in importances.into_iter().enumerate() {
                    if matches!(group.link(lane), Link::Inner(_)) {
                        continue;
                    }
                    let energy = f64::from(group.energy(lane)) * energy_factor;
                    match self.follow(&place, group, lane) {
                        Some(Next::Emitter(emitter)) if emitter < self.unforced_count => {
                            visit(emitter, importance, energy);
                        }
                        Some(Next::Emitter(_)) => {}
                        Some(Next::Group(below)) => {
                            let own = f64::from(self.trees[below.row as usize].root.energy());
                            open.push((below, energy / own));
                        }
                        None => {}
                    }
                }
            }
        }
    }
}
