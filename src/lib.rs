//! Candelabra: light trees for scenes with very many lights.
pub mod math;
pub mod render;
pub mod scene;
pub mod store;
