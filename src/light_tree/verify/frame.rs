//! What `verify` proves, of one frame: of what is asked for, and no more.
//!
//! Looked at are the rows of all trees, the row of the frame, and the trees that it reaches: its own, that of
//! what stands still, and those that both place. Each is proved once. No other page of a mapped file is
//! touched, so checksums are not compared: they are over whole sections.

use super::groups::verify_groups;
use super::{Checked, check, rules};
use crate::light_tree::records::FrameRow;
use crate::light_tree::tree::LightTree;
use crate::store::StoreError;
use rayon::prelude::*;

impl<D: AsRef<[u8]> + Sync> LightTree<D> {
    /// Proves that sampling a frame keeps what the [format](crate::store) promises: its walks end, stay
    /// inside the file and reach each emitter once; clusters bound their leaves. Nothing is proved of
    /// checksums, the list of lights, textures and other frames; [`verify`](LightTree::verify) proves all. A
    /// frame that the file lacks is not sampled, and so is sound.
    ///
    /// # Errors
    /// The first rule that is broken, with its section and record.
    pub fn verify_frame(&self, frame: i32) -> Result<(), StoreError> {
        if self.known().is_whole() {
            return Ok(());
        }
        self.verify_reached(frame).map_err(StoreError::Broken)
    }

    fn verify_reached(&self, frame: i32) -> Checked {
        if self.known().rows.get().is_none() {
            self.verify_trees()?;
            self.known().rows.get_or_init(|| ());
        }
        let (root, forced) = match self.row_of(frame) {
            None if self.frames().is_empty() => (self.still_tree(), 0..self.forced().len()),
            None => return Ok(()),
            Some(row) => {
                let FrameRow { tree, first_forced, forced_count, .. } = self.frames()[row];
                self.verify_root(row)?;
                let end = u64::from(first_forced) + u64::from(forced_count);
                check(end <= self.forced().len() as u64, rules::FRAMES_USE_FORCED, row)?;
                let has_tree = (tree as usize) < self.trees().len();
                (Some(tree).filter(|_| has_tree), first_forced as usize..end as usize)
            }
        };
        self.verify_forced(forced.clone())?;
        root.map_or(Ok(()), |row| self.verify_tree(row))?;
        self.verify_placed(self.forced()[forced].to_vec())
    }

    /// Proves a tree and all that it places. The rows of all trees are proven.
    fn verify_tree(&self, row: u32) -> Checked {
        if self.is_proven(row) {
            return Ok(());
        }
        let tree = &self.trees()[row as usize];
        let groups = self.groups_of(tree);
        let contents = || self.verify_contents(row as usize, tree, &mut Vec::new());
        let (groups_hold, contents_hold) = rayon::join(|| verify_groups(tree, groups), contents);
        groups_hold.and(contents_hold)?;
        self.verify_placed(self.placed_in(tree).collect())?;
        if let Some(known) = self.known_of(row) {
            known.proven.get_or_init(|| ());
        }
        Ok(())
    }

    /// Proves some rows of instances, and the trees that they place.
    fn verify_placed(&self, mut instances: Vec<u32>) -> Checked {
        instances.sort_unstable();
        let rows = instances.par_iter().map(|&row| self.verify_instance(row as usize));
        rows.find_first(Result::is_err).unwrap_or(Ok(()))?;
        let tree_of = |&row: &u32| self.instances()[row as usize].tree;
        let mut trees: Vec<u32> = instances.iter().map(tree_of).collect();
        trees.sort_unstable();
        trees.dedup();
        let trees = trees.par_iter().map(|&row| self.verify_tree(row));
        trees.find_first(Result::is_err).unwrap_or(Ok(()))
    }
}
