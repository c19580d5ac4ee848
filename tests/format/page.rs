//! The specification is enough: a reader that was written from it alone, in another language, reads what
//! the library reads.

use crate::bytes::Parts;
use crate::golden::path;
use candelabra::light_tree::{LightRow, LightTree, Link, Node, Receiver};
use candelabra::pipeline;
use candelabra::store::AlignedBytes;
use glam::Vec3;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::process::Command;

/// All that a file says, decoded. The reader in Python gives the same.
#[derive(Debug, Serialize, Deserialize)]
pub struct Report {
    fingerprint: String,
    /// Path, fingerprint, first emitter, emitters, energy, class.
    lights: Vec<(String, String, u32, u32, f64, u32)>,
    /// Of every used lane: box, axis, angles, sides, energy, range.
    nodes: Vec<ReportedNode>,
    frames: Vec<ReportedFrame>,
    /// The link number of each light, if the file tells.
    #[serde(default)]
    links: Vec<u32>,
}

#[derive(Debug, Serialize, Deserialize)]
struct ReportedNode {
    center: [f64; 3],
    half: [f64; 3],
    axis: [f64; 3],
    theta_o: f64,
    theta_e: f64,
    #[serde(default)]
    share: f64,
    two_sided: bool,
    energy: f64,
    /// `None` if it is without end.
    range: Option<f64>,
    link: u32,
}

#[derive(Debug, Serialize, Deserialize)]
struct ReportedFrame {
    frame: Option<i32>,
    /// Of what changes in it, if the file tells.
    #[serde(default)]
    fingerprint: Option<String>,
    emitters: Vec<u32>,
    energies: Vec<f64>,
    /// First emitters of the forced lights.
    forced: Vec<u32>,
}

/// What the library says of a file.
pub fn report<D: AsRef<[u8]>>(tree: &LightTree<D>) -> Report {
    let hex = |bytes: [u8; 32]| bytes.iter().map(|byte| format!("{byte:02x}")).collect();
    let light = |row: &LightRow| {
        let path = tree.light_path(row).to_string();
        let energy = f64::from(row.energy);
        (path, hex(row.fingerprint), row.first_emitter, row.emitter_count, energy, row.class)
    };
    let node = |node: Node| {
        let bounds = node.bounds();
        ReportedNode {
            center: node.center().as_dvec3().to_array(),
            half: node.half_extent().as_dvec3().to_array(),
            axis: bounds.cone.axis.as_dvec3().to_array(),
            theta_o: bounds.cone.theta_o.into(),
            theta_e: bounds.cone.theta_e.into(),
            share: bounds.share.into(),
            two_sided: bounds.cone.two_sided,
            energy: node.energy().into(),
            range: Some(f64::from(bounds.range_m)).filter(|range| range.is_finite()),
            link: code(node.link()),
        }
    };
    let numbers: Vec<Option<i32>> = match tree.frames() {
        [] => vec![None],
        frames => frames.iter().map(|row| Some(row.frame)).collect(),
    };
    let receiver = Receiver { point: Vec3::ZERO, normal: Vec3::ZERO };
    let frame = |number: Option<i32>| {
        let sampled = tree.at_frame(number.unwrap_or(0)).unwrap();
        let mut leaves = Vec::new();
        sampled.for_each_leaf(&receiver, |emitter, _, energy| leaves.push((emitter, energy)));
        leaves.sort_by_key(|&(emitter, _)| emitter);
        let (emitters, energies) = leaves.into_iter().unzip();
        let rows = match number {
            None => tree.forced(),
            Some(number) => {
                let row = &tree.frames()[tree.row_of(number).unwrap()];
                &tree.forced()[row.first_forced as usize..][..row.forced_count as usize]
            }
        };
        let first = |&row: &u32| tree.instances()[row as usize].first_emitter;
        let row = number.and_then(|number| tree.row_of(number));
        ReportedFrame {
            frame: number,
            fingerprint: row.and_then(|row| tree.fingerprints().get(row)).copied().map(hex),
            emitters,
            energies,
            forced: rows.iter().map(first).collect(),
        }
    };
    Report {
        fingerprint: hex(tree.fingerprint()),
        lights: tree.lights().iter().map(light).collect(),
        nodes: tree.groups().iter().flat_map(|group| group.nodes()).map(node).collect(),
        frames: numbers.into_iter().map(frame).collect(),
        links: tree.light_links().to_vec(),
    }
}

/// A link as the page has it.
fn code(link: Link) -> u32 {
    match link {
        Link::Nothing => 0,
        Link::Inner(ahead) => ahead,
        Link::Emitter(emitter) => emitter | 1 << 31,
        Link::Instance(row) => row | 3 << 30,
    }
}

impl Report {
    /// Asserts that another says the same, up to the last bits of decoded numbers.
    #[track_caller]
    pub fn assert_is(&self, other: &Report) {
        let value = |report: &Report| serde_json::to_value(report).unwrap();
        assert_alike(&value(self), &value(other), "report");
    }
}

#[track_caller]
fn assert_alike(a: &serde_json::Value, b: &serde_json::Value, place: &str) {
    use serde_json::Value::{Array, Number, Object};
    match (a, b) {
        (Number(a), Number(b)) => {
            let [a, b] = [a, b].map(|number| number.as_f64().unwrap());
            assert!((a - b).abs() <= 1e-6 * a.abs().max(1.0), "{place}: {a} and {b}");
        }
        (Array(a), Array(b)) => {
            assert_eq!(a.len(), b.len(), "{place}");
            let pairs = a.iter().zip(b).enumerate();
            pairs.for_each(|(i, (a, b))| assert_alike(a, b, &format!("{place}[{i}]")));
        }
        (Object(a), Object(b)) => {
            assert!(a.keys().eq(b.keys()), "{place}");
            a.iter().for_each(|(key, a)| assert_alike(a, &b[key], &format!("{place}.{key}")));
        }
        _ => assert_eq!(a, b, "{place}"),
    }
}

/// Runs the reader; `Err` is what it complains of.
fn read_in_python(file: &Path) -> Result<Report, String> {
    let output = Command::new("python3").arg(path("reader.py")).arg(file).output().unwrap();
    match output.status.success() {
        true => Ok(serde_json::from_slice(&output.stdout).unwrap()),
        false => Err(String::from_utf8(output.stderr).unwrap()),
    }
}

/// Whether there is a Python; where there is none its tests say so and pass.
fn python() -> bool {
    let found = Command::new("python3").arg("--version").output().is_ok();
    if !found {
        eprintln!("python3 is not there: skipped");
    }
    found
}

#[test]
fn a_reader_from_the_page_reads_what_the_library_reads() {
    if !python() {
        return;
    }
    let trees = [
        "../fuzz/corpus/tree/still.ltree",
        "../fuzz/corpus/tree/forced.ltree",
        "golden.ltree",
        "textured.ltree",
        "frames.ltree",
    ];
    for name in trees {
        let tree = pipeline::open_tree(&path(name), true).unwrap();
        read_in_python(&path(name)).unwrap().assert_is(&report(&tree));
    }
}

/// The reader knows what link numbers are, too.
#[test]
fn it_reads_links_and_refuses_wrong_ones() {
    if !python() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("linked.ltree");
    let lights = crate::golden::golden().lights().len() as u32;
    let sound: Vec<u32> = (0..lights).map(|row| row.min(3)).collect();
    for (numbers, rule) in
        [(sound.clone(), ""), (sound[1..].to_vec(), "LINK 1"), (vec![2; sound.len()], "LINK 2")]
    {
        let mut parts = Parts::of(&crate::golden::golden_bytes());
        crate::rules::linked(&mut parts, &numbers);
        std::fs::write(&file, parts.file().as_ref()).unwrap();
        match read_in_python(&file) {
            Ok(read) => {
                assert_eq!((rule, &read.links), ("", &numbers));
                read.assert_is(&report(&pipeline::open_tree(&file, true).unwrap()));
            }
            Err(complaint) => assert!(complaint.contains(&format!("rule {rule}\n")), "{complaint}"),
        }
    }
}

#[test]
fn it_refuses_by_the_same_rules() {
    if !python() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("damaged.ltree");
    let whole = crate::golden::golden_bytes();
    // A magic byte, the byte order, the version, the length, the checksum, a section's content.
    for (at, rule) in [
        (1, "HEAD 1"),
        (12, "HEAD 2"),
        (8, "HEAD 3"),
        (16, "HEAD 4"),
        (30, "HEAD 5"),
        (whole.len() - 1, "TABL 10"),
    ] {
        let mut bytes = whole.clone();
        bytes[at] ^= 0x10;
        std::fs::write(&file, &bytes).unwrap();
        let complaint = read_in_python(&file).unwrap_err();
        assert!(complaint.contains(&format!("rule {rule}\n")), "{complaint}");
        let error = LightTree::open(AlignedBytes::copy_of(&bytes))
            .and_then(|tree| tree.verify())
            .unwrap_err();
        assert_eq!(error.violation().rule.to_string(), rule);
    }
}
