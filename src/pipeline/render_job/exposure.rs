//! One exposure for a shot.
//!
//! Previews flicker if each process chooses an exposure from the frames that it happens to render. So it is
//! chosen from a small picture of the scene's first frame, whatever frames are asked for.

use super::shot::Shot;
use crate::pipeline::frames_of;
use crate::render::beauty::Beauty;
use crate::render::png::exposure_for;
use crate::render::{RenderDelegate, RenderError, RenderSettings};

/// Rows of the small picture.
const HEIGHT: u32 = 54;
/// Samples of each of its pixels.
const SAMPLES: u32 = 16;

/// Stops that bring the middle of the scene's first frame to middle grey.
///
/// # Errors
/// If the tree lacks that frame.
pub(super) fn of_shot<D: AsRef<[u8]> + Sync>(
    shot: &Shot,
    delegate: &mut RenderDelegate<D>,
) -> Result<f32, RenderError> {
    let RenderSettings { width, height, .. } = shot.settings;
    let columns = u64::from(width) * u64::from(HEIGHT) / u64::from(height);
    delegate.set_settings(RenderSettings {
        width: columns.clamp(1, 4 * u64::from(HEIGHT)) as u32,
        height: HEIGHT,
        samples: SAMPLES,
        aovs: Vec::new(),
        light_groups: Vec::new(),
        crop: None,
        ..shot.settings.clone()
    });
    let frame = frames_of(&shot.scene)[0];
    let rendered = delegate.render(frame, &());
    delegate.set_settings(shot.settings.clone());
    Ok(exposure_for(&Beauty::of(&rendered?.buffers, true)))
}
