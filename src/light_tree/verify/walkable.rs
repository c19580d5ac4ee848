//! Whether every walk through unverified trees ends in reasonable time.

use super::groups::parents_of;
use crate::light_tree::records::{InstanceRow, TreeKind, TreeRow};
use crate::light_tree::tree::LightTree;

impl<D: AsRef<[u8]>> LightTree<D> {
    /// Whether the links of a tree, and of those that it places, form trees:
    ///
    /// - Every group is reached once.
    /// - A shared tree holds no other trees. The tree of what stands still holds only shared trees.
    /// - The tree of a frame holds that of what stands still at most once.
    /// - The trees that one tree places, counted as often as they are placed, have no more groups than
    ///   the file has groups and emitters.
    ///
    /// Every walk ends if links only lead onwards. But if many links lead to one group, and many from
    /// there to the next, there are too many paths for a walk over all of them to finish. The same is
    /// true if many leaves place one large tree.
    pub(in crate::light_tree) fn is_walkable(&self, row: u32) -> bool {
        let Some(known) = self.known_of(row) else { return false };
        let is_so = || {
            let tree = &self.trees()[row as usize];
            let groups = self.groups_of(tree);
            let is_whole = tree.group_count > 0 && groups.len() == tree.group_count as usize;
            is_whole && parents_of(groups).is_ok() && self.holds_trees_once(tree)
        };
        self.is_proven(row) || *known.is_walkable.get_or_init(is_so)
    }

    fn holds_trees_once(&self, tree: &TreeRow) -> bool {
        let mut below = self.placed_in(tree).filter_map(|row| self.instances().get(row as usize));
        let most = (self.emitter_count() + self.groups().len()) as u64;
        let mut placed = 0;
        let mut kind_of = |instance: &InstanceRow| {
            let tree = self.trees().get(instance.tree as usize)?;
            placed += u64::from(tree.group_count);
            TreeKind::of(tree).filter(|_| placed <= most)
        };
        let (kind, mut stills) = (TreeKind::of(tree), 0);
        // A tree holds only trees of lesser kinds, so asking further ends.
        below.all(|instance| {
            let may_hold = match (kind, kind_of(instance)) {
                (Some(TreeKind::Still | TreeKind::Frame), Some(TreeKind::Shared)) => true,
                (Some(TreeKind::Frame), Some(TreeKind::Still)) => {
                    stills += 1;
                    stills == 1
                }
                _ => false,
            };
            may_hold && self.is_walkable(instance.tree)
        }) && kind.is_some()
    }
}
