//! Candelabra: light trees for scenes with very many lights.
pub mod bounds;
pub mod emitter;
pub mod ingest;
pub mod light_tree;
pub mod math;
pub mod pipeline;
pub mod render;
pub mod scene;
pub mod store;
