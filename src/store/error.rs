//! What can be wrong with a container.

use super::rule::rules;
use super::{Record, Rule, SectionId, Violation};
use thiserror::Error;

/// Why some bytes are not a container that this version reads. The caller knows the file's name.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum StoreError {
    /// The first bytes are not the magic.
    #[error("this is not a Candelabra tree file: it does not begin with the magic bytes")]
    NotOurs,
    /// The magic is there in the form a text-mode transfer leaves.
    #[error(
        "the file was damaged by a transfer in text mode (line ends were rewritten); copy it in binary mode"
    )]
    TextMode,
    /// A later major version.
    #[error(
        "the file has format version {found}.x and this program reads {known}.x; write it again with this program, or use a newer one"
    )]
    Version {
        /// Major version in the file.
        found: u16,
        /// Major version of this program.
        known: u16,
    },
    /// Written on a machine of the other byte order.
    #[error("the file's byte order is not this machine's (little-endian)")]
    ByteOrder,
    /// Shorter or longer than its header says.
    #[error(
        "the file is {actual} bytes long and its header promises {promised}: it was cut short or has bytes added; copy or write it again"
    )]
    Length {
        /// Length in the header.
        promised: u64,
        /// Length of the bytes.
        actual: u64,
    },
    /// A checksum does not match.
    #[error("{} is damaged: its checksum does not match; copy or build the file again", name(*section))]
    Checksum {
        /// The section; `None` for header and table.
        section: Option<SectionId>,
    },
    /// A section that must be there is not.
    #[error("section {0} is missing; build the file again")]
    Missing(SectionId),
    /// A section that this version does not know is marked as required.
    #[error(
        "section {0} is required to read this file and this program does not know it; use a newer program"
    )]
    Unknown(SectionId),
    /// A rule about one record, or about a section's place, is broken.
    #[error("{0}; build the file again")]
    Broken(Violation),
}

rules! {
    Rule::HEADER, RULES_OF_HEADER:
    MAGIC_IS_THERE = "the file begins with the magic bytes";
    BYTE_ORDER_IS_OURS = "the byte order mark is 01020304, little-endian";
    MAJOR_IS_KNOWN = "the major version is 1";
    LENGTH_IS_TOLD = "the file is as long as it says, has at most 256 sections and ends with the last of them";
    HEADER_IS_WHOLE = "the checksum of header and table matches";
}

rules! {
    Rule::TABLE, RULES_OF_TABLE:
    OFFSET_IS_ALIGNED = "a section's offset is a multiple of 64";
    SECTIONS_FOLLOW = "each section follows the one before it, at the next multiple of 64";
    SECTION_IS_INSIDE = "a section ends inside the file";
    ELEMENTS_HAVE_SIZE = "the size of an element is not 0";
    SECTION_IS_ONE = "no name appears twice";
    REQUIRED_IS_KNOWN = "a section that is marked as required is known to the reader";
    SECTION_IS_THERE = "the sections that every file has are there";
    ELEMENTS_ARE_WHOLE = "elements have the size that this page gives, and the section holds whole ones";
    GAPS_ARE_ZERO = "bytes between sections are 0";
    SECTION_IS_WHOLE = "the checksum of each section matches";
}

impl StoreError {
    /// The rule that is broken, and where.
    pub fn violation(&self) -> Violation {
        let header = |rule| Violation { rule, record: Record::All };
        let table = |rule, section| Violation { rule, record: Record::Section(section) };
        match *self {
            StoreError::NotOurs | StoreError::TextMode => header(MAGIC_IS_THERE),
            StoreError::ByteOrder => header(BYTE_ORDER_IS_OURS),
            StoreError::Version { .. } => header(MAJOR_IS_KNOWN),
            StoreError::Length { .. } => header(LENGTH_IS_TOLD),
            StoreError::Checksum { section: None } => header(HEADER_IS_WHOLE),
            StoreError::Checksum { section: Some(section) } => table(SECTION_IS_WHOLE, section),
            StoreError::Missing(section) => table(SECTION_IS_THERE, section),
            StoreError::Unknown(section) => table(REQUIRED_IS_KNOWN, section),
            StoreError::Broken(violation) => violation,
        }
    }
}

fn name(section: Option<SectionId>) -> String {
    section.map_or("the header".into(), |section| format!("section {section}"))
}
