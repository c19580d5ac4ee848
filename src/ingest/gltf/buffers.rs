//! The bytes behind buffers and buffer views.

use super::container::Container;
use super::document::{Document, label};
use crate::ingest::error::Fault;
use crate::ingest::uri::Folder;
use std::borrow::Cow;

const GIT_LFS_POINTER: &[u8] = b"version https://git-lfs.github.com/spec/";

/// The bytes of every buffer of the document, at least as many as it declares. A buffer without a
/// source (the fallback of a compression, say) is empty.
pub(super) struct Buffers<'a> {
    buffers: Vec<Cow<'a, [u8]>>,
}

impl<'a> Buffers<'a> {
    pub(super) fn read(
        document: &Document,
        file: &'a Container,
        folder: &Folder,
    ) -> Result<Buffers<'a>, Fault> {
        let mut buffers = Vec::with_capacity(document.buffers.len());
        for (i, buffer) in document.buffers.iter().enumerate() {
            let object = label("buffer", i, None);
            if buffer.byte_length == 0 {
                return Err(Fault::new(object, "has no bytes"));
            }
            let bytes = match &buffer.uri {
                Some(uri) => Cow::Owned(folder.read_uri(uri, &object)?),
                None if i == 0 && file.binary().is_some() => {
                    Cow::Borrowed(file.binary().unwrap_or_default())
                }
                None if i == 0 && file.is_glb() => {
                    return Err(Fault::new(
                        object,
                        "should be the file's binary chunk, which is absent",
                    )
                    .remedy("the file is damaged; fetch or export it again"));
                }
                None => {
                    buffers.push(Cow::Borrowed(&[][..]));
                    continue;
                }
            };
            if bytes.starts_with(GIT_LFS_POINTER) {
                return Err(Fault::new(object, "is a Git LFS pointer, not the data")
                    .remedy("run git lfs pull"));
            }
            if (bytes.len() as u64) < buffer.byte_length {
                let (declared, real) = (buffer.byte_length, bytes.len());
                let problem = format!("declares {declared} bytes, but there are {real}");
                return Err(Fault::new(object, problem)
                    .remedy("the buffer is truncated or another's; fetch or export it again"));
            }
            buffers.push(bytes);
        }
        Ok(Buffers { buffers })
    }

    /// How many bytes all buffers hold.
    pub(super) fn size(&self) -> u64 {
        self.buffers.iter().map(|bytes| bytes.len() as u64).sum()
    }

    /// The bytes of a buffer view.
    pub(super) fn view(
        &self,
        document: &Document,
        view: u32,
        object: &str,
    ) -> Result<&[u8], Fault> {
        let absent = || Fault::new(object, format!("refers to absent buffer view {view}"));
        let row = document.buffer_views.get(view as usize).ok_or_else(absent)?;
        let bytes = self.buffers.get(row.buffer as usize).ok_or_else(absent)?;
        if bytes.is_empty() {
            let problem = format!("its data should be in buffer {}, which has none", row.buffer);
            return Err(Fault::new(object, problem).remedy("export without mesh compression"));
        }
        let start = usize::try_from(row.byte_offset).ok();
        let end = row.byte_offset.checked_add(row.byte_length);
        let end = end.and_then(|end| usize::try_from(end).ok());
        // A file may be longer than the buffer it holds.
        let declared = document.buffers[row.buffer as usize].byte_length;
        let bytes = &bytes[..bytes.len().min(usize::try_from(declared).unwrap_or(usize::MAX))];
        start.zip(end).and_then(|(start, end)| bytes.get(start..end)).ok_or_else(|| {
            Fault::new(object, format!("buffer view {view} is not inside buffer {}", row.buffer))
        })
    }
}
