//! What can be wrong with a container.

use super::SectionId;
use thiserror::Error;

/// Why some bytes are not a container that this version reads. The caller knows the file's name.
#[derive(Debug, Error, PartialEq, Eq)]
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
        "the file has format version {found}.x and this program reads {known}.x; rebuild it with `candelabra build`, or use a newer program"
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
        "the file is {actual} bytes long and its header promises {promised}: it was cut short or has bytes added; copy or build it again"
    )]
    Length {
        /// Length in the header.
        promised: u64,
        /// Length of the bytes.
        actual: u64,
    },
    /// A checksum does not match.
    #[error("{part} is damaged: its checksum does not match; copy or build the file again")]
    Checksum {
        /// `the header` or a section.
        part: String,
    },
    /// A section that must be there is not.
    #[error("section {0} is missing; build the file again")]
    Missing(SectionId),
    /// A section that this version does not know is marked as required.
    #[error(
        "section {0} is required to read this file and this program does not know it; use a newer program"
    )]
    Unknown(SectionId),
    /// A section breaks a rule of the format.
    #[error("section {section}: {rule}; build the file again")]
    Section {
        /// Which.
        section: SectionId,
        /// What is wrong with it.
        rule: String,
    },
}
