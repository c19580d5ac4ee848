//! Where the leaf of each emitter is. The probability of sampling a given emitter needs it.
//!
//! Emitters are numbered by class (see the [format](crate::store)). First come those of lights that
//! stand still, with a leaf each; then those of lights that stand still in shared trees; then the same
//! two classes of lights that change; then the forced lights. An emitter with a leaf of its own is
//! looked up in a table, one in a shared tree by binary search. Neither takes room in the file.

use super::group::{Group, WIDTH};
use super::node::Link;
use super::records::{InstanceRow, LightRow, TreeKind, TreeRow};
use super::tree::LightTree;

/// A lane of a group: the group's number times [`WIDTH`] plus the lane's.
pub(super) type Slot = u32;
const NO_SLOT: Slot = u32::MAX;

/// Where the leaves are of all emitters that stand still or are in shared trees.
/// Made once for an open file.
#[derive(Clone, Debug, Default)]
pub(super) struct LeafTable {
    /// Of what stands still.
    still: Leaves,
    /// For each tree that is shared, the slot of each of its own emitters.
    shared: Vec<Vec<Slot>>,
}

/// The leaves of one tree.
#[derive(Clone, Debug, Default)]
pub(super) struct Leaves {
    /// The first emitter that has a leaf of its own.
    first: u32,
    /// The slots of the emitters from there on.
    slots: Vec<Slot>,
    /// Instances, by their first emitters, ascending.
    placed: Vec<Placed>,
    /// The leaf that stands for the tree of what stands still.
    pub below: Option<Slot>,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Placed {
    pub first_emitter: u32,
    pub instance: u32,
    /// Its leaf. Without meaning for a forced light, which has none.
    pub slot: Slot,
}

/// The path down to a leaf, through at most three trees: for each tree the slot at which the path
/// leaves it or ends.
#[derive(Clone, Copy, Debug)]
pub(super) struct Route {
    pub slots: [Slot; 3],
    pub count: usize,
}

impl<D: AsRef<[u8]>> LightTree<D> {
    /// The leaves of all emitters that stand still or are in shared trees.
    pub(super) fn leaf_table(&self) -> &LeafTable {
        self.known().leaves.get_or_init(|| self.find_leaves())
    }

    fn find_leaves(&self) -> LeafTable {
        let trees = self.trees();
        let of_kind = |kind| move |tree: &&TreeRow| TreeKind::of(tree) == Some(kind);
        let shared = trees.iter().take_while(of_kind(TreeKind::Shared)).map(|tree| {
            let mut slots = vec![NO_SLOT; self.groups_of(tree).len() * WIDTH];
            let mut count = 0;
            for (slot, link) in self.links(tree) {
                if let Link::Emitter(emitter) = link
                    && let Some(entry) = slots.get_mut(emitter as usize)
                {
                    *entry = slot;
                    count = count.max(emitter as usize + 1);
                }
            }
            slots.truncate(count);
            slots
        });
        let still = self.still_tree().map(|row| &trees[row as usize]);
        let first_placed = self.first_of_class(LightRow::PLACED);
        LeafTable {
            still: still.map_or_else(Leaves::default, |tree| self.leaves_of(tree, 0..first_placed)),
            shared: shared.collect(),
        }
    }

    /// The leaves of a tree. `own` are the emitters that have a leaf each in it.
    pub(super) fn leaves_of(&self, tree: &TreeRow, own: std::ops::Range<u32>) -> Leaves {
        let most = self.groups_of(tree).len() * WIDTH;
        let mut leaves = Leaves {
            first: own.start,
            slots: vec![NO_SLOT; own.len().min(most)],
            ..Leaves::default()
        };
        for (slot, link) in self.links(tree) {
            match link {
                Link::Emitter(emitter) => {
                    let at = emitter.checked_sub(own.start).map(|at| at as usize);
                    if let Some(entry) = at.and_then(|at| leaves.slots.get_mut(at)) {
                        *entry = slot;
                    }
                }
                Link::Instance(instance) => match self.instances().get(instance as usize) {
                    Some(row) if self.is_still(row) => leaves.below = Some(slot),
                    Some(&InstanceRow { first_emitter, .. }) => {
                        leaves.placed.push(Placed { first_emitter, instance, slot });
                    }
                    None => {}
                },
                Link::Inner(_) | Link::Nothing => {}
            }
        }
        leaves.placed.sort_unstable_by_key(|placed| placed.first_emitter);
        leaves
    }

    fn is_still(&self, instance: &InstanceRow) -> bool {
        let tree = self.trees().get(instance.tree as usize);
        tree.and_then(TreeKind::of) == Some(TreeKind::Still)
    }

    /// Every used lane of a tree and where it leads.
    fn links(&self, tree: &TreeRow) -> impl Iterator<Item = (Slot, Link)> + '_ {
        let first = tree.first_group.wrapping_mul(WIDTH as u32);
        let lanes = self.groups_of(tree).iter().flat_map(|g| (0..WIDTH).map(|lane| g.link(lane)));
        lanes.enumerate().map(move |(i, link)| (first.wrapping_add(i as u32), link))
    }
}

impl Leaves {
    /// The slot at which the path to an emitter leaves this tree or ends. If it goes on in an instance,
    /// that instance, too.
    pub fn find(&self, emitter: u32) -> Option<(Slot, Option<Placed>)> {
        let own = emitter.checked_sub(self.first).and_then(|at| self.slots.get(at as usize));
        match own {
            Some(&slot) => Some((slot, None)).filter(|_| slot != NO_SLOT),
            None => {
                let placed = find_placed(&self.placed, emitter)?;
                Some((placed.slot, Some(placed)))
            }
        }
    }
}

/// The instance that an emitter belongs to. `placed` ascends by first emitter.
pub(super) fn find_placed(placed: &[Placed], emitter: u32) -> Option<Placed> {
    let after = placed.partition_point(|placed| placed.first_emitter <= emitter);
    Some(placed[after.checked_sub(1)?])
}

impl LeafTable {
    /// The slot in the tree of what stands still of an emitter, or of what it is placed with.
    pub(super) fn in_still(&self, emitter: u32) -> Option<Slot> {
        self.still.find(emitter).map(|(slot, _)| slot)
    }

    /// The slot of an emitter in its shared tree.
    pub(super) fn in_shared(
        &self,
        instances: &[InstanceRow],
        placed: Placed,
        emitter: u32,
    ) -> Option<Slot> {
        let tree = instances.get(placed.instance as usize)?.tree;
        let own = emitter.checked_sub(placed.first_emitter)?;
        let slot = *self.shared.get(tree as usize)?.get(own as usize)?;
        (slot != NO_SLOT).then_some(slot)
    }

    /// The path to an emitter from the root of a frame. `own` are the leaves of the frame's own tree, if
    /// it has one.
    pub(super) fn route(
        &self,
        own: Option<&Leaves>,
        instances: &[InstanceRow],
        emitter: u32,
    ) -> Option<Route> {
        let mut route = Route { slots: [NO_SLOT; 3], count: 0 };
        let mut add = |slot| {
            route.slots[route.count] = slot;
            route.count += 1;
        };
        let placed = match own {
            Some(own) if emitter >= own.first => {
                let (slot, placed) = own.find(emitter)?;
                add(slot);
                placed
            }
            _ => {
                if let Some(own) = own {
                    add(own.below?);
                }
                let (slot, placed) = self.still.find(emitter)?;
                add(slot);
                placed
            }
        };
        if let Some(placed) = placed {
            add(self.in_shared(instances, placed, emitter)?);
        }
        Some(route)
    }
}

/// The lane of a group through which the path to another group of its subtree goes, `distance` groups
/// further on. Groups stand in preorder, so it is the last lane that leads no farther than that.
#[inline]
pub(super) fn lane_toward(group: &Group, distance: u32) -> Option<usize> {
    (0..WIDTH).rev().find(|&lane| matches!(group.link(lane), Link::Inner(by) if by <= distance))
}
