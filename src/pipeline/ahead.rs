//! What is found out about a shot before its frames are rendered, from small pictures of a few of them.
//!
//! Previews flicker if each process chooses an exposure from the frames that it happens to render, and
//! noise pumps if each chooses a grey floor. So both are chosen from frames of the scene, whatever frames
//! are asked for: the exposure from the first, the grey floor from [three](frames_of_grey). The knobs of
//! splitting are chosen by a [pilot](crate::render::knob::pilot) in the first.

use crate::light_tree::LightTree;
use crate::math::color::luminance;
use crate::render::beauty::Beauty;
use crate::render::knob::{Knobs, pilot_pays};
use crate::render::png::exposure_for;
use crate::render::{Progress, RenderDelegate, RenderError, RenderSettings, Split};
use std::time::Instant;

/// Rows of the small pictures.
const HEIGHT: u32 = 27;
/// Samples of each of their pixels.
const SAMPLES: u32 = 8;

/// What a small picture of a frame shows.
pub struct Glimpse {
    /// Stops that bring its middle to middle grey.
    pub exposure: f32,
    /// Of its pixels.
    pub luminances: Vec<f64>,
    /// Samples a second that were taken for it, by the clock.
    pub rate: f64,
}

/// Renders a small picture of a frame. The delegate must have `settings`, and has them afterwards.
///
/// # Errors
/// If the tree lacks the frame, or `progress` stops it.
pub fn glimpse(
    delegate: &mut RenderDelegate,
    settings: &RenderSettings,
    tree: &LightTree<&[u8]>,
    frame: i32,
    progress: &impl Progress,
) -> Result<Glimpse, RenderError> {
    let RenderSettings { width, height, .. } = *settings;
    let columns = u64::from(width) * u64::from(HEIGHT) / u64::from(height);
    delegate.set_settings(RenderSettings {
        width: columns.clamp(1, 4 * u64::from(HEIGHT)) as u32,
        height: HEIGHT,
        samples: SAMPLES,
        aovs: Vec::new(),
        light_groups: Vec::new(),
        crop: None,
        ..settings.clone()
    });
    let began = Instant::now();
    let rendered = delegate.render(tree, frame, progress);
    let seconds = began.elapsed().as_secs_f64();
    delegate.set_settings(settings.clone());
    let picture = Beauty::of(&rendered?.buffers, true);
    let luminances: Vec<f64> =
        picture.pixels.iter().map(|&color| f64::from(luminance(color))).collect();
    let rate = (luminances.len() * SAMPLES as usize) as f64 / seconds.max(1e-9);
    Ok(Glimpse { exposure: exposure_for(&picture), luminances, rate })
}

/// The frames of a scene that the grey floor is chosen from: the first, the middle and the last.
pub fn frames_of_grey(frames: &[i32]) -> Vec<i32> {
    let mut seen: Vec<i32> = [0, frames.len() / 2, frames.len().saturating_sub(1)]
        .iter()
        .filter_map(|&at| frames.get(at).copied())
        .collect();
    seen.dedup();
    seen
}

/// The settings with the knobs of splitting that are best for the shot. `pilot` asks the delegate, and is
/// called only if there is anything to find out. Where time decides how many samples there will be, `in_time` has
/// how many of a pixel the time is likely to pay for. The pilot is for that many, or for the usual number if that
/// is less, so that it takes no more than its share of the time.
///
/// # Errors
/// Those of `pilot`.
pub fn with_knobs<E>(
    delegate: &mut RenderDelegate,
    settings: &RenderSettings,
    in_time: Option<u32>,
    pilot: impl FnOnce(&RenderDelegate) -> Result<Knobs, E>,
) -> Result<RenderSettings, E> {
    let usual = RenderSettings::default().samples;
    let samples = in_time.map_or(settings.samples, |paid| settings.samples.min(usual).min(paid));
    let asked = RenderSettings { samples, ..settings.clone() };
    let knobs = match pilot_pays(&asked) {
        true => {
            delegate.set_settings(asked);
            let knobs = pilot(delegate);
            delegate.set_settings(settings.clone());
            knobs?
        }
        false => settings.split.knobs(),
    };
    Ok(RenderSettings { split: Split::ByBounce(knobs), ..settings.clone() })
}
