//! Floor 3: the renderer.
//!
//! The lower half of the room turns a ray into light that leaves a point, and pixels into files:
//!
//! | module | question |
//! |---|---|
//! | [`camera`] | which ray belongs to a point of the picture? |
//! | [`rays`] | what does a ray hit, and is a light visible? |
//! | [`surface`] | what is there: normals, textures, material, emission? |
//! | [`bsdf`] | how does it reflect? |
//! | [`buffers`] | what is kept of a frame? |
//! | [`exr`], [`png`] | how does it get to the disk? |
//! | [`frames`], [`frame_names`] | which frames, and under which names? |
//!
//! None of these knows of emitters or of the light tree.

pub mod bsdf;
pub mod buffers;
pub mod camera;
pub mod exr;
pub mod frame_names;
pub mod frames;
pub mod png;
pub mod rays;
pub mod surface;
