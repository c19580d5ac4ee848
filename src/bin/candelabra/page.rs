//! Writing a page.

use anyhow::{Result, bail};
use candelabra::store::write_atomically;
use std::io::Write;
use std::path::Path;

/// Writes a page that was made from some inputs, unless it would replace one of them.
pub fn write(page: &Path, html: &str, inputs: &[&Path]) -> Result<()> {
    let real = |path: &Path| path.canonicalize().ok();
    if inputs.iter().any(|input| real(page).is_some() && real(input) == real(page)) {
        bail!("{}: is what the page would be about; choose another name for it", page.display());
    }
    write_atomically(page, |file| file.write_all(html.as_bytes()))?;
    Ok(())
}
