//! Proof that a file is what the format says: that traversal ends, stays inside, and never calls
//! a lit point dark.

use super::node::{Link, Node};
use super::records::{self, LeafContent, LightRow, NO_TREE, TreeRow};
use super::sampling::first_leaf_of_right;
use super::tree::LightTree;
use crate::math::angle;
use crate::store::{SectionId, StoreError};
use std::f32::consts::PI;

/// Angles may differ by the rounding of their own computation.
const ANGLE_TOLERANCE: f32 = 5e-6;
/// Energies are sums of two `f32`.
const ENERGY_TOLERANCE: f64 = 1e-6;

type Checked<T = ()> = Result<T, StoreError>;

fn fail<T>(section: SectionId, rule: String) -> Checked<T> {
    Err(StoreError::Section { section, rule })
}

impl<D: AsRef<[u8]>> LightTree<D> {
    /// Checks everything the [format](crate::store) promises, in time linear in the file.
    ///
    /// # Errors
    /// The first rule that is broken, with its section and record.
    pub fn verify(&self) -> Result<(), StoreError> {
        self.verify_checksums()?;
        let static_emitters = self.verify_lights()?;
        let mut seen = vec![false; self.emitter_count()];
        let (mut pairs, mut leaves) = (0_u64, 0_u64);
        for (row, tree) in self.trees().iter().enumerate() {
            self.verify_row(row, tree, pairs, leaves)?;
            pairs += u64::from(tree.leaf_count) - 1;
            leaves += u64::from(tree.leaf_count);
            self.verify_nodes(row, tree)?;
            self.verify_leaves(row, tree, &mut seen)?;
        }
        if pairs != self.pairs().len() as u64 || leaves != self.leaves().len() as u64 {
            return fail(records::TREES, "the trees do not use all nodes and leaves".into());
        }
        if let Some(lost) = seen[..static_emitters].iter().position(|seen| !seen) {
            return fail(records::LEAVES, format!("emitter {lost} is in no tree"));
        }
        self.verify_frames()
    }

    /// The lights' rows; returns how many emitters stand still.
    fn verify_lights(&self) -> Checked<usize> {
        let mut next_emitter = 0_u64;
        let mut before: Option<&LightRow> = None;
        for (row, light) in self.lights().iter().enumerate() {
            let rule = if u64::from(light.first_emitter) != next_emitter {
                Some("its emitters do not follow those of the light before it")
            } else if light.moves > 1 || light.reserved != [0; 2] {
                Some("a field has an impossible value")
            } else if !(light.energy.is_finite() && light.energy >= 0.0) {
                Some("its energy is not a number")
            } else if self.light_path(light).is_empty() {
                Some("its path is not UTF-8 text inside PATH")
            } else if before.is_some_and(|b| {
                (b.moves, self.light_path(b)) >= (light.moves, self.light_path(light))
            }) {
                Some("lights are not in order of motion and path")
            } else {
                None
            };
            if let Some(rule) = rule {
                return fail(records::LIGHTS, format!("row {row}: {rule}"));
            }
            next_emitter += u64::from(light.emitter_count);
            before = Some(light);
        }
        if next_emitter > self.leaves().len() as u64 {
            return fail(records::LIGHTS, "there are more emitters than leaves".into());
        }
        Ok(self.static_emitter_count())
    }

    /// A tree's row: in range, and following the tree before it.
    fn verify_row(&self, row: usize, tree: &TreeRow, pairs: u64, leaves: u64) -> Checked {
        let count = u64::from(tree.leaf_count);
        let rule = if count == 0 || tree.reserved != 0 {
            "a field has an impossible value"
        } else if u64::from(tree.first_pair) != pairs || u64::from(tree.first_leaf) != leaves {
            "it does not follow the tree before it"
        } else if pairs + count - 1 > self.pairs().len() as u64
            || leaves + count > self.leaves().len() as u64
        {
            "it reaches beyond the nodes or leaves"
        } else {
            return Ok(());
        };
        fail(records::TREES, format!("row {row}: {rule}"))
    }

    /// All nodes of a tree: numbering, soundness, containment, energy.
    fn verify_nodes(&self, row: usize, tree: &TreeRow) -> Checked {
        if let Some(rule) = tree.root.broken_rule() {
            return fail(records::TREES, format!("row {row}: its root: {rule}"));
        }
        let expected = place(tree.first_pair, tree.first_leaf, tree.leaf_count);
        if tree.root.link() != expected {
            return fail(records::TREES, format!("row {row}: its root leads elsewhere"));
        }
        // Clusters still to be checked: parent, first leaf, leaf count. Links were checked to be
        // where preorder puts them before they are followed, so this visits every pair once.
        let mut open = vec![(&tree.root, tree.first_leaf, tree.leaf_count)];
        while let Some((parent, first_leaf, count)) = open.pop() {
            let Link::Inner(at) = parent.link() else { continue };
            let broken = |rule: &str| fail(records::NODES, format!("pair {at}: {rule}"));
            let pair = &self.pairs()[at as usize];
            let middle = first_leaf_of_right(pair, at, first_leaf);
            let left_count = middle.wrapping_sub(first_leaf);
            if left_count == 0 || left_count >= count {
                return broken("the leaves are not divided");
            }
            let places = [
                (place(at + 1, first_leaf, left_count), first_leaf, left_count),
                (place(at + left_count, middle, count - left_count), middle, count - left_count),
            ];
            for (child, (expected, first, count)) in pair.iter().zip(places) {
                if child.link() != expected {
                    return broken("a child leads elsewhere");
                }
                if let Some(rule) = child.broken_rule() {
                    return broken(rule);
                }
                if let Some(rule) = uncontained(parent, child) {
                    return broken(rule);
                }
                open.push((child, first, count));
            }
            let sum = f64::from(pair[0].energy()) + f64::from(pair[1].energy());
            if (sum - f64::from(parent.energy())).abs() > ENERGY_TOLERANCE * sum {
                return broken("the energies do not add up to the parent's");
            }
        }
        Ok(())
    }

    /// What the leaves stand for: each emitter once, and only trees that come earlier.
    fn verify_leaves(&self, row: usize, tree: &TreeRow, seen: &mut [bool]) -> Checked {
        let static_count = self.static_emitter_count();
        // A moving emitter may be in the tree of each frame, but only once in each.
        seen[static_count..].fill(false);
        for (leaf, content) in self.contents(tree) {
            let rule = match content {
                LeafContent::Tree(below) if below as usize >= row => "it stands for a later tree",
                LeafContent::Tree(_) => continue,
                LeafContent::Emitter(emitter) => match seen.get_mut(emitter as usize) {
                    None => "there is no such emitter",
                    Some(true) => "its emitter has another leaf too",
                    Some(once) => {
                        *once = true;
                        continue;
                    }
                },
            };
            return fail(records::LEAVES, format!("leaf {leaf}: {rule}"));
        }
        Ok(())
    }

    fn verify_frames(&self) -> Checked {
        let frames = self.frames();
        if !frames.is_sorted_by(|a, b| a.frame < b.frame) {
            return fail(records::FRAMES, "the frames do not ascend".into());
        }
        let trees = self.trees().len() as u32;
        match frames.iter().find(|row| row.tree >= trees && row.tree != NO_TREE) {
            Some(row) => fail(records::FRAMES, format!("frame {}: no such tree", row.frame)),
            None => Ok(()),
        }
    }
}

/// Where preorder puts a cluster.
fn place(first_pair: u32, first_leaf: u32, count: u32) -> Link {
    if count == 1 { Link::Leaf(first_leaf) } else { Link::Inner(first_pair) }
}

/// What of a child sticks out of its parent.
fn uncontained(parent: &Node, child: &Node) -> Option<&'static str> {
    let apart = (parent.center().as_dvec3() - child.center().as_dvec3()).abs();
    let reach = apart + child.half_extent().as_dvec3();
    if reach.cmpgt(parent.half_extent().as_dvec3()).any() {
        return Some("a child's box is not inside its parent's");
    }
    let (outer, inner) = (parent.bounds().cone, child.bounds().cone);
    if inner.theta_e > outer.theta_e + ANGLE_TOLERANCE || (inner.two_sided && !outer.two_sided) {
        return Some("a child shines where its parent does not");
    }
    let axis =
        if outer.two_sided && outer.axis.dot(inner.axis) < 0.0 { -inner.axis } else { inner.axis };
    let needed = angle::between(outer.axis, axis) + inner.theta_o;
    if outer.theta_o < PI - ANGLE_TOLERANCE && needed > outer.theta_o + ANGLE_TOLERANCE {
        return Some("a child's cone is not inside its parent's");
    }
    None
}
