//! What has been learned of a shot: from where how much of each cluster is seen.

mod cells;

pub use cells::{Cells, Coordinates, Plane, coordinates, divide};

use super::veil::{Veil, Veils};

/// What was learned, viewed in its bytes.
#[derive(Clone, Copy, Debug)]
pub struct Learned<'a> {
    /// Where receivers are.
    pub cells: Cells<'a>,
    /// What they see.
    pub veils: Veils<'a>,
}

/// What was learned, in memory.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// The planes between the cells.
    pub planes: Vec<Plane>,
    /// The veils, cell after cell, with the same number for each.
    pub rows: Vec<Veil>,
    /// The weights of lights beside the tree, cell after cell.
    pub beside: Vec<u8>,
}

impl Table {
    /// A view of it.
    pub fn view(&self) -> Learned<'_> {
        let cells = Cells(&self.planes);
        Learned { cells, veils: Veils::new(cells.count(), &self.rows, &self.beside) }
    }
}
