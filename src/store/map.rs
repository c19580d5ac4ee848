//! Memory-mapped files: the one place with `unsafe`.
#![allow(unsafe_code)]

use memmap2::{Advice, Mmap};
use std::fs::File;
use std::io;
use std::path::Path;

/// Maps a file read-only.
///
/// Our writers never change a file in place: they write another and rename it over the old one, so
/// a mapping keeps seeing the file that it was made of.
pub fn map(path: &Path) -> io::Result<Mmap> {
    let file = File::open(path)?;
    if !file.metadata()?.is_file() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "not a regular file"));
    }
    // SAFETY: the mapping is undefined if another process truncates or overwrites the file while
    // we read. No tool of ours does (see above). All types viewed in the bytes are `Pod`, so that
    // foreign writes could at worst give wrong numbers, which sampling survives by construction.
    let map = unsafe { Mmap::map(&file) }?;
    // Trees are small and read whole: fetch ahead rather than fault page by page.
    let _ = map.advise(Advice::WillNeed);
    Ok(map)
}
