//! Finished work, so that a second run goes on where the first was stopped.
//!
//! Pictures of the reference depend on scene, settings and program; times also on the machine. Both are in
//! the names of folders, so that nothing is ever taken for something else. Each file is whole or not there, and
//! one that cannot be read is made again: a cache is never an error.

use super::machine::Machine;
use crate::math::color::Rgb;
use crate::render::beauty::Beauty;
use crate::store::{read_regular, write_atomically};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// A picture is smaller: 2^26 pixels of 12 bytes.
const MOST_BYTES: u64 = 4 << 30;
/// Digits of a hash that name a folder.
const DIGITS: usize = 32;
/// Columns, rows, and a hash over all before it.
const SIZE: usize = 8;
const HASH: usize = 32;

/// A folder of finished work.
#[derive(Clone, Debug)]
pub struct Cache {
    pictures: PathBuf,
    cells: PathBuf,
    is_fresh: bool,
}

impl Cache {
    /// The work on one scene below a folder. `scene` is a fingerprint of all that pictures depend on,
    /// `rest` what the results depend on beside it. A fresh cache forgets what was there.
    pub fn new(root: &Path, scene: &str, rest: &str, machine: &Machine, is_fresh: bool) -> Cache {
        let short = |hash: &str| hash[..DIGITS.min(hash.len())].to_owned();
        let pictures = root.join(short(scene));
        let own = blake3::hash(format!("{machine:?} {rest}").as_bytes());
        let cells = pictures.join(short(&own.to_hex()));
        Cache { pictures, cells, is_fresh }
    }

    /// Where it is.
    pub fn folder(&self) -> &Path {
        &self.pictures
    }

    /// A picture by its name.
    pub fn picture(&self, name: &str) -> Option<Beauty> {
        let bytes = self.read(&self.picture_file(name))?;
        let (content, hash) = bytes.split_at_checked(bytes.len().checked_sub(HASH)?)?;
        if blake3::hash(content).as_bytes() != hash {
            return None;
        }
        let (size, pixels) = content.split_at_checked(SIZE)?;
        let number = |bytes: &[u8]| bytes.try_into().ok().map(u32::from_le_bytes);
        let (width, height) = (number(&size[..4])?, number(&size[4..])?);
        let float = |bytes: &[u8]| f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
        let color = |bytes: &[u8]| Rgb::new(float(bytes), float(&bytes[4..]), float(&bytes[8..]));
        let pixels = pixels.chunks_exact(12).map(color).collect();
        Some(Beauty { width, height, pixels })
    }

    /// Keeps a picture.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn keep_picture(&self, name: &str, picture: &Beauty) -> io::Result<()> {
        let mut bytes = Vec::with_capacity(SIZE + 12 * picture.pixels.len() + HASH);
        bytes.extend([picture.width, picture.height].into_iter().flat_map(u32::to_le_bytes));
        let floats = picture.pixels.iter().flat_map(|color| color.to_array());
        bytes.extend(floats.flat_map(f32::to_le_bytes));
        let hash = blake3::hash(&bytes);
        bytes.extend(hash.as_bytes());
        write_atomically(&self.picture_file(name), |file| file.write_all(&bytes))
    }

    /// A result by its name.
    pub fn result<T: DeserializeOwned>(&self, name: &str) -> Option<T> {
        serde_json::from_slice(&self.read(&self.result_file(name))?).ok()
    }

    /// Keeps a result.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn keep_result(&self, name: &str, result: &impl Serialize) -> io::Result<()> {
        let json = serde_json::to_vec(result)?;
        write_atomically(&self.result_file(name), |file| file.write_all(&json))
    }

    fn picture_file(&self, name: &str) -> PathBuf {
        self.pictures.join(format!("{name}.rgb"))
    }

    fn result_file(&self, name: &str) -> PathBuf {
        // Not every file system takes a colon.
        self.cells.join(format!("{}.json", name.replace(':', "-")))
    }

    fn read(&self, path: &Path) -> Option<Vec<u8>> {
        if self.is_fresh { None } else { read_regular(path, MOST_BYTES).ok() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_comes_back_and_what_is_rotten_does_not() {
        let folder = tempfile::tempdir().unwrap();
        let machine = Machine::this(2);
        let cache = |scene, rest, fresh| Cache::new(folder.path(), scene, rest, &machine, fresh);
        let own = cache("scene", "rest", false);
        let pixels = (0..6).map(|i| Rgb::new(i as f32, 1e-30, f32::MAX)).collect();
        let picture = Beauty { width: 3, height: 2, pixels };
        own.keep_picture("half", &picture).unwrap();
        own.keep_result("tree:0.5@2", &7).unwrap();
        assert_eq!(own.picture("half"), Some(picture.clone()));
        assert_eq!(own.result("tree:0.5@2"), Some(7));
        // Results are of one machine and one reference, pictures of any.
        let other = cache("scene", "other", false);
        assert_eq!(
            (other.picture("half"), other.result::<i32>("tree:0.5@2")),
            (Some(picture), None)
        );
        for elsewhere in [cache("another", "rest", false), cache("scene", "rest", true)] {
            assert_eq!(
                (elsewhere.picture("half"), elsewhere.result::<i32>("tree:0.5@2")),
                (None, None)
            );
        }
        let file = own.picture_file("half");
        let whole = std::fs::read(&file).unwrap();
        for at in [0, 9, whole.len() - 1] {
            let mut rotten = whole.clone();
            rotten[at] ^= 1;
            std::fs::write(&file, &rotten).unwrap();
            assert_eq!(own.picture("half"), None);
            std::fs::write(&file, &whole[..at]).unwrap();
            assert_eq!(own.picture("half"), None);
        }
    }
}
