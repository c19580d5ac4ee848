//! Proof that pictures are right: closed forms, other renderers, and every strategy against every
//! other.

mod animated_lights;
mod bounces;
mod cameras;
mod closed_forms;
mod coats;
mod deforming;
mod determinism;
mod extremes;
mod far;
#[path = "../ingest/files.rs"]
#[allow(dead_code)]
mod files;
mod filter_links;
mod filters;
mod fitted;
mod flames;
mod fog;
mod forced;
mod glass;
mod knobs;
mod layers;
mod learned;
mod lens;
mod lenses;
mod linking;
mod moving;
mod noise;
mod occluders;
mod panes;
mod ranges;
mod real;
mod references;
mod responses;
mod rooms;
mod samples;
mod seams;
mod shadows;
#[path = "../ingest/shared.rs"]
mod shared;
mod shared_trees;
mod shutter;
mod stage;
mod statistics;
mod strategies;
mod together;
mod visibility;
