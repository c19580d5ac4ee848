//! Whether every walk through unverified trees ends in reasonable time.

use super::groups::parents_of;
use crate::light_tree::group::{Group, WIDTH};
use crate::light_tree::node::Link;
use crate::light_tree::records::{TreeKind, TreeRow};
use crate::light_tree::tree::LightTree;

impl<D: AsRef<[u8]>> LightTree<D> {
    /// Whether links form trees:
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
    pub(in crate::light_tree) fn is_walkable(&self) -> bool {
        self.trees().iter().all(|tree| {
            let groups = self.groups_of(tree);
            let is_whole = tree.group_count > 0 && groups.len() == tree.group_count as usize;
            is_whole && parents_of(groups).is_ok() && self.holds_trees_once(tree, groups)
        })
    }

    fn holds_trees_once(&self, tree: &TreeRow, groups: &[Group]) -> bool {
        let links = groups.iter().flat_map(|group| (0..WIDTH).map(|lane| group.link(lane)));
        let below = links.filter_map(|link| match link {
            Link::Instance(row) => self.instances().get(row as usize),
            _ => None,
        });
        let most = (self.emitter_count() + self.groups().len()) as u64;
        let mut placed = 0;
        let mut kinds = below.map(|row| {
            let tree = self.trees().get(row.tree as usize)?;
            placed += u64::from(tree.group_count);
            TreeKind::of(tree).filter(|_| placed <= most)
        });
        match TreeKind::of(tree) {
            Some(TreeKind::Shared) => kinds.next().is_none(),
            Some(TreeKind::Still) => kinds.all(|kind| kind == Some(TreeKind::Shared)),
            Some(TreeKind::Frame) => {
                let others: Vec<_> =
                    kinds.filter(|kind| *kind != Some(TreeKind::Shared)).take(2).collect();
                matches!(others[..], [] | [Some(TreeKind::Still)])
            }
            None => false,
        }
    }
}
