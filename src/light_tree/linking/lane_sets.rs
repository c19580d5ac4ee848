//! Lane sets: of which link numbers the lights are that a lane of a group leads to.

use super::{BitRows, LitBy, ReceiverClass};
use crate::light_tree::group::WIDTH;
use crate::light_tree::node::Link;
use crate::light_tree::records::{TreeKind, TreeRow};
use crate::light_tree::tree::LightTree;
use std::collections::HashMap;
use std::ops::Range;

/// More numbers than this are not kept in sets of several. Further sets count as if they held number 0.
const MOST_MEMBERS: usize = 1 << 22;
/// More bits than this, of classes times sets, are not kept: 32 MB. Then every set of several counts as lit.
const MOST_BITS: usize = 1 << 28;

/// The lane sets of a tree.
#[derive(Clone, Debug, Default)]
pub(super) struct LaneSets {
    /// The groups of the tree.
    pub(super) groups: Range<u32>,
    /// Of each of them the sets of its lanes.
    pub(super) of_lanes: Vec<[u32; WIDTH]>,
    /// How many link numbers there are. A set of one is numbered by it.
    numbers: u32,
    /// The sets of several, from set `numbers` on. Each ascends.
    several: Vec<Box<[u32]>>,
    /// The set of all that the tree holds.
    whole: u32,
}

impl<D: AsRef<[u8]>> LightTree<D> {
    /// The link number of a row of [`lights`](LightTree::lights). A number that no writer gives counts as 0.
    pub fn link_of(&self, row: usize) -> u32 {
        let links = self.light_links();
        links.get(row).copied().filter(|&number| number as usize <= links.len()).unwrap_or(0)
    }

    /// How many link numbers there are, number 0 included.
    pub fn link_numbers(&self) -> u32 {
        (0..self.light_links().len()).map(|row| self.link_of(row) + 1).max().unwrap_or(1)
    }

    /// The link number of an emitter's light.
    pub(super) fn link_of_emitter(&self, emitter: u32) -> u32 {
        let behind = self.lights().partition_point(|light| light.first_emitter <= emitter);
        behind.checked_sub(1).map_or(0, |row| self.link_of(row))
    }

    /// The lane sets of a tree whose walks end. `still` are those of the tree that a leaf may stand for.
    pub(super) fn find_lane_sets(&self, tree: &TreeRow, still: Option<&LaneSets>) -> LaneSets {
        let groups = self.groups_of(tree);
        let numbers = self.link_numbers();
        let mut sets = Unions { numbers, several: Vec::new(), known: HashMap::new(), members: 0 };
        let mut of_lanes: Vec<[u32; WIDTH]> = vec![[0; WIDTH]; groups.len()];
        let mut of_groups = vec![0; groups.len()];
        // What a group leads to stands behind it.
        for at in (0..groups.len()).rev() {
            let mut used = Vec::with_capacity(WIDTH);
            for (lane, own) in of_lanes[at].iter_mut().enumerate() {
                *own = match groups[at].link(lane) {
                    Link::Nothing => continue,
                    Link::Inner(ahead) => of_groups.get(at + ahead as usize).copied().unwrap_or(0),
                    Link::Emitter(emitter) => self.link_of_emitter(emitter),
                    Link::Instance(row) => self.set_of_placed(row, still, &mut sets),
                };
                used.push(*own);
            }
            of_groups[at] = sets.union(used);
        }
        let groups = tree.first_group..tree.first_group + groups.len() as u32;
        let whole = of_groups.first().copied().unwrap_or(0);
        LaneSets { groups, of_lanes, numbers, several: sets.several, whole }
    }

    /// The set of a leaf that stands for a placed tree.
    fn set_of_placed(&self, row: u32, still: Option<&LaneSets>, sets: &mut Unions) -> u32 {
        let Some(instance) = self.instances().get(row as usize) else { return 0 };
        let tree = self.trees().get(instance.tree as usize);
        match (tree.and_then(TreeKind::of), still) {
            (Some(TreeKind::Still), Some(still)) => {
                let own = still.numbers_of(still.whole).to_vec();
                sets.union(own)
            }
            (Some(TreeKind::Still), None) => 0,
            _ => self.link_of_emitter(instance.first_emitter),
        }
    }
}

/// Sets of link numbers, each once.
struct Unions {
    numbers: u32,
    several: Vec<Box<[u32]>>,
    known: HashMap<Box<[u32]>, u32>,
    /// Numbers in all of them.
    members: usize,
}

impl Unions {
    /// The set of all that some sets hold.
    fn union(&mut self, mut of: Vec<u32>) -> u32 {
        of.sort_unstable();
        of.dedup();
        match of.as_slice() {
            [] | [0, ..] => return 0,
            [one] => return *one,
            _ => {}
        }
        let mut all = Vec::new();
        for set in of {
            match set.checked_sub(self.numbers) {
                None => all.push(set),
                Some(at) => all.extend_from_slice(&self.several[at as usize]),
            }
        }
        all.sort_unstable();
        all.dedup();
        if self.members + all.len() > MOST_MEMBERS {
            return self.known.get(all.as_slice()).copied().unwrap_or(0);
        }
        let next = self.numbers + self.several.len() as u32;
        let (several, members) = (&mut self.several, &mut self.members);
        *self.known.entry(all.into()).or_insert_with_key(|all| {
            *members += all.len();
            several.push(all.clone());
            next
        })
    }
}

impl LaneSets {
    /// The numbers in a set.
    fn numbers_of(&self, set: u32) -> Vec<u32> {
        match set.checked_sub(self.numbers) {
            None => vec![set],
            Some(at) => self.several[at as usize].to_vec(),
        }
    }

    /// For each class, by set, whether any of it lights the class.
    pub(super) fn lit(&self, lit_by: &LitBy) -> BitRows {
        let sets = self.numbers as usize + self.several.len();
        let is_small = sets.saturating_mul(lit_by.classes()) <= MOST_BITS;
        let several = if is_small { self.several.as_slice() } else { &[] };
        let mut rows = BitRows::new(self.numbers as usize + several.len());
        for class in (0..lit_by.classes() as u32).map(ReceiverClass) {
            let of_one = (0..self.numbers).map(|number| lit_by.holds(class, number));
            let any = |set: &[u32]| set.iter().any(|&number| lit_by.holds(class, number));
            rows.push(of_one.chain(several.iter().map(|set| any(set))));
        }
        rows
    }
}
