//! The two programs, as a pipeline TD and a farm use them.

mod alone;
mod build;
mod diff;
mod disk;
mod error;
mod files;
mod inspect;
mod layers;
mod learned;
mod lenses;
mod lies;
mod lights;
mod links;
mod measure;
mod names;
mod notes;
mod pages;
#[allow(dead_code)]
#[path = "../fuzz/probe/tree.rs"]
mod probe;
mod render;
mod resume;
mod stage;
mod trees;
mod verify;
mod views;
