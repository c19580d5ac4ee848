//! The bytes behind buffers and buffer views.

use super::container::Container;
use super::document::{Document, label};
use crate::ingest::error::Fault;
use crate::ingest::uri::Folder;
use gltf::json::Index;
use gltf::json::buffer::View;
use std::borrow::Cow;

const GIT_LFS_POINTER: &[u8] = b"version https://git-lfs.github.com/spec/";

/// The bytes of every buffer that a buffer view refers to. A buffer without a source (the fallback of a
/// compression, say) is empty.
pub(super) struct Buffers<'a> {
    buffers: Vec<Cow<'a, [u8]>>,
}

impl<'a> Buffers<'a> {
    pub(super) fn read(
        document: &Document,
        file: &'a Container,
        folder: &Folder,
    ) -> Result<Buffers<'a>, Fault> {
        let mut buffers = vec![Cow::Borrowed(&[][..]); document.buffers.len()];
        // How many bytes of each buffer its views reach for.
        let mut reach = vec![0u64; buffers.len()];
        for view in &document.buffer_views {
            let end = view.byte_offset.unwrap_or_default().0.saturating_add(view.byte_length.0);
            if let Some(reach) = reach.get_mut(view.buffer.value()) {
                *reach = end.max(*reach);
            }
        }
        for (i, buffer) in document.buffers.iter().enumerate().filter(|(i, _)| reach[*i] > 0) {
            let object = label("buffer", i, None);
            let bytes = match &buffer.uri {
                Some(uri) => Cow::Owned(folder.read_uri(uri, &object)?),
                None => match file.binary() {
                    Some(binary) if i == 0 => Cow::Borrowed(binary),
                    None if i == 0 && file.is_glb() => {
                        let problem = "should be the file's binary chunk, which is absent";
                        return Err(Fault::new(object, problem)
                            .remedy("the file is damaged; fetch or export it again"));
                    }
                    _ => continue,
                },
            };
            if bytes.starts_with(GIT_LFS_POINTER) {
                return Err(Fault::new(object, "is a Git LFS pointer, not the data")
                    .remedy("run git lfs pull"));
            }
            let (declared, length) = (buffer.byte_length.0, bytes.len() as u64);
            if length < declared && length < reach[i] {
                let problem = format!("declares {declared} bytes, but there are {length}");
                return Err(Fault::new(object, problem)
                    .remedy("the buffer is truncated or another's; fetch or export it again"));
            }
            buffers[i] = bytes;
        }
        Ok(Buffers { buffers })
    }

    /// How many bytes all buffers hold.
    pub(super) fn size(&self) -> u64 {
        self.buffers.iter().map(|bytes| bytes.len() as u64).sum()
    }

    /// The bytes of a buffer view, else what is wrong with it.
    pub(super) fn view(&self, document: &Document, view: Index<View>) -> Result<&[u8], String> {
        let absent = || format!("refers to absent buffer view {view}");
        let row = document.get(view).ok_or_else(absent)?;
        let bytes = self.buffers.get(row.buffer.value()).ok_or_else(absent)?;
        if bytes.is_empty() {
            return Err(format!("its data should be in buffer {}, which has none", row.buffer));
        }
        let offset = row.byte_offset.unwrap_or_default().0;
        let start = usize::try_from(offset).ok();
        let end = offset.checked_add(row.byte_length.0);
        let end = end.and_then(|end| usize::try_from(end).ok());
        start
            .zip(end)
            .and_then(|(start, end)| bytes.get(start..end))
            .ok_or_else(|| format!("buffer view {view} is not inside buffer {}", row.buffer))
    }
}
