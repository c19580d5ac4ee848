//! Writing a page.

use anyhow::{Result, bail};
use candelabra::store::{check_writable, write_atomically};
use std::io::Write;
use std::path::Path;

/// Checks beforehand that a page can be written and does not overwrite one of its inputs.
pub fn check(page: &Path, inputs: &[&Path]) -> Result<()> {
    let real = |path: &Path| path.canonicalize().ok();
    if inputs.iter().any(|input| real(page).is_some() && real(input) == real(page)) {
        bail!("{}: is what the page would be about; choose another name for it", page.display());
    }
    check_writable(page)?;
    Ok(())
}

/// Writes a page that has been checked.
pub fn write(page: &Path, html: &str) -> Result<()> {
    write_atomically(page, |file| file.write_all(html.as_bytes()))?;
    Ok(())
}
