//! Floor 3: the renderer.
//!
//! The lower half of the room turns a ray into light that leaves a point: [`rays`] finds what a
//! ray hits, [`bsdf`] says how it reflects. Neither knows of lights or of the light tree.

pub mod bsdf;
pub mod camera;
pub mod rays;
pub mod surface;
