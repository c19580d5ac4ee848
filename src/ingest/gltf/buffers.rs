//! The bytes behind buffers and buffer views.

use super::container::Container;
use super::document::{Document, label};
use crate::ingest::error::Fault;
use crate::ingest::uri::Folder;
use gltf::json::Index;
use gltf::json::buffer::View;
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
            let declared = buffer.byte_length.0;
            if declared == 0 {
                return Err(Fault::new(object, "has no bytes"));
            }
            let bytes = match &buffer.uri {
                Some(uri) => Cow::Owned(folder.read_uri(uri, &object)?),
                None => match file.binary() {
                    Some(binary) if i == 0 => Cow::Borrowed(binary),
                    None if i == 0 && file.is_glb() => {
                        let problem = "should be the file's binary chunk, which is absent";
                        return Err(Fault::new(object, problem)
                            .remedy("the file is damaged; fetch or export it again"));
                    }
                    _ => {
                        buffers.push(Cow::Borrowed(&[][..]));
                        continue;
                    }
                },
            };
            if bytes.starts_with(GIT_LFS_POINTER) {
                return Err(Fault::new(object, "is a Git LFS pointer, not the data")
                    .remedy("run git lfs pull"));
            }
            if (bytes.len() as u64) < declared {
                let problem = format!("declares {declared} bytes, but there are {}", bytes.len());
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
        view: Index<View>,
        object: &str,
    ) -> Result<&[u8], Fault> {
        let absent = || Fault::new(object, format!("refers to absent buffer view {view}"));
        let row = document.get(view).ok_or_else(absent)?;
        let buffer = document.get(row.buffer).ok_or_else(absent)?;
        let bytes = self.buffers.get(row.buffer.value()).ok_or_else(absent)?;
        if bytes.is_empty() {
            let problem = format!("its data should be in buffer {}, which has none", row.buffer);
            return Err(Fault::new(object, problem).remedy("export without mesh compression"));
        }
        let offset = row.byte_offset.unwrap_or_default().0;
        let start = usize::try_from(offset).ok();
        let end = offset.checked_add(row.byte_length.0);
        let end = end.and_then(|end| usize::try_from(end).ok());
        // A file may be longer than the buffer it holds.
        let declared = usize::try_from(buffer.byte_length.0).unwrap_or(usize::MAX);
        let bytes = &bytes[..bytes.len().min(declared)];
        start.zip(end).and_then(|(start, end)| bytes.get(start..end)).ok_or_else(|| {
            Fault::new(object, format!("buffer view {view} is not inside buffer {}", row.buffer))
        })
    }
}
