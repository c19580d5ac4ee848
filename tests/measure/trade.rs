//! Error against time: what is finished is kept, and what is found does not depend on how.

use crate::scenes::spiral_points;
use crate::stage::{Set, Stage};
use candelabra::measure::{
    Budget, Cache, Converged, Entrant, Machine, Onlooker, Row, Subject, Terms, Trade, TradeError,
    TradeOptions, Way, trade,
};
use candelabra::render::{LightStrategy, RenderDelegate, RenderError, RenderSettings};
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// Stops when a number of pictures have been begun, and remembers how far it was told that all is.
#[derive(Default)]
struct Patience {
    most: usize,
    begun: AtomicUsize,
    told: Mutex<Vec<f64>>,
}

impl Onlooker for Patience {
    fn begins(&self, _: &str) {
        self.begun.fetch_add(1, Relaxed);
    }

    fn is_at(&self, done: f64) {
        self.told.lock().unwrap().push(done);
    }

    fn is_stopped(&self) -> bool {
        self.begun.load(Relaxed) > self.most
    }
}

fn patience(most: usize) -> Patience {
    Patience { most, ..Default::default() }
}

fn options() -> TradeOptions {
    let ways = [Way::new(LightStrategy::Uniform, 0.0), Way::new(LightStrategy::Tree, 0.0)];
    let entrant = |samples| move |way| Entrant { way, budget: Budget::Samples(samples) };
    let numbers = [4, 16].into_iter().flat_map(|samples| ways.map(entrant(samples)));
    let to_error = Entrant { way: ways[1], budget: Budget::Error(0.3) };
    let entrants = numbers.chain([to_error]).collect();
    TradeOptions { entrants, seeds: 2, reference_samples: 256, grey: None, most: 1024, lights: 200 }
}

fn settings() -> RenderSettings {
    RenderSettings { width: 32, height: 18, depth: 1, ..Default::default() }
}

/// Measures a stage, with a cache in a folder.
fn measure(
    stage: &Stage,
    set: &Set,
    folder: &Path,
    onlooker: &Patience,
) -> Result<(Converged, Vec<Row>), TradeError> {
    let camera = stage.scene.cameras[0].clone();
    let mut delegate = RenderDelegate::new(&stage.scene, &set.emitters, camera, settings());
    let mut subject =
        Subject { delegate: &mut delegate, tree: &set.tree, frame: 1, base: settings() };
    let cache = Cache::new(folder, "scene", "", &Machine::this(1), false);
    trade(&mut subject, &options(), &cache, onlooker)
}

#[test]
fn a_run_that_is_stopped_goes_on_where_it_was() {
    let (stage, folder) = (spiral_points(200), tempfile::tempdir().unwrap());
    let set = stage.set();
    // Two halves of the reference, and two pictures.
    let stopped = measure(&stage, &set, folder.path(), &patience(4)).err().unwrap();
    assert!(matches!(stopped, TradeError::Render(RenderError::Stopped)), "{stopped}");
    let kept = || {
        let files = walk(folder.path());
        files
            .into_iter()
            .map(|file| (file.clone(), std::fs::read(file).unwrap()))
            .collect::<Vec<_>>()
    };
    let before = kept();
    assert_eq!(before.len(), 4);
    let onlooker = patience(usize::MAX);
    let (_, rows) = measure(&stage, &set, folder.path(), &onlooker).unwrap();
    assert_eq!(rows.len(), 5);
    let after = kept();
    assert_eq!(after.len(), 2 + 10);
    assert!(before.iter().all(|file| after.contains(file)), "what was there is as it was");
    // A third run renders nothing: times would differ.
    let again = measure(&stage, &set, folder.path(), &patience(usize::MAX)).unwrap().1;
    // Reading JSON rounds the last bit.
    let is_same = |(a, b): (&Row, &Row)| (a.seconds / b.seconds - 1.0).abs() < 1e-12;
    assert!(again.iter().zip(&rows).all(is_same), "{again:#?} {rows:#?}");
    let told = onlooker.told.into_inner().unwrap();
    assert!(told.iter().all(|done| (0.0..=1.0).contains(done)) && *told.last().unwrap() > 0.99);
}

#[test]
fn errors_do_not_depend_on_threads_or_runs() {
    let stage = spiral_points(200);
    let set = stage.set();
    let errors = |threads: usize| {
        let folder = tempfile::tempdir().unwrap();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let measured = pool.install(|| measure(&stage, &set, folder.path(), &patience(usize::MAX)));
        let (converged, rows) = measured.unwrap();
        let rows: Vec<_> = rows.iter().map(|row| (row.errors, row.samples, row.lights)).collect();
        (converged.reference, rows)
    };
    assert_eq!(errors(1), errors(3));
}

#[test]
fn importance_beats_blind_picking_and_more_samples_beat_fewer() {
    let (stage, folder) = (spiral_points(200), tempfile::tempdir().unwrap());
    let set = stage.set();
    let (converged, rows) = measure(&stage, &set, folder.path(), &patience(usize::MAX)).unwrap();
    let error = |name: &str| rows.iter().find(|row| row.name == name).unwrap().error;
    assert!(error("tree:0@4") < 0.7 * error("uniform@4"));
    assert!(error("tree:0@16") < 0.7 * error("tree:0@4"));
    assert!(converged.error < 0.5 * error("tree:0@16"));
    // The error that was asked for is there, and what it took is told.
    let asked = rows.iter().find(|row| row.asked == Some(0.3)).unwrap();
    assert!(asked.name == "tree:0@0.3" && asked.error < 1.1 * 0.3, "{asked:?}");
    assert!((8..1024).contains(&asked.samples) && asked.mean_off.abs() < 0.02, "{asked:?}");
    let through_tree = rows.iter().filter(|row| row.entrant.way.strategy == LightStrategy::Tree);
    assert!(through_tree.clone().all(|row| row.mean_off.abs() < 0.02), "{rows:#?}");
    let terms = Terms {
        grey: converged.grey,
        reference_samples: 256,
        reference_error: converged.error,
        seeds: 2,
        error: error("tree:0@16"),
    };
    let trade = Trade::new(rows, terms, &settings());
    let reach = trade.curves.iter().find(|curve| curve.name == "tree:0").unwrap().reach.unwrap();
    assert_eq!((reach.samples, reach.is_beyond), (16, false));
}

fn walk(folder: &Path) -> Vec<std::path::PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<_> =
        entries.flat_map(|path| if path.is_dir() { walk(&path) } else { vec![path] }).collect();
    files.sort();
    files
}
