//! A comparison as a page: what changed, where it is, and where the camera sees it.

mod plan;

use super::card::LightCard;
use super::change::{Change, Difference, Verb};
use super::heat::{HeatCell, HeatMap};
use super::text::details;
use super::{Diff, Tally};
use crate::page::{self, Cell, Column, Count, Ink, Page, Scale, Short, Table};
use plan::plan;

/// Changes in the table, at most: those that matter most.
const MOST_ROWS: usize = 2_000;
/// Changes of brightness are shown up to so many stops.
const MOST_STOPS: f32 = 2.0;

/// The page of a comparison. If the comparison was asked for them, it also shows the lights that did not
/// change, and what the camera sees.
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
    let both = |of: &dyn Fn(&Tally) -> String| {
        let (before, after) = (of(&totals.before), of(&totals.after));
        if before == after { after } else { format!("{before} → {after}") }
    };
    let mut facts = vec![
        ("lights", both(&|tally| Count(tally.lights).to_string())),
        ("emitters", both(&|tally| Count(tally.emitters).to_string())),
        ("energy, cd", both(&|tally| Short(tally.energy_cd).to_string())),
    ];
    if totals.before.illuminance_lux > 0.0 || totals.after.illuminance_lux > 0.0 {
        facts.push(("from infinity, lux", both(&|tally| Short(tally.illuminance_lux).to_string())));
    }
    if let Some(picking) = &diff.picking {
        let [mean, worst] = [100.0 * picking.mean, 100.0 * picking.worst];
        facts.push(("picks that go elsewhere", format!("{mean:.1} %, at worst {worst:.1} %")));
    }
    facts.extend([
        ("added", Count(totals.added).to_string()),
        ("removed", Count(totals.removed).to_string()),
        ("dirtied", Count(totals.dirtied).to_string()),
        ("renamed", Count(totals.renamed).to_string()),
        ("unchanged", Count(totals.unchanged).to_string()),
    ]);
    page.facts(facts);
}

/// The colour and the word of a verb.
fn key(verb: Verb) -> (Ink, &'static str) {
    match verb {
        Verb::Added => (Ink::Green, "added"),
        Verb::Removed => (Ink::Red, "removed"),
        Verb::Dirtied => (Ink::Orange, "dirtied"),
        Verb::Renamed => (Ink::Violet, "renamed"),
    }
}

fn heat_maps(page: &mut Page, heat: &HeatMap) {
    page.text(if heat.shadows {
        "Direct light that the first surface reflects to the camera, of all lights, with shadows."
    } else {
        "Direct light that the first surface reflects to the camera, of all lights, without shadows: \
         light from behind a wall counts too."
    });
    let values = |of: &dyn Fn(&HeatCell) -> f32| -> Vec<f32> {
        heat.cells.iter().map(|cell| cell.as_ref().map_or(f32::NAN, of)).collect()
    };
    let both = [values(&|cell| cell.before_nits), values(&|cell| cell.after_nits)];
    // One cell in fifty may be brighter than white.
    let mut nits: Vec<f32> = both.concat().into_iter().filter(|nits| *nits > 0.0).collect();
    nits.sort_by(f32::total_cmp);
    let white = nits.get(nits.len() * 49 / 50).copied().unwrap_or(1.0);
    let [before, after] = both;
    let pictures = [
        (
            "Change",
            values(&HeatCell::stops),
            Scale::Gain { limit: MOST_STOPS, unit: "stops".into() },
        ),
        ("Before, nits", before, Scale::Grey { white }),
        ("After, nits", after, Scale::Grey { white }),
    ];
    for (caption, values, scale) in pictures {
        page.add(&page::HeatMap { caption: caption.into(), width: heat.width, values, scale });
    }
}

fn table(diff: &Diff) -> Table {
    let maybe = |value: Option<f32>| value.map_or(Cell::Empty, |value| Cell::short(value.into()));
    let energy = |card: &Option<LightCard>| card.as_ref().map(|card| card.energy);
    let row = |change: &Change| {
        let (before, after) = (energy(&change.before), energy(&change.after));
        let stops = before.zip(after).map(|(before, after)| (after / before).log2());
        let moved = change.differences.iter().find_map(|difference| match difference {
            Difference::Transform { moved_m, .. } => Some(*moved_m),
            _ => None,
        });
        let (ink, verb) = key(change.verb);
        vec![
            Cell::Key(ink, verb.into()),
            Cell::Text(change.path().into()),
            Cell::Text(details(change)),
            Cell::short(100.0 * change.share),
            maybe(before),
            maybe(after),
            maybe(stops.filter(|stops| stops.is_finite())),
            maybe(moved),
        ]
    };
    let all = diff.changes.len();
    let listed = match all > MOST_ROWS {
        true => format!("The {} of {} that matter most.", Count(MOST_ROWS), Count(all)),
        false => format!("All {}, those that matter most first.", Count(all)),
    };
    let mut columns: Vec<Column> = ["change", "path", "what"].map(Column::text).into();
    columns.extend(["share, %", "before", "after", "stops", "moved, m"].map(Column::number));
    Table {
        caption: format!(
            "{listed} Share: of all energy or of all picks, whichever it gained or lost more of. Before, \
             after: energy in candela, of suns and domes in lux."
        ),
        columns,
        rows: diff.changes.iter().take(MOST_ROWS).map(row).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diff::{Place, SideName, Totals};

    fn card(path: String, x: f32) -> LightCard {
        LightCard {
            path,
            kind: None,
            emitters: 1,
            energy: 2.0,
            color: None,
            place: Some(Place { center_m: [x, 0.0, 0.0], size_m: [0.0; 3] }),
            axis: None,
            half_angle_deg: 180.0,
            range_m: None,
            forced: false,
            changes: false,
        }
    }

    #[test]
    fn very_many_changes_are_left_out_and_that_is_said() {
        let change = |i: usize| Change {
            verb: Verb::Dirtied,
            share: 1e-4,
            before: Some(card(format!("/lamp_{i}"), 0.0)),
            after: Some(card(format!("/lamp_{i}"), i as f32)),
            differences: Vec::new(),
        };
        let side = |file: &str| SideName { file: file.into(), is_tree: true };
        let diff = Diff {
            before: side("a.ltree"),
            after: side("b.ltree"),
            totals: Totals::default(),
            picking: None,
            changes: (0..MOST_ROWS + 4_000).map(change).collect(),
            table: None,
            unchanged: Vec::new(),
            heat: None,
        };
        let html = html(&diff);
        assert_eq!(html.matches("<tr><td>").count(), MOST_ROWS);
        assert!(html.contains("The 2,000 of 6,000 that matter most."));
        assert_eq!(html.matches("<circle").count(), 2 * 5_000);
        assert!(html.contains("the 5,000 heaviest of 6,000") && html.contains("a.ltree → b.ltree"));
    }
}
