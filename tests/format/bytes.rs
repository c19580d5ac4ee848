//! A tree file taken apart, to be changed and put together again.

use candelabra::store::AlignedBytes;

const HEADER: usize = 64;
const ROW: usize = 32;

/// The sections of a file, under checksums that will be right.
#[derive(Clone)]
pub struct Parts {
    pub magic: [u8; 8],
    pub version: [u16; 2],
    pub fingerprint: [u8; 32],
    pub sections: Vec<Section>,
}

#[derive(Clone)]
pub struct Section {
    pub name: [u8; 4],
    pub required: u32,
    pub element: u32,
    pub bytes: Vec<u8>,
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
}

fn usize_at(bytes: &[u8], at: usize) -> usize {
    u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap()) as usize
}

impl Parts {
    /// Of a sound file.
    pub fn of(file: &[u8]) -> Parts {
        let rows = file[HEADER..].chunks(ROW).take(u32_at(file, 24) as usize);
        let section = |row: &[u8]| Section {
            name: row[..4].try_into().unwrap(),
            required: u32_at(row, 4),
            element: u32_at(row, 24),
            bytes: file[usize_at(row, 8)..][..usize_at(row, 16)].to_vec(),
        };
        let fingerprint = file[32..HEADER].try_into().unwrap();
        let magic = file[..8].try_into().unwrap();
        Parts { magic, version: [1, 0], fingerprint, sections: rows.map(section).collect() }
    }

    /// A section's bytes.
    pub fn section(&mut self, name: &str) -> &mut Vec<u8> {
        let found = self.sections.iter_mut().find(|section| section.name == name.as_bytes());
        &mut found.unwrap().bytes
    }

    /// A 32-bit number of a section.
    pub fn get(&mut self, name: &str, at: usize) -> u32 {
        u32_at(self.section(name), at)
    }

    /// Changes it.
    pub fn set(&mut self, name: &str, at: usize, value: u32) {
        self.section(name)[at..at + 4].copy_from_slice(&value.to_le_bytes());
    }

    /// The file.
    pub fn file(&self) -> AlignedBytes {
        let table_end = HEADER + ROW * self.sections.len();
        let mut file = vec![0; table_end];
        file[..8].copy_from_slice(&self.magic);
        file[8..10].copy_from_slice(&self.version[0].to_le_bytes());
        file[10..12].copy_from_slice(&self.version[1].to_le_bytes());
        file[12..16].copy_from_slice(&0x0102_0304_u32.to_le_bytes());
        file[24..28].copy_from_slice(&(self.sections.len() as u32).to_le_bytes());
        file[32..HEADER].copy_from_slice(&self.fingerprint);
        for (i, section) in self.sections.iter().enumerate() {
            file.resize(file.len().next_multiple_of(64), 0);
            let row = HEADER + ROW * i;
            let (offset, length) = (file.len() as u64, section.bytes.len() as u64);
            file[row..row + 4].copy_from_slice(&section.name);
            file[row + 4..row + 8].copy_from_slice(&section.required.to_le_bytes());
            file[row + 8..row + 16].copy_from_slice(&offset.to_le_bytes());
            file[row + 16..row + 24].copy_from_slice(&length.to_le_bytes());
            file[row + 24..row + 28].copy_from_slice(&section.element.to_le_bytes());
            file.extend_from_slice(&section.bytes);
        }
        crate::probe::repaired(&file)
    }
}
