//! Cells: the space of receivers, divided where receivers are.
//!
//! A receiver is a place and a normal: six coordinates. Each plane divides the receivers that were given
//! in two halves, across the coordinate in which they lie farthest apart. The tree of planes is complete, and
//! stands level by level: the children of plane `i` are `2 i + 1` and `2 i + 2`. So it needs no links, and
//! whatever its bytes are, every receiver finds a cell.
//!
//! A plane is not sharp. Within a band about it either side is taken, with a chance that changes
//! smoothly, by a random number: noise that differs from cell to cell has no seams then.

use crate::light_tree::Cell;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Coordinates of a receiver: its place, metres, and its normal.
pub type Coordinates = [f32; 6];

/// A division of the cells in two.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Plane {
    /// Where it is along its axis.
    pub at: f32,
    /// The width of the band in which either side is taken.
    pub width: f32,
    /// The coordinate that it divides: 0 to 2 for the place, 3 to 5 for the normal.
    pub axis: u32,
}

/// Planes that divide receivers into cells: one cell more than planes.
#[derive(Clone, Copy, Debug)]
pub struct Cells<'a>(pub &'a [Plane]);

/// A normal all the way round counts as much as this share of the receivers' extent.
const TURN: f32 = 0.1;
/// The width of a plane's band as a share of that of the cells beside it.
const BAND: f32 = 0.5;

impl Cells<'_> {
    /// How many cells there are.
    pub fn count(&self) -> usize {
        self.0.len() + 1
    }

    /// The cell of a receiver, by a random number in `[0, 1)`.
    #[inline]
    pub fn find(&self, point: Vec3, normal: Vec3, mut u: f32) -> Cell {
        let receiver = coordinates(point, normal);
        let mut at = 0;
        while let Some(plane) = self.0.get(at) {
            let off = receiver[plane.axis as usize % 6] - plane.at;
            let inside = (0.5 + off / plane.width).clamp(0.0, 1.0);
            let chance = inside * inside * (3.0 - 2.0 * inside);
            let beyond = if chance > 0.0 && chance < 1.0 {
                let beyond = u < chance;
                u = if beyond { u / chance } else { (u - chance) / (1.0 - chance) };
                beyond
            } else {
                off > 0.0
            };
            at = 2 * at + 1 + usize::from(beyond);
        }
        Cell((at - self.0.len()) as u32)
    }

    /// Calls `visit` with each cell and the part of a box where receivers of some normal are of that cell:
    /// smallest and largest corner. Bands are left out of account.
    pub fn for_each_box(&self, around: [Vec3; 2], visit: &mut impl FnMut(Cell, [Vec3; 2])) {
        self.boxes_below(0, around, visit);
    }

    fn boxes_below(
        &self,
        node: usize,
        [low, high]: [Vec3; 2],
        visit: &mut impl FnMut(Cell, [Vec3; 2]),
    ) {
        let Some(plane) = self.0.get(node) else {
            return visit(Cell((node - self.0.len()) as u32), [low, high]);
        };
        let axis = plane.axis as usize % 6;
        let (mut until, mut from) = (high, low);
        if axis < 3 {
            // What is no number divides nothing off.
            let at = plane.at.max(low[axis]).min(high[axis]);
            (until[axis], from[axis]) = (at, at);
        }
        self.boxes_below(2 * node + 1, [low, until], visit);
        self.boxes_below(2 * node + 2, [from, high], visit);
    }
}

/// The coordinates of a receiver.
pub fn coordinates(point: Vec3, normal: Vec3) -> Coordinates {
    [point.x, point.y, point.z, normal.x, normal.y, normal.z]
}

/// Divides receivers into `2^levels` cells with about as many receivers each. The order of the receivers
/// is changed to that of their cells; also returns where the receivers of each cell begin and end.
pub fn divide(receivers: &mut [Coordinates], levels: u32) -> (Vec<Plane>, Vec<[usize; 2]>) {
    let extents = extents(receivers);
    let longest = extents[..3].iter().fold(f32::MIN_POSITIVE, |most, &own| most.max(own));
    let turn = 0.5 * TURN * longest;
    let mut planes = vec![Plane::default(); (1 << levels) - 1];
    let mut ranges = vec![[0, receivers.len()]; (2 << levels) - 1];
    for node in 0..planes.len() {
        let [begin, end] = ranges[node];
        let own = &mut receivers[begin..end];
        let (plane, left) = divide_once(own, turn);
        planes[node] = plane;
        (ranges[2 * node + 1], ranges[2 * node + 2]) = ([begin, begin + left], [begin + left, end]);
    }
    let cells = ranges.split_off(planes.len());
    let sizes: Vec<Coordinates> =
        cells.iter().map(|&[begin, end]| self::extents(&receivers[begin..end])).collect();
    for node in 0..planes.len() {
        let axis = planes[node].axis;
        let mut beside = Vec::new();
        add_beside(&planes, (2 * node + 1, 1), axis, &mut beside);
        add_beside(&planes, (2 * node + 2, 0), axis, &mut beside);
        let known =
            beside.iter().map(|&cell| sizes[cell][axis as usize]).filter(|&size| size > 0.0);
        let (count, sum) = known.fold((0, 0.0), |(count, sum), size| (count + 1, sum + size));
        planes[node].width = if count > 0 { BAND * sum / count as f32 } else { 0.0 };
    }
    (planes, cells)
}

/// The plane that divides some receivers best, and how many of them are before it.
fn divide_once(receivers: &mut [Coordinates], turn: f32) -> (Plane, usize) {
    let extents = extents(receivers);
    let weight = |axis: usize| if axis < 3 { extents[axis] } else { extents[axis] * turn };
    let axis = (1..6).fold(0, |best, axis| if weight(axis) > weight(best) { axis } else { best });
    if weight(axis) <= 0.0 {
        return (Plane::default(), receivers.len());
    }
    receivers.sort_unstable_by(|a, b| {
        // What lies alike along the axis is put in an order, too: the bytes depend on nothing else.
        let rest = || a.iter().zip(b).map(|(a, b)| a.total_cmp(b)).find(|order| order.is_ne());
        a[axis].total_cmp(&b[axis]).then_with(|| rest().unwrap_or(std::cmp::Ordering::Equal))
    });
    // Between the two neighbours that differ, nearest to the middle.
    let middle = receivers.len() / 2;
    let differs = |&at: &usize| receivers[at - 1][axis] < receivers[at][axis];
    let after = (middle.max(1)..receivers.len()).find(differs);
    let before = (1..middle).rev().find(differs);
    let left = match (before, after) {
        (Some(before), Some(after)) if middle - before < after - middle => before,
        (before, after) => after.or(before).unwrap_or(receivers.len()),
    };
    let (low, high) = (receivers[left - 1][axis], receivers[left][axis]);
    (Plane { at: 0.5 * low + 0.5 * high, width: 0.0, axis: axis as u32 }, left)
}

/// The cells below a node that lie at one end of an axis, the low one (0) or the high one (1).
fn add_beside(planes: &[Plane], (node, end): (usize, usize), axis: u32, found: &mut Vec<usize>) {
    match planes.get(node) {
        None => found.push(node - planes.len()),
        Some(plane) if plane.axis == axis => {
            add_beside(planes, (2 * node + 1 + end, end), axis, found);
        }
        Some(_) => {
            for child in [1, 2] {
                add_beside(planes, (2 * node + child, end), axis, found);
            }
        }
    }
}

fn extents(receivers: &[Coordinates]) -> Coordinates {
    std::array::from_fn(|axis| {
        let ends = receivers.iter().fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], own| {
            [low.min(own[axis]), high.max(own[axis])]
        });
        (ends[1] - ends[0]).max(0.0)
    })
}
