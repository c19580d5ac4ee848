//! Tree files.
#![no_main]

#[path = "../probe/tree.rs"]
mod tree;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| tree::probe(bytes));
