//! Scene files: OBJ with MTL.
#![no_main]

#[path = "../probe/scene.rs"]
mod scene;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| scene::probe_obj(bytes));
