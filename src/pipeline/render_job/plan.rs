//! What an earlier picture tells of its samples, to be repeated.

use crate::pipeline::Stamp;
use crate::render::Window;
use crate::render::exr::read_channel;
use crate::render::knob::Knobs;
use std::io;
use std::path::Path;

/// How a picture was sampled.
pub struct Plan {
    /// Which part of the whole picture it is.
    pub window: Window,
    /// Samples of each pixel, row after row.
    pub counts: Vec<u32>,
    /// The knobs of splitting, if the picture tells them.
    pub knobs: Option<Knobs>,
}

/// More samples than this are an error in the file: a 32-bit float counts no further by ones.
const MOST: f32 = 16_777_216.0;

/// Reads the layer `sampleCount` of a picture, and its stamp.
pub(super) fn read_plan(path: &Path) -> io::Result<Plan> {
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
    let counts = values.iter().map(count).collect::<io::Result<_>>()?;
    let knobs = Stamp::of_picture(path).and_then(|stamp| stamp.knobs);
    Ok(Plan { window, counts, knobs })
}
