//! Floor 3: the renderer.
pub mod bsdf;
pub mod camera;
pub mod path;
pub mod picker;
pub mod rays;
pub mod settings;
pub mod surface;
