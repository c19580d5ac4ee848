//! Proof that pictures are right: closed forms, other renderers, and every strategy against every
//! other.

mod bounces;
mod closed_forms;
mod determinism;
mod extremes;
mod lens;
mod moving;
mod real;
mod references;
mod rooms;
mod shadows;
#[path = "../ingest/shared.rs"]
mod shared;
mod stage;
mod statistics;
mod strategies;
