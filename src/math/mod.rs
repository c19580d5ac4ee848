//! Floor 0: the small mathematics that everything else stands on.
//!
//! Vectors and matrices are [`glam`]'s. This room adds what rendering needs and glam does not have:
//! orthonormal [`Frame`]s, area-preserving [`warp`]s of the unit square, [`angle`]s that are accurate
//! near 0 and pi, [`directions`] under any matrix, transforms that keep shapes ([`Similarity`]),
//! compensated [`sum`]s and linear [`color`]. Its [`random`] numbers depend on the seed and on
//! nothing else.

pub mod angle;
pub mod built_in;
pub mod color;
pub mod directions;
mod frame;
pub mod random;
mod similarity;
pub mod sum;
pub mod warp;

pub use frame::Frame;
pub use similarity::Similarity;
