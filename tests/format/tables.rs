//! Files that are cut short, changed in one bit, or lie about where their sections are.

use crate::bytes::{Parts, Section};
use crate::golden::{golden_bytes, path};
use crate::probe::{probe, repaired};
use candelabra::bounds::{Aabb, Cone, LightBounds};
use candelabra::diff::{DiffOptions, Side, compare};
use candelabra::light_tree::{
    LightList, LightLook, LightSummary, LightTree, LightTreeWriter, Link, TreeKind,
};
use candelabra::store::{AlignedBytes, StoreError};
use glam::Vec3;

/// Opens and verifies.
fn verify(bytes: &[u8]) -> Result<(), StoreError> {
    LightTree::open(AlignedBytes::copy_of(bytes))?.verify()
}

#[test]
fn every_prefix_is_refused() {
    let whole = golden_bytes();
    for length in 0..whole.len() {
        assert!(verify(&whole[..length]).is_err(), "{length}");
    }
}

#[test]
fn every_flipped_bit_is_refused() {
    let mut bytes = golden_bytes();
    for bit in 0..bytes.len() * 8 {
        bytes[bit / 8] ^= 1 << (bit % 8);
        assert!(verify(&bytes).is_err(), "bit {bit}");
        bytes[bit / 8] ^= 1 << (bit % 8);
    }
}

/// The same damage where nobody verifies, and every checksum agrees with it.
#[test]
fn every_prefix_is_survived_unverified() {
    let whole = golden_bytes();
    for length in (0..whole.len()).rev() {
        probe(&whole[..length]);
        // The last section may end with the file.
        let mut parts = Parts::of(&whole);
        let path = parts.section("PATH");
        let kept = path.len().saturating_sub(whole.len() - length);
        path.truncate(kept);
        if whole.len() - length <= 128 {
            probe(parts.file().as_ref());
        }
    }
}

#[test]
fn every_flipped_bit_is_survived_unverified() {
    let mut bytes = std::fs::read(path("../fuzz/corpus/tree/two.ltree")).unwrap();
    for bit in 0..bytes.len() * 8 {
        bytes[bit / 8] ^= 1 << (bit % 8);
        probe(&bytes);
        bytes[bit / 8] ^= 1 << (bit % 8);
    }
    // The larger file has more to ask of: one bit of every other byte.
    let mut bytes = golden_bytes();
    for at in (0..bytes.len()).step_by(2) {
        bytes[at] ^= 1 << (at / 2 * 5 % 8);
        probe(&bytes);
        bytes[at] ^= 1 << (at / 2 * 5 % 8);
    }
}

/// Changes one field of the row of a section in the table; what is said of it.
fn with_row(name: &str, field: std::ops::Range<usize>, value: u64) -> Option<StoreError> {
    let mut bytes = golden_bytes();
    let row = bytes[64..].chunks(32).position(|row| &row[..4] == name.as_bytes()).unwrap();
    let field = 64 + 32 * row + field.start..64 + 32 * row + field.end;
    let size = field.len();
    bytes[field].copy_from_slice(&value.to_le_bytes()[..size]);
    probe(&bytes);
    verify(repaired(&bytes).as_ref()).err()
}

#[test]
fn a_table_that_lies_is_refused_by_the_rule() {
    let rule = |error: Option<StoreError>| error.unwrap().violation().rule.to_string();
    let (offset, length, element) = (8..16, 16..24, 24..28);
    // Overlapping, out of order, unaligned, far away, at the end of all numbers.
    assert_eq!(rule(with_row("GRUP", offset.clone(), 64)), "TABL 2");
    assert_eq!(rule(with_row("GRUP", offset.clone(), 1 << 20)), "TABL 2");
    assert_eq!(rule(with_row("GRUP", offset.clone(), 65)), "TABL 1");
    assert_eq!(rule(with_row("GRUP", offset, u64::MAX - 63)), "TABL 3");
    // Into the next section, beyond the file, beyond all numbers, nothing at all.
    assert_eq!(rule(with_row("GRUP", length.clone(), 256 * 64)), "TABL 3");
    assert_eq!(rule(with_row("GRUP", length.clone(), u64::MAX)), "TABL 3");
    assert_eq!(rule(with_row("GRUP", length.clone(), 0)), "TABL 2");
    assert_eq!(rule(with_row("INST", length.clone(), 1 << 63)), "TABL 3");
    assert_eq!(rule(with_row("PATH", length.clone(), 0)), "HEAD 4");
    assert_eq!(rule(with_row("PATH", length, 1 << 40)), "TABL 3");
    // Elements of another size.
    for size in [1, 48, 255, u32::MAX] {
        assert_eq!(rule(with_row("GRUP", element.clone(), size.into())), "TABL 8");
    }
    for name in ["META", "TREE", "INST", "FRAM", "FORC", "LGHT", "PATH"] {
        assert_eq!(rule(with_row(name, element.clone(), 7)), "TABL 8", "{name}");
    }
    assert_eq!(rule(with_row("GRUP", element, 0)), "TABL 4");
    // Names.
    assert_eq!(rule(with_row("GRUP", 0..4, u32::from_le_bytes(*b"TREE").into())), "TABL 5");
    assert_eq!(rule(with_row("GRUP", 0..4, u32::from_le_bytes(*b"NEWS").into())), "TABL 6");
    assert_eq!(rule(with_row("META", 0..4, u32::from_le_bytes(*b"INST").into())), "TABL 5");
}

#[test]
fn a_header_that_lies_about_the_table_is_refused() {
    for count in [0, 1, 9, 257, 1 << 20, u32::MAX] {
        let mut bytes = golden_bytes();
        bytes[24..28].copy_from_slice(&count.to_le_bytes());
        probe(&bytes);
        assert!(verify(repaired(&bytes).as_ref()).is_err(), "{count} sections");
    }
}

/// A list of frames that is there and empty says as much as none: all that is asked of a sound file
/// has an answer.
#[test]
fn no_frames_are_no_frames() {
    let lone = LightBounds::of_emitter(Aabb::around([Vec3::Y]), Cone::ALL, 1.0, f32::INFINITY);
    let mut writer = LightTreeWriter::default();
    writer.add_tree(TreeKind::Still, &[lone], |_| Link::Emitter(0));
    let light = LightSummary {
        path: "/lamp".into(),
        fingerprint: [3; 32],
        emitter_count: 1,
        energy: 1.0,
        class: 0,
        look: LightLook::default(),
        link: 0,
    };
    let mut parts = Parts::of(writer.finish(&LightList::new(&[light]), "{}", [4; 32]).as_ref());
    let before = parts.file();
    parts.sections.push(Section { name: *b"FRAM", required: 1, element: 16, bytes: Vec::new() });
    parts.section("LGHT")[0] ^= 1;
    let after = parts.file();
    let folder = tempfile::tempdir().unwrap();
    let side = |name: &str, bytes: &AlignedBytes| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes.as_ref()).unwrap();
        Side::open(&path).unwrap()
    };
    verify(after.as_ref()).unwrap();
    probe(after.as_ref());
    let tree = LightTree::open(after.as_ref()).unwrap();
    assert!(tree.at_frame(7).unwrap().root().is_some());
    let sides = [side("before.ltree", &before), side("after.ltree", &after)];
    compare(&sides[0], &sides[1], &DiffOptions::default()).unwrap();
}

/// The forward rules of the page.
#[test]
fn later_files_are_read_as_far_as_they_can_be() {
    let news = |required| Section { name: *b"NEWS", required, element: 3, bytes: vec![7; 10] };
    let with = |change: &dyn Fn(&mut Parts)| {
        let mut parts = Parts::of(&golden_bytes());
        change(&mut parts);
        verify(parts.file().as_ref()).map_err(|error| error.violation().rule.to_string())
    };
    let refused = |rule: &str| Err(rule.to_string());
    // Sections nobody knows.
    assert_eq!(with(&|parts| parts.sections.insert(3, news(0))), Ok(()));
    assert_eq!(with(&|parts| parts.sections.insert(3, news(1))), refused("TABL 6"));
    // Minor versions, later and earlier; another major.
    assert_eq!(with(&|parts| parts.version = [1, 0]), Ok(()));
    assert_eq!(with(&|parts| parts.version = [1, 1]), Ok(()));
    assert_eq!(with(&|parts| parts.version = [1, 9]), Ok(()));
    assert_eq!(with(&|parts| parts.version = [2, 0]), refused("HEAD 3"));
    assert_eq!(with(&|parts| parts.version = [0, 9]), refused("HEAD 3"));
    // Spare bytes say something only in a later minor version.
    let spare = |parts: &mut Parts| parts.set("INST", 56, 1);
    assert_eq!(with(&spare), refused("INST 3"));
    assert_eq!(
        with(&|parts| {
            spare(parts);
            parts.version = [1, 5];
        }),
        Ok(())
    );
    // What is there if there is something to say; what is always there.
    assert_eq!(with(&|parts| parts.sections.retain(|s| &s.name != b"META")), Ok(()));
    assert_eq!(with(&|parts| parts.sections.retain(|s| &s.name != b"PATH")), refused("TABL 7"));
}

/// Each section in turn is empty, or not there at all, while others speak of it.
#[test]
fn sections_that_are_missed_are_missed() {
    let whole = Parts::of(&golden_bytes());
    for section in whole.sections.iter().filter(|section| &section.name != b"META") {
        let mut parts = whole.clone();
        parts.section(std::str::from_utf8(&section.name).unwrap()).clear();
        probe(parts.file().as_ref());
        assert!(verify(parts.file().as_ref()).is_err(), "{:?} is empty", section.name);
        parts.sections.retain(|other| other.name != section.name);
        probe(parts.file().as_ref());
        assert!(verify(parts.file().as_ref()).is_err(), "{:?} is absent", section.name);
    }
}

/// A scene without lights.
#[test]
fn a_file_may_say_nothing() {
    let mut parts = Parts::of(&golden_bytes());
    parts.sections.retain(|section| [b"TREE", b"GRUP", b"LGHT", b"PATH"].contains(&&section.name));
    parts.sections.iter_mut().for_each(|section| section.bytes.clear());
    let file = parts.file();
    probe(file.as_ref());
    assert_eq!(verify(file.as_ref()), Ok(()));
}
