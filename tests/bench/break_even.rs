//! What a tree file costs and saves, from a thousand emitters to a million: a table in Markdown.
//!
//! `cargo bench --bench break_even`, or with `-- --quick` up to ten thousand.

mod lights;

use candelabra::emitter::Emitters;
use candelabra::pipeline::{self, ShotTrees, Survey, TreeFile};
use candelabra::scene::Scene;
use candelabra::store::write_atomically;
use std::hint::black_box;
use std::io::Write;
use std::time::Instant;

/// The median of so many.
const REPETITIONS: usize = 7;

/// Seconds that something takes.
fn seconds<T>(mut work: impl FnMut() -> T) -> f64 {
    let mut taken: Vec<f64> = (0..REPETITIONS)
        .map(|_| {
            let started = Instant::now();
            black_box(work());
            started.elapsed().as_secs_f64()
        })
        .collect();
    taken.sort_by(f64::total_cmp);
    taken[REPETITIONS / 2]
}

fn milliseconds(seconds: f64) -> String {
    let digits = if seconds < 0.1 { 2 } else { 0 };
    format!("{:.digits$} ms", 1e3 * seconds)
}

fn survey(scene: &Scene) -> Survey {
    pipeline::survey(scene, &Emitters::collect(scene), &[1]).expect("lights of ordinary size")
}

/// One line of the table: point lights, each a prim of its own.
fn row(folder: &std::path::Path, count: u32) -> String {
    let mut scene = lights::points(count);
    let before = survey(&scene);
    let surveying = seconds(|| survey(&scene));
    let building = seconds(|| pipeline::build_tree(&before));
    let bytes = pipeline::build_tree(&before);
    let path = folder.join("points.ltree");
    let writing =
        seconds(|| write_atomically(&path, |file| file.write_all(bytes.as_ref())).unwrap());
    // What a process spends on lights before its first frame, after finding the emitters.
    let emitters = Emitters::collect(&scene);
    let without =
        seconds(|| ShotTrees::built(&scene, &emitters).unwrap().for_frame(1).map(drop).unwrap());
    let with = seconds(|| {
        let tree = pipeline::open_tree(&path, false).unwrap();
        let file = TreeFile {
            tree: tree.by_reference(),
            path: &path,
            options: &[],
            verify: true,
            mapped: None,
        };
        ShotTrees::of_file(&scene, &emitters, file).unwrap().for_frame(1).map(drop).unwrap();
    });

    lights::change_one(&mut scene);
    let after = survey(&scene);
    let verifying = seconds(|| pipeline::open_base(&path).unwrap());
    let base = pipeline::open_base(&path).unwrap();
    let rebuilding = seconds(|| pipeline::rebuild_tree(&after, &base));
    let rebuilt = pipeline::rebuild_tree(&after, &base);
    let full = pipeline::build_tree(&after);
    assert!(full.as_ref() == rebuilt.bytes.as_ref(), "the same bytes");

    let pays = ((surveying + building + writing) / (without - with)).ceil().max(1.0);
    let share = 100.0 * (verifying + rebuilding) / building;
    let cells = [surveying, building, writing, without, with].map(milliseconds).join(" | ");
    let [verifying, rebuilding] = [verifying, rebuilding].map(milliseconds);
    format!("| {count} | {cells} | {pays:.0} | {verifying} + {rebuilding} | {share:.0} % |")
}

fn main() {
    let folder = tempfile::tempdir().expect("a folder for the file");
    println!(
        "\n| emitters | survey | build | write | a process without the file | with it | pays with \
         process | one light changed: verify the base + rebuild | of a build \
         |\n|---|---|---|---|---|---|---|---|---|"
    );
    let counts = [1_000, 10_000, 100_000, 1_000_000];
    let is_quick = std::env::args().any(|argument| argument == "--quick");
    for &count in if is_quick { &counts[..2] } else { &counts[..] } {
        println!("{}", row(folder.path(), count));
    }
}
