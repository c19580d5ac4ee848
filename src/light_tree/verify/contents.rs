//! Whether a tree holds exactly the lights that it should, and its leaves contain the trees that they
//! stand for.

use super::{Checked, check, rules};
use crate::bounds::Aabb;
use crate::light_tree::group::WIDTH;
use crate::light_tree::node::{Link, Node};
use crate::light_tree::records::{InstanceRow, LightRow, TreeKind, TreeRow};
use crate::light_tree::tree::LightTree;
use crate::store::{Record, Rule, Violation};
use std::ops::Range;

/// Rounding error of transforming a box, relative to its size and its distance from the origin.
const PLACING_TOLERANCE: f32 = 2e-5;

impl<D: AsRef<[u8]> + Sync> LightTree<D> {
    /// Checks that a tree holds exactly the lights that it should: each emitter once, and only trees that
    /// come earlier. `seen` is scratch space. For each emitter, by its place in the tree, it has the row
    /// of the tree in which such an emitter was last seen, plus one.
    pub(super) fn verify_contents(
        &self,
        row: usize,
        tree: &TreeRow,
        seen: &mut Vec<u32>,
    ) -> Checked {
        let kind = TreeKind::of(tree);
        let own = self.own_emitters(tree);
        // No more emitters can have leaves than there are lanes.
        let most = own.len().min(self.groups_of(tree).len() * WIDTH);
        seen.resize(most.max(seen.len()), 0);
        let mark = row as u32 + 1;
        let (mut leaves, mut emitters, mut below) = (0, 0, 0);
        let mut placed = Vec::new();
        for (number, group) in (tree.first_group..).zip(self.groups_of(tree)) {
            for lane in 0..WIDTH {
                let broken = |rule| {
                    let record = Record::Lane { group: number, lane: lane as u8 };
                    Err(Violation { rule, record })
                };
                match group.link(lane) {
                    Link::Emitter(emitter) => {
                        let at = emitter.wrapping_sub(own.start) as usize;
                        match seen[..most].get_mut(at) {
                            Some(last) if *last != mark => *last = mark,
                            _ => return broken(rules::EMITTER_HAS_ONE_LEAF),
                        }
                        emitters += 1;
                    }
                    Link::Instance(instance) => {
                        let instance = self.instances().get(instance as usize);
                        let earlier = instance.filter(|instance| (instance.tree as usize) < row);
                        let Some(instance) = earlier else {
                            return broken(rules::INSTANCE_IS_EARLIER);
                        };
                        let tree_below = &self.trees()[instance.tree as usize];
                        let node = group.node(lane).expect("a lane that leads somewhere");
                        if let Some(rule) = sticks_out(&node, instance, tree_below) {
                            return broken(rule);
                        }
                        match TreeKind::of(tree_below) {
                            Some(TreeKind::Still) => below += 1,
                            _ => placed.push((instance.first_emitter, tree_below.leaf_count)),
                        }
                    }
                    Link::Inner(_) | Link::Nothing => continue,
                }
                leaves += 1;
            }
        }
        check(leaves == tree.leaf_count, rules::LEAVES_ARE_COUNTED, row)?;
        let expected_below =
            usize::from(kind == Some(TreeKind::Frame) && self.still_tree().is_some());
        placed.sort_unstable();
        let expected = match kind {
            Some(TreeKind::Still) => self.lights_of(LightRow::PLACED..LightRow::CHANGES),
            Some(TreeKind::Frame) => {
                let placed = LightRow::CHANGES | LightRow::PLACED;
                self.lights_of(placed..placed + 1)
            }
            _ => &[],
        };
        let expected = expected.iter().map(|light| (light.first_emitter, light.emitter_count));
        let holds =
            (emitters, below) == (own.len(), expected_below) && placed.into_iter().eq(expected);
        check(holds, rules::TREE_HOLDS_ITS_LIGHTS, row)
    }

    /// The emitters that have leaves of their own in a tree.
    pub(super) fn own_emitters(&self, tree: &TreeRow) -> Range<u32> {
        let between = |from, to| self.first_of_class(from)..self.first_of_class(to);
        match TreeKind::of(tree) {
            Some(TreeKind::Still) => between(0, LightRow::PLACED),
            Some(TreeKind::Frame) => {
                between(LightRow::CHANGES, LightRow::CHANGES | LightRow::PLACED)
            }
            _ => 0..tree.leaf_count,
        }
    }
}

/// The rule that is broken if a leaf does not contain the placed tree that it stands for. Energies are
/// not compared, because a light may get brighter.
fn sticks_out(leaf: &Node, instance: &InstanceRow, tree: &TreeRow) -> Option<Rule> {
    let to_local = instance.to_local.transform();
    let (root, outer) = (tree.root.bounds(), leaf.bounds());
    let world = root.aabb.transformed(&to_local.inverse());
    let slack =
        PLACING_TOLERANCE * (world.extent().max_element() + world.center().abs().max_element());
    let grown = Aabb { min: outer.aabb.min - slack, max: outer.aabb.max + slack };
    if !grown.contains_box(&world) {
        return Some(rules::PLACED_BOX_IS_INSIDE);
    }
    let (inner, cone) = (root.cone, outer.cone);
    if inner.theta_e > cone.theta_e || (inner.two_sided && !cone.two_sided) {
        return Some(rules::PLACED_CONE_IS_INSIDE);
    }
    let axis = to_local.inverse().transform_vector3(inner.axis).normalize_or_zero();
    let cosine = if cone.two_sided { axis.dot(cone.axis).abs() } else { axis.dot(cone.axis) };
    let needed = crate::math::angle::acos_clamped(cosine) + inner.theta_o;
    let is_inside = cone.theta_o >= std::f32::consts::PI - 1e-3 || needed <= cone.theta_o + 2e-3;
    (!is_inside).then_some(rules::PLACED_CONE_IS_INSIDE)
}
