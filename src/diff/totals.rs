//! Sums over all lights.

use serde::Serialize;

/// Sums before and after, and how many lights differ.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Totals {
    /// Of the version before.
    pub before: Tally,
    /// Of the version after.
    pub after: Tally,
    /// Lights that only the version after has.
    pub added: usize,
    /// Lights that only the version before has.
    pub removed: usize,
    /// Lights that are not what they were.
    pub dirtied: usize,
    /// Lights that have another path.
    pub renamed: usize,
    /// Lights that are the same.
    pub unchanged: usize,
}

/// Sums over the lights of one version.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Tally {
    /// How many shine.
    pub lights: usize,
    /// Their emitters.
    pub emitters: usize,
    /// Peak radiant intensity of all emitters, summed, candela.
    pub energy_cd: f64,
    /// Illuminance by suns and domes, summed, lux.
    pub illuminance_lux: f64,
}
