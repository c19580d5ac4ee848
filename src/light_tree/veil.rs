//! Veils: how much of each cluster is seen from where.
//!
//! An importance knows nothing of walls. Where it is known how much of a cluster is hidden, the
//! importance of the cluster is multiplied by a weight: 1 in full view, less behind something, never
//! zero. A cluster of which a viewer sees the share `v` has the second moment `v (1 + s)` times the square
//! of its importance, `s` being its spread, so the best weight is `sqrt(v)`, and with that weight the
//! spread becomes `s + 1 - v`.
//!
//! What is known belongs to a *cell*: a viewer says in which it is. Weights enter where a group is
//! weighed and nowhere else, so whatever they are, picks and probabilities agree, and no picture's mean
//! depends on them. A group of which nothing is known has the weight of the lane that leads to it.

use super::group::WIDTH;
use super::importance::{Cluster, Factors, Sight};
use super::viewer::{Viewer, sees_as};
use crate::math::Similarity;
use bytemuck::{Pod, Zeroable};

/// What is known of a group in one cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Veil {
    /// Number of the group.
    pub group: u32,
    /// Of each lane the weight, as [`encode`] has it.
    pub weights: [u8; WIDTH],
}

impl Veil {
    /// Of no group: the last rows of a cell that has fewer than others.
    pub const NONE: Veil = Veil { group: u32::MAX, weights: [255; WIDTH] };

    /// The rows of all cells, one cell after the other, each with as many as the longest.
    pub fn padded(cells: Vec<Vec<Veil>>) -> Vec<Veil> {
        let of_each = cells.iter().map(Vec::len).max().unwrap_or(0);
        let padded = cells.into_iter().map(|mut rows| {
            rows.resize(of_each, Veil::NONE);
            rows
        });
        padded.flatten().collect()
    }
}

/// The veils of all cells: each has the same number, by ascending group.
#[derive(Clone, Copy, Debug, Default)]
pub struct Veils<'a> {
    rows: &'a [Veil],
    of_each: usize,
}

/// Lights beside the tree are the lanes of groups with numbers from here on.
pub const BESIDE: u32 = 1 << 31;

/// A cell, by number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cell(pub u32);

impl Cell {
    /// None: nothing is known.
    pub const NONE: Cell = Cell(u32::MAX);
}

impl<'a> Veils<'a> {
    /// Of so many cells, with the same number of rows each.
    pub fn new(cells: usize, rows: &'a [Veil]) -> Veils<'a> {
        Veils { rows, of_each: rows.len() / cells.max(1) }
    }

    /// The weight of a light beside the tree in a cell: 1 if nothing is known.
    #[inline]
    pub(super) fn weight_beside(&self, cell: Cell, row: usize) -> f64 {
        let weights = self.weights(cell, BESIDE + (row / WIDTH) as u32);
        weights.map_or(1.0, |weights| weights[row % WIDTH].into())
    }

    /// The rows of a cell; none if there is no such cell.
    #[inline]
    pub fn of(&self, cell: Cell) -> &'a [Veil] {
        let first = (cell.0 as usize).saturating_mul(self.of_each);
        let rest = self.rows.get(first..).unwrap_or_default();
        rest.get(..self.of_each).unwrap_or_default()
    }

    /// The weights of the lanes of a group in a cell, if they are known there.
    #[inline]
    pub(super) fn weights(&self, cell: Cell, group: u32) -> Option<[f32; WIDTH]> {
        let rows = self.of(cell);
        let at = rows.binary_search_by_key(&group, |row| row.group).ok()?;
        Some(rows[at].weights.map(decode))
    }
}

/// The weight that a byte stands for: in `(0, 1]`, whatever the byte.
#[inline]
pub fn decode(byte: u8) -> f32 {
    let root = (f32::from(byte) + 1.0) / 256.0;
    root * root
}

/// The byte of the weight nearest to one in `[0, 1]`.
pub fn encode(weight: f64) -> u8 {
    (256.0 * weight.clamp(0.0, 1.0).sqrt() - 1.0).round().clamp(0.0, 255.0) as u8
}

/// A viewer in a cell.
#[derive(Clone, Copy, Debug)]
pub struct Veiled<V> {
    /// Who looks.
    pub viewer: V,
    /// From where.
    pub cell: Cell,
}

impl<V: Viewer> Viewer for Veiled<V> {
    sees_as!(viewer: V);

    #[inline(always)]
    fn cell(&self) -> Cell {
        self.cell
    }

    fn within(&self, space: &Similarity) -> Veiled<V> {
        Veiled { viewer: self.viewer.within(space), cell: self.cell }
    }
}
