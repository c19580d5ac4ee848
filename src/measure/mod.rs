//! Floor 4: the trade of speed against accuracy, measured.
//!
//! [`at_probes`] computes, without noise, the variance of every strategy's estimate of direct light at
//! points that camera paths visit. It is exact and repeatable, and leaves out all variance that the tree
//! does not cause. [`race()`] renders with several settings and compares their errors and times, which
//! are what a user sees. [`direct_light`] enumerates all lights for every pixel of a coarse picture.
//!
//! This is the only module that reads the clock.

mod contributions;
mod direct;
mod probes;
mod race;

pub use direct::direct_light;
pub use probes::{ProbeOptions, ProbeReport, StrategyReport, at_probes, visited};
pub use race::{Entrant, RaceOptions, Result, race};
