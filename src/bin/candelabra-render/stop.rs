//! Signals: what stops a render.

#![allow(unsafe_code)]

use signal_hook::consts::{SIGBUS, SIGINT, SIGTERM};
use signal_hook::{flag, low_level};
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed};

/// The signal that asked for a stop, if one did.
#[derive(Clone)]
pub struct Stop(Arc<AtomicUsize>);

impl Stop {
    /// Listens for Ctrl-C and SIGTERM. The first is noticed; a second one ends the process at once, with the
    /// code that a shell gives for the signal.
    pub fn listen() -> io::Result<Stop> {
        let (signal, again) = (Arc::new(AtomicUsize::new(0)), Arc::new(AtomicBool::new(false)));
        for number in [SIGINT, SIGTERM] {
            // In this order: the first signal does not yet find the flag set.
            flag::register_conditional_shutdown(number, 128 + number, again.clone())?;
            flag::register(number, again.clone())?;
            flag::register_usize(number, signal.clone(), number as usize)?;
        }
        explain_lost_pages()?;
        Ok(Stop(signal))
    }

    /// The number of the signal.
    pub fn signal(&self) -> Option<u8> {
        u8::try_from(self.0.load(Relaxed)).ok().filter(|&signal| signal > 0)
    }
}

/// A mapped file that gets shorter ends the process with SIGBUS when a missing part is read. Nothing can be
/// mended then, but the reason can be told.
fn explain_lost_pages() -> io::Result<()> {
    const WORDS: &[u8] = b"candelabra-render: the tree file was cut short or overwritten while it was in use, \
        or its disk failed. Finished frames are kept: publish trees under another name and rename them, \
        then render again with --resume\n";
    let explain = || {
        // The only things that a signal handler may do: write, and leave.
        let _ = rustix::io::write(rustix::stdio::stderr(), WORDS);
        low_level::exit(i32::from(super::BAD_TREE));
    };
    // SAFETY: the handler calls nothing but write(2) and _exit(2), which are safe in signal handlers.
    unsafe { low_level::register(SIGBUS, explain) }.map(drop)
}
