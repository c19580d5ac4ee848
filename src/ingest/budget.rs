//! How much a file may ask for.

use super::error::Fault;

/// What any file may ask for, however small it is.
const FLOOR_BYTES: u64 = 1 << 30;

/// What a file may ask for besides, for each byte it holds. Sharing and compression make honest
/// files grow by less than this; a few hostile bytes that name one buffer a million times do not.
const BYTES_PER_BYTE: u64 = 64;

/// Memory that a file may still ask for, so that no small file can exhaust the machine.
pub(super) struct Budget {
    left_bytes: u64,
}

impl Budget {
    /// For a file that holds so many bytes, buffers included.
    pub(super) fn for_file(held_bytes: u64) -> Budget {
        Budget { left_bytes: FLOOR_BYTES.saturating_add(held_bytes.saturating_mul(BYTES_PER_BYTE)) }
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
            .remedy("share meshes between nodes rather than data between meshes")),
        }
    }
}
