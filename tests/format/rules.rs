//! Every rule about a record: a file that breaks it, and what `verify` says of it.
//!
//! Rules about the header and the table have theirs in [`tables`](crate::tables).

use crate::bytes::{Parts, Section};
use crate::golden::{golden, golden_bytes};
use candelabra::light_tree::{Group, LightTree, Link, RULES, TreeKind};
use candelabra::store::{Record, Rule, Violation};

/// Where fields of records are.
const GROUP: usize = 256;
const ENERGY: usize = 96;
const HALF_EXPONENT: usize = 152;
const AXIS: usize = 160;
const THETA_O: usize = 192;
const RANGE: usize = 216;
const LINK: usize = 224;

/// A lane of a group of the golden file.
#[derive(Clone, Copy)]
struct Lane {
    group: usize,
    lane: usize,
}

impl Lane {
    /// The lanes of the tree of what stands still, and their links.
    fn all() -> Vec<(Lane, Link)> {
        let tree = golden();
        let still = |row: &&_| TreeKind::of(row) == Some(TreeKind::Still);
        let row = tree.trees().iter().find(still).unwrap();
        let lanes = |(group, own): (usize, &Group)| {
            (0..8).map(|lane| (Lane { group, lane }, own.link(lane))).collect::<Vec<_>>()
        };
        (row.first_group as usize..).zip(tree.groups_of(row)).flat_map(lanes).collect()
    }

    /// The first of them with a link of a kind.
    fn with(wanted: fn(Link) -> bool) -> Lane {
        Lane::all().into_iter().find(|&(_, link)| wanted(link)).unwrap().0
    }

    /// The last lane of the first group that leads to another; and how far ahead that is.
    fn last_inner() -> (Lane, u32) {
        let ahead = |(lane, link)| match link {
            Link::Inner(ahead) => Some((lane, ahead)),
            _ => None,
        };
        Lane::all().into_iter().take(8).filter_map(ahead).next_back().unwrap()
    }

    /// Where a field of it is whose elements have so many bytes.
    fn at(self, field: usize, size: usize) -> usize {
        self.group * GROUP + field + self.lane * size
    }

    fn record(self) -> Record {
        Record::Lane { group: self.group as u32, lane: self.lane as u8 }
    }

    fn whole_group(self) -> Record {
        Record::Row(self.group as u32)
    }
}

fn broken(file: &[u8], change: impl FnOnce(&mut Parts)) -> Option<Violation> {
    let mut parts = Parts::of(file);
    change(&mut parts);
    let file = parts.file();
    crate::probe::probe(file.as_ref());
    LightTree::open(file).unwrap().verify().err().map(|error| error.violation())
}

/// Collects what was broken, to see in the end that nothing was left out.
struct Cases(Vec<Rule>);

impl Cases {
    #[track_caller]
    fn breaks(&mut self, rule: &str, record: Record, change: impl FnOnce(&mut Parts)) {
        self.breaks_of(&golden_bytes(), rule, record, change);
    }

    /// The same of another file than the golden one.
    #[track_caller]
    fn breaks_of(
        &mut self,
        file: &[u8],
        rule: &str,
        record: Record,
        change: impl FnOnce(&mut Parts),
    ) {
        let violation = broken(file, change).expect(rule);
        assert_eq!((violation.rule.to_string().as_str(), violation.record), (rule, record));
        self.0.push(violation.rule);
    }
}

#[test]
fn every_rule_is_asked_and_named_with_its_record() {
    let mut cases = Cases(Vec::new());
    rows_of_trees(&mut cases);
    groups(&mut cases);
    rows_of_the_rest(&mut cases);
    textures(&mut cases);
    links(&mut cases);
    let whole = std::fs::read(crate::golden::path("frames.ltree")).unwrap();
    cases.breaks_of(&whole, "FPRT 1", Record::All, |p| p.section("FPRT").truncate(32));
    // Files so large are not made for a test.
    let excused = ["GRUP 1"];
    for rule in RULES[2..].concat() {
        let is_covered = cases.0.contains(&rule) || excused.contains(&rule.to_string().as_str());
        assert!(is_covered, "no file breaks rule {rule}");
    }
}

fn rows_of_trees(cases: &mut Cases) {
    let row = |number: usize, field: usize| 48 * number + field;
    cases.breaks("TREE 1", Record::Row(0), |p| p.set("TREE", row(0, 12), 3));
    cases.breaks("TREE 1", Record::Row(2), |p| p.set("TREE", row(2, 8), 0));
    cases.breaks("TREE 2", Record::Row(1), |p| p.set("TREE", row(0, 12), 1));
    cases.breaks("TREE 3", Record::Row(1), |p| p.set("TREE", row(1, 0), 0));
    cases.breaks("TREE 3", Record::Row(3), |p| p.set("TREE", row(3, 4), u32::MAX));
    cases.breaks("TREE 3", Record::All, |p| {
        let more = [0; GROUP];
        p.section("GRUP").extend(more);
    });
    cases.breaks("TREE 4", Record::Row(2), |p| p.set("TREE", row(2, 16), f32::NAN.to_bits()));
    cases.breaks("TREE 4", Record::Row(2), |p| p.set("TREE", row(2, 44), 1));
    cases.breaks("TREE 5", Record::Row(5), |p| {
        let leaves = p.get("TREE", row(5, 8));
        p.set("TREE", row(5, 8), leaves + 1);
    });
    // A light that stands still is said to have its own tree.
    cases.breaks("TREE 6", Record::Row(5), |p| p.set("INST", 52, 99));
}

fn groups(cases: &mut Cases) {
    let emitter = Lane::with(|link| matches!(link, Link::Emitter(_)));
    let instance = Lane::with(|link| matches!(link, Link::Instance(_)));
    let inner = Lane::with(|link| matches!(link, Link::Inner(_)));
    // A shared tree of one emitter has lanes to spare.
    let first_of_one = golden().trees()[1].first_group as usize;
    let unused = Lane { group: first_of_one, lane: 7 };
    cases.breaks("GRUP 2", unused.whole_group(), |p| p.set("GRUP", unused.at(ENERGY, 4), 1));
    // Onwards to the wrong group, out of the tree; and nowhere, which leaves groups that none leads to.
    for ahead in [2, 3, 0x3fff_ffff, 0x7fff_ffff] {
        cases.breaks("GRUP 3", inner.record(), |p| p.set("GRUP", inner.at(LINK, 4), ahead));
    }
    let (last, ahead) = Lane::last_inner();
    cases.breaks("GRUP 3", Record::Row(last.group as u32 + ahead), |p| {
        p.set("GRUP", last.at(LINK, 4), 1 << 31);
    });
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        cases.breaks("GRUP 4", emitter.record(), |p| {
            p.set("GRUP", emitter.at(32, 4), value.to_bits());
        });
    }
    cases.breaks("GRUP 4", emitter.record(), |p| {
        p.section("GRUP")[emitter.at(HALF_EXPONENT, 1)] = 255;
    });
    for value in [f32::NAN, f32::INFINITY, 0.0, -1.0] {
        cases.breaks("GRUP 5", emitter.record(), |p| {
            p.set("GRUP", emitter.at(ENERGY, 4), value.to_bits());
        });
    }
    cases.breaks("GRUP 6", emitter.record(), |p| {
        let at = emitter.at(AXIS, 2);
        p.section("GRUP")[at..at + 2].copy_from_slice(&i16::MIN.to_le_bytes());
    });
    cases.breaks("GRUP 7", emitter.record(), |p| {
        p.set("GRUP", emitter.at(0, 4), 1e3_f32.to_bits());
    });
    let first = Lane { group: emitter.group, lane: 0 };
    // Where normals point everywhere, the byte of theta_e means something else.
    cases.breaks("GRUP 8", first.record(), |p| {
        p.section("TREE")[48 * 5 + 16 + 24..][..3].copy_from_slice(&[0xfe, 0x7f, 0]);
    });
    let below = Lane { group: inner.group + 1, lane: 0 };
    cases.breaks("GRUP 9", below.record(), |p| {
        p.section("GRUP")[inner.at(RANGE, 1)] = 100;
    });
    cases.breaks("GRUP 10", below.record(), |p| {
        let at = inner.at(THETA_O, 2);
        // The faces below look another way than their parent says.
        p.section("GRUP")[at..at + 2].copy_from_slice(&(1_u16 << 15).to_le_bytes());
        let at = below.at(AXIS, 2);
        p.section("GRUP")[at..at + 2].copy_from_slice(&20_000_i16.to_le_bytes());
    });
    cases.breaks("GRUP 11", emitter.whole_group(), |p| {
        let at = emitter.at(ENERGY, 4);
        let energy = f32::from_bits(p.get("GRUP", at));
        p.set("GRUP", at, (energy * 1.001).to_bits());
    });
    cases.breaks("GRUP 12", emitter.record(), |p| p.set("GRUP", emitter.at(LINK, 4), 1 << 31 | 99));
    cases.breaks("GRUP 13", instance.record(), |p| p.set("GRUP", instance.at(LINK, 4), u32::MAX));
    // The tree itself: a walk that would never end.
    cases
        .breaks("GRUP 13", instance.record(), |p| p.set("GRUP", instance.at(LINK, 4), 3 << 30 | 3));
    cases.breaks("GRUP 14", instance.record(), |p| p.set("INST", 36, 1e3_f32.to_bits()));
    cases.breaks("GRUP 15", instance.record(), |p| {
        // Turned about, so that y and z change their signs; flat, it stays in its box.
        for number in (0..12).filter(|number| number % 3 > 0) {
            let turned = -f32::from_bits(p.get("INST", 4 * number));
            p.set("INST", 4 * number, turned.to_bits());
        }
    });
}

fn rows_of_the_rest(cases: &mut Cases) {
    cases.breaks("INST 1", Record::Row(0), |p| p.set("INST", 48, 99));
    cases.breaks("INST 1", Record::Row(0), |p| p.set("INST", 48, 6));
    cases.breaks("INST 2", Record::Row(1), |p| p.set("INST", 64, f32::NAN.to_bits()));
    cases.breaks("INST 2", Record::Row(1), |p| p.set("INST", 64, 9_f32.to_bits()));
    cases.breaks("INST 3", Record::Row(2), |p| p.set("INST", 2 * 64 + 60, 1));
    cases.breaks("INST 4", Record::Row(3), |p| p.set("INST", 3 * 64 + 52, 1));
    cases.breaks("FRAM 1", Record::Row(1), |p| p.set("FRAM", 16, 1));
    cases.breaks("FRAM 2", Record::Row(1), |p| p.set("FRAM", 20, 5));
    cases.breaks("FRAM 2", Record::Row(2), |p| p.set("FRAM", 36, u32::MAX));
    cases.breaks("FRAM 3", Record::Row(1), |p| p.set("FRAM", 24, 1));
    cases.breaks("FRAM 3", Record::Row(2), |p| p.set("FRAM", 44, u32::MAX));
    cases.breaks("FORC 1", Record::Row(0), |p| p.set("FORC", 0, 99));
    cases.breaks("FORC 1", Record::Row(0), |p| p.set("FORC", 0, 3));
    cases.breaks("FORC 2", Record::Row(1), |p| p.set("FORC", 4, 2));
    let light = |number: usize, field: usize| 64 * number + field;
    cases.breaks("LGHT 1", Record::Row(0), |p| p.set("LGHT", light(0, 32), 1));
    cases.breaks("LGHT 1", Record::Row(4), |p| p.set("LGHT", light(3, 36), u32::MAX));
    cases.breaks("LGHT 2", Record::Row(1), |p| p.set("LGHT", light(1, 52), 4));
    cases.breaks("LGHT 2", Record::Row(1), |p| p.set("LGHT", light(1, 52), 8));
    cases.breaks("LGHT 3", Record::Row(1), |p| p.set("LGHT", light(1, 56), 9));
    for value in [f32::NAN, f32::INFINITY, -1.0] {
        cases.breaks("LGHT 4", Record::Row(1), |p| p.set("LGHT", light(1, 48), value.to_bits()));
    }
    cases.breaks("LGHT 5", Record::Row(1), |p| p.set("LGHT", light(1, 40), u32::MAX));
    cases.breaks("LGHT 5", Record::Row(1), |p| p.set("LGHT", light(1, 44), 1 << 20));
    cases.breaks("LGHT 5", Record::Row(0), |p| p.section("PATH")[1] = 0xff);
    cases.breaks("LGHT 6", Record::Row(1), |p| {
        let [offset, length] = [40, 44].map(|field| p.get("LGHT", light(0, field)));
        p.set("LGHT", light(1, 40), offset);
        p.set("LGHT", light(1, 44), length);
    });
    let last = golden().lights().len() - 1;
    cases.breaks("LGHT 7", Record::All, |p| p.set("LGHT", light(last, 36), 1 << 30));
}

/// Gives the golden file link numbers.
pub fn linked(parts: &mut Parts, numbers: &[u32]) {
    let bytes = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
    parts.sections.push(Section { name: *b"LINK", required: 0, element: 4, bytes });
    parts.version = [1, 3];
}

fn links(cases: &mut Cases) {
    let lights = golden().lights().len();
    let numbers = |change: &dyn Fn(&mut [u32])| {
        let mut numbers: Vec<u32> = (0..lights as u32).map(|row| row.min(2)).collect();
        change(&mut numbers);
        numbers
    };
    assert_eq!(broken(&golden_bytes(), |p| linked(p, &numbers(&|_| ()))), None);
    cases.breaks("LINK 1", Record::All, |p| linked(p, &numbers(&|_| ())[1..]));
    cases.breaks("LINK 1", Record::All, |p| linked(p, &[]));
    cases.breaks("LINK 2", Record::Row(0), |p| linked(p, &numbers(&|all| all[0] = 2)));
    cases.breaks("LINK 2", Record::Row(3), |p| linked(p, &numbers(&|all| all[3] = 4)));
    cases.breaks("LINK 2", Record::Row(2), |p| linked(p, &numbers(&|all| all[2] = u32::MAX)));
    cases.breaks("LINK 3", Record::All, |p| linked(p, &numbers(&|all| all.fill(0))));
}

fn textures(cases: &mut Cases) {
    let whole = std::fs::read(crate::golden::path("textured.ltree")).unwrap();
    let mut breaks = |rule: &str, record, change: &dyn Fn(&mut Parts)| {
        cases.breaks_of(&whole, rule, record, change);
    };
    breaks("TXTR 1", Record::Row(1), &|p| {
        let first = p.section("TXTR")[..32].to_vec();
        p.section("TXTR")[40..72].copy_from_slice(&first);
    });
    breaks("TXTR 2", Record::Row(0), &|p| p.set("TXTR", 32, 1));
    breaks("TXTR 2", Record::Row(1), &|p| p.set("TXTR", 40 + 36, u32::MAX));
    breaks("TXTR 2", Record::All, &|p| p.set("TXTR", 40 + 36, 1));
    breaks("TXTR 2", Record::All, &|p| p.sections.retain(|section| &section.name != b"TXTR"));
    for value in [f32::NAN, f32::INFINITY, -1.0] {
        breaks("MEAN 1", Record::Row(2), &|p| p.set("MEAN", 2 * 16 + 8, value.to_bits()));
    }
    breaks("MEAN 1", Record::Row(2), &|p| p.section("MEAN")[2 * 16 + 4..3 * 16].fill(0));
    breaks("MEAN 2", Record::Row(1), &|p| p.set("MEAN", 16, 0));
}
