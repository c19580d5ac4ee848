//! Floor 4: the trade of speed against accuracy, measured.
//!
//! [`at_probes`] computes, without noise, how far off every strategy's estimate of direct light is at
//! points that camera paths visit; [`race()`] renders with several settings and compares their errors
//! and times. The first is exact and repeatable, and leaves out what is not the tree's; the second
//! is what a user sees.
//!
//! The only room that reads the clock.

mod contributions;
mod probes;
mod race;

pub use probes::{ProbeOptions, ProbeReport, StrategyReport, at_probes};
pub use race::{Entrant, RaceOptions, Result, race};
