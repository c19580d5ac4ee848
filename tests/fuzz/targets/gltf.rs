//! Scene files: glTF, text and binary.
#![no_main]

#[path = "../probe/scene.rs"]
#[allow(dead_code, reason = "the other half is for the other target")]
mod scene;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| scene::probe_gltf(bytes));
