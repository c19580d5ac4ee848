//! Frames in the making, on the disk: a job that was stopped goes on with them.
//!
//! A checkpoint stands beside the picture that is to come. It holds the film after its last pass, or as it
//! was when the job was told to stop, the stamp of what it is a frame of, and a hash of its bytes.
//! A frame that is gone on with gets the bytes of one that was never stopped.

use crate::pipeline::{Event, Stamp, Watch};
use crate::render::Film;
use crate::store::{read_regular, write_atomically};
use std::io::{self, BufWriter, Write};
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

    /// Fills a blank film from an earlier job, if it left one of the same frame, whole.
    pub fn restore(&self, blank: Film) -> Option<Film> {
        let bytes = read_regular(&self.path, MOST_BYTES).ok()?;
        let film = self.film_in(&bytes).and_then(|bytes| blank.restored(bytes));
        if film.is_none() {
            let text = format!(
                "{}: is not of this frame, scene and settings, or is not whole; the frame is begun anew",
                self.path.display()
            );
            self.watch.tell(Event::Note { text });
        }
        film
    }

    /// The film's bytes in a file: magic, length of the stamp, stamp, film, hash of all before it.
    fn film_in<'b>(&self, bytes: &'b [u8]) -> Option<&'b [u8]> {
        let (content, hash) = bytes.split_at_checked(bytes.len().checked_sub(blake3::OUT_LEN)?)?;
        let rest = content.strip_prefix(MAGIC)?;
        let (length, rest) = rest.split_at_checked(8)?;
        let length = u64::from_le_bytes(length.try_into().ok()?);
        let (stamp, film) = rest.split_at_checked(length.try_into().ok()?)?;
        let is_ours = serde_json::from_slice::<Stamp>(stamp).ok()?.is_of_same(self.stamp);
        (is_ours && blake3::hash(content).as_bytes() == hash).then_some(film)
    }

    /// Writes the film. If that fails the frame goes on without.
    pub fn write(&self, film: &Film) {
        let written = write_atomically(&self.path, |file| {
            let mut out = Hashed { out: BufWriter::new(file), hasher: blake3::Hasher::new() };
            let stamp = serde_json::to_vec(self.stamp)?;
            out.write_all(MAGIC)?;
            out.write_all(&(stamp.len() as u64).to_le_bytes())?;
            out.write_all(&stamp)?;
            film.save(&mut out)?;
            let hash = out.hasher.finalize();
            out.out.write_all(hash.as_bytes())?;
            out.out.flush()
        });
        if let Err(error) = written {
            let text = format!("{error}; the frame goes on without a checkpoint");
            self.watch.tell(Event::Note { text });
        }
    }
}

/// Writes on, and hashes what it writes.
struct Hashed<W> {
    out: W,
    hasher: blake3::Hasher,
}

impl<W: Write> Write for Hashed<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.out.write(bytes)?;
        self.hasher.update(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}
