//! Files that are either whole or not there.
//!
//! An output is written to a temporary file in the folder where it belongs, flushed to the disk
//! and renamed over its name. Whoever looks at the name sees the old file or the new one, never a
//! part of one, even if the machine stops in between; a failed write leaves the old file alone
//! and no temporary one behind.
//!
//! Of two writers of one name the last to finish wins. A writer that is killed (`kill -9`, a machine that
//! stops) cannot clean up: its temporary file, `.candelabra-*.part` in the output's folder, stays. Nothing
//! reads it and no later writer takes its name; who wants the space back may remove those that are older
//! than any job that runs.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::Path;
use tempfile::Builder;

/// Writes a file through `write`, all or nothing. Parent folders are created.
///
/// Errors name the path and, where the disk is full, the remedy; they keep the kind of what the system or
/// `write` reported.
pub fn write_atomically(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> io::Result<()> {
    replace(path, write).map_err(|error| {
        use io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
        let remedy = match error.kind() {
            StorageFull | QuotaExceeded | FileTooLarge => {
                "; the old file, if any, is as it was: free some space, or choose another output"
            }
            _ => "",
        };
        io::Error::new(error.kind(), format!("{}: {error}{remedy}", path.display()))
    })
}

fn replace(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> io::Result<()> {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    fs::create_dir_all(folder)?;
    // A rename would put a file in the place of a device or a pipe.
    if let Ok(there) = fs::metadata(path)
        && !(there.is_file() || there.is_dir())
    {
        let problem = "is a device or a pipe; choose another output";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, problem));
    }
    let mut builder = Builder::new();
    builder.prefix(".candelabra-").suffix(".part");
    // A temporary file is private by default; an output is as open as the user's mask allows.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let temporary = builder.tempfile_in(folder)?;
    let (file, name) = temporary.into_parts();
    let mut buffer = BufWriter::new(file);
    write(&mut buffer)?;
    buffer.flush()?;
    buffer.get_ref().sync_all()?;
    drop(buffer);
    name.persist(path)?;
    // The rename itself lives in the folder. Not every system lets a folder be opened; the file is
    // whole either way.
    if let Ok(folder) = File::open(folder) {
        let _ = folder.sync_all();
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_new_file_replaces_the_old_one_and_folders_appear() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a/b/out.bin");
        for text in ["first", "second, longer"] {
            write_atomically(&path, |file| file.write_all(text.as_bytes())).unwrap();
            assert_eq!(fs::read_to_string(&path).unwrap(), text);
        }
        assert_eq!(fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
    }

    #[test]
    fn a_failed_write_changes_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.bin");
        fs::write(&path, "old").unwrap();
        let error = write_atomically(&path, |file| {
            file.write_all(b"half of the n")?;
            Err(io::Error::new(io::ErrorKind::StorageFull, "no room"))
        })
        .unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::StorageFull);
        assert!(error.to_string().contains("out.bin") && error.to_string().contains("no room"));
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_folder_in_the_way_is_an_error_with_its_name() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("taken")).unwrap();
        let error = write_atomically(&folder.path().join("taken"), |_| Ok(())).unwrap_err();
        assert!(error.to_string().contains("taken"));
        fs::write(folder.path().join("file"), "").unwrap();
        assert!(write_atomically(&folder.path().join("file/below"), |_| Ok(())).is_err());
    }

    #[cfg(unix)]
    #[test]
    fn others_may_read_what_the_mask_allows() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (plain, ours) = (folder.path().join("plain"), folder.path().join("ours"));
        fs::write(&plain, "").unwrap();
        write_atomically(&ours, |_| Ok(())).unwrap();
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&ours), mode(&plain));
    }
}
