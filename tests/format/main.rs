//! The tree file: its specification, a file of version 1 that is read for ever, and files that lie.

mod bytes;
mod corpus;
mod golden;
mod links;
mod page;
#[path = "../fuzz/probe/tree.rs"]
mod probe;
mod rules;
mod scene;
mod tables;
