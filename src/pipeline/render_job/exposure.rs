//! One exposure for a shot.
//!
//! Previews flicker if each process chooses an exposure from the frames that it happens to render. So it is
//! chosen from a small picture of the scene's first frame, whatever frames are asked for.

use super::shot::Shot;
use crate::light_tree::LightTree;
use crate::pipeline::Watch;
use crate::render::beauty::Beauty;
use crate::render::png::exposure_for;
use crate::render::{Progress, RenderDelegate, RenderError, RenderSettings};

/// Rows of the small picture.
const HEIGHT: u32 = 54;
/// Samples of each of its pixels.
const SAMPLES: u32 = 16;

/// Stops that bring the middle of a frame to middle grey.
///
/// # Errors
/// If the tree lacks the frame, or the job is stopped.
pub(super) fn of_frame(
    shot: &Shot,
    delegate: &mut RenderDelegate,
    tree: &LightTree<&[u8]>,
    frame: i32,
    watch: &dyn Watch,
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
    let rendered = delegate.render(tree, frame, &Patience(watch));
    delegate.set_settings(shot.settings.clone());
    Ok(exposure_for(&Beauty::of(&rendered?.buffers, true)))
}

/// Tells nothing, and hears when to stop.
struct Patience<'a>(&'a dyn Watch);

impl Progress for Patience<'_> {
    fn rows_done(&self, _: u64) {}

    fn is_stopped(&self) -> bool {
        self.0.is_stopped()
    }
}
