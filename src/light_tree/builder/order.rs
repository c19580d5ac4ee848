//! The order of bounds where no cut tells them apart.
//!
//! Which of two bounds comes first depends on their numbers alone. Their places in the input decide only
//! between equal bounds, which are interchangeable.

use crate::bounds::LightBounds;
use std::cmp::Ordering;

/// Compares two of some bounds, named by their places, by every number they have, then by place.
pub fn of(bounds: &[LightBounds]) -> impl Fn(u32, u32) -> Ordering + Sync {
    |a, b| by_numbers(&bounds[a as usize], &bounds[b as usize]).then(a.cmp(&b))
}

/// A total order over every number of the bounds.
pub fn by_numbers(a: &LightBounds, b: &LightBounds) -> Ordering {
    let numbers = |bounds: &LightBounds| {
        let LightBounds { aabb, cone, energy, share, range_m } = *bounds;
        let vectors = [aabb.min, aabb.max, cone.axis].map(|v| v.to_array());
        (vectors, [cone.theta_o, cone.theta_e, energy, share, range_m], cone.two_sided)
    };
    let ((va, sa, ta), (vb, sb, tb)) = (numbers(a), numbers(b));
    let pairs = va.as_flattened().iter().zip(vb.as_flattened()).chain(sa.iter().zip(&sb));
    pairs.map(|(x, y)| x.total_cmp(y)).find(|o| o.is_ne()).unwrap_or_else(|| ta.cmp(&tb))
}
