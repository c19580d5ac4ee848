//! Everything that can be asked of a tree file, asked of bytes that nobody verified.

use candelabra::light_tree::{
    FrameTree, Glossy, LightTree, Lobes, Picked, Receiver, Scratch, Segment, SplitTest, Splitting,
    Viewer,
};
use candelabra::store::AlignedBytes;
use glam::Vec3;
use std::ops::Range;

/// Where the format has what must agree with the rest of the file.
const FILE_LENGTH: Range<usize> = 16..24;
const SECTION_COUNT: Range<usize> = 24..28;
const HEADER_CHECKSUM: Range<usize> = 28..32;
const HEADER: usize = 64;
const ROW: usize = 32;

/// A file whose length and checksums have been made to agree with its bytes, as far as it has a header
/// and a table at all: damage that gets past them is what is looked for.
pub fn repaired(bytes: &[u8]) -> AlignedBytes {
    let mut file = AlignedBytes::copy_of(bytes);
    let bytes = file.as_mut();
    let length = bytes.len();
    if length < HEADER {
        return file;
    }
    bytes[FILE_LENGTH].copy_from_slice(&(length as u64).to_le_bytes());
    let count = u32::from_le_bytes(bytes[SECTION_COUNT].try_into().unwrap()) as usize;
    let table_end = HEADER.saturating_add(count.saturating_mul(ROW));
    if table_end > length {
        return file;
    }
    for row in (HEADER..table_end).step_by(ROW) {
        let number = |at: usize| {
            let bytes = bytes[row + at..row + at + 8].try_into().unwrap();
            usize::try_from(u64::from_le_bytes(bytes)).unwrap_or(usize::MAX)
        };
        let (from, to) = (number(8), number(8).saturating_add(number(16)));
        if let Some(section) = bytes.get(from..to) {
            let checksum = crc32fast::hash(section);
            bytes[row + 28..row + 32].copy_from_slice(&checksum.to_le_bytes());
        }
    }
    bytes[HEADER_CHECKSUM].fill(0);
    let checksum = crc32fast::hash(&bytes[..table_end]);
    bytes[HEADER_CHECKSUM].copy_from_slice(&checksum.to_le_bytes());
    file
}

/// Asks everything of a file, repaired. Whatever it holds, no question panics, and none takes for ever;
/// and what `verify` lets pass keeps its promises.
pub fn probe(bytes: &[u8]) {
    let Ok(tree) = LightTree::open(repaired(bytes)) else { return };
    for number in tree.frames().iter().map(|row| row.frame).take(4).chain([0]) {
        let _ = (tree.digest_at(number), tree.verify_frame(number), tree.digest_at(number));
    }
    let is_sound = tree.verify().is_ok();
    let _ = (tree.meta(), tree.sections(), tree.fingerprint(), tree.byte_length());
    for light in tree.lights() {
        let _ = tree.light_path(light);
    }
    let known = tree.frames().iter().map(|row| row.frame).take(4);
    for number in known.chain([0, i32::MIN]) {
        if let Ok(frame) = tree.at_frame(number) {
            ask_all(&frame, is_sound);
        }
    }
}

fn ask_all(frame: &FrameTree, is_sound: bool) {
    let middle = frame.root().map_or(Vec3::ZERO, |root| root.center());
    let receiver = Receiver { point: middle + Vec3::new(1.0, 2.0, -0.5), normal: Vec3::Y };
    ask(frame, &receiver, is_sound);
    let receiver = Receiver { point: middle, ..receiver };
    let lobes = Lobes { diffuse: 0.5, at_normal: 0.04, toward_grazing: 0.5, alpha: 0.2 };
    let (about, to_eye, toward) = (receiver.normal, Vec3::Y, Vec3::Z);
    ask(frame, &Glossy { receiver, about, to_eye, lobes, toward }, is_sound);
    ask(frame, &Segment { origin: Vec3::ZERO, direction: Vec3::X, length: 2.0 }, is_sound);
}

/// Emitters that are asked after one by one.
const ASKED: u32 = 64;

fn ask<V: Viewer>(frame: &FrameTree, viewer: &V, is_sound: bool) {
    for u in [0.0, 0.3, 0.999_999] {
        if let Some(pick) = frame.sample(viewer, u) {
            assert!(pick.probability > 0.0 && (0.0..1.0).contains(&pick.leftover), "{pick:?}");
            let emitter = pick.light.emitter().unwrap();
            let told = frame.probability(viewer, emitter);
            let agree = (told - pick.probability).abs() <= 1e-9 * pick.probability;
            assert!(!is_sound || agree, "{pick:?} has the probability {told}");
        }
        for light in 0..frame.forced_count().min(4) {
            frame.sample_forced(light, viewer, u);
        }
    }
    frame.for_each_leaf(viewer, |_, _, _| {});
    let emitters = frame.unforced_count();
    let sum: f64 = (0..emitters.min(ASKED)).map(|emitter| frame.probability(viewer, emitter)).sum();
    assert!(!is_sound || sum <= 1.0 + 1e-9, "probabilities add up to {sum}");
    frame.probability(viewer, emitters);
    frame.probability(viewer, u32::MAX);
    let mut scratch = Scratch::default();
    let halfway = Splitting { knob: 0.5, ..Splitting::NONE };
    let by_angle = Splitting { test: SplitTest::SolidAngle, most: 4, ..halfway };
    for how in [Splitting::NONE, halfway, by_angle, Splitting::ALL] {
        let beside = [0.5, 0.0];
        frame.for_each_pick(viewer, &beside, &how, (0.6, 7), &mut scratch, |_| {});
        for light in [Picked::Emitter(0), Picked::Emitter(emitters / 2), Picked::Beside(0)] {
            frame.expected(viewer, &beside, &how, light, &mut scratch);
        }
        frame.moments(viewer, &beside, &how, &|_, _| 1.0);
    }
}
