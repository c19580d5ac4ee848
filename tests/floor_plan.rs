//! The house keeps its floors: a room imports only from floors below its own, and a file is one
//! concept of readable size.

use std::fs;
use std::path::{Path, PathBuf};

/// Rooms by floor, from the ground up.
const FLOORS: [&[&str]; 8] = [
    &["math"],
    &["scene", "bounds", "store", "page"],
    &["ingest", "emitter", "light_tree"],
    &["render"],
    &["learn", "measure"],
    &["pipeline"],
    &["diff", "farm", "inspect"],
    &["bin"],
];

/// No file is longer than this.
const LONGEST_FILE: usize = 700;

fn floor_of(room: &str) -> Option<usize> {
    FLOORS.iter().position(|rooms| rooms.contains(&room))
}

fn rust_files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let path = entry.path();
        if path.is_dir() {
            // What the fuzzer has built is not ours.
            if !path.ends_with("target") {
                rust_files(&path, found);
            }
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

/// The rooms a source text names, by `crate::room` or, from a binary, `candelabra::room`.
fn rooms_named(text: &str) -> Vec<&str> {
    let code = text.lines().filter(|line| !line.trim_start().starts_with("//"));
    code.flat_map(|line| ["crate::", "candelabra::"].map(|root| (line, root)))
        .flat_map(|(line, root)| line.split(root).skip(1))
        .flat_map(|rest| {
            let group = rest.strip_prefix('{').unwrap_or(rest);
            let names = group.split(['}', ';']).next().unwrap_or("");
            let is_group = rest.starts_with('{');
            names
                .split(',')
                .take(if is_group { usize::MAX } else { 1 })
                .map(|name| name.trim().split("::").next().unwrap_or(""))
        })
        .filter(|room| floor_of(room).is_some())
        .collect()
}

#[test]
fn imports_point_down_and_never_sideways() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    rust_files(&source, &mut files);
    assert!(files.len() > 10, "found only {} sources below {}", files.len(), source.display());
    let mut wrong = Vec::new();
    for file in &files {
        let inside = file.strip_prefix(&source).unwrap();
        let own = inside.iter().next().unwrap().to_str().unwrap().trim_end_matches(".rs");
        if own == "lib" {
            continue;
        }
        let floor = floor_of(own).unwrap_or_else(|| panic!("no floor for {}", inside.display()));
        for room in rooms_named(&fs::read_to_string(file).unwrap()) {
            if room != own && floor_of(room).unwrap() >= floor {
                wrong.push(format!("{} imports {room}", inside.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "imports must point down:\n{}", wrong.join("\n"));
}

#[test]
fn the_reader_of_imports_sees_them() {
    assert_eq!(rooms_named("use crate::scene::Mesh;"), ["scene"]);
    assert_eq!(rooms_named("use crate::{math::Frame, store};"), ["math", "store"]);
    assert_eq!(rooms_named("let x = candelabra::render::go(crate::bounds::Cone);").len(), 2);
    assert!(rooms_named("// crate::render").is_empty());
}

#[test]
fn no_file_is_two_concepts() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    rust_files(&root.join("src"), &mut files);
    rust_files(&root.join("tests"), &mut files);
    let long: Vec<_> = files
        .iter()
        .filter(|file| fs::read_to_string(file).unwrap().lines().count() > LONGEST_FILE)
        .collect();
    assert!(long.is_empty(), "longer than {LONGEST_FILE} lines: {long:?}");
}
