//! Laws of the light tree over random and adversarial sets of bounds.

mod build;
mod city;
mod darkness;
mod expected;
mod extremes;
mod far_field;
mod frames;
mod glossy;
mod importance;
mod incremental;
mod instances;
mod invariance;
mod linking;
mod measure;
mod sampling;
mod scenes;
mod splitting;
mod staleness;
mod support;
mod veils;
