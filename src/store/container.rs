//! The container: a header, a table of sections, and the sections. See the [room's page](super).

use super::header::{self, Form, HEADER_SIZE, Header, TREE_FILE, read_header};
use super::{ALIGNMENT, AlignedBytes, Record, Rule, StoreError, Violation, error};
use bytemuck::{Pod, Zeroable};
use crc32fast::Hasher;
use rayon::prelude::*;
use std::fmt;
use std::ops::Range;

/// The most sections that a file may have.
const MOST_SECTIONS: u32 = 256;

/// Four ASCII letters that name a section.
#[derive(Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct SectionId(pub [u8; 4]);

impl fmt::Display for SectionId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.0.escape_ascii())
    }
}

impl fmt::Debug for SectionId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// One row of the section table.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct Section {
    /// Its name.
    pub id: SectionId,
    /// 1 if a reader that does not know it must refuse the file.
    pub required: u32,
    /// First byte in the file; a multiple of [`ALIGNMENT`].
    pub offset: u64,
    /// Length in bytes.
    pub length: u64,
    /// Bytes of one element.
    pub element_size: u32,
    /// CRC-32 of its bytes.
    pub checksum: u32,
}

const ROW_SIZE: usize = size_of::<Section>();

/// Writes a section into its place.
type Fill<'a> = Box<dyn FnOnce(&mut [u8]) + Send + 'a>;

/// Gathers sections and lays them out.
#[derive(Default)]
pub struct ContainerWriter<'a> {
    sections: Vec<(Section, Fill<'a>)>,
}

impl<'a> ContainerWriter<'a> {
    /// Adds a section. Sections keep the order in which they are added.
    pub fn section<T: Pod>(&mut self, id: SectionId, required: bool, elements: &'a [T]) {
        let bytes: &[u8] = bytemuck::cast_slice(elements);
        self.add::<T>(id, required, elements.len(), move |place| {
            let places = place.par_chunks_mut(CHUNK).zip(bytes.par_chunks(CHUNK));
            places.for_each(|(to, from)| to.copy_from_slice(from));
        });
    }

    /// Adds a section whose elements are zero until `fill` writes them in place, in
    /// [`finish`](Self::finish).
    pub fn section_with<T: Pod>(
        &mut self,
        id: SectionId,
        required: bool,
        count: usize,
        fill: impl FnOnce(&mut [T]) + Send + 'a,
    ) {
        self.add::<T>(id, required, count, |place| fill(bytemuck::cast_slice_mut(place)));
    }

    fn add<T>(
        &mut self,
        id: SectionId,
        required: bool,
        count: usize,
        fill: impl FnOnce(&mut [u8]) + Send + 'a,
    ) {
        let row = Section {
            id,
            required: required.into(),
            offset: 0,
            length: (count * size_of::<T>()) as u64,
            element_size: size_of::<T>() as u32,
            checksum: 0,
        };
        self.sections.push((row, Box::new(fill)));
    }

    /// The whole file, with the content's fingerprint in its header.
    pub fn finish(self, fingerprint: [u8; 32]) -> AlignedBytes {
        self.finish_as(&TREE_FILE, fingerprint)
    }

    /// The same as a file of another kind.
    pub fn finish_as(mut self, form: &Form, fingerprint: [u8; 32]) -> AlignedBytes {
        let table_end = HEADER_SIZE + self.sections.len() * ROW_SIZE;
        let mut end = table_end;
        for (row, _) in &mut self.sections {
            end = end.next_multiple_of(ALIGNMENT);
            row.offset = end as u64;
            end += row.length as usize;
        }
        let header = Header {
            magic: form.magic,
            major: form.version.0,
            minor: form.version.1,
            byte_order: header::BYTE_ORDER_MARK,
            file_length: end as u64,
            section_count: self.sections.len() as u32,
            checksum: 0,
            fingerprint,
        };
        let mut file = AlignedBytes::zeroed(end);
        let (head, mut rest) = file.as_mut().split_at_mut(table_end);
        let mut at = table_end;
        let mut places = Vec::with_capacity(self.sections.len());
        for (row, fill) in self.sections {
            let (_, place) = rest.split_at_mut(row.offset as usize - at);
            let (place, behind) = place.split_at_mut(row.length as usize);
            at = (row.offset + row.length) as usize;
            rest = behind;
            places.push((row, fill, place));
        }
        let write = |(mut row, fill, place): (Section, Fill, &mut [u8])| {
            fill(place);
            row.checksum = checksum_of(place);
            row
        };
        let rows: Vec<Section> = places.into_par_iter().map(write).collect();
        head[..HEADER_SIZE].copy_from_slice(bytemuck::bytes_of(&header));
        head[HEADER_SIZE..].copy_from_slice(bytemuck::cast_slice(&rows));
        let checksum = crc32fast::hash(head);
        head[CHECKSUM_FIELD].copy_from_slice(&checksum.to_le_bytes());
        file
    }
}

/// Bytes that one task copies or sums.
const CHUNK: usize = 1 << 18;

/// CRC-32, chunk by chunk, side by side.
fn checksum_of(bytes: &[u8]) -> u32 {
    if bytes.len() <= CHUNK {
        return crc32fast::hash(bytes);
    }
    let sum = |chunk: &[u8]| {
        let mut hasher = Hasher::new();
        hasher.update(chunk);
        hasher
    };
    let join = |mut start: Hasher, end: Hasher| {
        start.combine(&end);
        start
    };
    bytes.par_chunks(CHUNK).map(sum).reduce(Hasher::new, join).finalize()
}

const CHECKSUM_FIELD: Range<usize> = 28..32;

/// A container over some bytes: mapped, or just written.
pub struct Container<D> {
    data: D,
    sections: Vec<Section>,
    fingerprint: [u8; 32],
    minor: u16,
}

impl<D: AsRef<[u8]>> Container<D> {
    /// Reads header and table; touches no section. Sections that are not in `known` are skipped,
    /// or refused if they are required.
    ///
    /// # Errors
    /// Whatever [`StoreError`] says about headers and tables.
    pub fn open(data: D, known: &[SectionId]) -> Result<Container<D>, StoreError> {
        Container::open_as(&TREE_FILE, data, known)
    }

    /// The same of another kind of file.
    ///
    /// # Errors
    /// As [`open`](Container::open).
    pub fn open_as(form: &Form, data: D, known: &[SectionId]) -> Result<Container<D>, StoreError> {
        let bytes = data.as_ref();
        let header = read_header(form, bytes)?;
        let table_end = HEADER_SIZE + header.section_count as usize * ROW_SIZE;
        let actual = bytes.len() as u64;
        if header.section_count > MOST_SECTIONS
            || header.file_length != actual
            || table_end > bytes.len()
        {
            return Err(StoreError::Length { promised: header.file_length, actual });
        }
        let mut hasher = Hasher::new();
        hasher.update(&bytes[..CHECKSUM_FIELD.start]);
        hasher.update(&[0; 4]);
        hasher.update(&bytes[CHECKSUM_FIELD.end..table_end]);
        if hasher.finalize() != header.checksum {
            return Err(StoreError::Checksum { section: None });
        }
        let sections: Vec<Section> = bytes[HEADER_SIZE..table_end]
            .chunks_exact(ROW_SIZE)
            .map(bytemuck::pod_read_unaligned)
            .collect();
        check_layout(&sections, table_end as u64, actual)?;
        if let Some(alien) = sections.iter().find(|s| s.required != 0 && !known.contains(&s.id)) {
            return Err(StoreError::Unknown(alien.id));
        }
        Ok(Container { fingerprint: header.fingerprint, minor: header.minor, sections, data })
    }

    /// The same over a view of its bytes.
    pub fn by_reference(&self) -> Container<&[u8]> {
        let Container { data, sections, fingerprint, minor } = self;
        let sections = sections.clone();
        Container { data: data.as_ref(), sections, fingerprint: *fingerprint, minor: *minor }
    }

    /// Compares every section with its checksum, and the gaps between them with zero.
    ///
    /// # Errors
    /// The first section that is damaged.
    pub fn verify_checksums(&self) -> Result<(), StoreError> {
        let bytes = self.data.as_ref();
        let mut end = HEADER_SIZE + self.sections.len() * ROW_SIZE;
        for section in &self.sections {
            let range = section.offset as usize..(section.offset + section.length) as usize;
            if bytes[end..range.start].iter().any(|&byte| byte != 0) {
                return Err(broken(error::GAPS_ARE_ZERO, section.id));
            }
            if checksum_of(&bytes[range.clone()]) != section.checksum {
                return Err(StoreError::Checksum { section: Some(section.id) });
            }
            end = range.end;
        }
        Ok(())
    }

    /// The content's fingerprint, from the header.
    pub fn fingerprint(&self) -> [u8; 32] {
        self.fingerprint
    }

    /// The minor version that it was written in. A later one than [`VERSION`](super::VERSION)'s may say more, in sections
    /// and bytes that this version does not know.
    pub fn minor_version(&self) -> u16 {
        self.minor
    }

    /// The section table.
    pub fn sections(&self) -> &[Section] {
        &self.sections
    }

    /// Where a section's elements are, if it is there; checked to be whole elements of `T`.
    ///
    /// # Errors
    /// [`StoreError::Broken`] if the element size is another.
    pub fn find<T: Pod>(&self, id: SectionId) -> Result<Option<Range<usize>>, StoreError> {
        let Some(section) = self.sections.iter().find(|s| s.id == id) else {
            return Ok(None);
        };
        let size = size_of::<T>();
        if section.element_size as usize != size || !(section.length as usize).is_multiple_of(size)
        {
            return Err(broken(error::ELEMENTS_ARE_WHOLE, id));
        }
        Ok(Some(section.offset as usize..(section.offset + section.length) as usize))
    }

    /// The elements of a range that [`find`](Container::find) gave; empty if the bytes are not
    /// aligned for `T`. Those of a mapped file and of [`AlignedBytes`] always are.
    #[inline]
    pub fn view<T: Pod>(&self, range: &Range<usize>) -> &[T] {
        bytemuck::try_cast_slice(&self.data.as_ref()[range.clone()]).unwrap_or(&[])
    }

    /// What it was opened over.
    pub fn into_bytes(self) -> D {
        self.data
    }

    /// What holds the bytes.
    pub fn data(&self) -> &D {
        &self.data
    }

    /// All bytes.
    pub fn bytes(&self) -> &[u8] {
        self.data.as_ref()
    }
}

fn broken(rule: Rule, section: SectionId) -> StoreError {
    StoreError::Broken(Violation { rule, record: Record::Section(section) })
}

/// Sections lie in order, aligned, without overlap, inside the file.
fn check_layout(sections: &[Section], table_end: u64, file_length: u64) -> Result<(), StoreError> {
    let mut end = table_end;
    for (i, section) in sections.iter().enumerate() {
        let fail = |rule| Err(broken(rule, section.id));
        let Some(section_end) = section.offset.checked_add(section.length) else {
            return fail(error::SECTION_IS_INSIDE);
        };
        if section.offset % ALIGNMENT as u64 != 0 {
            return fail(error::OFFSET_IS_ALIGNED);
        }
        if section.offset < end || section.offset - end >= ALIGNMENT as u64 {
            return fail(error::SECTIONS_FOLLOW);
        }
        if section_end > file_length {
            return fail(error::SECTION_IS_INSIDE);
        }
        if section.element_size == 0 {
            return fail(error::ELEMENTS_HAVE_SIZE);
        }
        if sections[..i].iter().any(|earlier| earlier.id == section.id) {
            return fail(error::SECTION_IS_ONE);
        }
        end = section_end;
    }
    if end != file_length {
        return Err(StoreError::Length { promised: end, actual: file_length });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const NUMBERS: SectionId = SectionId(*b"NUMB");
    const NOTES: SectionId = SectionId(*b"NOTE");

    fn sample() -> AlignedBytes {
        let mut writer = ContainerWriter::default();
        writer.section(NUMBERS, true, &[1_u32, 2, 3]);
        writer.section(NOTES, false, b"hello");
        writer.finish([7; 32])
    }

    /// Opens and checks everything.
    fn read(bytes: &[u8]) -> Result<Vec<u32>, StoreError> {
        let container = Container::open(AlignedBytes::copy_of(bytes), &[NUMBERS])?;
        container.verify_checksums()?;
        let range = container.find::<u32>(NUMBERS)?.ok_or(StoreError::Missing(NUMBERS))?;
        Ok(container.view(&range).to_vec())
    }

    #[test]
    fn what_was_written_is_read() {
        assert_eq!(read(sample().as_ref()).unwrap(), [1, 2, 3]);
    }

    #[test]
    fn every_prefix_and_every_flipped_bit_is_refused() {
        let whole = sample();
        let whole = whole.as_ref();
        for length in 0..whole.len() {
            assert!(read(&whole[..length]).is_err(), "prefix of {length}");
        }
        for bit in 0..whole.len() * 8 {
            let mut flipped = whole.to_vec();
            flipped[bit / 8] ^= 1 << (bit % 8);
            // The fingerprint and the minor version are under the header's checksum too.
            assert!(read(&flipped).is_err(), "bit {bit}");
        }
    }

    #[test]
    fn damage_is_named() {
        let whole = sample().as_ref().to_vec();
        assert_eq!(read(b"PK\x03\x04 something else"), Err(StoreError::NotOurs));
        let text: Vec<u8> = whole.iter().copied().filter(|&byte| byte != b'\r').collect();
        assert_eq!(read(&text), Err(StoreError::TextMode));
        let mut later = whole.clone();
        later[8] = 2;
        assert_eq!(read(&later), Err(StoreError::Version { found: 2, known: 1 }));
        let longer = [whole.as_slice(), b"x"].concat();
        assert!(matches!(read(&longer), Err(StoreError::Length { .. })));
    }

    #[test]
    fn unknown_sections_are_skipped_unless_required() {
        let mut writer = ContainerWriter::default();
        writer.section(NOTES, true, b"must understand");
        let bytes = writer.finish([0; 32]);
        let opened = Container::open(bytes, &[NUMBERS]);
        assert_eq!(opened.err(), Some(StoreError::Unknown(NOTES)));
    }
}
