//! Proof that a file is what the format says: that traversal ends, stays inside, and never calls
//! a lit point dark.

use super::group::{Group, WIDTH};
use super::node::{Link, MOST, Node};
use super::records::{self, LightRow, NO_TREE, Parent, TreeRow};
use super::tree::LightTree;
use crate::store::{SectionId, StoreError};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering};

/// Energies are sums of a few `f32`.
const ENERGY_TOLERANCE: f64 = 1e-6;

type Checked<T = ()> = Result<T, StoreError>;

fn fail<T>(section: SectionId, rule: String) -> Checked<T> {
    Err(StoreError::Section { section, rule })
}

impl<D: AsRef<[u8]> + Sync> LightTree<D> {
    /// Checks everything the [format](crate::store) promises, in time linear in the file.
    ///
    /// # Errors
    /// The first rule that is broken, with its section and record.
    pub fn verify(&self) -> Result<(), StoreError> {
        self.verify_checksums()?;
        let static_emitters = self.verify_lights()?;
        if self.groups().len() >= MOST / WIDTH || self.parents().len() != self.groups().len() {
            return fail(records::PARENTS, "there is not one for each group".into());
        }
        // In the tree of which row each emitter was last seen, plus one.
        let seen: Vec<AtomicU32> = (0..self.emitter_count()).map(|_| AtomicU32::new(0)).collect();
        let mut groups = 0_u64;
        for (row, tree) in self.trees().iter().enumerate() {
            self.verify_row(row, tree, groups)?;
            groups += u64::from(tree.group_count);
            self.verify_groups(row, tree, &seen)?;
            self.verify_contents(row, tree, static_emitters)?;
        }
        if groups != self.groups().len() as u64 {
            return fail(records::TREES, "the trees do not use all groups".into());
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
        if next_emitter > (self.groups().len() * WIDTH) as u64 {
            return fail(records::LIGHTS, "there are more emitters than leaves".into());
        }
        Ok(self.static_emitter_count())
    }

    /// A tree's row: in range, and following the tree before it.
    fn verify_row(&self, row: usize, tree: &TreeRow, groups: u64) -> Checked {
        let rule = if tree.group_count == 0 || tree.leaf_count == 0 || tree.reserved != 0 {
            "a field has an impossible value"
        } else if u64::from(tree.first_group) != groups {
            "it does not follow the tree before it"
        } else if groups + u64::from(tree.group_count) > self.groups().len() as u64 {
            "it reaches beyond the groups"
        } else if let Some(rule) = tree.root.broken_rule() {
            rule
        } else if tree.root.link() != Link::Nothing {
            "its root leads somewhere"
        } else {
            return Ok(());
        };
        fail(records::TREES, format!("row {row}: {rule}"))
    }

    /// All groups of a tree: each has one lane that leads to it, from an earlier group of the same
    /// tree, and is contained in it. Then the walk down reaches every group, once, and ends.
    fn verify_groups(&self, row: usize, tree: &TreeRow, seen: &[AtomicU32]) -> Checked {
        let groups = self.groups_of(tree);
        let parents = &self.parents()[tree.first_group as usize..][..groups.len()];
        let check = |own: usize| {
            let rule = match parent_of(groups, parents, own, &tree.root) {
                Ok(parent) => check_group(&groups[own], &parent)
                    .and_then(|()| check_links(&groups[own], row, tree, seen)),
                Err(rule) => Err(rule),
            };
            let number = tree.first_group as usize + own;
            rule.or_else(|rule| fail(records::GROUPS, format!("group {number}: {rule}")))
        };
        (0..groups.len()).into_par_iter().try_for_each(check)?;
        let count = |wanted: fn(Link) -> bool| {
            let lanes = |g: &Group| (0..WIDTH).filter(|&lane| wanted(g.link(lane))).count();
            groups.par_iter().map(lanes).sum::<usize>()
        };
        if count(|link| matches!(link, Link::Inner(_))) != groups.len() - 1 {
            return fail(records::GROUPS, format!("tree {row}: lanes and groups do not match"));
        }
        if count(|link| matches!(link, Link::Emitter(_) | Link::Tree(_)))
            != tree.leaf_count as usize
        {
            return fail(records::TREES, format!("row {row}: it has another number of leaves"));
        }
        Ok(())
    }

    /// A tree holds either all that stands still, and is the first; or all that moves, and the tree
    /// of what stands still as one leaf. (That no emitter is there twice is known by now.)
    fn verify_contents(&self, row: usize, tree: &TreeRow, static_emitters: usize) -> Checked {
        let moving = self.emitter_count() - static_emitters;
        let is_static = row == 0 && static_emitters > 0;
        let (mut wanted, mut below) = (0, 0);
        for node in self.groups_of(tree).iter().flat_map(Group::nodes) {
            match node.link() {
                Link::Emitter(emitter) => {
                    wanted +=
                        usize::from((emitter as usize) < static_emitters) ^ usize::from(!is_static);
                }
                Link::Tree(stands_for) => {
                    below += 1;
                    let root = &self.trees()[stands_for as usize].root;
                    let off = f64::from(root.energy()) - f64::from(node.energy());
                    let sticks_out = node.uncontained(root).is_some();
                    if stands_for != 0
                        || sticks_out
                        || off.abs() > ENERGY_TOLERANCE * f64::from(root.energy())
                    {
                        return fail(
                            records::GROUPS,
                            format!("tree {row}: a leaf is not the tree it stands for"),
                        );
                    }
                }
                Link::Inner(_) | Link::Nothing => {}
            }
        }
        let expected = if is_static {
            (static_emitters, 0)
        } else {
            (moving, usize::from(static_emitters > 0))
        };
        if (wanted, below) != expected || tree.leaf_count as usize != wanted + below {
            let rule = format!("row {row}: it does not hold just the emitters that it should");
            return fail(records::TREES, rule);
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

/// The node whose children a group holds; the lane must lead back to the group.
fn parent_of(
    groups: &[Group],
    parents: &[Parent],
    own: usize,
    root: &Node,
) -> Result<Node, &'static str> {
    match (own, parents[own].get()) {
        (0, None) => Ok(*root),
        (0, Some(_)) => Err("the first group of a tree has a parent"),
        (_, None) => Err("it has no parent"),
        (_, Some((back, lane))) => {
            let above = own.checked_sub(back as usize).filter(|&above| above < own);
            let node = above.and_then(|above| groups[above].node(lane));
            let node = node.filter(|node| node.link() == Link::Inner(back));
            node.ok_or("its parent does not lead to it")
        }
    }
}

/// Soundness, containment and energy of a group's nodes.
fn check_group(group: &Group, parent: &Node) -> Result<(), &'static str> {
    if group.has_dirty_lane() {
        return Err("a lane that is not used is not zero");
    }
    let mut sum = 0.0;
    for child in group.nodes() {
        if let Some(rule) = child.broken_rule() {
            return Err(rule);
        }
        if let Some(rule) = parent.uncontained(&child) {
            return Err(rule);
        }
        sum += f64::from(child.energy());
    }
    if (sum - f64::from(parent.energy())).abs() > ENERGY_TOLERANCE * sum || sum == 0.0 {
        return Err("the energies do not add up to the parent's");
    }
    Ok(())
}

/// What a group's leaves stand for: each emitter once in a tree, and only trees that come earlier.
fn check_links(
    group: &Group,
    row: usize,
    tree: &TreeRow,
    seen: &[AtomicU32],
) -> Result<(), &'static str> {
    let mark = row as u32 + 1;
    for lane in 0..WIDTH {
        match group.link(lane) {
            Link::Nothing => {}
            Link::Inner(ahead) if ahead < tree.group_count => {}
            Link::Inner(_) => return Err("a lane leads out of its tree"),
            Link::Tree(below) if (below as usize) < row => {}
            Link::Tree(_) => return Err("a lane stands for a later tree"),
            Link::Emitter(emitter) => match seen.get(emitter as usize) {
                None => return Err("there is no such emitter"),
                Some(last) if last.swap(mark, Ordering::Relaxed) == mark => {
                    return Err("an emitter has two leaves in one tree");
                }
                Some(_) => {}
            },
        }
    }
    Ok(())
}
