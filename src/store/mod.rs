//! Floor 1: bytes on disk, and nothing of what they mean.
//!
//! A [`Container`] is a header, a table of sections and the sections themselves, over mapped or owned
//! bytes. [`MappedFile`] maps a file, [`read_regular`] reads one, [`write_atomically`] writes one that is either whole
//! or not there.
//! What the sections of a tree file hold is `light_tree`'s affair.
#![doc = include_str!("format.md")]

mod atomic;
mod bytes;
mod container;
mod error;
mod header;
mod map;
mod regular;
mod rule;
mod seal;

pub use atomic::{check_room, check_writable, folder_of, is_full, sweep, write_atomically};
pub use bytes::{ALIGNMENT, AlignedBytes};
pub use container::{Container, ContainerWriter, Section, SectionId};
pub use error::{RULES_OF_HEADER, RULES_OF_TABLE, StoreError};
pub use header::{Form, MAGIC, TREE_FILE, VERSION};
pub use map::MappedFile;
pub use regular::{open_regular, read_regular};
pub(crate) use rule::rules;
pub use rule::{Record, Rule, Violation};
pub use seal::{BLANK, is_sealed, set_seal};
