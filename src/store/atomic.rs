//! Files that are either whole or not there.
//!
//! An output is written to a temporary file in the folder where it belongs, flushed to the disk
//! and renamed over its name. A reader sees the old file or the new one, never a part of one, even if
//! the machine stops in between. A failed write leaves the old file as it was and removes the temporary
//! one.
//!
//! Of two writers of one name the last to finish wins. A writer that is killed (`kill -9`, a machine that
//! stops) cannot clean up: its temporary file, `.candelabra-*.part` in the output's folder, stays. Nothing
//! reads it and no later writer takes its name. Writers hold a lock on their temporary files, which the
//! system drops when they die; so [`sweep`] can tell the files that nobody writes any more, and removes them.
//! Not every file system carries locks from machine to machine. So the name tells the machine, and files of
//! others are swept only when they are a day old.
//!
//! Long work should not fail only when its output is written: [`check_writable`] tests beforehand, as far
//! as possible, whether that will succeed.

use std::fs::{self, File, TryLockError};
use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::sync::LazyLock;
use std::time::Duration;
use tempfile::{Builder, NamedTempFile};

/// How temporary files are named.
const PREFIX: &str = ".candelabra-";
const SUFFIX: &str = ".part";
/// `.candelabra-` and what tells this machine, since it was started, from others.
static OWN_PREFIX: LazyLock<String> = LazyLock::new(|| {
    let boot = fs::read_to_string("/proc/sys/kernel/random/boot_id").unwrap_or_default();
    format!("{PREFIX}{}-", boot.trim().split('-').next().unwrap_or_default())
});
/// No writer works on one file for longer.
const LONGEST_WRITE: Duration = Duration::from_secs(24 * 3600);
/// What is written to find out whether anything can be.
const TRIAL: [u8; 1 << 12] = [0x5a; 1 << 12];

/// Writes a file through `write`, all or nothing. Parent folders are created.
///
/// Errors name the path and, if the disk is full, the remedy. Their kind is the one that the system or
/// `write` reported.
pub fn write_atomically(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> io::Result<()> {
    replace(path, write).map_err(|error| {
        let remedy = match is_full(&error) {
            true => {
                "; the old file, if any, is as it was: free some space, or choose another output"
            }
            false => "",
        };
        io::Error::new(error.kind(), format!("{}: {error}{remedy}", path.display()))
    })
}

/// Whether there is no room on a disk, or none that this user may take.
pub fn is_full(error: &io::Error) -> bool {
    use io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
    matches!(error.kind(), StorageFull | QuotaExceeded | FileTooLarge)
}

/// Checks that a small file can be written; see [`check_room`].
pub fn check_writable(path: &Path) -> io::Result<()> {
    check_room(path, 0)
}

/// Checks that a file of some bytes can be written: no folder or device has its name, and in its folder or,
/// if that does not exist, in the nearest one above that does, a small temporary file can be written and the
/// file system has room for the bytes. Nothing is left behind. Errors name the path and the remedy.
pub fn check_room(path: &Path, bytes: u64) -> io::Result<()> {
    check(path, bytes).map_err(|error| {
        let remedy = if is_full(&error) { "free some space, or " } else { "" };
        let problem = format!(
            "{}: cannot be written: {error}; {remedy}choose another output",
            path.display()
        );
        io::Error::new(error.kind(), problem)
    })
}

fn check(path: &Path, bytes: u64) -> io::Result<()> {
    match fs::metadata(path) {
        Ok(there) if there.is_dir() => {
            return Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder"));
        }
        Ok(there) if !there.is_file() => {
            return Err(io::Error::new(io::ErrorKind::AlreadyExists, "it is a device or a pipe"));
        }
        Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    let mut folder = folder_of(path);
    while fs::symlink_metadata(folder).is_err() && folder != Path::new(".") {
        folder = folder_of(folder);
    }
    let mut temporary = temporary_file(folder)?;
    temporary.write_all(&TRIAL)?;
    temporary.flush()?;
    match room(temporary.as_file()) {
        Some(room) if room < bytes => {
            let problem = format!("{bytes} bytes are needed, and {room} are free");
            Err(io::Error::new(io::ErrorKind::StorageFull, problem))
        }
        _ => Ok(()),
    }
}

/// Bytes that are free where a file is, if the system tells.
fn room(file: &File) -> Option<u64> {
    #[cfg(unix)]
    {
        // Some file systems answer with zeros alone.
        let disk = rustix::fs::fstatvfs(file).ok().filter(|disk| disk.f_blocks > 0)?;
        Some(disk.f_bavail.saturating_mul(disk.f_frsize))
    }
    #[cfg(not(unix))]
    None
}

/// Removes the temporary files in a folder that killed writers have left; those of other machines, or from
/// before this one was started, when they are a day old. Errors are ignored: the files are in nobody's way.
pub fn sweep(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for path in entries.flatten().map(|entry| entry.path()) {
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        let Ok(there) = fs::symlink_metadata(&path) else { continue };
        let age = || there.modified().ok()?.elapsed().ok();
        let is_left =
            || name.starts_with(&*OWN_PREFIX) || age().is_some_and(|age| age > LONGEST_WRITE);
        if !(name.starts_with(PREFIX) && name.ends_with(SUFFIX) && there.is_file() && is_left()) {
            continue;
        }
        // Locked until it is removed: a writer that comes late sees that it has lost the file.
        if let Ok(file) = File::open(&path)
            && file.try_lock().is_ok()
        {
            let _ = fs::remove_file(&path);
        }
    }
}

/// The folder that a file belongs in.
pub fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// A temporary file in a folder, locked.
fn temporary_file(folder: &Path) -> io::Result<NamedTempFile> {
    let mut builder = Builder::new();
    builder.prefix(&*OWN_PREFIX).suffix(SUFFIX);
    // A temporary file is private by default; an output is as open as the user's mask allows.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    /// A sweeper may come between the making of a file and its lock, but not many times in a row.
    const TRIES: u32 = 8;
    for _ in 0..TRIES {
        let temporary = builder.tempfile_in(folder)?;
        match temporary.as_file().try_lock() {
            Ok(()) if fs::symlink_metadata(temporary.path()).is_ok() => return Ok(temporary),
            // No locks on this file system; then nobody sweeps it either.
            Err(TryLockError::Error(_)) => return Ok(temporary),
            Ok(()) | Err(TryLockError::WouldBlock) => {}
        }
    }
    Err(io::Error::other("another program removes temporary files as fast as they are made"))
}

fn replace(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> io::Result<()> {
    let folder = folder_of(path);
    fs::create_dir_all(folder)?;
    let (file, name) = temporary_file(folder)?.into_parts();
    let mut buffer = BufWriter::new(file);
    write(&mut buffer)?;
    buffer.flush()?;
    buffer.get_ref().sync_all()?;
    // Open, and so locked, until it has its own name.
    name.persist(path)?;
    drop(buffer);
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

    #[test]
    fn what_can_be_written_is_told_beforehand_and_nothing_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        fs::create_dir(path("taken")).unwrap();
        fs::write(path("file"), "old").unwrap();
        for name in ["new", "file", "taken/new", "a/b/c/new"] {
            check_writable(&path(name)).unwrap();
        }
        let long = "x".repeat(300);
        for name in ["taken", "file/below", "file/a/below", &long] {
            let error = check_writable(&path(name)).unwrap_err();
            assert!(error.to_string().contains(name), "{error}");
            assert!(write_atomically(&path(name), |_| Ok(())).is_err(), "{name}");
        }
        #[cfg(target_os = "linux")]
        for name in ["/proc/nope", "/proc/nope/deep/file", "/dev/null"] {
            assert!(check_writable(Path::new(name)).is_err(), "{name}");
        }
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
        assert_eq!(fs::read_to_string(path("file")).unwrap(), "old");
        assert_eq!(fs::read_dir(path("taken")).unwrap().count(), 0);
    }

    #[test]
    fn what_dead_writers_left_is_swept_and_what_lives_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let dead = format!("{}dead.part", *OWN_PREFIX);
        // Of another machine, whose locks may not be seen here: young, and older than any write.
        let (young, old) = (".candelabra-0other-a.part", ".candelabra-0other-b.part");
        for name in [&dead, young, old, ".candelabra-x", "a.part", "candelabra-y.part"] {
            fs::write(path(name), "half").unwrap();
        }
        let long_ago = std::time::SystemTime::now() - 2 * LONGEST_WRITE;
        File::options().write(true).open(path(old)).unwrap().set_modified(long_ago).unwrap();
        fs::create_dir(path(&format!("{}folder.part", *OWN_PREFIX))).unwrap();
        let alive = temporary_file(folder.path()).unwrap();
        alive.as_file().set_modified(long_ago).unwrap();
        sweep(folder.path());
        assert!(!path(&dead).exists() && !path(old).exists());
        assert!(alive.path().exists() && path(young).exists());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 6);
        sweep(&path("no such folder"));
    }

    #[cfg(unix)]
    #[test]
    fn a_disk_without_room_is_told_beforehand() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("large");
        check_room(&path, 1 << 10).unwrap();
        let error = check_room(&path, u64::MAX).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::StorageFull);
        assert!(error.to_string().contains("are free"), "{error}");
    }

    /// Two writers and a sweeper on one folder: every file is written whole, nothing stays.
    #[test]
    fn a_sweeper_takes_nothing_from_writers() {
        let folder = tempfile::tempdir().unwrap();
        let write = &|name: &str| {
            for _ in 0..200 {
                let path = folder.path().join(name);
                write_atomically(&path, |file| file.write_all(name.as_bytes())).unwrap();
                assert_eq!(fs::read_to_string(&path).unwrap(), name);
            }
        };
        std::thread::scope(|scope| {
            let writers = ["a", "b"].map(|name| scope.spawn(move || write(name)));
            while !writers.iter().all(|writer| writer.is_finished()) {
                sweep(folder.path());
            }
        });
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
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
