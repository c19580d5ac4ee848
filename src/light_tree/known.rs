//! What has been found out about the trees of an open file, so that it is found out once.

use super::leaves::LeafTable;
use super::linking::{LitBy, LitLanes};
use std::sync::{Arc, Mutex, OnceLock};

/// What is known of a file.
#[derive(Default)]
pub(super) struct Known {
    /// Set once the whole file is proven to keep the format's promises.
    whole: OnceLock<()>,
    /// Set once the rows of all trees are.
    pub rows: OnceLock<()>,
    /// Where the leaves are that frames share.
    pub leaves: OnceLock<LeafTable>,
    /// What of the tree of what stands still lights receivers, for those that asked last.
    pub lit_lanes: Mutex<Option<(Arc<LitBy>, Arc<LitLanes>)>>,
    /// What a table of what is seen belongs to.
    pub still_key: OnceLock<[u8; 32]>,
    trees: OnceLock<Box<[OfTree]>>,
}

/// What is known of one tree and of all that it places.
#[derive(Default)]
pub(super) struct OfTree {
    /// Whether every walk through it ends in reasonable time.
    pub is_walkable: OnceLock<bool>,
    /// Set once it is proven to keep the format's promises.
    pub proven: OnceLock<()>,
    /// BLAKE3 over all that sampling it can read.
    pub digest: OnceLock<[u8; 32]>,
}

impl Known {
    /// Notes that the whole file is proven.
    pub fn note_whole(&self) {
        self.whole.get_or_init(|| ());
    }

    pub fn is_whole(&self) -> bool {
        self.whole.get().is_some()
    }

    /// What is known of a tree, given how many there are; `None` if there is no such tree.
    pub fn of_tree(&self, row: u32, count: usize) -> Option<&OfTree> {
        let trees = self.trees.get_or_init(|| (0..count).map(|_| OfTree::default()).collect());
        trees.get(row as usize)
    }
}
