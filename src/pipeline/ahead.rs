//! What a shot looks like, from small pictures of a few of its frames.
//!
//! Previews flicker if each process chooses an exposure from the frames that it happens to render, and
//! noise pumps if each chooses a grey floor. So both are chosen from frames of the scene, whatever frames
//! are asked for: the exposure from the first, the grey floor from the first, the middle and the last.

use super::shot::Shot;
use crate::light_tree::LightTree;
use crate::math::color::luminance;
use crate::pipeline::Watch;
use crate::render::beauty::Beauty;
use crate::render::png::exposure_for;
use crate::render::{Progress, RenderDelegate, RenderError, RenderSettings};

/// Rows of the small pictures.
const HEIGHT: u32 = 27;
/// Samples of each of their pixels.
const SAMPLES: u32 = 8;

/// A small picture of a frame.
pub(super) struct Glimpse {
    /// Stops that bring its middle to middle grey.
    pub exposure: f32,
    /// Of its pixels.
    pub luminances: Vec<f64>,
}

/// Looks at a frame.
///
/// # Errors
/// If the tree lacks the frame, or the job is stopped.
pub(super) fn glimpse(
    shot: &Shot,
    delegate: &mut RenderDelegate,
    tree: &LightTree<&[u8]>,
    frame: i32,
    watch: &dyn Watch,
) -> Result<Glimpse, RenderError> {
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
    let picture = Beauty::of(&rendered?.buffers, true);
    let luminances = picture.pixels.iter().map(|&color| f64::from(luminance(color))).collect();
    Ok(Glimpse { exposure: exposure_for(&picture), luminances })
}

/// Tells nothing, and hears when to stop.
struct Patience<'a>(&'a dyn Watch);

impl Progress for Patience<'_> {
    fn is_stopped(&self) -> bool {
        self.0.is_stopped()
    }
}
