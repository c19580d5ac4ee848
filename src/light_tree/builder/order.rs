//! The canonical order of the items, by which the input's order is forgotten.
//!
//! Whether one item comes before another depends on these two alone. So the items of a cluster are
//! in the same order whatever else the tree holds.

use super::item::Item;
use crate::bounds::LightBounds;
use glam::Vec3;
use rayon::prelude::*;
use std::cmp::Ordering;

/// The items along a Morton curve of their centres; equal places by every number they have.
pub fn canonical(bounds: &[LightBounds]) -> Vec<Item> {
    let of = |index: u32| &bounds[index as usize];
    let place = |index: u32| place_on_curve(of(index).aabb.center());
    let mut keys: Vec<(u64, u32)> =
        (0..bounds.len() as u32).into_par_iter().map(|index| (place(index).0, index)).collect();
    keys.par_sort_unstable_by_key(|(coarse, _)| *coarse);
    let by_all = |&(_, a): &(u64, u32), &(_, b): &(u64, u32)| {
        let by_place = place(a).1.cmp(&place(b).1);
        by_place.then_with(|| total_order(of(a), of(b))).then(a.cmp(&b))
    };
    let runs = keys.par_chunk_by_mut(|a, b| a.0 == b.0).filter(|run| run.len() > 1);
    runs.for_each(|run| run.par_sort_unstable_by(by_all));
    keys.par_iter().map(|&(_, index)| Item::new(of(index), index)).collect()
}

/// A total order over every number of the bounds. Equal bounds may swap: nobody can tell, but by the
/// numbers of their emitters, which ascend.
fn total_order(a: &LightBounds, b: &LightBounds) -> Ordering {
    let numbers = |bounds: &LightBounds| {
        let LightBounds { aabb, cone, energy, range_m } = *bounds;
        let vectors = [aabb.min, aabb.max, cone.axis].map(|v| v.to_array());
        (vectors, [cone.theta_o, cone.theta_e, energy, range_m], cone.two_sided)
    };
    let ((va, sa, ta), (vb, sb, tb)) = (numbers(a), numbers(b));
    let pairs = va.as_flattened().iter().zip(vb.as_flattened()).chain(sa.iter().zip(&sb));
    pairs.map(|(x, y)| x.total_cmp(y)).find(|o| o.is_ne()).unwrap_or_else(|| ta.cmp(&tb))
}

/// Interleaved bits of the coordinates: the upper 21 of each axis, which tell most places apart, and
/// the lower 11. Their patterns, not their values: those ascend alike, over all magnitudes, and need
/// no box around everything to be relative to.
#[inline]
fn place_on_curve(p: Vec3) -> (u64, u64) {
    let axes = p.to_array().map(ascending_bits);
    let interleave = |bits: [u32; 3]| {
        let [x, y, z] = bits.map(|bits| spread(bits.into()));
        x | y << 1 | z << 2
    };
    (interleave(axes.map(|bits| bits >> 11)), interleave(axes.map(|bits| bits & 0x7ff)))
}

/// The bits of a number, changed so that they ascend with it.
fn ascending_bits(x: f32) -> u32 {
    let bits = x.to_bits();
    bits ^ if x.is_sign_negative() { u32::MAX } else { 1 << 31 }
}

/// Puts two zero bits between any two of the low 21.
fn spread(x: u64) -> u64 {
    let x = (x | x << 32) & 0x001f_0000_0000_ffff;
    let x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    let x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    let x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_ascend_with_the_numbers() {
        let numbers = [f32::MIN, -1.5, -1e-40, -0.0, 0.0, 1e-40, 1.0, 1.0f32.next_up(), f32::MAX];
        assert!(numbers.map(ascending_bits).is_sorted_by(|a, b| a < b));
    }

    #[test]
    fn no_two_places_share_one_on_the_curve() {
        let near = [1.0, 1.0f32.next_up(), 1.0f32.next_down(), -1.0, 1e6];
        let places = near.iter().flat_map(|&x| near.map(|y| Vec3::new(x, y, x * y)));
        let mut codes: Vec<_> = places.map(place_on_curve).collect();
        codes.sort_unstable();
        codes.dedup();
        assert_eq!(codes.len(), near.len() * near.len());
    }
}
