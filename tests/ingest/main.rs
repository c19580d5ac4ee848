//! Files in, a scene index out.

mod cameras;
mod coat;
mod cones;
mod corpus;
mod deforming;
mod files;
mod filters;
mod fog;
mod glass;
mod glows;
mod gltf;
mod lenses;
mod links;
mod malformed;
mod mended;
mod mended_textures;
mod obj;
mod open_exr;
mod posing;
mod posing_mended;
mod posing_puppets;
#[path = "../fuzz/probe/scene.rs"]
mod probe;
mod real;
mod refused;
mod responses;
mod shared;
mod strengths;
mod usd;
