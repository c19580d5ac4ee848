//! What has been learned of a shot: from where how much of each cluster is seen.
//!
//! A table is a [tree of planes](Cells) that divides receivers into cells, and for each cell the
//! [weights](super::veil) of some groups. It is in memory as a [`Table`], and in a file as a [`LearnedFile`],
//! which is mapped; both give the same view, [`Learned`].
#![doc = include_str!("format.md")]

mod cells;
mod file;

pub use super::veil::BESIDE;
pub use cells::{Cells, Coordinates, Plane, coordinates, divide};
pub use file::{LEARNED_FILE, LearnedFile, RULES_OF_LEARNED, ViewKeys};

use super::veil::{Veil, Veils};

/// What was learned, viewed in its bytes.
#[derive(Clone, Copy, Debug)]
pub struct Learned<'a> {
    /// The [tree](super::LightTree::still_key) that its groups are of.
    pub tree: [u8; 32],
    /// Where receivers are.
    pub cells: Cells<'a>,
    /// What they see.
    pub veils: Veils<'a>,
}

/// What was learned, in memory.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// The [tree](super::LightTree::still_key) that its groups are of.
    pub tree: [u8; 32],
    /// The planes between the cells: level by level, one less than there are cells.
    pub planes: Vec<Plane>,
    /// The veils, cell after cell, with the same number for each. None if nothing is hidden.
    pub rows: Vec<Veil>,
    /// The box around the receivers that it was learned at: smallest and largest corner, world space,
    /// metres. For people; so is what follows.
    pub area: Option<[[f32; 3]; 2]>,
    /// Of each cell the share of the light that is hidden there, in parts of 255; or nothing.
    pub hidden: Vec<u8>,
}

impl Table {
    /// A view of it; `None` if it has nothing to say.
    pub fn view(&self) -> Option<Learned<'_>> {
        Learned::over(self.tree, &self.planes, &self.rows)
    }
}

impl<'a> Learned<'a> {
    fn over(tree: [u8; 32], planes: &'a [Plane], rows: &'a [Veil]) -> Option<Learned<'a>> {
        let cells = Cells(planes);
        let veils = Veils::new(cells.count(), rows);
        (!rows.is_empty()).then_some(Learned { tree, cells, veils })
    }
}
