//! What `verify` checks of lights, and of the frames in which they shine.

use super::{Checked, check, check_all, first_violation, rules};
use crate::light_tree::group::WIDTH;
use crate::light_tree::node::MOST;
use crate::light_tree::records::{FrameRow, LightRow, NO_TREE, TreeKind};
use crate::light_tree::tree::LightTree;
use std::ops::Range;

/// The number after that of a light's last emitter.
fn next_emitter(light: &LightRow) -> u64 {
    u64::from(light.first_emitter) + u64::from(light.emitter_count)
}

impl<D: AsRef<[u8]> + Sync> LightTree<D> {
    /// Checks the rows of the lights.
    pub(super) fn verify_lights(&self) -> Checked {
        let lights = self.lights();
        first_violation(lights.len(), |row| self.verify_light(row))?;
        // Each emitter of class 0 has a leaf of its own, so a lane.
        let own = u64::from(self.first_of_class(LightRow::PLACED));
        let lanes = (self.groups().len() * WIDTH) as u64;
        let is_numbered = lights.last().map_or(0, next_emitter) < MOST as u64 && own <= lanes;
        check_all(is_numbered, rules::EMITTERS_ARE_NUMBERED)
    }

    /// Checks one of them, and that it follows the one before it.
    fn verify_light(&self, row: usize) -> Checked {
        let light = &self.lights()[row];
        let before = row.checked_sub(1).map(|before| &self.lights()[before]);
        let follows = u64::from(light.first_emitter) == before.map_or(0, next_emitter);
        check(follows, rules::EMITTERS_FOLLOW, row)?;
        check(matches!(light.class, 0..=3 | 5 | 7), rules::CLASS_IS_KNOWN, row)?;
        let is_known = light.look.is_sound() || self.is_of_later_version();
        check(is_known, rules::LOOK_IS_KNOWN, row)?;
        let is_number = light.energy.is_finite() && light.energy >= 0.0;
        check(is_number, rules::LIGHT_ENERGY_IS_A_NUMBER, row)?;
        check(!self.light_path(light).is_empty(), rules::PATH_IS_TEXT, row)?;
        let place = |light: &LightRow| (light.class, self.path_bytes(light));
        let ascends = before.is_none_or(|before| place(before) < place(light));
        check(ascends, rules::LIGHTS_ARE_IN_ORDER, row)
    }

    /// The lights of some classes, which stand together.
    pub(super) fn lights_of(&self, classes: Range<u32>) -> &[LightRow] {
        let lights = self.lights();
        let [from, to] = [classes.start, classes.end]
            .map(|class| lights.partition_point(|light| light.class < class));
        // Of lights that nobody has put in order there may be none.
        lights.get(from..to).unwrap_or_default()
    }

    /// Checks the rows of the frames and their entries of forced lights; those of the file if there are
    /// no frames.
    pub(super) fn verify_frames(&self) -> Checked {
        let mut before = None;
        let mut next_forced = 0_u64;
        for (row, &FrameRow { frame, first_forced, forced_count, .. }) in
            self.frames().iter().enumerate()
        {
            check(before < Some(frame), rules::FRAMES_ASCEND, row)?;
            before = Some(frame);
            self.verify_root(row)?;
            let follows = u64::from(first_forced) == next_forced;
            next_forced += u64::from(forced_count);
            let is_there = next_forced <= self.forced().len() as u64;
            check(follows && is_there, rules::FRAMES_USE_FORCED, row)?;
            self.verify_forced(first_forced as usize..next_forced as usize)?;
        }
        let is_told =
            self.fingerprints().is_empty() || self.fingerprints().len() == self.frames().len();
        check_all(is_told, rules::FRAMES_HAVE_FINGERPRINTS)?;
        if self.frames().is_empty() {
            return self.verify_forced(0..self.forced().len());
        }
        check_all(next_forced == self.forced().len() as u64, rules::FRAMES_USE_FORCED)
    }

    /// Checks the tree of a frame.
    pub(super) fn verify_root(&self, row: usize) -> Checked {
        let tree = self.frames()[row].tree;
        let kind = self.trees().get(tree as usize).and_then(TreeKind::of);
        let any_changes = !self.lights_of(LightRow::CHANGES..LightRow::FORCED).is_empty();
        // Where only forced lights change, frames share the tree of what stands still.
        let is_right = match (any_changes, self.still_tree().is_some()) {
            (true, _) => kind == Some(TreeKind::Frame),
            (false, true) => kind == Some(TreeKind::Still),
            (false, false) => tree == NO_TREE,
        };
        check(is_right, rules::FRAME_HAS_ITS_TREE, row)
    }

    /// Checks that a run of entries holds all forced lights, in order.
    pub(super) fn verify_forced(&self, run: Range<usize>) -> Checked {
        let mut lights = self.lights_of(LightRow::FORCED..2 * LightRow::FORCED).iter();
        for entry in run.clone() {
            let instance = self.instances().get(self.forced()[entry] as usize);
            let placed = instance
                .and_then(|instance| Some((instance, self.trees().get(instance.tree as usize)?)))
                .filter(|(_, tree)| TreeKind::of(tree) == Some(TreeKind::Shared));
            check(placed.is_some(), rules::FORCED_IS_A_TREE, entry)?;
            let placed = placed.map(|(instance, tree)| (instance.first_emitter, tree.leaf_count));
            let light = lights.next().map(|light| (light.first_emitter, light.emitter_count));
            check(placed == light, rules::FORCED_ARE_ALL, entry)?;
        }
        check(lights.next().is_none(), rules::FORCED_ARE_ALL, run.end)
    }
}
