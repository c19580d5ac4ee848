//! What must hold before anything is read: first of the document alone, then of its data.
//!
//! Whatever passes here can be compiled without asking again: references lead somewhere, the nodes
//! are a forest, every array has the type that its use asks for.

mod animations;
mod data;
mod extensions;
mod hierarchy;
mod materials;
mod meshes;
mod nodes;
mod references;

use super::accessors::Accessor;
use super::document::Document;
use crate::ingest::error::Fault;

/// Checks the document alone.
pub(super) fn structure(document: &Document) -> Result<(), Fault> {
    extensions::check(document)?;
    references::check(document)?;
    hierarchy::check(document)?;
    nodes::check(document)?;
    materials::check(document)
}

/// Checks the arrays against their uses.
pub(super) fn contents(document: &Document, accessors: &[Accessor]) -> Result<(), Fault> {
    let facts = data::check(document, accessors)?;
    meshes::check(document, accessors, &facts)?;
    animations::check(document, accessors, &facts)
}
