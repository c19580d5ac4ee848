//! Everything that can be asked of a table of what is hidden, asked of bytes that nobody verified.

use super::tree::repaired;
use candelabra::inspect::{TableReport, table_html};
use candelabra::light_tree::learned::{Learned, LearnedFile};
use candelabra::light_tree::{
    Cell, FrameTree, LightTree, Picked, Receiver, Scratch, Splitting, Veiled,
};
use candelabra::store::AlignedBytes;
use glam::Vec3;

/// A tree whose lights are weighed by the tables.
const TREE: &[u8] = include_bytes!("../corpus/tree/golden.ltree");

/// Asks everything of a file, repaired. Whatever it holds, no question panics, and none takes for ever; and
/// whatever it holds, the estimate by lights that are weighed by it keeps its mean.
pub fn probe(bytes: &[u8]) {
    let Ok(file) = LearnedFile::open(repaired(bytes)) else { return };
    let is_sound = file.verify().is_ok();
    let _ = (file.meta(), file.fingerprint(), file.byte_length());
    let _ = (file.tree_key(), file.view_keys(), file.area(), file.hidden());
    if is_sound {
        // Pages are made of what was verified.
        let report = TableReport::of(&file);
        assert!((0.0..=1.0).contains(&report.hidden), "{report:?}");
        assert!(table_html(&file, &report, "table").ends_with("</html>\n"));
    }
    let Some(learned) = file.view() else { return };
    let tree = LightTree::open(AlignedBytes::copy_of(TREE)).unwrap();
    let frame = tree.frames().first().map_or(0, |row| row.frame);
    let plain = tree.at_frame(frame).unwrap();
    let veiled = plain.clone().veiled(learned.veils);
    let middle = plain.root().map_or(Vec3::ZERO, |root| root.center());
    for (point, normal) in [
        (middle, Vec3::Y),
        (middle + Vec3::new(1.0, 2.0, -0.5), Vec3::NEG_X),
        (Vec3::splat(1e30), Vec3::Z),
        (Vec3::NAN, Vec3::Y),
    ] {
        let cell = cell_of(&learned, point, normal);
        if point.is_finite() {
            ask(&plain, &veiled, Receiver { point, normal }, cell);
        }
    }
    // A cell that the table does not have.
    ask(&plain, &veiled, Receiver { point: middle, normal: Vec3::Y }, Cell(u32::MAX - 1));
}

/// Every receiver has a cell, and a number tells which.
fn cell_of(learned: &Learned, point: Vec3, normal: Vec3) -> Cell {
    let cells = [0.0, 0.5, 0.999_999].map(|u| learned.cells.find(point, normal, u));
    for Cell(cell) in cells {
        assert!((cell as usize) < learned.cells.count(), "cell {cell}");
    }
    cells[1]
}

fn ask(plain: &FrameTree, veiled: &FrameTree, viewer: Receiver, cell: Cell) {
    let there = Veiled { viewer, cell };
    let mut scratch = Scratch::default();
    let halfway = Splitting { knob: 0.5, ..Splitting::NONE };
    let beside: Vec<f64> = (0..2).map(|row| 0.5 * veiled.weight_beside(cell, row)).collect();
    for how in [Splitting::NONE, halfway, Splitting::ALL] {
        let mut picks = Vec::new();
        veiled.for_each_pick(&there, &beside, &how, (0.6, 7), &mut scratch, |p| picks.push(p));
        for pick in picks {
            let told = veiled.expected(&there, &beside, &how, pick.light, &mut scratch);
            assert!(pick.probability > 0.0, "{pick:?}");
            assert!((told - pick.expected).abs() <= 1e-9 * told, "{pick:?}, but {told}");
        }
        let of = |light: Picked, _| match light {
            Picked::Emitter(emitter) => f64::from(emitter % 5 + 1),
            Picked::Beside(row) => f64::from(row + 1),
        };
        let with = veiled.moments(&there, &beside, &how, &of).mean;
        let without = plain.moments(&viewer, &[0.5; 2], &how, &of).mean;
        assert!((with - without).abs() <= 1e-9 * without, "{with} in place of {without}");
    }
}
