//! Scene files: glTF, text and binary.
#![no_main]

#[path = "../probe/scene.rs"]
mod scene;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| scene::probe_gltf(bytes));
