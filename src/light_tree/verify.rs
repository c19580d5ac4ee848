//! Proof that a file is what the format says: that traversal ends, stays inside, and never calls
//! a lit point dark.

use super::group::{Group, WIDTH};
use super::node::{Link, MOST, Node};
use super::records::{self, FrameRow, InstanceRow, LightRow, NO_TREE, TreeKind, TreeRow};
use super::tree::LightTree;
use crate::bounds::Aabb;
use crate::store::{SectionId, StoreError};
use glam::{Affine3A, Mat3, Vec3};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering};

/// Energies are sums of a few `f32`.
const ENERGY_TOLERANCE: f64 = 1e-6;
/// What transforming a box may add, relative to its size and place.
const PLACING_TOLERANCE: f32 = 2e-5;

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
        self.verify_lights()?;
        if self.groups().len() >= MOST / WIDTH {
            return fail(records::GROUPS, "there are too many".into());
        }
        let mut groups = 0_u64;
        for (row, tree) in self.trees().iter().enumerate() {
            self.verify_row(row, tree, groups)?;
            groups += u64::from(tree.group_count);
        }
        if groups != self.groups().len() as u64 {
            return fail(records::TREES, "the trees do not use all groups".into());
        }
        self.verify_instances()?;
        // In the tree of which row each emitter was last seen, plus one; by its place in the tree.
        let most = self.trees().iter().map(|tree| tree.leaf_count).max();
        let seen: Vec<AtomicU32> = (0..most.unwrap_or(0)).map(|_| AtomicU32::new(0)).collect();
        for (row, tree) in self.trees().iter().enumerate() {
            self.verify_groups(row, tree, &seen)?;
            self.verify_contents(row, tree)?;
        }
        self.verify_frames()
    }

    /// The lights' rows.
    fn verify_lights(&self) -> Checked {
        let mut next_emitter = 0_u64;
        let mut before: Option<&LightRow> = None;
        for (row, light) in self.lights().iter().enumerate() {
            let rule = if u64::from(light.first_emitter) != next_emitter {
                Some("its emitters do not follow those of the light before it")
            } else if light.class > 7 || light.class & 5 == 4 || !light.look.is_sound() {
                Some("a field has an impossible value")
            } else if !(light.energy.is_finite() && light.energy >= 0.0) {
                Some("its energy is not a number")
            } else if self.light_path(light).is_empty() {
                Some("its path is not UTF-8 text inside PATH")
            } else if before.is_some_and(|b| {
                (b.class, self.light_path(b)) >= (light.class, self.light_path(light))
            }) {
                Some("lights are not in order of class and path")
            } else {
                None
            };
            if let Some(rule) = rule {
                return fail(records::LIGHTS, format!("row {row}: {rule}"));
            }
            next_emitter += u64::from(light.emitter_count);
            before = Some(light);
        }
        if next_emitter >= MOST as u64 {
            return fail(records::LIGHTS, "there are too many emitters".into());
        }
        let own = u64::from(self.first_of_class(LightRow::PLACED));
        if own > (self.groups().len() * WIDTH) as u64 {
            return fail(records::LIGHTS, "there are more emitters than leaves".into());
        }
        Ok(())
    }

    /// A tree's row: in range, and following the tree before it.
    fn verify_row(&self, row: usize, tree: &TreeRow, groups: u64) -> Checked {
        let before = row.checked_sub(1).and_then(|before| TreeKind::of(&self.trees()[before]));
        let kind = TreeKind::of(tree);
        let rule = if tree.group_count == 0 || tree.leaf_count == 0 || kind.is_none() {
            "a field has an impossible value"
        } else if before > kind || (before == kind && kind == Some(TreeKind::Still)) {
            "trees are not in order of their kinds"
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

    /// Trees put somewhere.
    fn verify_instances(&self) -> Checked {
        for (row, instance) in self.instances().iter().enumerate() {
            let tree = self.trees().get(instance.tree as usize);
            let rule = match tree.map(TreeKind::of) {
                None => "there is no such tree",
                Some(Some(TreeKind::Frame)) => "it places the tree of a frame",
                _ if !instance.to_local.is_sound() => "its transform bends shapes",
                _ if instance.reserved != [0; 2] => "a field has an impossible value",
                _ => continue,
            };
            return fail(records::INSTANCES, format!("row {row}: {rule}"));
        }
        Ok(())
    }

    /// All groups of a tree stand in preorder, each reached by one lane of an earlier one, and are
    /// contained in it. Then the walk down reaches every group, once, and ends.
    fn verify_groups(&self, row: usize, tree: &TreeRow, seen: &[AtomicU32]) -> Checked {
        let groups = self.groups_of(tree);
        let number = |own: usize| tree.first_group as usize + own;
        let parents = parents_of(groups).or_else(|(own, rule)| {
            fail(records::GROUPS, format!("group {}: {rule}", number(own)))
        })?;
        let first = self.own_emitters(tree).start;
        let check = |own: usize| {
            let parent = match own {
                0 => tree.root,
                _ => {
                    let (parent, lane) =
                        (parents[own] as usize / WIDTH, parents[own] as usize % WIDTH);
                    groups[parent].node(lane).expect("a lane that leads somewhere")
                }
            };
            let rule = check_group(&groups[own], &parent)
                .and_then(|()| self.check_links(&groups[own], row, first, seen));
            rule.or_else(|rule| fail(records::GROUPS, format!("group {}: {rule}", number(own))))
        };
        (0..groups.len()).into_par_iter().try_for_each(check)?;
        let count = |wanted: fn(Link) -> bool| {
            let lanes = |g: &Group| (0..WIDTH).filter(|&lane| wanted(g.link(lane))).count();
            groups.par_iter().map(lanes).sum::<usize>()
        };
        if count(|link| matches!(link, Link::Emitter(_) | Link::Instance(_)))
            != tree.leaf_count as usize
        {
            return fail(records::TREES, format!("row {row}: it has another number of leaves"));
        }
        Ok(())
    }

    /// A tree holds just the lights that it should. (That no emitter is there twice is known by now.)
    fn verify_contents(&self, row: usize, tree: &TreeRow) -> Checked {
        let kind = TreeKind::of(tree).expect("known by now");
        let class = if kind == TreeKind::Frame { LightRow::CHANGES } else { 0 };
        let own = self.own_emitters(tree);
        let mut firsts = Vec::new();
        let (mut emitters, mut below) = (0, 0);
        for node in self.groups_of(tree).iter().flat_map(Group::nodes) {
            match node.link() {
                Link::Emitter(emitter) if own.contains(&emitter) => emitters += 1,
                Link::Emitter(_) => {
                    let rule = format!("row {row}: an emitter does not belong in this tree");
                    return fail(records::TREES, rule);
                }
                Link::Instance(instance) => {
                    let instance = &self.instances()[instance as usize];
                    let tree = &self.trees()[instance.tree as usize];
                    if let Some(rule) = sticks_out(&node, instance, tree) {
                        return fail(records::GROUPS, format!("tree {row}: {rule}"));
                    }
                    match TreeKind::of(tree) {
                        Some(TreeKind::Still) => below += 1,
                        _ => firsts.push((instance.first_emitter, tree.leaf_count)),
                    }
                }
                Link::Inner(_) | Link::Nothing => {}
            }
        }
        let has_still = self.trees().iter().any(|t| TreeKind::of(t) == Some(TreeKind::Still));
        let expected_below = usize::from(kind == TreeKind::Frame && has_still);
        firsts.sort_unstable();
        let placed = match kind {
            TreeKind::Shared => Vec::new(),
            _ => self.lights_of_class(class | LightRow::PLACED),
        };
        if (emitters, below) != (own.len(), expected_below) || firsts != placed {
            let rule = format!("row {row}: it does not hold just the lights that it should");
            return fail(records::TREES, rule);
        }
        Ok(())
    }

    /// The emitters that have leaves of their own in a tree.
    fn own_emitters(&self, tree: &TreeRow) -> std::ops::Range<u32> {
        let between = |from, to| self.first_of_class(from)..self.first_of_class(to);
        match TreeKind::of(tree) {
            Some(TreeKind::Still) => between(0, LightRow::PLACED),
            Some(TreeKind::Frame) => {
                between(LightRow::CHANGES, LightRow::CHANGES | LightRow::PLACED)
            }
            _ => 0..tree.leaf_count,
        }
    }

    /// First emitter and count of the lights of a class.
    fn lights_of_class(&self, class: u32) -> Vec<(u32, u32)> {
        let lights = self.lights().iter().filter(|light| light.class == class);
        lights.map(|light| (light.first_emitter, light.emitter_count)).collect()
    }

    fn verify_frames(&self) -> Checked {
        let frames = self.frames();
        if !frames.is_sorted_by(|a, b| a.frame < b.frame) {
            return fail(records::FRAMES, "the frames do not ascend".into());
        }
        let is_frame = |row: u32| {
            self.trees().get(row as usize).and_then(TreeKind::of) == Some(TreeKind::Frame)
        };
        let changes = !self.lights_of_class(LightRow::CHANGES).is_empty()
            || !self.lights_of_class(LightRow::CHANGES | LightRow::PLACED).is_empty();
        let mut next_forced = 0_u64;
        for FrameRow { frame, tree, first_forced, forced_count } in frames {
            // Where only forced lights change, frames share the tree of what stands still.
            let sound = match *tree {
                NO_TREE => !changes,
                row if changes => is_frame(row),
                row => (row as usize) < self.trees().len() && !is_frame(row),
            };
            if !sound {
                return fail(records::FRAMES, format!("frame {frame}: no such tree"));
            }
            if u64::from(*first_forced) != next_forced {
                let rule =
                    format!("frame {frame}: its forced lights do not follow the last frame's");
                return fail(records::FRAMES, rule);
            }
            next_forced += u64::from(*forced_count);
            self.verify_forced(*first_forced as usize, *forced_count as usize)?;
        }
        match frames.is_empty() {
            true => self.verify_forced(0, self.forced().len()),
            false if next_forced != self.forced().len() as u64 => {
                fail(records::FORCED, "the frames do not use all entries".into())
            }
            false => Ok(()),
        }
    }

    /// A run of forced lights: all there are, in order.
    fn verify_forced(&self, first: usize, count: usize) -> Checked {
        let Some(run) = self.forced().get(first..).and_then(|rest| rest.get(..count)) else {
            return fail(records::FORCED, "a frame reaches beyond the entries".into());
        };
        let mut lights = Vec::new();
        for &row in run {
            let Some(instance) = self.instances().get(row as usize) else {
                return fail(records::FORCED, "there is no such instance".into());
            };
            let tree = &self.trees()[instance.tree as usize];
            if TreeKind::of(tree) != Some(TreeKind::Shared) {
                return fail(records::FORCED, "a forced light is not a tree of its own".into());
            }
            lights.push((instance.first_emitter, tree.leaf_count));
        }
        let forced = self.lights().iter().filter(|light| light.is(LightRow::FORCED));
        let forced: Vec<_> = forced.map(|l| (l.first_emitter, l.emitter_count)).collect();
        if lights != forced {
            return fail(records::FORCED, "these are not the forced lights".into());
        }
        Ok(())
    }

    /// What a group's leaves stand for: each emitter once in a tree, and only trees that come earlier.
    fn check_links(
        &self,
        group: &Group,
        row: usize,
        first: u32,
        seen: &[AtomicU32],
    ) -> Result<(), &'static str> {
        let mark = row as u32 + 1;
        for lane in 0..WIDTH {
            match group.link(lane) {
                Link::Nothing | Link::Inner(_) => {}
                Link::Instance(below) => match self.instances().get(below as usize) {
                    Some(instance) if (instance.tree as usize) < row => {}
                    Some(_) => return Err("a lane stands for a later tree"),
                    None => return Err("there is no such instance"),
                },
                Link::Emitter(emitter) => match seen.get(emitter.wrapping_sub(first) as usize) {
                    None => return Err("an emitter does not belong in this tree"),
                    Some(last) if last.swap(mark, Ordering::Relaxed) == mark => {
                        return Err("an emitter has two leaves in one tree");
                    }
                    Some(_) => {}
                },
            }
        }
        Ok(())
    }
}

/// For each group the slot of the lane that leads to it; or the group, and the rule it breaks.
fn parents_of(groups: &[Group]) -> Result<Vec<u32>, (usize, &'static str)> {
    let mut parents = vec![0; groups.len()];
    // Behind the last group of each group's subtree.
    let mut ends = vec![0; groups.len()];
    for own in (0..groups.len()).rev() {
        let mut end = own + 1;
        for lane in 0..WIDTH {
            let Link::Inner(ahead) = groups[own].link(lane) else { continue };
            let child = own + ahead as usize;
            if child >= groups.len() {
                return Err((own, "a lane leads out of its tree"));
            }
            if child != end {
                return Err((own, "the groups below it are not in preorder"));
            }
            parents[child] = (own * WIDTH + lane) as u32;
            end = ends[child];
        }
        ends[own] = end;
    }
    match ends.first() {
        Some(&end) if end != groups.len() => Err((end, "no lane leads to it")),
        _ => Ok(parents),
    }
}

/// What of a placed tree sticks out of the leaf that stands for it, if anything does. Its energy is
/// the leaf's own affair: a light may get brighter.
fn sticks_out(leaf: &Node, instance: &InstanceRow, tree: &TreeRow) -> Option<&'static str> {
    let to_local = Affine3A::from_mat3_translation(
        Mat3::from_cols_array_2d(&instance.to_local.axes),
        Vec3::from_array(instance.to_local.origin),
    );
    let (root, outer) = (tree.root.bounds(), leaf.bounds());
    let world = root.aabb.transformed(&to_local.inverse());
    let slack =
        PLACING_TOLERANCE * (world.extent().max_element() + world.center().abs().max_element());
    let grown = Aabb { min: outer.aabb.min - slack, max: outer.aabb.max + slack };
    if !grown.contains_box(&world) {
        return Some("a placed tree is not inside its leaf");
    }
    let (inner, cone) = (root.cone, outer.cone);
    if inner.theta_e > cone.theta_e || (inner.two_sided && !cone.two_sided) {
        return Some("a placed tree shines where its leaf does not");
    }
    let axis = to_local.inverse().transform_vector3(inner.axis).normalize_or_zero();
    let cosine = if cone.two_sided { axis.dot(cone.axis).abs() } else { axis.dot(cone.axis) };
    let needed = crate::math::angle::acos_clamped(cosine) + inner.theta_o;
    let is_inside = cone.theta_o >= std::f32::consts::PI - 1e-3 || needed <= cone.theta_o + 2e-3;
    (!is_inside).then_some("a placed tree's cone is not inside its leaf's")
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
