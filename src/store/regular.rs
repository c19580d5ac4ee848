//! Regular files, and nothing that only looks like one.
//!
//! Opening a pipe blocks, and a device such as `/dev/zero` never ends. Inputs are opened here, so that both
//! are refused at once.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Read};
use std::path::Path;

/// Opens a regular file for reading. Symbolic links are followed.
///
/// # Errors
/// If there is no such file, or it is a folder, a pipe, a socket or a device.
pub fn open_regular(path: &Path) -> io::Result<File> {
    // Asked before it is opened: opening a pipe waits for a writer.
    refuse_others(&fs::metadata(path)?)?;
    let file = File::open(path)?;
    refuse_others(&file.metadata()?)?;
    Ok(file)
}

/// Reads a regular file that has at most so many bytes.
///
/// # Errors
/// As [`open_regular`]; [`FileTooLarge`](ErrorKind::FileTooLarge) for more bytes, of which none is read.
pub fn read_regular(path: &Path, most_bytes: u64) -> io::Result<Vec<u8>> {
    let file = open_regular(path)?;
    let length = file.metadata()?.len();
    let too_large = || {
        let problem = format!("it has more than the {most_bytes} bytes that are read");
        io::Error::new(ErrorKind::FileTooLarge, problem)
    };
    if length > most_bytes {
        return Err(too_large());
    }
    let mut bytes = Vec::new();
    let reserved = usize::try_from(length).ok().map(|length| bytes.try_reserve_exact(length));
    if !matches!(reserved, Some(Ok(()))) {
        return Err(io::Error::new(ErrorKind::OutOfMemory, "there is not enough memory for it"));
    }
    // It may grow while it is read.
    match file.take(most_bytes.saturating_add(1)).read_to_end(&mut bytes)? as u64 > most_bytes {
        true => Err(too_large()),
        false => Ok(bytes),
    }
}

fn refuse_others(what: &fs::Metadata) -> io::Result<()> {
    match what.is_file() {
        true => Ok(()),
        false => Err(io::Error::new(ErrorKind::InvalidInput, "not a regular file")),
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::process::Command;

    #[test]
    fn pipes_devices_and_folders_are_refused_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let link = folder.path().join("link");
        std::os::unix::fs::symlink(&pipe, &link).unwrap();
        for path in [&pipe, &link, Path::new("/dev/zero"), folder.path()] {
            let error = read_regular(path, 10).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::InvalidInput, "{}", path.display());
        }
    }

    #[test]
    fn large_files_are_refused_unread() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sparse");
        // A hole of a terabyte takes no place on the disk.
        File::create(&path).unwrap().set_len(1 << 40).unwrap();
        assert_eq!(read_regular(&path, 1 << 30).unwrap_err().kind(), ErrorKind::FileTooLarge);
        fs::write(&path, "12345").unwrap();
        assert_eq!(read_regular(&path, 5).unwrap(), b"12345");
        assert!(read_regular(&path, 4).is_err());
    }
}
