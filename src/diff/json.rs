//! A comparison for programs.
//!
//! It is one JSON object on one line. `schema` is `candelabra.diff` and `version` is 1. Within a version
//! fields may be added, and none changes or is removed.
//!
//! For two files the object holds what [`Diff`] holds: `before` and `after` (`file`, `is_tree`),
//! `totals`, `picking` (or `null`) and `changes`. Each change has `verb`, `share`, `before` and `after`
//! (or `null`) and `differences`; each difference has an `aspect` and its amounts.
//!
//! If a table of what is hidden is named, there is `table`: `file`, `outdated` and `unknown` (any of `lights`,
//! `lights_at_infinity`, `geometry`, `camera`), `is_used`, and `learned`, what the table says of itself.
//!
//! If one of the files is such a table, the object holds `before` and `after` (`file`, `is_tree`, `is_table`) and
//! `table`; of two tables also `is_same_table` and `learned_after`.
//!
//! For two folders it holds `before`, `after` and `shots`. Each shot has `name` and `outcome` (`added`,
//! `removed`, `same`, `dirtied` or `trouble`). A dirtied shot has a `diff` as above, and one with trouble
//! a `message`.
//!
//! Units are in the names: `_m` metres, `_deg` degrees, `_cd` candela, `_lux` lux. An infinite number is
//! `null`.

use super::{Diff, FolderDiff, TableDiff};
use crate::page::plain_json;
use serde::Serialize;
use std::io::{self, Write};

/// The version of the schema.
pub const SCHEMA_VERSION: u32 = 1;

#[derive(Serialize)]
struct Document<'a, T> {
    schema: &'static str,
    version: u32,
    #[serde(flatten)]
    content: &'a T,
}

impl Diff {
    /// Writes it as JSON: see the [module page](self).
    ///
    /// # Errors
    /// If writing fails.
    pub fn write_json(&self, out: &mut impl Write) -> io::Result<()> {
        write(out, self)
    }
}

impl TableDiff {
    /// Writes it as JSON: see the [module page](self).
    ///
    /// # Errors
    /// If writing fails.
    pub fn write_json(&self, out: &mut impl Write) -> io::Result<()> {
        write(out, self)
    }
}

impl FolderDiff {
    /// Writes it as JSON: see the [module page](self).
    ///
    /// # Errors
    /// If writing fails.
    pub fn write_json(&self, out: &mut impl Write) -> io::Result<()> {
        write(out, self)
    }
}

fn write(out: &mut impl Write, content: &impl Serialize) -> io::Result<()> {
    let document = Document { schema: "candelabra.diff", version: SCHEMA_VERSION, content };
    let json = serde_json::to_string(&document).map_err(io::Error::from)?;
    writeln!(out, "{}", plain_json(&json))
}
