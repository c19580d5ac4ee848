//! A comparison for programs.
//!
//! One JSON object on one line. `schema` is `candelabra.diff` and `version` is 1: fields may be added
//! in it, none changes or goes. Then, of two files, what [`Diff`] holds: `before` and `after` (`file`,
//! `is_tree`), `totals`, `picking` (or `null`) and `changes`, each with `verb`, `share`, `before` and
//! `after` (or `null`) and `differences`, each of these with an `aspect` and its amounts. Of two
//! folders: `before`, `after` and `shots`, each with `name`, `outcome` (`added`, `removed`, `same`,
//! `dirtied` or `trouble`) and, if it is dirtied, `diff` as above; if there is trouble, `message`.
//! Units are in the names: `_m` metres, `_deg` degrees, `_cd` candela, `_lux`. What is infinite is
//! `null`.

use super::{Diff, FolderDiff};
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
