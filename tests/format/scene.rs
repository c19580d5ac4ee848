//! A tree file beside its scene: what the file says of lights is what the scene gives, or it is refused.

use crate::bytes::Parts;
use crate::golden::path;
use crate::probe::repaired;
use candelabra::emitter::Emitters;
use candelabra::light_tree::{LightTree, Link, Node, Receiver};
use candelabra::pipeline::{
    self, OpenedTree, ShotTrees, Standing, TreeError, TreeFile, check_fresh, collect_emitters,
    rebuild_tree, standing,
};
use candelabra::render::{LightStrategy, RenderDelegate, RenderSettings, Split};
use candelabra::scene::Scene;
use candelabra::store::AlignedBytes;
use glam::Vec3;
use std::sync::atomic::{AtomicU64, Ordering};

const GROUP: usize = 256;

/// A scene with its emitters, and the tree that is built of it.
struct Owner {
    scene: Scene,
    emitters: Emitters,
    bytes: AlignedBytes,
}

impl Owner {
    fn of(name: &str) -> Owner {
        let scene = pipeline::load_scene(&path(name)).unwrap();
        let emitters = Emitters::collect(&scene);
        let survey = pipeline::survey(&scene, &emitters, &pipeline::frames_of(&scene)).unwrap();
        Owner { bytes: pipeline::build_tree(&survey), scene, emitters }
    }

    fn survey(&self) -> pipeline::Survey {
        let frames = pipeline::frames_of(&self.scene);
        pipeline::survey(&self.scene, &self.emitters, &frames).unwrap()
    }

    fn check<D: AsRef<[u8]> + Sync>(
        &self,
        tree: &LightTree<D>,
        leaves: bool,
    ) -> Result<(), TreeError> {
        check_fresh(tree, "shot.ltree".as_ref(), &self.scene, &self.emitters, &[], leaves)
    }
}

fn both() -> [Owner; 2] {
    ["golden.gltf", "textured.gltf"].map(Owner::of)
}

fn open(bytes: AlignedBytes) -> LightTree<AlignedBytes> {
    LightTree::open(bytes).unwrap()
}

fn leaves<D: AsRef<[u8]>>(tree: &LightTree<D>) -> Vec<Node> {
    let nodes = tree.groups().iter().flat_map(|group| group.nodes());
    nodes.filter(|node| !matches!(node.link(), Link::Inner(_))).collect()
}

/// A number that looks random.
fn next(state: &mut u64) -> usize {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 33) as usize
}

/// A file with a few bytes changed behind its table, under checksums that are right.
fn damaged(whole: &[u8], state: &mut u64) -> AlignedBytes {
    let table_end = 64 + 32 * u32::from_le_bytes(whole[24..28].try_into().unwrap()) as usize;
    let mut bytes = whole.to_vec();
    for _ in 0..1 + next(state) % 3 {
        let at = table_end + next(state) % (bytes.len() - table_end);
        bytes[at] = match next(state) % 3 {
            0 => bytes[at] ^ 1 << (next(state) % 8),
            1 => next(state) as u8,
            _ => [0, 0x7f, 0x80, 0xff][next(state) % 4],
        };
    }
    repaired(&bytes)
}

#[test]
fn what_was_built_from_a_scene_agrees_with_it() {
    for owner in both() {
        let tree = open(owner.bytes.clone());
        tree.verify().unwrap();
        owner.check(&tree, true).unwrap();
        assert_eq!(standing(&tree, &owner.survey()), Standing::UpToDate);
    }
}

/// Sound in itself, and dark where the scene is lit: every range of the shortest.
#[test]
fn a_sound_file_whose_leaves_lie_is_refused() {
    let owner = Owner::of("golden.gltf");
    let mut parts = Parts::of(owner.bytes.as_ref());
    let groups = parts.section("GRUP");
    for group in groups.chunks_mut(GROUP) {
        for lane in 0..8 {
            if group[224 + 4 * lane..228 + 4 * lane] != [0; 4] {
                group[216 + lane] = 1;
            }
        }
    }
    parts.section("TREE").chunks_mut(48).for_each(|tree| tree[16 + 27] = 1);
    let lie = open(parts.file());
    lie.verify().unwrap();
    let error = owner.check(&lie, true).unwrap_err();
    assert!(matches!(error, TreeError::Contradicts { .. }));
    let text = error.to_string();
    assert!(text.contains("its range") && text.contains("candelabra build"), "{text}");
    assert!(matches!(standing(&lie, &owner.survey()), Standing::Contradicts(_)));
    // Nor is anything taken over from it.
    let rebuilt = rebuild_tree(&owner.survey(), &lie);
    assert!(rebuilt.base_contradicts && rebuilt.reused == 0);
    assert!(rebuilt.bytes.as_ref() == owner.bytes.as_ref());
}

/// Whatever is changed: what is let pass has the leaves of the scene, bit by bit; and a build upon it
/// either gives what a build from scratch gives, or something as sound.
#[test]
fn whatever_passes_has_the_scenes_leaves() {
    for (number, owner) in both().into_iter().enumerate() {
        let (whole, survey) = (owner.bytes.as_ref(), owner.survey());
        let honest = leaves(&open(owner.bytes.clone()));
        let (mut state, mut sound, mut refused) = (number as u64, 0, 0);
        for _ in 0..4000 {
            let tree = open(damaged(whole, &mut state));
            if tree.verify().is_err() {
                continue;
            }
            sound += 1;
            if owner.check(&tree, true).is_err() {
                refused += 1;
            } else {
                let own = leaves(&tree);
                let same = own.iter().zip(&honest).all(|(a, b)| a.difference(b).is_none());
                assert!(same && own.len() == honest.len());
                // What agrees in the whole agrees frame by frame: no build calls it up to date, and no
                // render stale.
                let path = "shot.ltree".as_ref();
                let file = TreeFile {
                    tree: tree.by_reference(),
                    path,
                    options: &[],
                    verify: true,
                    mapped: None,
                };
                let trees = ShotTrees::of_file(&owner.scene, &owner.emitters, file);
                let mut trees = trees.unwrap_or_else(|error| panic!("{error}"));
                for frame in 1..=3 {
                    trees.for_frame(frame).map(drop).unwrap();
                }
            }
            let rebuilt = open(rebuild_tree(&survey, &tree).bytes);
            rebuilt.verify().unwrap();
            owner.check(&rebuilt, true).unwrap();
        }
        assert!(sound > 100 && refused > 20, "{sound} {refused}");
    }
}

/// Whoever does not verify gets what the bytes give: wrong light perhaps, but a picture, by every
/// strategy.
#[test]
fn every_strategy_survives_what_nobody_verified() {
    use LightStrategy::{All, Distance, Exhaustive, Power, Tree, Uniform};
    let strategies = [Tree, Power, All, Uniform, Distance, Exhaustive];
    for (number, owner) in both().into_iter().enumerate() {
        let (mut state, mut rendered) = (7 + number as u64, 0);
        for round in 0..3000 {
            let tree = open(damaged(owner.bytes.as_ref(), &mut state));
            if owner.check(&tree, false).is_err() {
                continue;
            }
            let settings = RenderSettings {
                width: 2,
                height: 2,
                samples: 1,
                strategy: strategies[round % strategies.len()],
                split: Split::Fixed([0.0, 0.5, 1.0][round % 3]),
                ..Default::default()
            };
            let camera = owner.scene.cameras[0].clone();
            let delegate = RenderDelegate::new(&owner.scene, &owner.emitters, camera, settings);
            rendered += usize::from(delegate.render(&tree, 1 + round as i32 % 3, &()).is_ok());
        }
        assert!(rendered > 500, "{rendered}");
    }
}

/// The same of who asks for one frame: what is let pass has the scene's leaves in that frame.
#[test]
fn whatever_passes_in_a_frame_has_the_scenes_leaves_there() {
    let frame_leaves = |tree: &LightTree<&[u8]>, frame| {
        let (mut emitters, mut forced) = (Vec::new(), Vec::new());
        let sampled = tree.at_frame(frame).unwrap();
        let everywhere = Receiver { point: Vec3::splat(40.0), normal: Vec3::ZERO };
        sampled.for_each_leaf(&everywhere, |emitter, importance, energy| {
            emitters.push((emitter, importance.to_bits(), energy.to_bits()));
        });
        emitters.sort_unstable();
        for light in 0..sampled.forced_count() {
            let pick = sampled.sample_forced(light, &everywhere, 0.5);
            forced.push(pick.map(|pick| (pick.light, pick.probability.to_bits())));
        }
        (emitters, forced)
    };
    for (number, owner) in both().into_iter().enumerate() {
        let whole = owner.bytes.as_ref();
        let (mut state, mut passed, mut refused) = (40 + number as u64, 0, 0);
        let honest = open(owner.bytes.clone());
        let frames = [1, 2, 3];
        let honest = frames.map(|frame| frame_leaves(&honest.by_reference(), frame));
        for round in 0..3000 {
            let frame = frames[round % 3];
            let tree = open(damaged(whole, &mut state));
            // The means of textures are taken from the file, like all else.
            let emitters = collect_emitters(&owner.scene, Some(&tree), &|_, _| {});
            let path = "shot.ltree".as_ref();
            let file = TreeFile {
                tree: tree.by_reference(),
                path,
                options: &[],
                verify: true,
                mapped: None,
            };
            let trees = ShotTrees::of_file(&owner.scene, &emitters, file);
            match trees.and_then(|mut trees| Ok(frame_leaves(&trees.for_frame(frame)?, frame))) {
                Err(_) => refused += 1,
                Ok(found) => {
                    passed += 1;
                    assert_eq!(found.0.len(), honest[round % 3].0.len());
                    assert!(found == honest[round % 3], "frame {frame}, round {round}");
                }
            }
        }
        assert!(passed > 100 && refused > 500, "{passed} {refused}");
    }
}

/// The means of textures in a file are those that integrating gives, and are used.
#[test]
fn means_are_taken_from_the_file() {
    let owner = Owner::of("textured.gltf");
    let tree = open(owner.bytes.clone());
    assert_eq!((tree.textures().len(), owner.emitters.texture_means().len()), (2, 2));
    let integrated = |tree: Option<&LightTree<AlignedBytes>>| {
        let done = AtomicU64::new(0);
        let watch = |so_far: u64, _| {
            done.fetch_max(so_far, Ordering::Relaxed);
        };
        let emitters = collect_emitters(&owner.scene, tree, &watch);
        assert_eq!(emitters.texture_means(), owner.emitters.texture_means());
        assert_eq!(emitters.len(), owner.emitters.len());
        done.into_inner()
    };
    assert_eq!(integrated(Some(&tree)), 0);
    let all = integrated(None);
    assert_eq!(all, 32, "two meshes of sixteen triangles");
    // A triangle whose texels are black is no emitter: of each of three signs the left half, but for
    // its edges.
    assert!((27..42).contains(&owner.emitters.len()), "{}", owner.emitters.len());
    // What cannot be so is worked out again.
    for (at, value) in [(0, u32::MAX), (0, 9), (4, f32::NAN.to_bits()), (4, (-1f32).to_bits())] {
        let mut parts = Parts::of(owner.bytes.as_ref());
        parts.set("MEAN", at, value);
        assert!(integrated(Some(&open(parts.file()))) > 0 || value == 9, "{value}");
    }
    // And what could be, but is not, is not believed.
    let mut parts = Parts::of(owner.bytes.as_ref());
    parts.set("MEAN", 4, 0.9f32.to_bits());
    let lie = open(parts.file());
    lie.verify().unwrap();
    assert!(owner.check(&lie, true).is_err());
    let believing = collect_emitters(&owner.scene, Some(&lie), &|_, _| {});
    let path = "shot.ltree".as_ref();
    assert!(check_fresh(&lie, path, &owner.scene, &believing, &[], true).is_err());
}

/// A file of version 1.0 has no means: they are worked out, and a build adds them.
#[test]
fn a_file_without_means_is_used_and_renewed() {
    let owner = Owner::of("textured.gltf");
    let mut parts = Parts::of(owner.bytes.as_ref());
    parts.sections.retain(|section| ![b"TXTR", b"MEAN"].contains(&&section.name));
    let old = open(parts.file());
    old.verify().unwrap();
    owner.check(&old, true).unwrap();
    assert_eq!(standing(&old, &owner.survey()), Standing::OutOfDate);
}

/// What the fingerprint of a texture's means depends on, it depends on.
#[test]
fn another_texture_or_use_of_it_has_other_means() {
    use candelabra::scene::{Pixels, Wrap};
    let known = open(Owner::of("textured.gltf").bytes);
    let found = |change: &dyn Fn(&mut Scene)| {
        let mut scene = pipeline::load_scene(&path("textured.gltf")).unwrap();
        change(&mut scene);
        let done = AtomicU64::new(0);
        let watch = |so_far: u64, _| {
            done.fetch_max(so_far, Ordering::Relaxed);
        };
        collect_emitters(&scene, Some(&known), &watch);
        done.into_inner() == 0
    };
    assert!(found(&|_| {}));
    // What the means do not depend on.
    assert!(found(&|scene| scene.materials[0].emission_nits *= 2.0));
    assert!(found(&|scene| scene.meshes[0].positions[0].x -= 1.0));
    assert!(!found(&|scene| scene.textures[0].wrap[0] = Wrap::Clamp));
    assert!(!found(&|scene| scene.textures[0].bilinear = false));
    assert!(!found(&|scene| scene.meshes[0].uv_sets[0][3].x += 0.01));
    assert!(!found(&|scene| scene.meshes[0].triangles[3].rotate_left(1)));
    let usage = |scene: &mut Scene| {
        scene.materials[0].emission_texture.as_mut().unwrap().transform =
            Some(glam::Affine2::from_scale(glam::Vec2::splat(2.0)))
    };
    assert!(!found(&|scene| usage(scene)));
    assert!(!found(&|scene| match &mut scene.textures[0].pixels {
        Pixels::Srgb8(texels) => texels[127][1] ^= 1,
        _ => unreachable!("a picture in 8 bits"),
    }));
}

/// The golden file of version 1.1, which stays as it is.
#[test]
fn the_golden_file_with_textures_is_read() {
    let tree: OpenedTree = pipeline::open_tree(&path("textured.ltree"), true).unwrap();
    let counts: Vec<u32> = tree.textures().iter().map(|row| row.count).collect();
    assert_eq!((counts.len(), counts.iter().sum::<u32>() as usize), (2, tree.means().len()));
    let brightest = tree.means().iter().map(|row| row.mean[1]).fold(0.0, f32::max);
    assert!((0.3..0.6).contains(&brightest), "{brightest}");
    for row in tree.textures() {
        let found = tree.means_of(&row.fingerprint).unwrap();
        assert_eq!(found.len(), row.count as usize);
    }
    assert_eq!(tree.means_of(&[7; 32]), None);
}

/// The golden file of version 1.2, likewise: three frames of the golden scene, and two long after.
#[test]
fn the_golden_file_with_fingerprints_of_frames_is_read() {
    let tree: OpenedTree = pipeline::open_tree(&path("frames.ltree"), true).unwrap();
    let (rows, prints) = (tree.frames(), tree.fingerprints());
    assert_eq!(rows.iter().map(|row| row.frame).collect::<Vec<_>>(), LONG);
    assert_eq!(prints.len(), rows.len());
    assert_eq!((prints[3], rows[3].tree), (prints[4], rows[4].tree));
    assert!(prints[0] != prints[1] && rows[0].tree != rows[1].tree);
}

const LONG: [i32; 5] = [1, 2, 3, 1000, 1001];

#[test]
#[ignore = "writes the golden file with fingerprints of frames, once"]
fn write_frames() {
    let Owner { scene, emitters, .. } = Owner::of("golden.gltf");
    let survey = pipeline::survey(&scene, &emitters, &LONG).unwrap();
    std::fs::write(path("frames.ltree"), pipeline::build_tree(&survey)).unwrap();
}

#[test]
#[ignore = "writes the golden file with textures, once"]
fn write_textured() {
    std::fs::write(path("textured.ltree"), Owner::of("textured.gltf").bytes).unwrap();
}
