//! A table of what is hidden, for people.

use super::Text;
use crate::diff::{Diff, TableDiff, TableStanding};
use crate::page::{Count, Plain};
use crate::pipeline::Outdated;
use serde_json::Value;
use std::fmt;

impl Text<'_, Diff> {
    pub(super) fn write_table(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(table) = &self.of.table else { return Ok(()) };
        writeln!(f, "  table     {}: {}", Plain(&table.file), verdict(table))
    }
}

impl fmt::Display for Text<'_, TableDiff> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let TableDiff { before, after, table, is_same_table, learned_after } = self.of;
        write!(f, "{} -> {}: ", Plain(&before.file), Plain(&after.file))?;
        match (is_same_table, table.is_up_to_date()) {
            (None, _) => writeln!(f, "the table is {}", verdict(table))?,
            (Some(true), _) => return writeln!(f, "the same table"),
            (Some(false), true) => writeln!(f, "learned from the same, but not the same table")?,
            (Some(false), false) => writeln!(f, "learned from other {}", names(&table.outdated))?,
        }
        match learned_after {
            None => writeln!(f, "  learned from {}", effort(&table.learned)),
            Some(after) => {
                writeln!(f, "  learned from {} -> {}", effort(&table.learned), effort(after))
            }
        }
    }
}

fn verdict(table: &TableStanding) -> String {
    let told = match (table.is_up_to_date(), table.unknown.is_empty()) {
        (true, true) => return "up to date".into(),
        (true, false) => "up to date, as far as a tree tells".into(),
        (false, _) => format!("out of date ({})", names(&table.outdated)),
    };
    let unknown = match table.unknown.as_slice() {
        [] => String::new(),
        unknown => format!("; a tree does not tell {}", names(unknown)),
    };
    let then = match (table.is_up_to_date(), table.is_used) {
        (true, _) => "",
        (false, true) => "; a renderer uses it, and has more noise than it has to",
        (false, false) => "; a renderer does not use it",
    };
    let remedy = if table.is_up_to_date() { "" } else { "; `candelabra learn` renews it" };
    format!("{told}{unknown}{then}{remedy}")
}

fn names(what: &[Outdated]) -> String {
    what.iter().map(|what| what.name()).collect::<Vec<_>>().join(", ")
}

/// Rays and frames, as a table tells them.
fn effort(learned: &Value) -> String {
    let rays = learned["rays"].as_u64().map_or("?".into(), |rays| Count(rays as usize).to_string());
    let frames = learned["frames"].as_array().map(Vec::as_slice).unwrap_or_default();
    let frames: Vec<String> = frames.iter().map(Value::to_string).collect();
    let word = if frames.len() == 1 { "frame" } else { "frames" };
    format!("{rays} rays of {word} {}", frames.join(", "))
}
