//! Floor 4: the trade of speed against accuracy, measured.
//!
//! [`trade()`] renders with every way of picking lights at every budget and compares errors and times,
//! which are what a user sees. [`at_probes`] computes, without noise, the variance of every way's estimate of
//! direct light at points that camera paths visit: it is exact and repeatable, and leaves out all variance that the
//! picking does not cause. [`direct_light`] enumerates all lights for every pixel of a coarse picture. Error is
//! always that of [`noise`](crate::render::noise).
//!
//! | module | question |
//! |---|---|
//! | `entrant` | who takes part? |
//! | `picture` | what does one picture take? |
//! | `reference` | what is it compared with? |
//! | `cache` | what is finished already? |
//! | `trade` | in which order is it all done? |
//! | `frontier` | what do the curves say? |
//! | `report` | what came out? |
//! | `html` | how does it look? |
//! | `pilot` | what will a shot take? |
//! | `probes`, `contributions` | how much variance does a way have, exactly? |
//! | `oracle` | what would exact visibility give? |
//! | `machine` | what was it measured on? |
//!
//! This is the only module that reads the clock, beside jobs.

mod cache;
mod contributions;
mod direct;
mod entrant;
mod frontier;
mod html;
mod machine;
mod oracle;
mod picture;
mod pilot;
mod probes;
mod reference;
mod report;
mod trade;

pub use cache::Cache;
pub use direct::direct_light;
pub use entrant::{Asked, Budget, Entrant, NoEntrant, Way};
pub use frontier::{Point, Reach};
pub use html::{html, svg};
pub use machine::Machine;
pub use picture::{Picture, Subject};
pub use pilot::{FrameCost, ShotCost};
pub use probes::{ProbeOptions, ProbeReport, StrategyReport, at_probes, visited};
pub use reference::Converged;
pub use report::{Curve, Report, Row, Terms, Trade, csv};
pub use trade::{Cell, Onlooker, TradeError, TradeOptions, again, trade};
