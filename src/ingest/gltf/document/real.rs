//! Numbers.

use serde::Deserialize;

/// A number of the file that `f32` can hold; anything larger is refused while parsing.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, PartialOrd)]
#[serde(try_from = "f64")]
pub(in crate::ingest::gltf) struct Real(f64);

impl TryFrom<f64> for Real {
    type Error = String;

    fn try_from(value: f64) -> Result<Real, String> {
        match (value as f32).is_finite() {
            true => Ok(Real(value)),
            false => Err(format!("{value:e} is too large for a 32-bit number")),
        }
    }
}

impl Real {
    pub(in crate::ingest::gltf) fn f64(self) -> f64 {
        self.0
    }

    pub(in crate::ingest::gltf) fn f32(self) -> f32 {
        self.0 as f32
    }
}

/// Several numbers in single precision.
pub(in crate::ingest::gltf) fn reals<const N: usize>(values: [Real; N]) -> [f32; N] {
    values.map(Real::f32)
}
