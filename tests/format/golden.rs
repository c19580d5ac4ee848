//! A file of version 1 that is read for ever, and what it says; and what a build gives today.
//!
//! `golden.ltree` was built from `golden.gltf`, a few lights of every class, and stays as it is; another
//! version of the format gets a file of its own beside it. `built.ltree` is what the same scene gives
//! by this version of the algorithm. Where that has changed on purpose:
//!
//! ```sh
//! cargo test --test format bless -- --ignored
//! ```
//!
//! Where estimates change, and probabilities with them, `record` in the place of `bless` writes anew
//! what is recorded of the golden file.

use crate::bytes::Parts;
use crate::page::{Report, report};
use candelabra::emitter::Emitters;
use candelabra::light_tree::{FrameTree, Pick, Receiver};
use candelabra::pipeline::{self, OpenedTree};
use candelabra::store::AlignedBytes;
use glam::Vec3;
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::{Path, PathBuf};

pub fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/format").join(name)
}

/// The golden file, opened and verified as the renderer does.
pub fn golden() -> OpenedTree {
    pipeline::open_tree(&path("golden.ltree"), true).unwrap()
}

/// The golden file as bytes that may be changed.
pub fn golden_bytes() -> Vec<u8> {
    fs::read(path("golden.ltree")).unwrap()
}

/// The scene, built today.
fn built() -> AlignedBytes {
    let scene = pipeline::load_scene(&path("golden.gltf")).unwrap();
    let emitters = Emitters::collect(&scene);
    let survey = pipeline::survey(&scene, &emitters, &pipeline::frames_of(&scene)).unwrap();
    pipeline::build_tree(&survey)
}

/// What was recorded of the file: its content, and what sampling it gave.
#[derive(Serialize, Deserialize)]
struct Recorded {
    content: Report,
    samples: Vec<Sample>,
}

#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Sample {
    frame: i32,
    emitter: u32,
    probability: f64,
}

/// A few picks in every frame, of forced lights too.
fn samples(tree: &OpenedTree) -> Vec<Sample> {
    let mut samples = Vec::new();
    for frame in 1..=3 {
        let sampled = tree.at_frame(frame).unwrap();
        for (point, normal) in [(Vec3::ZERO, Vec3::Y), (Vec3::new(-3.0, 0.0, 2.0), Vec3::ZERO)] {
            let receiver = Receiver { point, normal };
            let picks = (0..4).map(|i| sampled.sample(&receiver, (f64::from(i) + 0.5) / 4.0));
            let picks = picks.chain(picks_of_forced(&sampled, &receiver)).flatten();
            samples.extend(picks.map(|pick| Sample {
                frame,
                emitter: pick.light.emitter().unwrap(),
                probability: pick.probability,
            }));
        }
    }
    samples
}

fn picks_of_forced<'a>(
    sampled: &'a FrameTree,
    receiver: &'a Receiver,
) -> impl Iterator<Item = Option<Pick>> + 'a {
    (0..sampled.forced_count()).map(|light| sampled.sample_forced(light, receiver, 0.5))
}

fn recorded() -> Recorded {
    serde_json::from_slice(&fs::read(path("golden.json")).unwrap()).unwrap()
}

#[test]
fn the_golden_file_says_what_it_said() {
    let (tree, recorded) = (golden(), recorded());
    recorded.content.assert_is(&report(&tree));
    let samples = samples(&tree);
    assert_eq!(samples.len(), recorded.samples.len());
    for (now, then) in samples.iter().zip(&recorded.samples) {
        assert_eq!((now.frame, now.emitter), (then.frame, then.emitter));
        let off = (now.probability / then.probability - 1.0).abs();
        assert!(off < 1e-4, "{now:?}, then {then:?}");
    }
}

/// It has a light of every class there is, and a group of every kind of link.
#[test]
fn the_golden_file_has_everything() {
    let tree = golden();
    let mut classes: Vec<u32> = tree.lights().iter().map(|light| light.class).collect();
    classes.dedup();
    assert_eq!(classes, [0, 1, 2, 3, 5, 7]);
    let mut kinds: Vec<u32> = tree.trees().iter().map(|tree| tree.kind).collect();
    kinds.dedup();
    assert_eq!(kinds, [0, 1, 2]);
    assert_eq!(tree.sections().len(), 8);
    assert!(
        tree.trees()
            .iter()
            .all(|tree| tree.kind == 2 || tree.group_count > 1 || tree.leaf_count == 1)
    );
}

/// A file without the name of the program, which has its version; and the fingerprint in its header.
fn unnamed(file: &[u8]) -> (Vec<u8>, Vec<u8>) {
    let mut parts = Parts::of(file);
    let meta = parts.section("META");
    let mut told: serde_json::Value = serde_json::from_slice(meta).unwrap();
    told["program"].take();
    *meta = told.to_string().into_bytes();
    (parts.file().as_ref().to_vec(), file[32..64].to_vec())
}

#[test]
fn todays_build_gives_the_same_bytes() {
    let same = unnamed(built().as_ref()) == unnamed(&fs::read(path("built.ltree")).unwrap());
    assert!(same, "the build has changed; see the head of this file for how to bless it");
}

#[test]
#[ignore = "writes down what a build gives"]
fn bless() {
    fs::write(path("built.ltree"), built()).unwrap();
}

#[test]
#[ignore = "writes anew what is recorded of the golden file"]
fn record() {
    let tree = golden();
    let recorded = Recorded { content: report(&tree), samples: samples(&tree) };
    fs::write(path("golden.json"), serde_json::to_string(&recorded).unwrap() + "\n").unwrap();
}
