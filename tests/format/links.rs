//! Links that lead astray: walks over what nobody verified end, and soon.

use crate::bytes::Parts;
use crate::probe::{probe, repaired};
use candelabra::bounds::{Aabb, Cone, LightBounds};
use candelabra::light_tree::{
    LightList, LightLook, LightSummary, LightTree, LightTreeWriter, Link, Receiver, Splitting,
    TreeKind,
};
use candelabra::store::AlignedBytes;
use glam::Vec3;

const GROUP: usize = 256;
const LINK: usize = 224;
/// What makes a link one to an emitter, and one to an instance.
const EMITTER: u32 = 1 << 31;
const INSTANCE: u32 = 3 << 30;

fn point(energy: f32) -> LightBounds {
    LightBounds::of_emitter(Aabb::around([Vec3::ONE]), Cone::ALL, energy, f32::INFINITY)
}

/// A file over so many points in one place.
fn points(count: u32) -> Parts {
    let bounds = vec![point(1.0); count as usize];
    let mut writer = LightTreeWriter::default();
    writer.add_tree(TreeKind::Still, &bounds, |i| Link::Emitter(i as u32));
    let light = LightSummary {
        path: "/points".into(),
        fingerprint: [0; 32],
        emitter_count: count,
        energy: count as f32,
        class: 0,
        look: LightLook::default(),
        link: 0,
    };
    Parts::of(writer.finish(&LightList::new(&[light]), "{}", [0; 32]).as_ref())
}

/// Points, and in the place of their tree `count` groups, all of whose lanes that `leads` says lead on to
/// the next; the last leads to emitters.
fn chain(count: usize, leads: std::ops::Range<usize>) -> Parts {
    let mut parts = points(64);
    let group: Vec<u8> = parts.section("GRUP")[..GROUP].to_vec();
    let mut groups = group.repeat(count);
    for number in 0..count {
        for lane in 0..8 {
            let on = leads.contains(&lane) && number + 1 < count;
            let link = if on { 1 } else { EMITTER | ((number * 8 + lane) as u32 % 64) };
            let at = GROUP * number + LINK + 4 * lane;
            groups[at..at + 4].copy_from_slice(&link.to_le_bytes());
        }
    }
    *parts.section("GRUP") = groups;
    parts.set("TREE", 4, count as u32);
    parts
}

/// Each lane leads on to the next group: eight times as many ways at every step, and no way back.
#[test]
fn ways_that_multiply_are_not_walked() {
    for count in [3, 12, 60, 2000] {
        probe(chain(count, 0..8).file().as_ref());
        probe(chain(count, 3..5).file().as_ref());
    }
}

/// A tree may be as deep as it has groups, and be sound: nothing recurses.
#[test]
fn a_sound_tree_of_any_depth_is_walked() {
    const DEPTH: u32 = 100_000;
    let mut parts = points(DEPTH + 1);
    let group: Vec<u8> = parts.section("GRUP")[..GROUP].to_vec();
    let mut groups = Vec::new();
    // Lane 0 of a group is an emitter, lane 1 the rest; energies halve so that sums are exact, until they
    // are too small to tell.
    let total = |number: u32| 2f32.powi(-(number.min(120) as i32));
    for number in 0..DEPTH {
        let mut own = vec![0; GROUP];
        let mut copy_lane = |to: usize, energy: f32, link: u32| {
            for (field, size) in [
                (0, 4),
                (32, 4),
                (64, 4),
                (128, 1),
                (136, 1),
                (144, 1),
                (152, 1),
                (160, 2),
                (176, 2),
                (192, 2),
                (208, 1),
                (216, 1),
            ] {
                let (from, to) = (field, field + to * size);
                own[to..to + size].copy_from_slice(&group[from..from + size]);
            }
            own[96 + 4 * to..][..4].copy_from_slice(&energy.to_le_bytes());
            own[LINK + 4 * to..][..4].copy_from_slice(&link.to_le_bytes());
        };
        let is_last = number + 1 == DEPTH;
        let (here, rest) = match number < 120 {
            true => (0.5 * total(number), 0.5 * total(number)),
            false => (f32::from_bits(1), total(number)),
        };
        copy_lane(0, here, EMITTER | number);
        copy_lane(1, rest, if is_last { EMITTER | DEPTH } else { 1 });
        groups.extend(own);
    }
    *parts.section("GRUP") = groups;
    parts.set("TREE", 4, DEPTH);
    parts.set("TREE", 16 + 12, 1f32.to_bits());
    let tree = LightTree::open(parts.file()).unwrap();
    assert_eq!(tree.verify(), Ok(()));
    let frame = tree.at_frame(0).unwrap();
    let receiver = Receiver { point: Vec3::ZERO, normal: Vec3::ZERO };
    assert!(frame.sample(&receiver, 0.999_999).is_some());
    let last = frame.probability(&receiver, DEPTH);
    assert!(last > 0.0 && last < 1e-30, "{last}");
    let moments = frame.moments(&receiver, &[], &Splitting::NONE, &|_, expected| expected);
    assert!((moments.mean - 1.0).abs() < 1e-6, "{moments:?}");
}

/// A tree placed in itself, in a later one, or in two that place each other.
#[test]
fn trees_that_place_each_other_are_not_walked_in_circles() {
    let whole = std::fs::read(crate::golden::path("golden.ltree")).unwrap();
    let rows = LightTree::open(AlignedBytes::copy_of(&whole)).unwrap().instances().len();
    for tree in 0..10 {
        let mut parts = Parts::of(&whole);
        for row in 0..rows {
            parts.set("INST", 64 * row + 48, tree);
        }
        probe(parts.file().as_ref());
        let groups = parts.section("GRUP").len() / GROUP;
        for link in (0..groups * 8).map(|lane| GROUP * (lane / 8) + LINK + 4 * (lane % 8)) {
            parts.set("GRUP", link, INSTANCE | (link as u32 % rows as u32));
        }
        probe(parts.file().as_ref());
    }
}

/// Numbers that are none, everywhere at once.
#[test]
fn floats_that_are_no_numbers_are_survived() {
    let whole = std::fs::read(crate::golden::path("golden.ltree")).unwrap();
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, -0.0, 1e-45] {
        for field in 0..4 {
            let mut parts = Parts::of(&whole);
            let groups = parts.section("GRUP").len() / GROUP;
            for at in (0..groups).flat_map(|group| (0..8).map(move |lane| GROUP * group + 4 * lane))
            {
                parts.set("GRUP", at + 32 * field, value.to_bits());
            }
            probe(parts.file().as_ref());
            parts = Parts::of(&whole);
            let rows = parts.section("INST").len() / 64;
            for row in 0..rows {
                parts.set("INST", 64 * row + 12 * field, value.to_bits());
            }
            probe(parts.file().as_ref());
        }
    }
    assert!(LightTree::open(repaired(&whole)).unwrap().verify().is_ok());
}
