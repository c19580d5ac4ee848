//! Frames in the making, on the disk: a job that was stopped goes on with them.
//!
//! A checkpoint stands beside the picture that is to come. It holds the film after its last pass, or as it
//! was when the job was told to stop, the stamp of what it is a frame of, and a hash of its bytes.
//! A frame that is gone on with gets the bytes of one that was never stopped.

use crate::pipeline::{Event, Stamp, Watch};
use crate::render::Film;
use crate::store::{read_regular, write_atomically};
use std::io::Write;
use std::path::{Path, PathBuf};

/// What the file begins with.
const MAGIC: &[u8; 16] = b"candelabra film\n";
/// Larger files are none of ours.
const MOST_BYTES: u64 = 1 << 40;

/// The checkpoint of one frame.
pub(super) struct Checkpoint<'a> {
    path: PathBuf,
    stamp: &'a Stamp,
    watch: &'a dyn Watch,
}

impl<'a> Checkpoint<'a> {
    /// Beside a picture.
    pub fn of(picture: &Path, stamp: &'a Stamp, watch: &'a dyn Watch) -> Checkpoint<'a> {
        let mut name = picture.as_os_str().to_owned();
        name.push(".checkpoint");
        Checkpoint { path: name.into(), stamp, watch }
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The film of an earlier job, if there is one of the same frame, whole; else the blank one.
    pub fn restore(&self, blank: Film) -> Film {
        let Ok(bytes) = read_regular(&self.path, MOST_BYTES) else { return blank };
        let film = self.film_in(&bytes).and_then(|bytes| blank.clone().restored(bytes));
        if film.is_none() {
            let text = format!(
                "{}: is not of this frame, scene and settings, or is not whole; the frame is begun anew",
                self.path.display()
            );
            self.watch.tell(Event::Note { text });
        }
        film.unwrap_or(blank)
    }

    /// The film's bytes in a file: magic, hash of all that follows, length of the stamp, stamp, film.
    fn film_in<'b>(&self, bytes: &'b [u8]) -> Option<&'b [u8]> {
        let rest = bytes.strip_prefix(MAGIC)?;
        let (hash, rest) = rest.split_at_checked(blake3::OUT_LEN)?;
        let (length, after) = rest.split_at_checked(8)?;
        let length = u64::from_le_bytes(length.try_into().ok()?);
        let (stamp, film) = after.split_at_checked(length.try_into().ok()?)?;
        let is_ours = serde_json::from_slice::<Stamp>(stamp).ok()?.is_of_same(self.stamp);
        (is_ours && blake3::hash(rest).as_bytes() == hash).then_some(film)
    }

    /// Writes the film. If that fails the frame goes on without.
    pub fn write(&self, film: &Film) {
        let written = self.bytes_of(film).and_then(|bytes| {
            write_atomically(&self.path, |file| {
                file.write_all(MAGIC)?;
                file.write_all(blake3::hash(&bytes).as_bytes())?;
                file.write_all(&bytes)
            })
        });
        if let Err(error) = written {
            let text = format!("{error}; the frame goes on without a checkpoint");
            self.watch.tell(Event::Note { text });
        }
    }

    fn bytes_of(&self, film: &Film) -> std::io::Result<Vec<u8>> {
        let stamp = serde_json::to_vec(self.stamp)?;
        let mut bytes = (stamp.len() as u64).to_le_bytes().to_vec();
        bytes.extend(stamp);
        film.save(&mut bytes)?;
        Ok(bytes)
    }
}
