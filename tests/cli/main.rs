//! The two programs, as a pipeline TD and a farm use them.

mod build;
mod diff;
mod disk;
mod files;
mod inspect;
mod lights;
mod names;
mod notes;
mod pages;
mod render;
mod resume;
mod trees;
mod verify;
