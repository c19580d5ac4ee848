//! Tables of what is hidden: their specification, and files that lie.

use crate::bytes::{Parts, Section};
use crate::table::probe;
use candelabra::light_tree::Veil;
use candelabra::light_tree::learned::{LearnedFile, Plane, RULES_OF_LEARNED, Table, ViewKeys};
use candelabra::store::{AlignedBytes, StoreError};
use proptest::prelude::*;

const FORMAT: &str = include_str!("../../src/light_tree/learned/format.md");

/// Four cells with two rows each.
fn table() -> Table {
    let plane = |axis: u32, at: f32| Plane { at, width: 0.5, axis };
    let row = |group: u32| Veil { group, weights: [255, 200, 3, 0, 17, 255, 255, 90] };
    let rows = (0..4).flat_map(|cell| [row(cell), if cell < 2 { row(7) } else { Veil::NONE }]);
    Table {
        tree: [7; 32],
        planes: vec![plane(0, 0.25), plane(2, -1.0), plane(4, 0.0)],
        rows: rows.collect(),
        area: Some([[-1.0, 0.0, -2.0], [3.0, 2.5, 2.0]]),
        hidden: vec![0, 255, 31, 140],
    }
}

fn bytes_of(table: &Table) -> AlignedBytes {
    let view = ViewKeys { infinite: [1; 32], geometry: [2; 32], camera: [3; 32] };
    table.to_bytes(view, "{\"rays\": 1000}")
}

fn verify(bytes: &[u8]) -> Result<(), StoreError> {
    LearnedFile::open(AlignedBytes::copy_of(bytes))?.verify()
}

#[test]
fn what_is_written_is_read() {
    for table in [table(), Table { area: None, hidden: Vec::new(), ..table() }, Table::default()] {
        let file = LearnedFile::open(bytes_of(&table)).unwrap();
        file.verify().unwrap();
        assert_eq!((file.planes(), file.rows()), (&*table.planes, &*table.rows));
        assert_eq!((file.tree_key(), file.hidden()), (table.tree, &*table.hidden));
        let area = file.area().map(|area| area.map(|corner| corner.to_array()));
        assert_eq!(area, table.area);
        let view = file.view_keys();
        assert_eq!([view.infinite, view.geometry, view.camera], [[1; 32], [2; 32], [3; 32]]);
        assert_eq!(file.view().is_some(), !table.rows.is_empty());
    }
}

/// Of each table its parts say what it is.
#[test]
fn a_fingerprint_is_of_all_that_is_said() {
    let print = |table: &Table| LearnedFile::open(bytes_of(table)).unwrap().fingerprint();
    let whole = print(&table());
    let mut other = [table(), table(), table(), table(), table()];
    other[0].tree[31] ^= 1;
    other[1].planes[2].axis = 3;
    other[2].rows[5].weights[0] = 254;
    other[3].area = None;
    other[4].hidden[1] = 0;
    assert!(other.iter().all(|other| print(other) != whole));
}

#[test]
fn every_prefix_and_every_flipped_bit_is_refused() {
    let mut bytes = bytes_of(&table()).as_ref().to_vec();
    for length in 0..bytes.len() {
        assert!(verify(&bytes[..length]).is_err(), "{length}");
    }
    for bit in 0..bytes.len() * 8 {
        bytes[bit / 8] ^= 1 << (bit % 8);
        assert!(verify(&bytes).is_err(), "bit {bit}");
        bytes[bit / 8] ^= 1 << (bit % 8);
    }
}

/// The same damage where nobody verifies, and every checksum agrees with it.
#[test]
fn all_damage_is_survived_unverified() {
    let mut bytes = bytes_of(&table()).as_ref().to_vec();
    for length in (0..bytes.len()).rev() {
        probe(&bytes[..length]);
    }
    for bit in 0..bytes.len() * 8 {
        bytes[bit / 8] ^= 1 << (bit % 8);
        probe(&bytes);
        bytes[bit / 8] ^= 1 << (bit % 8);
    }
}

proptest! {
    /// Several things wrong at once, anywhere: numbers that are set, runs that are copied elsewhere, a part that is
    /// missing. `PROPTEST_CASES` asks for more of it.
    #[test]
    fn random_damage_is_survived_unverified(
        edits in prop::collection::vec((any::<prop::sample::Index>(), number()), 0..8),
        copies in prop::collection::vec(
            (any::<prop::sample::Index>(), any::<prop::sample::Index>(), 1usize..40), 0..3
        ),
        missing in prop::option::of((any::<prop::sample::Index>(), 1usize..100)),
    ) {
        let mut bytes = bytes_of(&table()).as_ref().to_vec();
        for (at, number) in edits {
            let at = at.index(bytes.len() / 4) * 4;
            bytes[at..at + 4].copy_from_slice(&number.to_le_bytes());
        }
        for (from, to, length) in copies {
            let (from, to) = (from.index(bytes.len()), to.index(bytes.len()));
            let length = length.min(bytes.len() - from.max(to));
            bytes.copy_within(from..from + length, to);
        }
        if let Some((at, length)) = missing {
            let at = at.index(bytes.len());
            bytes.drain(at..(at + length).min(bytes.len()));
        }
        probe(&bytes);
    }
}

/// A number that may mean something to someone.
fn number() -> impl Strategy<Value = u32> {
    prop_oneof![
        any::<u32>(),
        0u32..300,
        any::<f32>().prop_map(f32::to_bits),
        Just(u32::MAX),
        Just(1 << 31),
        prop_oneof![Just(f32::NAN), Just(f32::INFINITY), Just(1e38), Just(-0.0)]
            .prop_map(f32::to_bits),
    ]
}

#[test]
fn every_rule_is_kept_and_in_the_specification() {
    let plane = |number: usize, field: usize| 12 * number + 4 * field;
    type Damage = Box<dyn Fn(&mut Parts)>;
    let set = |section: &'static str, at: usize, value: u32| -> Damage {
        Box::new(move |parts| parts.set(section, at, value))
    };
    let cut = |section: &'static str, length: usize| -> Damage {
        Box::new(move |parts| parts.section(section).truncate(length))
    };
    let cases: Vec<(&str, Damage)> = vec![
        ("KEYS 1", cut("KEYS", 96)),
        ("PLAN 1", cut("PLAN", 24)),
        ("PLAN 2", set("PLAN", plane(1, 0), f32::NAN.to_bits())),
        ("PLAN 2", set("PLAN", plane(0, 1), (-1f32).to_bits())),
        ("PLAN 2", set("PLAN", plane(2, 1), f32::INFINITY.to_bits())),
        ("PLAN 2", set("PLAN", plane(2, 2), 6)),
        ("VEIL 1", cut("VEIL", 84)),
        ("VEIL 2", set("VEIL", 12, 0)),
        ("VEIL 2", set("VEIL", 60, 1)),
        ("AREA 1", cut("AREA", 20)),
        ("AREA 1", set("AREA", 0, 4f32.to_bits())),
        ("AREA 1", set("AREA", 20, f32::NAN.to_bits())),
        ("HIDN 1", cut("HIDN", 3)),
    ];
    let whole = bytes_of(&table());
    let mut broken = Vec::new();
    for (rule, damage) in cases {
        let mut parts = Parts::of(whole.as_ref());
        damage(&mut parts);
        let Err(StoreError::Broken(violation)) = verify(parts.file().as_ref()) else {
            panic!("rule {rule} lets it pass");
        };
        assert_eq!(violation.rule.to_string(), rule);
        broken.push(violation.rule);
    }
    let rules = RULES_OF_LEARNED.concat();
    assert!(rules.iter().all(|rule| broken.contains(rule)), "a rule that no file breaks");
    let rows: Vec<&str> = FORMAT.lines().filter_map(|line| line.strip_prefix("| ")).collect();
    for rule in &rules {
        let row = format!("{rule} | {} |", rule.text);
        assert!(rows.contains(&&*row), "not in the specification: {row}");
    }
    // Each section is in the table of the specification, and no other.
    for Section { name, .. } in Parts::of(whole.as_ref()).sections {
        let row = format!("`{}` |", String::from_utf8_lossy(&name));
        assert!(rows.iter().any(|line| line.starts_with(&row)), "{row}");
    }
}
