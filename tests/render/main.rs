//! Proof that pictures are right: closed forms, other renderers, and every strategy against every
//! other.

mod bounces;
mod cameras;
mod closed_forms;
mod deforming;
mod determinism;
mod extremes;
mod far;
mod fitted;
mod fog;
mod forced;
mod glass;
mod knobs;
mod layers;
mod learned;
mod lens;
mod linking;
mod moving;
mod noise;
mod occluders;
mod panes;
mod ranges;
mod real;
mod references;
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
mod visibility;
