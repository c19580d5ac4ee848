//! What the fuzzer has found interesting, again: see `tests/fuzz`.

#[test]
fn the_corpus_of_trees_is_survived() {
    let folder = crate::golden::path("../fuzz/corpus/tree");
    let files: Vec<_> =
        std::fs::read_dir(folder).unwrap().map(|file| file.unwrap().path()).collect();
    assert!(files.len() > 4);
    files.iter().for_each(|file| crate::probe::probe(&std::fs::read(file).unwrap()));
}

#[test]
fn the_corpus_of_tables_is_survived() {
    let folder = crate::golden::path("../fuzz/corpus/table");
    let files: Vec<_> =
        std::fs::read_dir(folder).unwrap().map(|file| file.unwrap().path()).collect();
    assert!(files.len() > 2);
    files.iter().for_each(|file| crate::table::probe(&std::fs::read(file).unwrap()));
}
