//! The canonical order of the items, by which the input's order is forgotten.

use super::Item;
use crate::bounds::{Aabb, LightBounds};
use glam::Vec3;
use rayon::prelude::*;
use std::cmp::Ordering;

/// The items along a Morton curve of their centres; equal codes by every number they have.
pub fn canonical(bounds: &[LightBounds]) -> Vec<Item> {
    let centers = bounds.iter().map(|b| b.aabb.center());
    let around = Aabb::around(centers);
    let mut keys: Vec<(u64, u32)> = bounds
        .par_iter()
        .enumerate()
        .map(|(i, b)| (morton(b.aabb.center(), &around), i as u32))
        .collect();
    keys.par_sort_unstable_by(|a, b| {
        let ties = || total_order(&bounds[a.1 as usize], &bounds[b.1 as usize]);
        a.0.cmp(&b.0).then_with(ties).then(a.1.cmp(&b.1))
    });
    keys.into_par_iter().map(|(_, index)| Item { bounds: bounds[index as usize], index }).collect()
}

/// A total order over every number of the bounds. Equal bounds may swap: nobody can tell.
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

/// Interleaved bits of a position in a box, 21 an axis.
fn morton(p: Vec3, around: &Aabb) -> u64 {
    let extent = around.extent().as_dvec3();
    let offset = p.as_dvec3() - around.min.as_dvec3();
    let cell = |offset: f64, extent: f64| {
        if extent > 0.0 { (offset / extent * 2_097_151.0) as u64 } else { 0 }
    };
    spread(cell(offset.x, extent.x))
        | spread(cell(offset.y, extent.y)) << 1
        | spread(cell(offset.z, extent.z)) << 2
}

/// Puts two zero bits between any two of the low 21.
fn spread(x: u64) -> u64 {
    let x = (x | x << 32) & 0x001f_0000_0000_ffff;
    let x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    let x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    let x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}
