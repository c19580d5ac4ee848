//! Tables of what is hidden.
#![no_main]

#[path = "../probe/table.rs"]
mod table;
#[path = "../probe/tree.rs"]
#[allow(dead_code, reason = "the other half is for the other target")]
mod tree;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| table::probe(bytes));
