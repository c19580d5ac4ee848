//! What lights with photometric profiles tell the tree: their intensity by direction.

use crate::emitter::PosedEmitters;
use crate::light_tree::far_field::{FarField, LaneTables};
use crate::light_tree::{FrameTree, LightTree};
use glam::Vec3;
use std::sync::{Arc, Mutex, PoisonError};

impl FarField for PosedEmitters<'_> {
    fn is_known(&self, emitter: u32) -> bool {
        self.is_photometric(emitter)
    }

    fn intensity(&self, emitter: u32, direction: Vec3) -> f32 {
        self.intensity(emitter, direction)
    }
}

/// The tables of the tree of what stands still, by its key: frames of a shot share them.
#[derive(Default)]
pub struct StillTables(Mutex<Option<([u8; 32], Arc<LaneTables>)>>);

impl StillTables {
    /// A frame's tree that knows the far fields of its emitters, which must be of one scene for all trees.
    pub fn told<'a>(
        &self,
        of: &LightTree<impl AsRef<[u8]>>,
        tree: FrameTree<'a>,
        emitters: &'a PosedEmitters<'a>,
    ) -> FrameTree<'a> {
        let key = of.still_key();
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let known = kept.as_ref().filter(|(own, _)| *own == key).map(|(_, tables)| tables.clone());
        let (tree, still) = tree.with_far_fields(emitters, known);
        *kept = still.map(|still| (key, still));
        tree
    }
}
