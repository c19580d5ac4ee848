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
    /// Sum of the logarithms of the luminance of its lit pixels, to base 2, and how many they are.
    pub lit: (f64, f64),
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
    let lights = picture.pixels.iter().map(|&color| f64::from(luminance(color)));
    let lit = lights
        .filter(|light| *light > 0.0 && light.is_finite())
        .fold((0.0, 0.0), |(sum, count), light| (sum + light.log2(), count + 1.0));
    Ok(Glimpse { exposure: exposure_for(&picture), lit })
}

/// The middle luminance of some pictures: the geometric mean over all that is lit, 0 if nothing is.
pub(super) fn middle<'a>(glimpses: impl Iterator<Item = &'a Glimpse>) -> f64 {
    let add = |(sum, count), glimpse: &Glimpse| (sum + glimpse.lit.0, count + glimpse.lit.1);
    let (sum, count) = glimpses.fold((0.0, 0.0), add);
    if count > 0.0 { f64::exp2(sum / count) } else { 0.0 }
}

/// Tells nothing, and hears when to stop.
struct Patience<'a>(&'a dyn Watch);

impl Progress for Patience<'_> {
    fn is_stopped(&self) -> bool {
        self.0.is_stopped()
    }
}
