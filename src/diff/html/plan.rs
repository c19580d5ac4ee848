//! Where the lights are that changed, among those that did not.

use super::key;
use crate::bounds::Aabb;
use crate::diff::{Change, Diff, LightCard, Mark, Verb, text::details};
use crate::page::{self, Count, Cuboid, Ink, Plan, Short};
use glam::Vec3;

/// Changes that are drawn, at most, and as many lights that did not change; the heaviest.
const MOST_MARKS: usize = 5_000;

/// The picture; `None` if all lights are at infinity.
pub fn plan(diff: &Diff) -> Option<Plan> {
    let mut changed: Vec<page::Mark> = diff.changes.iter().filter_map(mark).collect();
    let mut unchanged: Vec<&Mark> = diff.unchanged.iter().collect();
    let places = changed.iter().flat_map(|mark| [Some(mark.at), mark.from]).flatten();
    let around = Aabb::around(places.chain(unchanged.iter().map(|mark| mark.center_m.into())));
    if around.is_empty() {
        return None;
    }
    let is_shaded = unchanged.len() > MOST_MARKS;
    let caption = caption(changed.len(), unchanged.len());
    let mut plan = Plan::new(&caption, Cuboid { min: around.min, max: around.max });
    if is_shaded {
        for mark in &unchanged {
            plan.shade(mark.center_m.into(), mark.energy_cd.into());
        }
    }
    let verbs = [Verb::Added, Verb::Removed, Verb::Dirtied, Verb::Renamed].map(key);
    let is_there = |ink| changed.iter().any(|mark| mark.ink == ink);
    let kinds = verbs.into_iter().filter(|&(ink, _)| is_there(ink));
    let quiet = (!unchanged.is_empty()).then_some((Ink::Grey, "unchanged"));
    plan.kinds = kinds.chain(quiet).map(|(ink, name)| (ink, name.into())).collect();

    unchanged.sort_by(|a, b| b.energy_cd.total_cmp(&a.energy_cd));
    changed.sort_by(|a, b| b.weight.total_cmp(&a.weight));
    let quiet = |mark: &Mark| page::Mark {
        at: mark.center_m.into(),
        from: None,
        weight: mark.energy_cd,
        ink: Ink::Grey,
        label: format!("unchanged, {} cd", Short(mark.energy_cd.into())),
    };
    plan.marks.extend(unchanged.into_iter().take(MOST_MARKS).map(quiet));
    plan.marks.extend(changed.into_iter().take(MOST_MARKS));
    Some(plan)
}

fn caption(changed: usize, unchanged: usize) -> String {
    let of = |all: usize| match all > MOST_MARKS {
        true => format!("the {} heaviest of {}", Count(MOST_MARKS), Count(all)),
        false => format!("all {}", Count(all)),
    };
    let mut caption = format!(
        "Lights that changed ({}), with a line to where they were. The area is in proportion to the \
         energy, the larger of before and after, down to a size that can be seen.",
        of(changed)
    );
    if unchanged > 0 {
        caption += &format!(" Lights that did not change: {}.", of(unchanged));
    }
    if unchanged > MOST_MARKS {
        caption += " The grey ground is the energy of all of these.";
    }
    caption
}

/// What is drawn of a change; nothing of lights at infinity.
fn mark(change: &Change) -> Option<page::Mark> {
    let middle = |card: &Option<LightCard>| Some(Vec3::from(card.as_ref()?.place?.center_m));
    let energy = |card: &Option<LightCard>| card.as_ref().map_or(0.0, |card| card.energy);
    let (before, after) = (middle(&change.before), middle(&change.after));
    let at = after.or(before)?;
    let (ink, verb) = key(change.verb);
    Some(page::Mark {
        at,
        from: before.filter(|before| *before != at),
        weight: energy(&change.before).max(energy(&change.after)),
        ink,
        label: format!("{}\n{verb}: {}", change.path(), details(change)),
    })
}
