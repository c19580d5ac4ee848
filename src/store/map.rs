//! Memory-mapped files: the one place with `unsafe`.
#![allow(unsafe_code)]

use super::open_regular;
use memmap2::Mmap;
use std::io;
use std::path::Path;

/// Maps a file read-only.
///
/// Our writers never change a file in place: they write another and rename it over the old one, so
/// a mapping keeps seeing the file that it was made of, whole, for as long as it is used.
///
/// Other programs may change it in place: `cp` over a tree, `rsync --inplace`, an editor. What was
/// verified may then no longer hold; sampling survives that, with wrong numbers. But if the file gets
/// *shorter*, or its disk fails, the system ends the process with `SIGBUS` when it reads the missing part.
/// That is not caught: a handler could neither read the rest nor unwind from here. Finished frames are not
/// lost, because pictures are written whole or not at all; start the render again with `--resume`. To
/// replace a tree safely, copy the new one to another name and `mv` it over the old one.
pub fn map(path: &Path) -> io::Result<Mmap> {
    let file = open_regular(path)?;
    // SAFETY: the mapping is undefined if another process truncates or overwrites the file while
    // we read. No tool of ours does (see above). All types viewed in the bytes are `Pod`, so that
    // foreign writes could at worst give wrong numbers, which sampling survives by construction.
    unsafe { Mmap::map(&file) }
}
