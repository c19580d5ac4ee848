//! A comparison as a page: what changed, where it is, and where the camera sees it.

use super::card::LightCard;
use super::change::{Change, Difference, Verb};
use super::heat::{HeatCell, HeatMap};
use super::{Diff, Mark};
use crate::bounds::Aabb;
use crate::page::{self, Cell, Column, Cuboid, Ink, Page, Plan, Scale, Table, count, rounded};
use glam::Vec3;

/// Changes in the table, at most: those that matter most.
const MOST_ROWS: usize = 2_000;
/// Changes that are drawn, at most, and as many lights that did not change; the heaviest.
const MOST_MARKS: usize = 5_000;
/// Changes of brightness are shown up to so many stops.
const MOST_STOPS: f32 = 2.0;

/// The page of a comparison. The picture of where the lights are shows those that did not change, and
/// the page has a map of the camera's view, if the comparison was asked for them.
pub fn html(diff: &Diff) -> String {
    let mut page = Page::new(&format!("{} → {}", diff.before.file, diff.after.file));
    summary(&mut page, diff);
    if let Some(plan) = plan(diff) {
        page.heading("Where the lights are");
        page.add(&plan);
    }
    if let Some(heat) = &diff.heat {
        page.heading("What the camera sees of it");
        heat_maps(&mut page, heat);
    }
    page.heading("Changes");
    match diff.changes.is_empty() {
        true => page.text("None."),
        false => page.add(&table(diff)),
    }
    page.finish()
}

fn summary(page: &mut Page, diff: &Diff) {
    let totals = &diff.totals;
    let (before, after) = (&totals.before, &totals.after);
    let both = |before: String, after: String| match before == after {
        true => after,
        false => format!("{before} → {after}"),
    };
    let reals = |before, after, unit| format!("{} {unit}", both(rounded(before), rounded(after)));
    let mut facts = vec![
        ("lights", both(count(before.lights), count(after.lights))),
        ("emitters", both(count(before.emitters), count(after.emitters))),
        ("energy", reals(before.energy_cd, after.energy_cd, "cd")),
    ];
    if before.illuminance_lux != 0.0 || after.illuminance_lux != 0.0 {
        let lux = reals(before.illuminance_lux, after.illuminance_lux, "lux");
        facts.push(("from infinity", lux));
    }
    facts.extend([
        ("added", count(totals.added)),
        ("removed", count(totals.removed)),
        ("dirtied", count(totals.dirtied)),
        ("renamed", count(totals.renamed)),
        ("unchanged", count(totals.unchanged)),
    ]);
    if let Some(picking) = &diff.picking {
        let percent = |share: f64| format!("{} %", rounded(100.0 * share));
        facts.push(("picks that go elsewhere", percent(picking.mean)));
        facts.push(("at the worst probe", percent(picking.worst)));
    }
    page.facts(facts);
}

fn ink(verb: Verb) -> Ink {
    match verb {
        Verb::Added => Ink::Green,
        Verb::Removed => Ink::Red,
        Verb::Dirtied => Ink::Orange,
        Verb::Renamed => Ink::Violet,
    }
}

fn name(verb: Verb) -> &'static str {
    match verb {
        Verb::Added => "added",
        Verb::Removed => "removed",
        Verb::Dirtied => "dirtied",
        Verb::Renamed => "renamed",
    }
}

/// The middle of a light that is somewhere.
fn middle(card: &Option<LightCard>) -> Option<Vec3> {
    Some(card.as_ref()?.place?.center_m.into())
}

/// What is drawn of a change; nothing of lights at infinity.
fn mark(change: &Change) -> Option<page::Mark> {
    let before = middle(&change.before);
    let at = middle(&change.after).or(before)?;
    let energy = |card: &Option<LightCard>| card.as_ref().map_or(0.0, |card| card.energy);
    Some(page::Mark {
        at,
        from: before.filter(|before| *before != at),
        weight: energy(&change.before).max(energy(&change.after)),
        ink: ink(change.verb),
        label: format!("{}\n{}: {}", change.path(), name(change.verb), words(change)),
    })
}

fn plan(diff: &Diff) -> Option<Plan> {
    let changed: Vec<page::Mark> = diff.changes.iter().filter_map(mark).collect();
    let mut unchanged: Vec<&Mark> = diff.unchanged.iter().collect();
    let points = changed.iter().flat_map(|mark| [Some(mark.at), mark.from]).flatten();
    let around = Aabb::around(points.chain(unchanged.iter().map(|mark| mark.center_m.into())));
    if around.is_empty() {
        return None;
    }
    let drawn = |all: usize| match all > MOST_MARKS {
        true => format!("the {} heaviest of {}", count(MOST_MARKS), count(all)),
        false => format!("all {}", count(all)),
    };
    let mut caption = format!(
        "Changes ({}), a line to where they were; their area is in proportion to their energy, the \
         larger of before and after, down to a size that can be seen.",
        drawn(changed.len())
    );
    if !unchanged.is_empty() {
        caption += &format!(" Lights that did not change: {}.", drawn(unchanged.len()));
    }
    let is_shaded = unchanged.len() > MOST_MARKS;
    if is_shaded {
        caption += " The grey ground is the energy of all of them.";
    }
    let mut plan = Plan::new(&caption, Cuboid { min: around.min, max: around.max });
    if is_shaded {
        for mark in &unchanged {
            plan.shade(mark.center_m.into(), mark.energy_cd.into());
        }
    }
    unchanged.sort_by(|a, b| b.energy_cd.total_cmp(&a.energy_cd));
    let quiet = unchanged.iter().take(MOST_MARKS).map(|mark| page::Mark {
        at: mark.center_m.into(),
        from: None,
        weight: mark.energy_cd,
        ink: Ink::Grey,
        label: format!("unchanged, {} cd", rounded(mark.energy_cd.into())),
    });
    let kinds = [Verb::Added, Verb::Removed, Verb::Dirtied, Verb::Renamed];
    let is_there = |ink| changed.iter().any(|mark| mark.ink == ink);
    plan.kinds = kinds
        .into_iter()
        .filter(|&verb| is_there(ink(verb)))
        .map(|verb| (ink(verb), name(verb).to_string()))
        .chain((!unchanged.is_empty()).then(|| (Ink::Grey, "unchanged".to_string())))
        .collect();
    plan.marks.extend(quiet);
    let mut changed = changed;
    changed.sort_by(|a, b| b.weight.total_cmp(&a.weight));
    plan.marks.extend(changed.into_iter().take(MOST_MARKS));
    Some(plan)
}

fn heat_maps(page: &mut Page, heat: &HeatMap) {
    let shown = |of: fn(&HeatCell) -> f32| -> Vec<f32> {
        heat.cells.iter().map(|cell| cell.as_ref().map_or(f32::NAN, of)).collect()
    };
    page.text(if heat.shadows {
        "Direct light that the first surface reflects to the camera, of all lights and with their \
         shadows."
    } else {
        "Direct light that the first surface reflects to the camera, of all lights; none casts a shadow \
         here, so light from behind a wall counts too."
    });
    let both = [shown(|cell| cell.before_nits), shown(|cell| cell.after_nits)];
    // Nine cells in ten are darker than white.
    let mut nits: Vec<f32> = both.concat().into_iter().filter(|nits| *nits > 0.0).collect();
    nits.sort_by(f32::total_cmp);
    let white = nits.get(nits.len() * 9 / 10).copied().unwrap_or(1.0);
    let width = heat.width;
    page.add(&page::HeatMap {
        caption: "Change of brightness; where it is dark before and after, none.".into(),
        width,
        values: shown(HeatCell::stops),
        scale: Scale::Gain { limit: MOST_STOPS, unit: "stops".into() },
    });
    for (caption, values) in ["Before, nits", "After, nits"].into_iter().zip(both) {
        let scale = Scale::Grey { white };
        page.add(&page::HeatMap { caption: caption.into(), width, values, scale });
    }
}

/// What changed, in words.
fn words(change: &Change) -> String {
    let aspects: Vec<&str> = change.differences.iter().map(Difference::aspect).collect();
    aspects.join(", ")
}

fn table(diff: &Diff) -> Table {
    let number = |value: f32| Cell::Number(value.into(), rounded(value.into()));
    let maybe = |value: Option<f32>| value.map_or(Cell::Empty, number);
    let row = |change: &Change| {
        let cards = (&change.before, &change.after);
        let path = match cards {
            (Some(before), Some(after)) if before.path != after.path => {
                format!("{} (was {})", after.path, before.path)
            }
            _ => change.path().to_string(),
        };
        let energy = |card: &Option<LightCard>| card.as_ref().map(|card| card.energy);
        let stops = match (energy(cards.0), energy(cards.1)) {
            (Some(before), Some(after)) => Some((after / before).log2()),
            _ => None,
        };
        let moved = change.differences.iter().find_map(|difference| match difference {
            Difference::Transform { moved_m, .. } => Some(*moved_m),
            _ => None,
        });
        vec![
            Cell::Key(ink(change.verb), name(change.verb).into()),
            Cell::Text(path),
            Cell::Text(words(change)),
            Cell::Number(change.share, rounded(100.0 * change.share)),
            maybe(energy(cards.0)),
            maybe(energy(cards.1)),
            maybe(stops.filter(|stops| stops.is_finite())),
            maybe(moved),
        ]
    };
    Table {
        caption: format!(
            "{} Share: of all energy or of all picks, whichever it gained or lost more of.",
            match diff.changes.len() {
                all if all > MOST_ROWS => {
                    format!("The {} of {} that matter most.", count(MOST_ROWS), count(all))
                }
                all => format!("All {}, those that matter most first.", count(all)),
            }
        ),
        columns: vec![
            Column::text("change"),
            Column::text("path"),
            Column::text("what"),
            Column::number("share, %"),
            Column::number("before"),
            Column::number("after"),
            Column::number("stops"),
            Column::number("moved, m"),
        ],
        rows: diff.changes.iter().take(MOST_ROWS).map(row).collect(),
    }
}
