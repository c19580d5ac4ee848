//! What a tree file is, in numbers.

use super::VERSION;
use super::shape::{Shape, shapes};
use crate::light_tree::{LightLook, LightRow, LightTree};
use serde::Serialize;

/// A tree file.
#[derive(Clone, Debug, Serialize)]
pub struct TreeReport {
    /// `candelabra.tree`.
    pub schema: &'static str,
    /// [`VERSION`].
    pub version: u32,
    /// The file, as it was named.
    pub file: String,
    /// Length of the file.
    pub bytes: usize,
    /// Length over emitters.
    pub bytes_per_emitter: f64,
    /// What the builder says of itself.
    pub meta: serde_json::Value,
    /// BLAKE3 of the content that the trees were built from, in hexadecimal.
    pub fingerprint: String,
    /// The sections of the file.
    pub sections: Vec<SectionReport>,
    /// How many lights.
    pub lights: usize,
    /// How many emitters they have.
    pub emitters: usize,
    /// How many lights change with time.
    pub changing: usize,
    /// How many are forced: in no estimate, and sampled at every point.
    pub forced: usize,
    /// How many do not light everything.
    pub linked: usize,
    /// How many different sets those light.
    pub link_sets: usize,
    /// Energy of all lights: peak radiant intensity, candela (of those that change in the first frame).
    pub energy: f64,
    /// Trees put somewhere.
    pub instances: usize,
    /// The frames that have trees of their own, if lights change.
    pub frames: Option<FrameSpan>,
    /// The trees, by kind.
    pub trees: Vec<Shape>,
    /// The lights of the most energy, that of most first.
    pub heaviest: Vec<LightReport>,
}

/// One section.
#[derive(Clone, Debug, Serialize)]
pub struct SectionReport {
    /// Its name.
    pub id: String,
    /// Its length.
    pub bytes: u64,
    /// Whether a reader must know it.
    pub required: bool,
}

/// Some frames.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct FrameSpan {
    /// The first.
    pub first: i32,
    /// The last.
    pub last: i32,
    /// How many.
    pub count: usize,
}

/// One light.
#[derive(Clone, Debug, Serialize)]
pub struct LightReport {
    /// Its prim path.
    pub path: String,
    /// Peak radiant intensity, summed over its emitters, candela.
    pub energy: f32,
    /// Its share of the energy of all lights, `[0, 1]`.
    pub share: f64,
    /// How many emitters it has.
    pub emitters: u32,
    /// `mesh`, `point`, `spot` or `sphere`; `light` if the file does not tell.
    pub kind: &'static str,
    /// Its hue, linear Rec. 709, the largest component 1; `None` if it is dark.
    pub color: Option<[f32; 3]>,
    /// Whether it has a tree of its own, which an instance places.
    pub placed: bool,
    /// Whether it changes with time.
    pub changes: bool,
    /// Whether it is sampled at every point.
    pub forced: bool,
}

impl TreeReport {
    /// Looks at a tree, and names the heaviest of its lights.
    pub fn of<D: AsRef<[u8]>>(tree: &LightTree<D>, file: &str, heaviest: usize) -> TreeReport {
        let lights = tree.lights();
        let count = |class| lights.iter().filter(|light| light.is(class)).count();
        let energy = lights.iter().map(|light| f64::from(light.energy)).sum();
        let emitters = tree.emitter_count();
        let span = |frames: &[crate::light_tree::FrameRow]| {
            let (first, last) = (frames.first()?.frame, frames.last()?.frame);
            Some(FrameSpan { first, last, count: frames.len() })
        };
        TreeReport {
            schema: "candelabra.tree",
            version: VERSION,
            file: file.into(),
            bytes: tree.byte_length(),
            bytes_per_emitter: tree.byte_length() as f64 / emitters.max(1) as f64,
            meta: serde_json::from_str(tree.meta()).unwrap_or_default(),
            fingerprint: blake3::Hash::from_bytes(tree.fingerprint()).to_hex().to_string(),
            sections: tree
                .sections()
                .iter()
                .map(|section| SectionReport {
                    id: section.id.to_string(),
                    bytes: section.length,
                    required: section.required != 0,
                })
                .collect(),
            lights: lights.len(),
            emitters,
            changing: count(LightRow::CHANGES),
            forced: count(LightRow::FORCED),
            linked: (0..lights.len()).filter(|&row| tree.link_of(row) != 0).count(),
            link_sets: tree.link_numbers() as usize - 1,
            energy,
            instances: tree.instances().len(),
            frames: span(tree.frames()),
            trees: shapes(tree),
            heaviest: by_energy(tree)
                .into_iter()
                .take(heaviest)
                .map(|row| light(tree, &lights[row], energy))
                .collect(),
        }
    }
}

/// The rows of all lights, that of the most energy first; equals in the order of their rows.
pub fn by_energy<D: AsRef<[u8]>>(tree: &LightTree<D>) -> Vec<usize> {
    let lights = tree.lights();
    let mut rows: Vec<usize> = (0..lights.len()).collect();
    rows.sort_by(|&a, &b| lights[b].energy.total_cmp(&lights[a].energy));
    rows
}

/// What is said of a light, given the energy of all.
pub fn light<D: AsRef<[u8]>>(tree: &LightTree<D>, row: &LightRow, total: f64) -> LightReport {
    LightReport {
        path: tree.light_path(row).into(),
        energy: row.energy,
        share: if total > 0.0 { f64::from(row.energy) / total } else { 0.0 },
        emitters: row.emitter_count,
        kind: match row.look.kind {
            LightLook::MESH => "mesh",
            LightLook::POINT => "point",
            LightLook::SPOT => "spot",
            LightLook::SPHERE => "sphere",
            _ => "light",
        },
        color: row.look.hue().map(Into::into),
        placed: row.is(LightRow::PLACED),
        changes: row.is(LightRow::CHANGES),
        forced: row.is(LightRow::FORCED),
    }
}
