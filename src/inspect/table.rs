//! A table of what is hidden, in numbers.

use crate::light_tree::WIDTH;
use crate::light_tree::learned::LearnedFile;
use crate::light_tree::veil::decode;
use serde::Serialize;

/// A cluster with a smaller weight is called hidden.
const HIDDEN: f32 = 0.25;

/// A table of what is hidden.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TableReport {
    /// Length of the file.
    pub bytes: usize,
    /// Cells; none if nothing is hidden.
    pub cells: usize,
    /// Groups of the tree with weights in each.
    pub groups: usize,
    /// The share of the clusters of all cells with a weight below a quarter.
    pub hidden: f64,
    /// What it says about itself: `frames`, `budget`, `rays`, `hidden`, `program`.
    pub learned: serde_json::Value,
    /// The share of the light that is hidden, by importance, in the mean over the cells; `None` if the file does not
    /// tell.
    pub light_hidden: Option<f64>,
}

impl TableReport {
    /// Of a table, which must have been verified.
    pub fn of(table: &LearnedFile<impl AsRef<[u8]>>) -> TableReport {
        let cells = table.view().map_or(0, |learned| learned.cells.count());
        let lanes = table.rows().iter().flat_map(|row| row.weights);
        let below = lanes.filter(|&byte| decode(byte) < HIDDEN).count();
        let shares = table.hidden();
        let sum: u64 = shares.iter().map(|&share| u64::from(share)).sum();
        TableReport {
            bytes: table.byte_length(),
            cells,
            groups: table.rows().len() / cells.max(1),
            hidden: below as f64 / (table.rows().len() * WIDTH).max(1) as f64,
            learned: serde_json::from_str(table.meta()).unwrap_or_default(),
            light_hidden: (!shares.is_empty()).then(|| sum as f64 / (255 * shares.len()) as f64),
        }
    }
}
