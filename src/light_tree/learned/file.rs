//! The file of a table. See the [format](super).

use super::{Learned, Plane, Table};
use crate::light_tree::veil::Veil;
use crate::store::{
    AlignedBytes, Container, ContainerWriter, Form, Record, Rule, SectionId, StoreError, Violation,
    rules,
};
use bytemuck::Pod;
use glam::Vec3;
use std::ops::Range;

/// What the file begins with.
pub const LEARNED_FILE: Form = Form { magic: *b"\x89LVS\r\n\x1a\n", version: (1, 0) };

const META: SectionId = SectionId(*b"META");
const KEYS: SectionId = SectionId(*b"KEYS");
const PLANES: SectionId = SectionId(*b"PLAN");
const VEILS: SectionId = SectionId(*b"VEIL");
const AREA: SectionId = SectionId(*b"AREA");
const HIDDEN: SectionId = SectionId(*b"HIDN");
const ALL: [SectionId; 6] = [META, KEYS, PLANES, VEILS, AREA, HIDDEN];

/// More levels than this no table has.
const MOST_LEVELS: u32 = 24;

/// The rules of the file beyond those of its container.
pub const RULES_OF_LEARNED: [&[Rule]; 5] = [OF_KEYS, OF_PLANES, OF_VEILS, OF_AREA, OF_HIDDEN];

rules! {
    KEYS, OF_KEYS:
    KEYS_ARE_FOUR = "there are four";
}

rules! {
    PLANES, OF_PLANES:
    PLANES_ARE_COMPLETE = "there are `2^k - 1`, k at most 24";
    PLANE_IS_SOUND = "its numbers are finite, its width is not negative, its axis is below 6";
}

rules! {
    VEILS, OF_VEILS:
    CELLS_ARE_ALIKE = "each cell has the same number of rows";
    GROUPS_ASCEND = "the groups of a cell ascend; rows of no group are the last";
}

rules! {
    AREA, OF_AREA:
    AREA_IS_A_BOX = "it is six finite numbers, the first three not above the last three, or nothing";
}

rules! {
    HIDDEN, OF_HIDDEN:
    HIDDEN_IS_OF_EACH = "there is one for each cell, or none";
}

/// What a table was learned from beside the tree: BLAKE3 of each. None depends on how bright anything is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ViewKeys {
    /// The lights at infinity, in their order.
    pub infinite: [u8; 32],
    /// All that rays can meet: where it is, and where it lets light through.
    pub geometry: [u8; 32],
    /// The camera.
    pub camera: [u8; 32],
}

/// A table in the bytes of its file.
pub struct LearnedFile<D> {
    container: Container<D>,
    keys: Range<usize>,
    planes: Range<usize>,
    veils: Range<usize>,
    area: Option<Range<usize>>,
    hidden: Option<Range<usize>>,
}

impl Table {
    /// The bytes of its file. `view` has the keys of what it was learned from.
    pub fn to_bytes(&self, view: ViewKeys, meta: &str) -> AlignedBytes {
        let keys = [self.tree, view.infinite, view.geometry, view.camera];
        let mut hasher = blake3::Hasher::new();
        hasher.update(meta.as_bytes()).update(keys.as_flattened());
        hasher.update_rayon(bytemuck::cast_slice(&self.planes));
        hasher.update_rayon(bytemuck::cast_slice(&self.rows));
        hasher.update(bytemuck::cast_slice(self.area.as_slice())).update(&self.hidden);
        let mut writer = ContainerWriter::default();
        writer.section(META, false, meta.as_bytes());
        writer.section(KEYS, true, &keys);
        writer.section(PLANES, true, &self.planes);
        writer.section(VEILS, true, &self.rows);
        if let Some(area) = &self.area {
            writer.section(AREA, false, area.as_flattened());
        }
        if !self.hidden.is_empty() {
            writer.section(HIDDEN, false, &self.hidden);
        }
        writer.finish_as(&LEARNED_FILE, *hasher.finalize().as_bytes())
    }
}

impl<D: AsRef<[u8]>> LearnedFile<D> {
    /// Opens the bytes of a file in constant time.
    ///
    /// # Errors
    /// If the header or the section table is not sound.
    pub fn open(data: D) -> Result<LearnedFile<D>, StoreError> {
        let container = Container::open_as(&LEARNED_FILE, data, &ALL)?;
        fn required<T: Pod>(
            container: &Container<impl AsRef<[u8]>>,
            id: SectionId,
        ) -> Result<Range<usize>, StoreError> {
            container.find::<T>(id)?.ok_or(StoreError::Missing(id))
        }
        container.find::<u8>(META)?;
        let keys = required::<[u8; 32]>(&container, KEYS)?;
        let planes = required::<Plane>(&container, PLANES)?;
        let veils = required::<Veil>(&container, VEILS)?;
        let area = container.find::<f32>(AREA)?;
        let hidden = container.find::<u8>(HIDDEN)?;
        Ok(LearnedFile { container, keys, planes, veils, area, hidden })
    }

    /// Checks everything that the format promises.
    ///
    /// # Errors
    /// The first rule that is broken.
    pub fn verify(&self) -> Result<(), StoreError> {
        self.container.verify_checksums()?;
        let broken = |rule, record| Err(StoreError::Broken(Violation { rule, record }));
        if self.keys().len() != 4 {
            return broken(KEYS_ARE_FOUR, Record::All);
        }
        let cells = self.planes().len() + 1;
        if !cells.is_power_of_two() || cells.ilog2() > MOST_LEVELS {
            return broken(PLANES_ARE_COMPLETE, Record::All);
        }
        let is_sound = |plane: &Plane| {
            plane.at.is_finite() && plane.width.is_finite() && plane.width >= 0.0 && plane.axis < 6
        };
        if let Some(row) = self.planes().iter().position(|plane| !is_sound(plane)) {
            return broken(PLANE_IS_SOUND, Record::Row(row as u32));
        }
        if !self.rows().len().is_multiple_of(cells) {
            return broken(CELLS_ARE_ALIKE, Record::All);
        }
        let of_each = self.rows().len() / cells;
        let ascends = |pair: &[Veil]| {
            pair[0].group < pair[1].group || pair.iter().all(|row| row.group == Veil::NONE.group)
        };
        for (cell, rows) in self.rows().chunks(of_each.max(1)).enumerate() {
            if let Some(at) = rows.windows(2).position(|pair| !ascends(pair)) {
                return broken(GROUPS_ASCEND, Record::Row((cell * of_each + at + 1) as u32));
            }
        }
        let area = self.view_of::<f32>(&self.area);
        let is_box = |[low, high]: [&[f32]; 2]| {
            area.iter().all(|number| number.is_finite())
                && low.iter().zip(high).all(|(a, b)| a <= b)
        };
        if !area.is_empty() && (area.len() != 6 || !is_box([&area[..3], &area[3..]])) {
            return broken(AREA_IS_A_BOX, Record::All);
        }
        if ![0, cells].contains(&self.hidden().len()) {
            return broken(HIDDEN_IS_OF_EACH, Record::All);
        }
        Ok(())
    }

    /// What it says; `None` if that is nothing.
    pub fn view(&self) -> Option<Learned<'_>> {
        Learned::over(self.tree_key(), self.planes(), self.rows())
    }

    /// The [tree](crate::light_tree::LightTree::still_key) that it was learned with.
    pub fn tree_key(&self) -> [u8; 32] {
        self.key(0)
    }

    /// The keys of what it was learned from beside the tree.
    pub fn view_keys(&self) -> ViewKeys {
        ViewKeys { infinite: self.key(1), geometry: self.key(2), camera: self.key(3) }
    }

    /// The box around the receivers that it was learned at, if it tells: smallest and largest corner, world
    /// space, metres.
    pub fn area(&self) -> Option<[Vec3; 2]> {
        let [x, y, z, to_x, to_y, to_z] = *self.view_of::<f32>(&self.area).first_chunk()?;
        Some([Vec3::new(x, y, z), Vec3::new(to_x, to_y, to_z)])
    }

    /// Of each cell the share of the light that is hidden there, by importance and without any weights, in
    /// parts of 255; nothing if it does not tell.
    pub fn hidden(&self) -> &[u8] {
        self.view_of(&self.hidden)
    }

    /// BLAKE3 over all that it says.
    pub fn fingerprint(&self) -> [u8; 32] {
        self.container.fingerprint()
    }

    /// The JSON for people.
    pub fn meta(&self) -> &str {
        let bytes: &[u8] = self.view_of(&self.container.find::<u8>(META).ok().flatten());
        std::str::from_utf8(bytes).unwrap_or_default()
    }

    /// The planes between the cells.
    pub fn planes(&self) -> &[Plane] {
        self.container.view(&self.planes)
    }

    /// The rows of all cells.
    pub fn rows(&self) -> &[Veil] {
        self.container.view(&self.veils)
    }

    /// Length of the file in bytes.
    pub fn byte_length(&self) -> usize {
        self.container.bytes().len()
    }

    /// What holds the bytes of the file.
    pub fn data(&self) -> &D {
        self.container.data()
    }

    fn keys(&self) -> &[[u8; 32]] {
        self.container.view(&self.keys)
    }

    fn key(&self, number: usize) -> [u8; 32] {
        self.keys().get(number).copied().unwrap_or_default()
    }

    fn view_of<T: Pod>(&self, section: &Option<Range<usize>>) -> &[T] {
        section.as_ref().map_or(&[], |range| self.container.view(range))
    }
}
