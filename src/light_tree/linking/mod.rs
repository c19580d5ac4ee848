//! Linking: lights that do not light everything.
//!
//! Lights that light the same have one *link number*; number 0 lights everything. The file has the number of each
//! light and nothing more. Receivers come in *classes*: all receivers of a class are lit by the same numbers
//! ([`LitBy`]). A lane of a group leads to lights of some numbers, its *lane set*. For a receiver of a class, the
//! importance of a lane is 0 if none of these numbers light the class. Else it is multiplied by the share of the lane's
//! energy that does: a strong lamp that lights one figure alone must not draw the samples of all that is around it. So it
//! is 0 only where no light below is linked, and picks, cuts, probabilities and moments agree, because all of them
//! weigh groups by one function (`place`).
//!
//! Lane sets and shares follow from the tree, so they cannot be wrong where the numbers are right. They are found
//! once for an open file, and only if somebody asks for a frame [with links](super::LightTree::at_frame_linked). A set that
//! holds number 0 is that of number 0, for a lane with such a light is dark to nobody. All lights of a placed tree
//! are of one number; below the leaf that stands for it, nothing is masked.

mod lane_sets;
mod lit_lanes;
mod same;

pub(super) use lit_lanes::{FrameLinks, LitLanes};
pub use same::SameLinks;

use super::importance::{Cluster, Factors, Sight};
use super::veil::Cell;
use super::viewer::{Viewer, sees_as};
use crate::math::Similarity;

/// A class of receivers, by number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ReceiverClass(pub u32);

impl ReceiverClass {
    /// Receivers that are lit by every light.
    pub const ALL: ReceiverClass = ReceiverClass(u32::MAX);
}

/// Which link numbers light each class of receivers.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LitBy {
    rows: BitRows,
}

impl LitBy {
    /// Of classes in the order of their numbers; each tells of every link number from 0 on whether it lights the
    /// class. Number 0 lights all.
    pub fn new(numbers: usize, classes: impl IntoIterator<Item = Vec<bool>>) -> LitBy {
        let mut rows = BitRows::new(numbers);
        for class in classes {
            rows.push(
                class.into_iter().take(numbers).enumerate().map(|(number, lit)| number == 0 || lit),
            );
        }
        LitBy { rows }
    }

    /// How many classes there are.
    pub fn classes(&self) -> usize {
        self.rows.count()
    }

    /// Whether a link number lights a class. A class or a number that is not there is lit, and lights: what is
    /// unknown is no reason to lose light.
    #[inline]
    pub fn holds(&self, class: ReceiverClass, number: u32) -> bool {
        self.rows.get(class.0, number)
    }
}

/// Bits in rows.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct BitRows {
    columns: usize,
    words: Vec<u64>,
}

impl BitRows {
    fn new(columns: usize) -> BitRows {
        BitRows { columns, words: Vec::new() }
    }

    fn words_of_row(&self) -> usize {
        self.columns.div_ceil(64)
    }

    fn push(&mut self, bits: impl Iterator<Item = bool>) {
        let start = self.words.len();
        self.words.resize(start + self.words_of_row(), 0);
        for (column, _) in bits.enumerate().filter(|(_, bit)| *bit) {
            self.words[start + column / 64] |= 1 << (column % 64);
        }
    }

    fn count(&self) -> usize {
        self.words.len() / self.words_of_row().max(1)
    }

    /// A bit; set where there is none.
    #[inline]
    fn get(&self, row: u32, column: u32) -> bool {
        let (row, column) = (row as usize, column as usize);
        if column >= self.columns {
            return true;
        }
        let word =
            row.checked_mul(self.words_of_row()).and_then(|at| self.words.get(at + column / 64));
        word.is_none_or(|word| word >> (column % 64) & 1 == 1)
    }
}

/// A viewer of a class.
#[derive(Clone, Copy, Debug)]
pub struct Linked<V> {
    /// Who looks.
    pub viewer: V,
    /// What lights it.
    pub class: ReceiverClass,
}

impl<V: Viewer> Viewer for Linked<V> {
    const IS_LINKED: bool = true;
    sees_as!(viewer: V);

    #[inline(always)]
    fn class(&self) -> ReceiverClass {
        self.class
    }

    #[inline(always)]
    fn cell(&self) -> Cell {
        self.viewer.cell()
    }

    fn within(&self, space: &Similarity) -> Linked<V> {
        Linked { viewer: self.viewer.within(space), class: self.class }
    }
}
