//! The file of a table. See the [format](super).

use super::{Learned, Plane, Table};
use crate::light_tree::veil::Veil;
use crate::store::{
    AlignedBytes, Container, ContainerWriter, Form, Record, Rule, SectionId, StoreError, Violation,
    rules,
};
use bytemuck::Pod;
use std::ops::Range;

/// What the file begins with.
pub const LEARNED_FILE: Form = Form { magic: *b"\x89LVS\r\n\x1a\n", version: (1, 0) };

const META: SectionId = SectionId(*b"META");
const KEYS: SectionId = SectionId(*b"KEYS");
const PLANES: SectionId = SectionId(*b"PLAN");
const VEILS: SectionId = SectionId(*b"VEIL");

/// More levels than this no table has.
const MOST_LEVELS: u32 = 24;

/// The rules of the file beyond those of its container.
pub const RULES_OF_LEARNED: [&[Rule]; 3] = [OF_KEYS, OF_PLANES, OF_VEILS];

rules! {
    KEYS, OF_KEYS:
    KEYS_ARE_TWO = "there are two";
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

/// A table in the bytes of its file.
pub struct LearnedFile<D> {
    container: Container<D>,
    keys: Range<usize>,
    planes: Range<usize>,
    veils: Range<usize>,
}

impl Table {
    /// The bytes of its file. `view` is the key of what it was learned through.
    pub fn to_bytes(&self, view: [u8; 32], meta: &str) -> AlignedBytes {
        let keys = [self.tree, view];
        let mut hasher = blake3::Hasher::new();
        hasher.update(meta.as_bytes()).update(keys.as_flattened());
        hasher.update_rayon(bytemuck::cast_slice(&self.planes));
        hasher.update_rayon(bytemuck::cast_slice(&self.rows));
        let mut writer = ContainerWriter::default();
        writer.section(META, false, meta.as_bytes());
        writer.section(KEYS, true, &keys);
        writer.section(PLANES, true, &self.planes);
        writer.section(VEILS, true, &self.rows);
        writer.finish_as(&LEARNED_FILE, *hasher.finalize().as_bytes())
    }
}

impl<D: AsRef<[u8]>> LearnedFile<D> {
    /// Opens the bytes of a file in constant time.
    ///
    /// # Errors
    /// If the header or the section table is not sound.
    pub fn open(data: D) -> Result<LearnedFile<D>, StoreError> {
        let container = Container::open_as(&LEARNED_FILE, data, &[META, KEYS, PLANES, VEILS])?;
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
        Ok(LearnedFile { container, keys, planes, veils })
    }

    /// Checks everything that the format promises.
    ///
    /// # Errors
    /// The first rule that is broken.
    pub fn verify(&self) -> Result<(), StoreError> {
        self.container.verify_checksums()?;
        let broken = |rule, record| Err(StoreError::Broken(Violation { rule, record }));
        if self.keys().len() != 2 {
            return broken(KEYS_ARE_TWO, Record::All);
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
        Ok(())
    }

    /// What it says; `None` if that is nothing.
    pub fn view(&self) -> Option<Learned<'_>> {
        Learned::over(self.tree_key(), self.planes(), self.rows())
    }

    /// The [tree](crate::light_tree::LightTree::still_key) that it was learned with.
    pub fn tree_key(&self) -> [u8; 32] {
        self.keys().first().copied().unwrap_or_default()
    }

    /// The key of the geometry and the camera that it was learned from.
    pub fn view_key(&self) -> [u8; 32] {
        self.keys().get(1).copied().unwrap_or_default()
    }

    /// BLAKE3 over all that it says.
    pub fn fingerprint(&self) -> [u8; 32] {
        self.container.fingerprint()
    }

    /// The JSON for people.
    pub fn meta(&self) -> &str {
        let range = self.container.find::<u8>(META).ok().flatten();
        let bytes: &[u8] = range.as_ref().map_or(&[], |range| self.container.view(range));
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
}
