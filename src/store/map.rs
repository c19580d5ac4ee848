//! Memory-mapped files: the one place with `unsafe`.
#![allow(unsafe_code)]

use super::open_regular;
use memmap2::Mmap;
use std::fs::File;
use std::io;
use std::path::Path;
use std::time::SystemTime;

/// A file, mapped read-only.
///
/// Our writers never change a file in place: they write another and rename it over the old one, so
/// a mapping keeps seeing the file that it was made of, whole, for as long as it is used.
///
/// Other programs may change it in place: `cp` over a tree, `rsync --inplace`, an editor. What was
/// verified may then no longer hold; sampling survives that, with wrong numbers, and
/// [`is_unchanged`](MappedFile::is_unchanged) tells. But if the file gets *shorter*, or its disk fails, the
/// system ends the process with `SIGBUS` when it reads the missing part: nothing here can prevent that. To
/// replace a tree safely, copy the new one to another name and `mv` it over the old one.
pub struct MappedFile {
    map: Mmap,
    file: File,
    state: io::Result<State>,
}

/// What changes when a file is written to, and not when it gets another name.
#[derive(PartialEq, Eq)]
struct State {
    length: u64,
    modified: SystemTime,
}

impl State {
    fn of(file: &File) -> io::Result<State> {
        let now = file.metadata()?;
        Ok(State { length: now.len(), modified: now.modified()? })
    }
}

impl MappedFile {
    /// Maps a file.
    ///
    /// # Errors
    /// If it is no regular file, or cannot be mapped.
    pub fn open(path: &Path) -> io::Result<MappedFile> {
        let file = open_regular(path)?;
        let state = State::of(&file);
        // SAFETY: the mapping is undefined if another process truncates or overwrites the file while
        // we read. No tool of ours does (see above). All types viewed in the bytes are `Pod`, so that
        // foreign writes could at worst give wrong numbers, which sampling survives by construction.
        let map = unsafe { Mmap::map(&file) }?;
        Ok(MappedFile { map, file, state })
    }

    /// Whether nobody has written to the file since it was mapped, as far as its length and time tell.
    pub fn is_unchanged(&self) -> bool {
        match (&self.state, State::of(&self.file)) {
            (Ok(then), Ok(now)) => *then == now,
            _ => false,
        }
    }
}

impl AsRef<[u8]> for MappedFile {
    fn as_ref(&self) -> &[u8] {
        &self.map
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::fs;
    use std::os::unix::fs::PermissionsExt;

    #[test]
    fn a_mapped_file_notices_who_writes_to_it_and_not_who_replaces_it() {
        let folder = tempfile::tempdir().unwrap();
        let (path, other) = (folder.path().join("a"), folder.path().join("b"));
        let mapped = |content: &str| {
            fs::write(&path, content).unwrap();
            MappedFile::open(&path).unwrap()
        };
        let pause = || std::thread::sleep(std::time::Duration::from_millis(20));
        let replaced = mapped("first");
        pause();
        fs::write(&other, "later").unwrap();
        fs::rename(&other, &path).unwrap();
        assert!(replaced.is_unchanged() && replaced.as_ref() == b"first");
        // Archived under another name, and made private: nobody wrote to it.
        let archived = mapped("first");
        pause();
        fs::rename(&path, &other).unwrap();
        fs::set_permissions(&other, fs::Permissions::from_mode(0o600)).unwrap();
        assert!(archived.is_unchanged());
        // Of the same length; of another.
        for content in ["FIRST", "longer"] {
            let written = mapped("first");
            assert!(written.is_unchanged());
            pause();
            fs::OpenOptions::new().write(true).open(&path).unwrap();
            assert!(written.is_unchanged());
            io::Write::write_all(
                &mut fs::OpenOptions::new().write(true).open(&path).unwrap(),
                content.as_bytes(),
            )
            .unwrap();
            assert!(!written.is_unchanged(), "{content}");
        }
    }
}
