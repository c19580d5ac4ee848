//! Where pictures go, and whether they can.

use super::RenderError;
use crate::render::frame_names::FrameNames;
use crate::render::frames::Frames;
use crate::scene::Scene;
use crate::store::{check_room, folder_of, sweep};
use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// The files of a shot.
pub(super) struct Outputs<'a> {
    pub names: &'a FrameNames,
    /// Whether there is a preview beside each picture.
    pub previews: bool,
    /// Bytes that must be free before a frame is worth rendering.
    room: AtomicU64,
}

impl<'a> Outputs<'a> {
    pub fn new(names: &'a FrameNames, previews: bool) -> Outputs<'a> {
        Outputs { names, previews, room: AtomicU64::new(0) }
    }

    /// The picture of a frame.
    pub fn picture(&self, frame: i32) -> PathBuf {
        self.names.path(frame)
    }

    /// Its preview.
    pub fn preview(&self, frame: i32) -> Option<PathBuf> {
        self.previews.then(|| self.picture(frame).with_extension("png"))
    }

    fn files(&self, frame: i32) -> impl Iterator<Item = PathBuf> {
        self.preview(frame).into_iter().chain([self.picture(frame)])
    }

    /// Refuses a shot whose frames would share a name, or of which no frame can be written. A shot to be
    /// resumed may be done, and then nothing has to be written.
    pub fn check(&self, frames: &Frames, resume: bool) -> Result<(), RenderError> {
        self.names.check(frames)?;
        if resume {
            return Ok(());
        }
        let mut checks = frames.as_slice().iter().map(|&frame| self.check_frame(frame));
        match checks.next() {
            Some(Err(error)) if !checks.any(|check| check.is_ok()) => {
                Err(RenderError::Unwritable(error))
            }
            _ => Ok(()),
        }
    }

    /// Makes sure that a frame's files can be written.
    pub fn check_frame(&self, frame: i32) -> io::Result<()> {
        let room = self.room.load(Relaxed);
        self.files(frame).try_for_each(|file| check_room(&file, room))
    }

    /// Notes that a file has needed so many bytes, or would have.
    pub fn note_length(&self, bytes: u64) {
        self.room.fetch_max(bytes, Relaxed);
    }

    /// No picture may replace what it is rendered from.
    pub fn refuse_inputs<'p>(
        &self,
        scene: &'p Scene,
        files: impl Iterator<Item = &'p Path>,
        frames: &Frames,
    ) -> Result<(), RenderError> {
        let real = |path: &Path| path.canonicalize().ok();
        let read = scene.files.iter().map(|file| file.path.as_path()).chain(files);
        let inputs: BTreeSet<PathBuf> = read.filter_map(real).collect();
        let mut files = frames.as_slice().iter().flat_map(|&frame| self.files(frame));
        match files.find(|file| real(file).is_some_and(|file| inputs.contains(&file))) {
            Some(file) => Err(RenderError::Overwrites(file)),
            None => Ok(()),
        }
    }

    /// Removes what killed renders have left in the folders of these frames.
    pub fn sweep(&self, frames: &Frames) {
        let files = frames.as_slice().iter().map(|&frame| self.picture(frame));
        let folders: BTreeSet<PathBuf> = files.map(|file| folder_of(&file).to_path_buf()).collect();
        folders.iter().for_each(|folder| sweep(folder));
    }
}
