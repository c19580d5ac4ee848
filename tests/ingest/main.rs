//! Files in, a scene index out.

mod files;
mod fog;
mod gltf;
mod malformed;
mod obj;
mod real;
mod refused;
mod shared;
mod usd;
