//! Lit lanes: what of each lane of a group lights each class of receivers.

use super::lane_sets::LaneSets;
use super::{BitRows, LitBy, ReceiverClass};
use crate::light_tree::group::{Group, WIDTH};
use crate::light_tree::node::Link;
use crate::light_tree::records::{TreeKind, TreeRow};
use crate::light_tree::sampling::FrameTree;
use crate::light_tree::tree::{LightTree, NoSuchFrame};
use std::sync::{Arc, PoisonError};

/// More shares of groups than this are not kept in a tree: 64 MB. For the classes that are left, a lane counts as a
/// whole or not at all.
const MOST_SHARES: usize = 1 << 21;

/// The links of a frame's lights, for some classes of receivers.
#[derive(Debug)]
pub(in crate::light_tree) struct FrameLinks {
    /// The trees whose lanes lead to lights of several numbers: of what stands still, and of the frame.
    parts: Vec<Arc<LitLanes>>,
    /// Of each forced light its link number.
    forced: Vec<u32>,
    lit_by: Arc<LitBy>,
}

/// What of the lanes of a tree lights each class of receivers.
#[derive(Debug)]
pub(in crate::light_tree) struct LitLanes {
    sets: Arc<LaneSets>,
    /// By class and set, whether any of it does.
    lit: BitRows,
    /// By class and group, of each lane the share of its energy that does; of as many classes as there is room for.
    shares: Vec<[f32; WIDTH]>,
    /// By class, that share of the whole tree.
    whole: Vec<f32>,
}

impl FrameLinks {
    /// Weighs the lanes of a group by what of them lights a class.
    #[inline]
    pub fn weigh(&self, class: ReceiverClass, group: u32, importances: &mut [f64; WIDTH]) {
        let part = self.parts.iter().find(|part| part.sets.groups.contains(&group));
        let Some(LitLanes { sets, lit, shares, .. }) = part.map(|part| &**part) else { return };
        let at = (group - sets.groups.start) as usize;
        let row = (class.0 as usize).checked_mul(sets.of_lanes.len());
        if let Some(shares) = row.and_then(|row| shares.get(row + at)) {
            for (importance, &share) in importances.iter_mut().zip(shares) {
                *importance *= f64::from(share);
            }
            return;
        }
        let of_lanes = &sets.of_lanes[at];
        for (importance, &set) in importances.iter_mut().zip(of_lanes) {
            if !lit.get(class.0, set) {
                *importance = 0.0;
            }
        }
    }

    /// Whether a forced light, by its number among them, lights a class.
    pub fn lights_from_forced(&self, class: ReceiverClass, light: usize) -> bool {
        self.forced.get(light).is_none_or(|&number| self.lit_by.holds(class, number))
    }
}

impl<D: AsRef<[u8]>> LightTree<D> {
    /// The tree of a frame, which receivers of some classes pick from: [`Linked`](super::Linked) viewers. Others see all lights.
    ///
    /// # Errors
    /// [`NoSuchFrame`] if lights change and the file was built without this frame.
    pub fn at_frame_linked(
        &self,
        frame: i32,
        lit_by: &Arc<LitBy>,
    ) -> Result<FrameTree<'_>, NoSuchFrame> {
        let mut tree = self.at_frame(frame)?;
        if self.light_links().is_empty() {
            return Ok(tree);
        }
        let row = |row: u32| &self.trees()[row as usize];
        let is_whole = tree.root.is_some();
        let still = tree.still.filter(|_| is_whole);
        let still = still.map(|still| self.still_lanes(row(still), lit_by));
        let own = tree.root.filter(|root| Some(*root) != tree.still).map(|own| {
            let sets = self.find_lane_sets(row(own), still.as_ref().map(|still| &*still.sets));
            Arc::new(self.find_lit_lanes(row(own), Arc::new(sets), lit_by, still.as_deref()))
        });
        let forced = tree.forced.iter().map(|placed| self.link_of_emitter(placed.first_emitter));
        let parts = [still, own].into_iter().flatten();
        let parts = parts.collect();
        let links = FrameLinks { parts, forced: forced.collect(), lit_by: lit_by.clone() };
        tree.links = Some(Arc::new(links));
        Ok(tree)
    }

    /// What is known of the tree of what stands still. The last result is kept.
    fn still_lanes(&self, tree: &TreeRow, lit_by: &Arc<LitBy>) -> Arc<LitLanes> {
        let known = &self.known().lit_lanes;
        let mut known = known.lock().unwrap_or_else(PoisonError::into_inner);
        let sets = match &*known {
            Some((own, lanes)) if Arc::ptr_eq(own, lit_by) => return lanes.clone(),
            Some((_, lanes)) => lanes.sets.clone(),
            None => Arc::new(self.find_lane_sets(tree, None)),
        };
        let lanes = Arc::new(self.find_lit_lanes(tree, sets, lit_by, None));
        *known = Some((lit_by.clone(), lanes.clone()));
        lanes
    }

    /// What of the lanes of a tree lights each class. `still` is that of the tree that a leaf may stand for.
    fn find_lit_lanes(
        &self,
        tree: &TreeRow,
        sets: Arc<LaneSets>,
        lit_by: &LitBy,
        still: Option<&LitLanes>,
    ) -> LitLanes {
        let (groups, classes) = (self.groups_of(tree), lit_by.classes());
        let lit = sets.lit(lit_by);
        let (mut shares, mut whole) = (Vec::new(), vec![1.0; classes]);
        let kept = classes.min(MOST_SHARES / groups.len().max(1));
        shares.reserve(kept * groups.len());
        for (class, whole) in (0..).zip(&mut whole[..kept]) {
            let below = still.map_or(1.0, |still| still.whole[class as usize]);
            let start = shares.len();
            shares.resize(start + groups.len(), [1.0; WIDTH]);
            let is_lit = |set| lit.get(class, set);
            *whole = self.find_shares(groups, &sets, is_lit, below, &mut shares[start..]);
        }
        LitLanes { sets, lit, shares, whole }
    }

    /// Fills in the shares of the energies of lanes that light a class, and returns that of all. `below` is the share
    /// of the tree of what stands still. A share is 0 only if it is nothing.
    fn find_shares(
        &self,
        groups: &[Group],
        sets: &LaneSets,
        is_lit: impl Fn(u32) -> bool,
        below: f32,
        shares: &mut [[f32; WIDTH]],
    ) -> f32 {
        let mut of_groups = vec![1.0f32; groups.len()];
        for at in (0..groups.len()).rev() {
            let (mut lit, mut all, mut is_whole) = (0.0, 0.0, true);
            for (lane, own) in shares[at].iter_mut().enumerate() {
                let share = match groups[at].link(lane) {
                    Link::Nothing => continue,
                    Link::Inner(ahead) => {
                        of_groups.get(at + ahead as usize).copied().unwrap_or(1.0)
                    }
                    Link::Instance(row) if self.places_still(row) => below,
                    Link::Instance(_) | Link::Emitter(_) => 1.0,
                };
                *own = if is_lit(sets.of_lanes[at][lane]) { share } else { 0.0 };
                let energy = f64::from(groups[at].energy(lane));
                lit += energy * f64::from(*own);
                all += energy;
                is_whole &= *own == 1.0;
            }
            if !is_whole {
                // Of a file that nobody verified, it may be no number.
                let share = (lit / all) as f32;
                let is_some = share > f32::MIN_POSITIVE;
                of_groups[at] = if is_some { share.min(1.0) } else { f32::MIN_POSITIVE };
            }
        }
        of_groups.first().copied().unwrap_or(1.0)
    }

    /// Whether an instance is of the tree of what stands still.
    fn places_still(&self, row: u32) -> bool {
        let instance = self.instances().get(row as usize);
        let tree = instance.and_then(|instance| self.trees().get(instance.tree as usize));
        tree.and_then(TreeKind::of) == Some(TreeKind::Still)
    }
}
