//! The tree file: its specification, a file of version 1 that is read for ever, and files that lie; and the same of
//! the table of what is hidden.

mod bytes;
mod corpus;
mod golden;
mod learned;
mod links;
mod page;
mod rules;
mod scene;
#[path = "../fuzz/probe/table.rs"]
mod table;
mod tables;
#[path = "../fuzz/probe/tree.rs"]
mod tree;

use tree as probe;
