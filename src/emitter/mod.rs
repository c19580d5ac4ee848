//! Floor 2: from a scene to its emitters, their bounds, and light from a point of them.
//!
//! [`Emitters`] lists what a scene's lights are made of, in canonical order: triangles of mesh lights,
//! spheres, points and spots. Finding them is quick, except for the means of emission textures over
//! triangles ([`TextureMeans`]), which a tree file keeps. [`PosedEmitters`] puts the emitters where a
//! frame has them, with the corners that are drawn. It gives the bounds that a tree is built over, and
//! samples one emitter for a receiver. For an emitter that a ray has hit it gives the radiance and the
//! sampling density, so that multiple importance sampling can weigh both ways of finding light.
//! [`InfiniteLight`]s, suns and domes, stay outside the tree.
//!
//! [`PosedFilters`] tell what of a light's light gets to a point; bounds and densities are without them.
//!
//! This room does not know the tree. Which emitter to sample is decided elsewhere.
//!
//! Differences of positions, angles off an axis and products of edges are in double precision. What is
//! stored and handed out is in 32 bits.

mod beam;
mod bounding;
mod dome;
mod filters;
mod infinite;
mod mesh_light;
mod picture;
mod posed;
mod set;
mod shaping;
mod sphere;
mod texel_rows;
mod texels;
mod textured;
mod triangle;

pub use bounding::LightOverflow;
pub use filters::{Lit, PosedFilters, Source};
pub use infinite::{InfiniteLight, InfiniteSample, Skies, infinite_lights};
pub use mesh_light::MeshLight;
pub use posed::{EmitterHit, LightSample, MeshPlace, PosedEmitters};
pub use set::{EmitterPlace, EmitterRef, Emitters, LightEntry, LightSource};
pub use sphere::WorldSphere;
pub use textured::{KnownMeans, LitTriangle, TextureMeans};
