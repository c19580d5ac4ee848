//! How much memory a file may ask for.

use super::error::Fault;

/// Memory that a file may still ask for: some however small it is, and more for each byte it
/// holds. Sharing and compression make honest files grow by less; a few hostile bytes that name
/// one buffer a million times, or declare an enormous picture, do not exhaust the machine.
pub(super) struct Budget {
    left_bytes: u64,
    bytes_per_byte: u64,
}

impl Budget {
    /// For rows of the file, nodes, vertices and keys. A node of a few letters takes a hundred times as
    /// much memory.
    pub(super) fn for_geometry() -> Budget {
        Budget { left_bytes: 256 << 20, bytes_per_byte: 128 }
    }

    /// For pictures: one of a single colour compresses a thousandfold, so more to begin with.
    pub(super) fn for_pictures() -> Budget {
        Budget { left_bytes: 2 << 30, bytes_per_byte: 256 }
    }

    /// Says that bytes were read which the memory can be asked for.
    pub(super) fn grow(&mut self, held_bytes: u64) {
        let more = held_bytes.saturating_mul(self.bytes_per_byte);
        self.left_bytes = self.left_bytes.saturating_add(more);
    }

    /// Says that memory which was asked for is free again. Who does this has spent no more time on it than on what
    /// is kept.
    pub(super) fn put_back(&mut self, bytes: u64) {
        self.left_bytes = self.left_bytes.saturating_add(bytes);
    }

    /// Asks for memory before it is allocated. The object names who asks.
    pub(super) fn take(
        &mut self,
        bytes: u64,
        object: impl FnOnce() -> String,
    ) -> Result<(), Fault> {
        match self.left_bytes.checked_sub(bytes) {
            Some(left) => {
                self.left_bytes = left;
                Ok(())
            }
            None => Err(Fault::new(
                object(),
                format!("needs {bytes} more bytes of memory, out of proportion to the file's size"),
            )
            .remedy("share meshes between nodes rather than data between meshes; scale pictures")),
        }
    }
}
