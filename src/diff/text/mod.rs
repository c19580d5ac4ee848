//! A comparison for people.

mod change;
mod table;

use super::{Diff, FolderDiff, Outcome, PickingChange, ProbePlaces, Verb};
use crate::page::{Count, Plain, Short, Triple, counted};
use std::fmt;

pub(super) use change::details;

/// A comparison, to be printed with at most so many changes: those that matter most.
#[derive(Clone, Copy)]
pub struct Text<'a, T> {
    /// What to print.
    pub of: &'a T,
    /// How many changes are listed, of each shot.
    pub most: usize,
}

/// Paths are padded to the longest of those listed, but not beyond this.
const WIDEST_PATH: usize = 48;

impl fmt::Display for Text<'_, Diff> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Diff { before, after, totals, .. } = self.of;
        write!(f, "{} -> {}: ", Plain(&before.file), Plain(&after.file))?;
        if self.of.is_same() {
            let emitters = counted(totals.after.emitters, "emitter");
            writeln!(f, "the same {} of {emitters}", counted(totals.after.lights, "light"))?;
            return self.write_table(f);
        }
        let all = totals.unchanged + self.of.changes.len();
        writeln!(f, "{} of {} differ", Count(self.of.changes.len()), counted(all, "light"))?;
        self.write_totals(f)?;
        self.write_table(f)?;
        self.write_changes(f)
    }
}

impl Text<'_, Diff> {
    fn write_totals(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Diff { totals, picking, .. } = self.of;
        let verbs = [
            (totals.added, "added"),
            (totals.removed, "removed"),
            (totals.dirtied, "dirtied"),
            (totals.renamed, "renamed"),
            (totals.unchanged, "unchanged"),
        ];
        let verbs = verbs.into_iter().filter(|(count, _)| *count > 0);
        let verbs: Vec<_> = verbs.map(|(count, verb)| format!("{} {verb}", Count(count))).collect();
        let (a, b) = (totals.before, totals.after);
        writeln!(f, "  lights    {}: {}", from_to(a.lights, b.lights), verbs.join(", "))?;
        writeln!(f, "  emitters  {}", from_to(a.emitters, b.emitters))?;
        writeln!(f, "  energy    {}", sums(a.energy_cd, b.energy_cd, "cd"))?;
        if a.illuminance_lux > 0.0 || b.illuminance_lux > 0.0 {
            writeln!(f, "  infinity  {}", sums(a.illuminance_lux, b.illuminance_lux, "lux"))?;
        }
        picking.as_ref().map_or(Ok(()), |picking| writeln!(f, "  picks     {}", moved(picking)))
    }

    fn write_changes(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let changes = &self.of.changes;
        let listed = &changes[..changes.len().min(self.most)];
        let widths = listed.iter().map(|change| change.path().chars().count());
        let width = widths.max().unwrap_or(0).min(WIDEST_PATH);
        if !listed.is_empty() {
            writeln!(f, "     share")?;
        }
        for change in listed {
            let verb = match change.verb {
                Verb::Added => "added",
                Verb::Removed => "removed",
                Verb::Dirtied => "dirtied",
                Verb::Renamed => "renamed",
            };
            let (share, path) = (percent(change.share), change.path());
            let line = format!("  {share:>6} %  {verb:<7}  {path:<width$}  {}", details(change));
            writeln!(f, "{}", Plain(line.trim_end()))?;
        }
        match changes.len() - listed.len() {
            0 => Ok(()),
            left => writeln!(f, "            and {} more (--all lists them)", Count(left)),
        }
    }
}

impl fmt::Display for Text<'_, FolderDiff> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let FolderDiff { before, after, shots } = self.of;
        let differ = shots.iter().filter(|shot| !matches!(shot.outcome, Outcome::Same)).count();
        write!(f, "{} -> {}: ", Plain(before), Plain(after))?;
        match differ {
            0 => writeln!(f, "the same {}", counted(shots.len(), "shot"))?,
            _ => writeln!(f, "{} of {} differ", Count(differ), counted(shots.len(), "shot"))?,
        }
        for shot in shots {
            match &shot.outcome {
                Outcome::Same => {}
                Outcome::Added => writeln!(f, "added    {}", Plain(&shot.name))?,
                Outcome::Removed => writeln!(f, "removed  {}", Plain(&shot.name))?,
                Outcome::Trouble { message } => writeln!(f, "trouble  {}", Plain(message))?,
                Outcome::Dirtied { diff } => {
                    write!(f, "dirtied  {}", Text { of: diff.as_ref(), most: self.most })?;
                }
            }
        }
        Ok(())
    }
}

/// A share in per cent with two decimals. A positive share is never shown as 0.
fn percent(share: f64) -> String {
    if share > 0.0 && share < 5e-5 { "<0.01".into() } else { format!("{:.2}", 100.0 * share) }
}

fn from_to(before: usize, after: usize) -> String {
    match before == after {
        true => Count(after).to_string(),
        false => format!("{} -> {}", Count(before), Count(after)),
    }
}

fn sums(before: f64, after: f64, unit: &str) -> String {
    if before == after {
        return format!("{} {unit}", Short(after));
    }
    let change = match before > 0.0 && after > 0.0 {
        true => format!(" ({:+.2} stops)", (after / before).log2()),
        false => String::new(),
    };
    format!("{} -> {} {unit}{change}", Short(before), Short(after))
}

fn moved(picking: &PickingChange) -> String {
    let places = match picking.places {
        ProbePlaces::CameraPaths => "on camera paths",
        ProbePlaces::BoxAroundLights => "around the lights",
    };
    format!(
        "{} % go to other lights in the mean over {} {places}, {} % at worst, at {}",
        percent(picking.mean),
        counted(picking.probes, "point"),
        percent(picking.worst),
        Triple(picking.worst_at_m)
    )
}
