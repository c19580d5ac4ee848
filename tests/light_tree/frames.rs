//! A shot frame by frame: who asks for one frame gets what the whole shot has of it, and looks at no other.

use crate::incremental::{Prim, Tree, prim, scene_of, survey_of, without_twins};
use candelabra::emitter::Emitters;
use candelabra::light_tree::{LightTree, TreeKind};
use candelabra::pipeline::{self, ShotTrees, TreeError, TreeFile};
use candelabra::scene::{Keys, LightKind, Scene};
use candelabra::store::AlignedBytes;
use glam::Vec3;
use proptest::prelude::*;
use std::path::Path;

/// The lights move and flicker from frame 1 to 3, and then hold still.
const FRAMES: [i32; 5] = [1, 2, 3, 7, 9];
const GROUP: usize = 256;

fn whole(scene: &Scene) -> Tree {
    LightTree::open(pipeline::build_tree(&survey_of(scene, &FRAMES))).unwrap()
}

fn file(tree: &Tree) -> TreeFile<'_> {
    TreeFile {
        tree: tree.by_reference(),
        path: Path::new("a.ltree"),
        options: &[],
        verify: true,
        mapped: None,
    }
}

/// What the whole shot has of each frame, asked for alone.
fn digests(scene: &Scene, tree: &Tree) -> Vec<[u8; 32]> {
    let emitters = Emitters::collect(scene);
    let mut trees = ShotTrees::of_file(scene, &emitters, file(tree)).unwrap();
    FRAMES.iter().map(|&frame| trees.for_frame(frame).unwrap().digest_at(frame).unwrap()).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// The digest of a frame does not depend on where its tree comes from: the file of the shot, a build
    /// for that frame alone, or a build after other frames, in any order.
    #[test]
    fn a_frame_is_the_same_wherever_it_comes_from(
        prims in prop::collection::vec(prim(), 0..80), order in Just(FRAMES).prop_shuffle(),
    ) {
        let scene = scene_of(&without_twins(prims));
        let emitters = Emitters::collect(&scene);
        let told = digests(&scene, &whole(&scene));
        let told_of = |frame: i32| told[FRAMES.iter().position(|own| *own == frame).unwrap()];
        let mut in_turn = ShotTrees::built(&scene, &emitters).unwrap();
        for frame in order {
            prop_assert_eq!(in_turn.for_frame(frame).unwrap().digest_at(frame), Ok(told_of(frame)));
            let alone = pipeline::build_tree(&survey_of(&scene, &[frame]));
            let alone = LightTree::open(alone).unwrap();
            prop_assert_eq!(alone.digest_at(frame), Ok(told_of(frame)));
        }
    }

    /// Frames of one fingerprint share a tree, and so have one digest. Frames of one digest have one fingerprint,
    /// unless a forced light varies: it is sampled at every point, however strong it is.
    #[test]
    fn frames_that_are_alike_share_a_tree(prims in prop::collection::vec(prim(), 0..60)) {
        let may_differ_unseen = prims.iter().any(|prim| prim.forced && prim.varies);
        let scene = scene_of(&without_twins(prims));
        let tree = whole(&scene);
        if tree.frames().is_empty() {
            return Ok(());
        }
        let (told, prints, rows) = (digests(&scene, &tree), tree.fingerprints(), tree.frames());
        for a in 0..FRAMES.len() {
            for b in 0..a {
                let alike = prints[a] == prints[b];
                prop_assert!(!alike || told[a] == told[b]);
                prop_assert!(alike || told[a] != told[b] || may_differ_unseen);
                prop_assert!(!alike || rows[a].tree == rows[b].tree);
            }
        }
        // After their last key all lights hold still.
        prop_assert_eq!(prints[3], prints[4]);
    }
}

/// A row of lamps that stand still, and lamps of every kind that change.
fn street() -> Vec<Prim> {
    let still = (0..200).map(|i| Prim::lamp(i, [i as i8 % 50, 3, (i / 50) as i8]));
    let tram = Prim { moves: true, ..Prim::lamp(300, [0, 1, 0]) };
    let sign = Prim { varies: true, ..Prim::lamp(301, [9, 1, 0]) };
    let siren = Prim { moves: true, forced: true, ..Prim::lamp(302, [5, 1, 5]) };
    still.chain([tram, sign, siren]).collect()
}

/// Where the groups of the trees are that a frame does not reach.
fn beyond(tree: &Tree, frame: i32) -> Vec<usize> {
    let own = tree.frames()[tree.row_of(frame).unwrap()].tree as usize;
    let rows = tree.trees().iter().enumerate();
    let other =
        rows.filter(|(row, tree)| TreeKind::of(tree) == Some(TreeKind::Frame) && *row != own);
    let range = |(_, tree): (usize, &candelabra::light_tree::TreeRow)| {
        let first = tree.first_group as usize;
        first..first + tree.group_count as usize
    };
    other.flat_map(range).collect()
}

fn groups_start(tree: &Tree) -> usize {
    let section = tree.sections().iter().find(|section| &section.id.0 == b"GRUP").unwrap();
    section.offset as usize
}

/// Nothing of the trees of other frames is looked at: they are rubbish, and no one minds who does not ask for
/// them. Who does is told.
#[test]
fn what_is_not_asked_for_is_not_looked_at() {
    let scene = scene_of(&street());
    let emitters = Emitters::collect(&scene);
    let tree = whole(&scene);
    let (start, rubbish) = (groups_start(&tree), beyond(&tree, 2));
    assert!(rubbish.len() >= 3);
    let told = digests(&scene, &tree)[1];
    let mut bytes = tree.into_bytes().as_ref().to_vec();
    for group in rubbish {
        bytes[start + group * GROUP..][..GROUP].fill(0xa5);
    }
    let tree = LightTree::open(AlignedBytes::copy_of(&bytes)).unwrap();
    let mut trees = ShotTrees::of_file(&scene, &emitters, file(&tree)).unwrap();
    assert_eq!(trees.for_frame(2).unwrap().digest_at(2), Ok(told));
    for frame in [1, 3, 9] {
        let error = trees.for_frame(frame).map(drop).unwrap_err();
        assert!(matches!(error, TreeError::Broken { .. }), "{error}");
    }
    // It is not the worse for having been asked.
    assert_eq!(trees.for_frame(2).unwrap().digest_at(2), Ok(told));
    assert!(tree.verify().is_err());
}

/// Nor is the scene at other frames: a light is too strong for any tree there.
#[test]
fn the_scene_is_not_looked_at_in_other_frames() {
    let mut scene = scene_of(&street());
    let sign = scene.lights.iter_mut().find(|light| light.values.is_some()).unwrap();
    let values = vec![Vec3::ONE, Vec3::ONE, Vec3::splat(3.4e38)];
    sign.values = Some(
        Keys { times_s: vec![0.0, 0.1, 0.3], values, interpolation: Default::default() }.into(),
    );
    let emitters = Emitters::collect(&scene);
    let beyond = FRAMES[4];
    assert!(pipeline::survey(&scene, &emitters, &FRAMES).is_err());
    let survey = pipeline::survey(&scene, &emitters, &[1, 2, 3]).unwrap();
    let tree = LightTree::open(pipeline::build_tree(&survey)).unwrap();
    let ways = [
        ShotTrees::of_file(&scene, &emitters, file(&tree)).unwrap(),
        ShotTrees::built(&scene, &emitters).unwrap(),
    ];
    for mut trees in ways {
        for frame in [1, 2, 3] {
            trees.for_frame(frame).map(drop).unwrap();
        }
        assert!(trees.for_frame(beyond).is_err());
    }
}

/// A scene that changes after frame 2 has the same frame 2, but its file is of the scene before: the trees of
/// frame 2 are as good as ever, those of frame 3 are stale, and the message names the light.
#[test]
fn a_frame_is_stale_if_it_has_changed() {
    let scene = scene_of(&street());
    let tree = whole(&scene);
    let mut later = scene_of(&street());
    let sign = later.lights.iter_mut().find(|light| light.values.is_some()).unwrap();
    let keys = sign.values.as_mut().unwrap();
    // From the time of frame 2 on.
    keys.times_s = vec![0.0, 1.0 / 24.0, 0.1];
    keys.values = vec![Vec3::ONE, Vec3::ONE * (1.0 + 10.0 / 24.0), Vec3::splat(9.0)];
    let emitters = Emitters::collect(&later);
    let mut trees = ShotTrees::of_file(&later, &emitters, file(&tree)).unwrap();
    trees.for_frame(1).map(drop).unwrap();
    let error = trees.for_frame(3).map(drop).unwrap_err();
    let text = error.to_string();
    assert!(matches!(error, TreeError::Stale { .. }), "{text}");
    assert!(
        text.contains("dirtied: /lights/00301.") && text.contains("candelabra build"),
        "{text}"
    );
    // What stands still concerns every frame.
    let lamp = later.lights.iter_mut().find(|light| light.values.is_none()).unwrap();
    lamp.kind = LightKind::Point { intensity_cd: Vec3::splat(7.0) };
    let emitters = Emitters::collect(&later);
    let error = ShotTrees::of_file(&later, &emitters, file(&tree)).map(drop).unwrap_err();
    assert!(error.to_string().contains("/lights/00000"), "{error}");
}

#[test]
fn a_frame_that_the_file_lacks_is_named() {
    let scene = scene_of(&street());
    let (tree, emitters) = (whole(&scene), Emitters::collect(&scene));
    let mut trees = ShotTrees::of_file(&scene, &emitters, file(&tree)).unwrap();
    let error = trees.for_frame(4).map(drop).unwrap_err();
    assert!(matches!(error, TreeError::NoSuchFrame { .. }));
    assert!(error.to_string().contains("a.ltree: the tree has no frame 4"), "{error}");
    // Where nothing changes, every frame is there.
    let still = scene_of(&street()[..200]);
    let (tree, emitters) = (whole(&still), Emitters::collect(&still));
    let mut trees = ShotTrees::of_file(&still, &emitters, file(&tree)).unwrap();
    let [a, b] = [4, 1_000_000].map(|frame| trees.for_frame(frame).unwrap().digest_at(frame));
    assert_eq!(a, b);
}

/// Another tree over the same lights has another digest, and is found out where it matters: a light that it
/// tells wrongly.
#[test]
fn other_trees_have_other_digests() {
    let scene = scene_of(&street());
    let tree = whole(&scene);
    let told = digests(&scene, &tree);
    let (start, groups) = (groups_start(&tree), tree.groups().len());
    let bytes = tree.into_bytes();
    let mut changed = 0;
    for group in 0..groups {
        // A half extent of the first lane: the box is a little wider.
        let mut bytes = bytes.as_ref().to_vec();
        bytes[start + group * GROUP + 128] ^= 1;
        let tree = LightTree::open(AlignedBytes::copy_of(&bytes)).unwrap();
        let differs = |(at, frame): (usize, i32)| tree.digest_at(frame) != Ok(told[at]);
        changed += usize::from(FRAMES.into_iter().enumerate().any(differs));
    }
    assert_eq!(changed, groups);
}

/// One light that changes costs one light a frame, however many there are that do not.
#[test]
fn a_light_that_changes_costs_one_light_a_frame() {
    let lamps = |count: u16| (0..count).map(|i| Prim::lamp(i, [i as i8, (i / 256) as i8, 0]));
    let sign = Prim { varies: true, ..Prim::lamp(60_000, [9, 1, 0]) };
    let size = |count: u16, frames: &[i32]| {
        let prims: Vec<Prim> = lamps(count).chain([sign.clone()]).collect();
        pipeline::build_tree(&survey_of(&scene_of(&prims), frames)).as_ref().len()
    };
    let a_frame = |count: u16| size(count, &[1, 2]) - size(count, &[1]);
    // A row each of TREE, FRAM and FPRT, and one group; sections are padded.
    let most = 48 + 16 + 32 + GROUP + 4 * 64;
    assert!(a_frame(10) <= most && a_frame(3000) <= most, "{} {}", a_frame(10), a_frame(3000));
}
