//! What to say when the pages of a mapped file are lost.

#![allow(unsafe_code)]

use signal_hook::consts::SIGBUS;
use signal_hook::low_level;
use std::io;

const WORDS: &[u8] =
    b"candelabra: a tree file or a table was cut short or overwritten while it was in use, or its disk \
    failed; publish it under another name and rename it over the old one, then start again: \
    candelabra-render keeps finished frames under --resume\n";

/// A mapped file that gets shorter ends the process with SIGBUS when a missing part is read. Nothing can be
/// mended then, but the reason can be told. The process ends with `code`.
pub fn explain(code: i32) -> io::Result<()> {
    let explain = move || {
        // The only things that a signal handler may do: write, and leave.
        let _ = rustix::io::write(rustix::stdio::stderr(), WORDS);
        low_level::exit(code);
    };
    // SAFETY: the handler calls nothing but write(2) and _exit(2), which are safe in signal handlers.
    unsafe { low_level::register(SIGBUS, explain) }.map(drop)
}
