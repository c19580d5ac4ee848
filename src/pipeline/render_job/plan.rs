//! Numbers of samples of an earlier picture, to be repeated.

use crate::render::Window;
use crate::render::exr::read_channel;
use std::io;
use std::path::Path;

/// Samples of each pixel of a picture.
pub(super) struct Counts {
    /// Which part of the whole picture it is.
    pub window: Window,
    /// Row after row.
    pub of_pixels: Vec<u32>,
}

/// More samples than this are an error in the file: a 32-bit float counts no further by ones.
const MOST: f32 = 16_777_216.0;

/// Reads the layer `sampleCount` of a picture.
pub(super) fn read_counts(path: &Path) -> io::Result<Counts> {
    let (window, values) = read_channel(path, "sampleCount")?;
    let count = |&value: &f32| {
        let is_count = (0.0..=MOST).contains(&value) && value.fract() == 0.0;
        is_count.then_some(value as u32).ok_or_else(|| {
            let path = path.display();
            let text =
                format!("{path}: its layer sampleCount has {value}, which is no number of samples");
            io::Error::new(io::ErrorKind::InvalidData, text)
        })
    };
    Ok(Counts { window, of_pixels: values.iter().map(count).collect::<io::Result<_>>()? })
}
