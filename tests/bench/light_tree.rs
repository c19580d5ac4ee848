//! What a tree over a million triangles costs: building, picking, opening, bytes, memory.
//!
//! `cargo bench --bench light_tree`

mod lights;

use candelabra::bounds::{Aabb, Cone, LightBounds};
use candelabra::emitter::Emitters;
use candelabra::light_tree::{
    Glossy, LightList, LightLook, LightSummary, LightTree, LightTreeWriter, Link, Lobes, Receiver,
    TreeKind,
};
use candelabra::math::random::{hash, widen};
use candelabra::pipeline::{self, open_tree};
use candelabra::scene::Scene;
use candelabra::store::AlignedBytes;
use criterion::{Criterion, criterion_group};
use glam::Vec3;
use lights::{place, random};
use std::hint::black_box;
use std::time::Duration;

const EMITTERS: u32 = 1_000_000;

fn direction(i: u32, n: u32) -> Vec3 {
    let (z, phi) = (1.0 - 2.0 * random(i, n), std::f32::consts::TAU * random(i, n + 1));
    let radius = (1.0 - z * z).sqrt();
    Vec3::new(radius * phi.cos(), radius * phi.sin(), z)
}

/// Small triangles facing every way.
fn triangles(count: u32) -> Vec<LightBounds> {
    (0..count)
        .map(|i| {
            let a = place(i);
            let (b, c) = (a + 0.05 * direction(i, 3), a + 0.05 * direction(i, 5));
            let normal = (b - a).cross(c - a);
            LightBounds::of_emitter(
                Aabb::around([a, b, c]),
                Cone::flat(normal.normalize_or(Vec3::Z), false),
                normal.length() * (0.5 + random(i, 7)) + 1e-9,
                f32::INFINITY,
            )
        })
        .collect()
}

fn build(bounds: &[LightBounds]) -> AlignedBytes {
    let mut writer = LightTreeWriter::default();
    writer.add_tree(TreeKind::Still, bounds, |i| Link::Emitter(i as u32));
    let light = LightSummary {
        path: "/mesh".into(),
        fingerprint: [0; 32],
        emitter_count: bounds.len() as u32,
        energy: 1.0,
        class: 0,
        look: LightLook::default(),
        link: 0,
    };
    writer.finish(&LightList::new(&[light]), "{}", [0; 32])
}

fn benchmarks(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("a million triangles");
    group.sample_size(10).measurement_time(Duration::from_secs(20));

    let bounds = triangles(EMITTERS);
    group.bench_function("build, two threads", |b| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
        b.iter(|| pool.install(|| build(black_box(&bounds))));
    });

    let bytes = build(&bounds);
    let each = bytes.as_ref().len() as f64 / f64::from(EMITTERS);
    println!("file: {} bytes, {each:.1} an emitter", bytes.as_ref().len());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("million.ltree");
    std::fs::write(&path, bytes.as_ref()).unwrap();
    group.bench_function("open and verify", |b| b.iter(|| open_tree(&path, true).unwrap()));
    group.bench_function("open", |b| b.iter(|| open_tree(&path, false).unwrap()));

    let tree = LightTree::open(bytes).unwrap();
    let frame = tree.at_frame(0).unwrap();
    // Receivers of a picture: neighbours in space, as paths visit them.
    let receiver = |i: u32| Receiver {
        point: Vec3::new(random(i >> 10, 0), 0.0, random(i >> 10, 1)) * 100.0
            + 0.1 * Vec3::new(random(i, 2), 0.0, random(i, 3)),
        normal: Vec3::Y,
    };
    let mut next = 0;
    group.bench_function("one pick, one thread", |b| {
        b.iter(|| {
            next += 1;
            frame.sample(&receiver(next), widen(random(next, 4), next))
        });
    });
    let glossy = |i: u32| Glossy {
        receiver: receiver(i),
        about: receiver(i).normal,
        to_eye: Vec3::new(0.6, 0.8, 0.0),
        lobes: Lobes { diffuse: 0.5, at_normal: 0.04, toward_grazing: 0.5, alpha: 0.1 },
        toward: Vec3::Y,
    };
    group.bench_function("one pick for a glossy surface, one thread", |b| {
        b.iter(|| {
            next += 1;
            frame.sample(&glossy(next), widen(random(next, 4), next))
        });
    });
    let mapped = open_tree(&path, true).unwrap();
    let mapped_frame = mapped.at_frame(0).unwrap();
    group.bench_function("one pick from a mapped file, one thread", |b| {
        b.iter(|| {
            next += 1;
            mapped_frame.sample(&receiver(next), widen(random(next, 4), next))
        });
    });
    group.bench_function("one probability, one thread", |b| {
        b.iter(|| {
            next += 1;
            frame.probability(&receiver(next), hash(next, 5) % EMITTERS)
        });
    });
    group.finish();
}

/// What a build upon an earlier file saves.
fn one_changed(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("a hundred thousand lights, one changed");
    group.sample_size(20);
    let survey = |scene: &Scene| pipeline::survey(scene, &Emitters::collect(scene), &[1]).unwrap();
    let mut scene = lights::points(100_000);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("before.ltree");
    std::fs::write(&path, pipeline::build_tree(&survey(&scene)).as_ref()).unwrap();
    lights::change_one(&mut scene);
    let after = survey(&scene);
    group.bench_function("build", |b| b.iter(|| pipeline::build_tree(&after)));
    let open = || pipeline::open_base(&path).unwrap();
    group.bench_function("open and verify the base", |b| b.iter(open));
    let base = open();
    group.bench_function("build upon it", |b| b.iter(|| pipeline::rebuild_tree(&after, &base)));
    group.finish();
}

/// The most memory this process has used so far, bytes.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<u64>().ok()? * 1024)
}

criterion_group!(timed, benchmarks, one_changed);

fn main() {
    // First of all, while the process is small: what one build needs.
    let bounds = triangles(EMITTERS);
    let before = peak_memory();
    drop(black_box(build(&bounds)));
    if let (Some(before), Some(after)) = (before, peak_memory()) {
        let megabytes = |bytes: u64| bytes as f64 / 1e6;
        println!(
            "peak memory of a build: {:.0} MB, of which {:.0} MB are the bounds it was given",
            megabytes(after),
            megabytes(before)
        );
    }
    drop(bounds);
    timed();
    Criterion::default().configure_from_args().final_summary();
}
