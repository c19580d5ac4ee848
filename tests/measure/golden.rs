//! The exact variance of every way of picking lights, on every scene: a change that samples worse fails,
//! and one that samples better asks to be written down:
//!
//! ```text
//! cargo test --test measure bless -- --ignored
//! ```

use crate::scenes::{lamps, spiral_mesh, spiral_points};
use crate::stage::Stage;
use candelabra::measure::{ProbeOptions, Way, at_probes};
use candelabra::render::{LightStrategy, RenderDelegate, RenderSettings, SplitBy};
use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;

/// Of a way on a scene: mean and ninth decile of the relative variance, and lights sampled at a point.
type Measured = BTreeMap<String, [f64; 3]>;

/// By how much a number may differ that was calculated on another machine.
const ROUNDING: f64 = 1e-3;
/// Variances below are none.
const NONE: f64 = 1e-9;

fn path() -> PathBuf {
    [env!("CARGO_MANIFEST_DIR"), "tests", "measure", "golden.json"].iter().collect()
}

fn ways() -> Vec<Way> {
    use LightStrategy::{Distance, Exhaustive, Power, Tree, Uniform};
    let mut ways = vec![Way::new(Uniform, 0.0), Way::new(Power, 0.0), Way::new(Exhaustive, 0.0)];
    ways.extend([0.0, 0.5].map(|split| Way::new(Distance, split)));
    ways.extend([0.0, 0.2, 0.5, 0.8].map(|split| Way::new(Tree, split)));
    ways.push(Way { split_by: SplitBy::SolidAngle, ..Way::new(Tree, 0.5) });
    ways
}

fn scenes() -> [(&'static str, Stage, bool); 4] {
    [
        ("spiral_points", spiral_points(600), false),
        ("spiral_mesh", spiral_mesh(300), false),
        ("lamps", lamps(100), false),
        ("lamps, occluded", lamps(100), true),
    ]
}

fn measured() -> Measured {
    let mut measured = Measured::new();
    for (name, stage, visibility) in scenes() {
        let set = stage.set();
        let settings = RenderSettings { width: 160, height: 90, ..Default::default() };
        let camera = stage.scene.cameras[0].clone();
        let delegate = RenderDelegate::new(&stage.scene, &set.emitters, camera, settings);
        let options = ProbeOptions {
            probes: 192,
            visibility,
            ways: ways(),
            grey: None,
            seed: 0,
            oracles: vec![],
        };
        let report = at_probes(&delegate, &set.tree, 1, &options).unwrap();
        assert!(report.probes > 100, "{name}: {} points are lit", report.probes);
        for row in report.strategies {
            let numbers = [row.variance, row.ninth_decile, row.lights];
            measured.insert(format!("{name}: {}", row.name), numbers);
        }
    }
    measured
}

/// What differs between two measurements, one line each: what got worse, and what got better or is new.
fn differences(before: &Measured, after: &Measured) -> [Vec<String>; 2] {
    let (mut worse, mut better) = (Vec::new(), Vec::new());
    for (name, now) in after {
        let Some(old) = before.get(name) else {
            better.push(format!("{name}: new, {now:?}"));
            continue;
        };
        let told = ["variance", "ninth decile", "lights"];
        for (what, (old, now)) in told.iter().zip(old.iter().zip(now)) {
            let line = format!(
                "{name}: {what} {old:.6} -> {now:.6} ({:+.1} %)",
                100.0 * (now / old - 1.0)
            );
            if *now > old * (1.0 + ROUNDING) + NONE {
                worse.push(line);
            } else if *now < old * (1.0 - ROUNDING) - NONE {
                better.push(line);
            }
        }
    }
    let gone = before.keys().filter(|name| !after.contains_key(*name));
    worse.extend(gone.map(|name| format!("{name}: is not measured any more")));
    [worse, better]
}

#[test]
fn no_way_samples_worse_than_it_did() {
    let before: Measured = serde_json::from_str(&fs::read_to_string(path()).unwrap()).unwrap();
    let [worse, better] = differences(&before, &measured());
    assert!(
        worse.is_empty(),
        "these sample worse, or take more lights:\n{}\n{} are better:\n{}\nIf that is what is meant, see \
         the head of this file for how to bless it.",
        worse.join("\n"),
        better.len(),
        better.join("\n")
    );
    assert!(
        better.is_empty(),
        "these sample better; see the head of this file for how to bless it:\n{}",
        better.join("\n")
    );
}

#[test]
fn better_and_worse_are_told_apart() {
    let of = |numbers: [f64; 3]| Measured::from([("a".into(), numbers)]);
    let before = of([0.1, 0.2, 3.0]);
    assert_eq!(differences(&before, &of([0.100_01, 0.2, 3.0])), [vec![], Vec::<String>::new()]);
    let [worse, better] = differences(&before, &of([0.12, 0.1, 3.0]));
    assert_eq!(worse, ["a: variance 0.100000 -> 0.120000 (+20.0 %)"]);
    assert_eq!(better, ["a: ninth decile 0.200000 -> 0.100000 (-50.0 %)"]);
    let [worse, better] = differences(&before, &Measured::from([("b".into(), [0.0; 3])]));
    assert_eq!((worse.len(), better.len()), (1, 1));
}

#[test]
#[ignore = "writes down what is measured"]
fn bless() {
    fs::write(path(), serde_json::to_string_pretty(&measured()).unwrap() + "\n").unwrap();
}
