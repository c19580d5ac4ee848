//! Laws of the light tree over random and adversarial sets of bounds.

mod build;
mod importance;
mod sampling;
mod support;
