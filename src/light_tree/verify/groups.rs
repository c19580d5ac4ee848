//! Whether the groups of a tree form one: each is reached exactly once and lies inside its parent.

use super::{Checked, first_violation, rules};
use crate::light_tree::group::{Group, WIDTH};
use crate::light_tree::node::{Link, Node};
use crate::light_tree::records::TreeRow;
use crate::store::{Record, Rule, Violation};

/// Relative rounding error of an energy that is the sum of a few `f32`.
const ENERGY_TOLERANCE: f64 = 1e-6;

/// The result of checking one group. An error is the rule that is broken and the lane that breaks it,
/// `None` for the group as a whole.
type InGroup = Result<(), (Rule, Option<usize>)>;

/// Checks that the groups of a tree stand in preorder, that one lane of an earlier group leads to each,
/// and that this lane's node contains it. Then a walk down reaches every group once, and ends.
pub(super) fn verify_groups(tree: &TreeRow, groups: &[Group]) -> Checked {
    let name = |own: usize, (rule, lane): (Rule, Option<usize>)| {
        let group = tree.first_group + own as u32;
        let lane_of = |lane: usize| Record::Lane { group, lane: lane as u8 };
        Violation { rule, record: lane.map_or(Record::Row(group), lane_of) }
    };
    let parents = parents_of(groups)
        .map_err(|(own, lane)| name(own, (rules::GROUPS_ARE_IN_PREORDER, lane)))?;
    let check = |own: usize| {
        let (group, lane) = (parents[own] as usize / WIDTH, parents[own] as usize % WIDTH);
        let parent = match own {
            0 => tree.root,
            _ => groups[group].node(lane).expect("a lane that leads somewhere"),
        };
        check_group(&groups[own], &parent).map_err(|broken| name(own, broken))
    };
    first_violation(groups.len(), check)
}

/// For each group the slot of the lane that leads to it. An error is the group that is out of order, and
/// its lane that leads to a wrong group, if there is one.
pub(super) fn parents_of(groups: &[Group]) -> Result<Vec<u32>, (usize, Option<usize>)> {
    let mut parents = vec![0; groups.len()];
    // For each group, one past the last group of its subtree.
    let mut ends = vec![0; groups.len()];
    for own in (0..groups.len()).rev() {
        let mut end = own + 1;
        for lane in 0..WIDTH {
            let Link::Inner(ahead) = groups[own].link(lane) else { continue };
            let child = own + ahead as usize;
            if child >= groups.len() || child != end {
                return Err((own, Some(lane)));
            }
            parents[child] = (own * WIDTH + lane) as u32;
            end = ends[child];
        }
        ends[own] = end;
    }
    match ends.first() {
        Some(&end) if end != groups.len() => Err((end, None)),
        _ => Ok(parents),
    }
}

/// Checks soundness, containment and energy of a group's nodes.
fn check_group(group: &Group, parent: &Node) -> InGroup {
    if group.has_dirty_lane() {
        return Err((rules::UNUSED_LANE_IS_ZERO, None));
    }
    let mut sum = 0.0;
    for lane in 0..WIDTH {
        let Some(child) = group.node(lane) else { continue };
        if let Some(rule) = child.broken_rule().or_else(|| parent.uncontained(&child)) {
            return Err((rule, Some(lane)));
        }
        sum += f64::from(child.energy());
    }
    let off = (sum - f64::from(parent.energy())).abs();
    if sum > 0.0 && off <= ENERGY_TOLERANCE * sum {
        Ok(())
    } else {
        Err((rules::ENERGIES_ADD_UP, None))
    }
}
