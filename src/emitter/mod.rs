//! Floor 2: scene -> emitters, their bounds, and light from a point of them.
//!
//! [`Emitters`] lists what a scene's lights are made of: triangles of mesh lights, spheres, points
//! and spots, in canonical order. Finding them is quick but for emission textures, whose means over
//! triangles ([`TextureMeans`]) take time; a tree file keeps them.
//!
//! [`PosedEmitters`] puts the emitters where a frame has them. It gives the bounds that a tree is
//! built over. It takes a sample of one emitter for a receiver. And it tells the radiance and the
//! sampling density of an emitter that a ray has hit, so that both ways of finding light can be
//! weighed against each other. [`InfiniteLight`]s, suns and domes, stay outside the tree.
//!
//! This room does not know the tree: which emitter to sample is decided elsewhere.

mod beam;
mod bounding;
mod dome;
mod infinite;
mod mesh_light;
mod posed;
mod set;
mod shaping;
mod sphere;
mod texel_rows;
mod texels;
mod textured;
mod triangle;

pub use bounding::LightOverflow;
pub use infinite::{InfiniteLight, InfiniteSample, infinite_lights};
pub use mesh_light::MeshLight;
pub use posed::{EmitterHit, LightSample, MeshPlace, PosedEmitters};
pub use set::{EmitterPlace, EmitterRef, Emitters, LightEntry, LightSource};
pub use sphere::WorldSphere;
pub use textured::{KnownMeans, LitTriangle, TextureMeans};
