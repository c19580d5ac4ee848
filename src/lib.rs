//! Candelabra: light trees for scenes with very many lights.
pub mod ingest;
pub mod math;
pub mod scene;
