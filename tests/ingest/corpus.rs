//! What the fuzzer has found interesting, again: see `tests/fuzz`.

use crate::probe;
use std::path::{Path, PathBuf};

fn corpus(name: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fuzz/corpus").join(name);
    let files: Vec<_> = folder.read_dir().unwrap().map(|file| file.unwrap().path()).collect();
    assert!(files.len() > 4, "{}", folder.display());
    files
}

#[test]
fn the_corpus_of_gltf_files_is_survived() {
    corpus("gltf").iter().for_each(|file| probe::probe_gltf(&std::fs::read(file).unwrap()));
}

#[test]
fn the_corpus_of_obj_files_is_survived() {
    corpus("obj").iter().for_each(|file| probe::probe_obj(&std::fs::read(file).unwrap()));
}
