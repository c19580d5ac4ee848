//! Standard error, for notes and errors.

use candelabra::page::Plain;
use std::fmt::Display;
use std::io::Write;

/// Says a line. A reader that has gone (`2>&1 | head`) ends nothing.
pub fn say(line: impl Display) {
    let _ = writeln!(std::io::stderr(), "{}", Plain(line));
}
