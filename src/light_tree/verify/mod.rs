//! Proves that a file keeps the format: traversal ends, stays inside the file, and never calls a lit
//! point dark. Each check is one of the format's [rules].

mod contents;
mod frame;
mod groups;
mod lights;
mod links;
pub(super) mod rules;
mod textures;
mod walkable;

use super::group::WIDTH;
use super::node::{Link, MOST};
use super::records::{TreeKind, TreeRow};
use super::tree::LightTree;
use crate::math::Similarity;
use crate::store::{Record, Rule, StoreError, Violation};
use groups::verify_groups;
use rayon::prelude::*;

type Checked<T = ()> = Result<T, Violation>;

/// A violation of a rule by a row, unless the rule holds.
fn check(holds: bool, rule: Rule, row: usize) -> Checked {
    if holds { Ok(()) } else { Err(Violation { rule, record: Record::Row(row as u32) }) }
}

/// A violation of a rule by a section as a whole, unless the rule holds.
fn check_all(holds: bool, rule: Rule) -> Checked {
    if holds { Ok(()) } else { Err(Violation { rule, record: Record::All }) }
}

/// Checks rows in parallel. Returns the first violation in the file, whatever the number of threads.
fn first_violation(count: usize, check: impl Fn(usize) -> Checked + Sync) -> Checked {
    /// Rows checked by one task: finding the first among tasks costs more than checking a row.
    const CHUNK: usize = 1 << 10;
    let in_chunk = |chunk: usize| {
        let start = chunk * CHUNK;
        (start..count.min(start + CHUNK)).find_map(|row| check(row).err())
    };
    let chunks = (0..count.div_ceil(CHUNK)).into_par_iter();
    chunks.find_map_first(in_chunk).map_or(Ok(()), Err)
}

impl<D: AsRef<[u8]> + Sync> LightTree<D> {
    /// Checks everything the [format](crate::store) promises, in time linear in the file.
    ///
    /// # Errors
    /// The first rule that is broken, with its section and record.
    pub fn verify(&self) -> Result<(), StoreError> {
        // In parallel. A wrong checksum is returned rather than a broken rule, whichever is found first.
        let (sums, rules) = rayon::join(|| self.verify_checksums(), || self.verify_rules());
        sums?;
        rules.map_err(StoreError::Broken)?;
        self.known().note_whole();
        Ok(())
    }

    fn verify_rules(&self) -> Checked {
        let trees = || self.verify_trees().and_then(|()| self.verify_instances());
        let rows = || {
            self.verify_lights()
                .and_then(|()| self.verify_textures())
                .and_then(|()| self.verify_links())
        };
        let (lights, trees) = rayon::join(rows, trees);
        lights?;
        trees?;
        let whole = |row, tree: &TreeRow, seen: &mut Vec<u32>| {
            let groups = || verify_groups(tree, self.groups_of(tree));
            let (groups, contents) = rayon::join(groups, || self.verify_contents(row, tree, seen));
            groups.and(contents)
        };
        let trees = self.trees().par_iter().enumerate();
        let trees = trees.map_init(Vec::new, |seen, (row, tree)| whole(row, tree, seen));
        trees.find_first(Result::is_err).unwrap_or(Ok(()))?;
        self.verify_frames()
    }

    /// Checks the rows of the trees: each is in range and follows the tree before it.
    fn verify_trees(&self) -> Checked {
        let all = self.groups().len() as u64;
        check_all(self.groups().len() < MOST / WIDTH, rules::GROUPS_ARE_NUMBERED)?;
        let mut groups = 0_u64;
        let mut before = None;
        for (row, tree) in self.trees().iter().enumerate() {
            let kind = TreeKind::of(tree);
            let has_some = tree.group_count > 0 && tree.leaf_count > 0;
            check(kind.is_some() && has_some, rules::TREE_IS_OF_A_KIND, row)?;
            let is_second_still = before == kind && kind == Some(TreeKind::Still);
            check(before <= kind && !is_second_still, rules::TREES_ARE_IN_ORDER, row)?;
            let follows = u64::from(tree.first_group) == groups;
            groups += u64::from(tree.group_count);
            check(follows && groups <= all, rules::TREES_USE_THE_GROUPS, row)?;
            let root_is_sound =
                tree.root.broken_rule().is_none() && tree.root.link() == Link::Nothing;
            check(root_is_sound, rules::ROOT_IS_SOUND, row)?;
            before = kind;
        }
        check_all(groups == all, rules::TREES_USE_THE_GROUPS)
    }

    /// Checks the rows of the instances.
    fn verify_instances(&self) -> Checked {
        (0..self.instances().len()).try_for_each(|row| self.verify_instance(row))
    }

    /// Checks one of them.
    fn verify_instance(&self, row: usize) -> Checked {
        let instance = &self.instances()[row];
        let kind = self.trees().get(instance.tree as usize).and_then(TreeKind::of);
        let is_placeable = matches!(kind, Some(TreeKind::Shared | TreeKind::Still));
        check(is_placeable, rules::INSTANCE_IS_OF_A_TREE, row)?;
        check(instance.to_local.is_sound(), rules::INSTANCE_KEEPS_SHAPES, row)?;
        let is_spare = instance.reserved == [0; 2] || self.is_of_later_version();
        check(is_spare, rules::INSTANCE_SPARE_IS_ZERO, row)?;
        let is_in_place = instance.to_local == Similarity::IDENTITY && instance.first_emitter == 0;
        let is_still = kind == Some(TreeKind::Still);
        check(is_in_place || !is_still, rules::STILL_IS_IN_PLACE, row)
    }
}

#[cfg(test)]
mod tests {
    /// The page has every rule, by its number and in its words; and no other.
    #[test]
    fn the_page_has_the_rules() {
        let page = include_str!("../../store/format.md");
        let all = super::rules::RULES.concat();
        let rows: Vec<String> =
            all.iter().map(|rule| format!("| {rule} | {} |", rule.text)).collect();
        let number = |line: &str| {
            let (part, number) = line.strip_prefix("| ")?.split(" | ").next()?.split_once(' ')?;
            all.iter().find(|rule| rule.part.to_string() == part)?;
            number.parse::<u8>().ok()
        };
        let on_page: Vec<&str> = page.lines().filter(|line| number(line).is_some()).collect();
        assert_eq!(on_page, rows);
    }
}
