//! Floor 0: the small mathematics everything else stands on.
//!
//! Vectors and matrices are [`glam`]'s; this room adds what rendering needs and glam does not
//! have: orthonormal [`Frame`]s, area-preserving [`warp`]s of the unit square, [`angle`]s that stay
//! accurate at their ends, maps that keep shapes ([`Similarity`]), compensated [`sum`]s, linear [`color`], and the [`random`] numbers that
//! make a picture depend on its seed and on nothing else.

pub mod angle;
pub mod color;
mod frame;
pub mod random;
mod similarity;
pub mod sum;
pub mod warp;

pub use frame::Frame;
pub use similarity::Similarity;
