//! What tracing costs, in nanoseconds of one processor.
//!
//! Costs are counted and priced by this table, never by the clock of a run: the same shot gets the same
//! knobs on every machine and under every load. Only ratios matter.

use crate::render::path::TraceStats;

/// A ray that looks for the nearest hit, and what is done at the hit.
const LOOK: f64 = 760.0;
/// A ray that asks whether a picked light is visible, and what picks and reflects that light.
const SHADOW_RAY: f64 = 500.0;
/// A group of the tree weighed, and what is done with its lanes.
const GROUP: f64 = 450.0;

/// What something cost.
pub fn cost(stats: &TraceStats) -> f64 {
    let looks = stats.rays - stats.shadow_rays;
    LOOK * looks as f64 + SHADOW_RAY * stats.shadow_rays as f64 + GROUP * stats.groups as f64
}
