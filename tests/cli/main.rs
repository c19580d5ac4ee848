//! The two programs, as a pipeline TD and a farm use them.

mod build;
mod diff;
mod disk;
mod files;
mod inspect;
mod lights;
mod pages;
mod render;
mod resume;
mod trees;
mod verify;
mod views;
