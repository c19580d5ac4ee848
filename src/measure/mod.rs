//! Floor 4: the trade of speed against accuracy, measured.
//!
//! [`at_probes`] computes, without noise, how far off every strategy's estimate of direct light is at
//! points that camera paths visit; [`race()`] renders with several settings and compares their errors
//! and times. The first is exact and repeatable, and leaves out what is not the tree's; the second
//! is what a user sees. [`direct_light`] enumerates all lights for every pixel of a coarse picture.
//!
//! The only room that reads the clock.

mod contributions;
mod direct;
mod probes;
mod race;

pub use direct::direct_light;
pub use probes::{ProbeOptions, ProbeReport, StrategyReport, at_probes, visited};
pub use race::{Entrant, RaceOptions, Result, race};
