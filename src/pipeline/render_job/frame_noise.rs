//! What the noise of a frame has come to, and whether that is true.

use crate::light_tree::LightTree;
use crate::math::random::hash;
use crate::render::noise::{Grey, Halves, Reference, decibels};
use crate::render::passes::{ErrorGoal, Planned};
use crate::render::{Film, Progress, RenderDelegate, RenderError, RenderSettings};
use serde::{Deserialize, Serialize};

/// What the noise of a frame has come to; see [`noise`](crate::render::noise).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameNoise {
    /// Its error.
    pub error: f64,
    /// With 95 % certainty its error is at most this.
    pub bound: f64,
    /// The error in decibels.
    pub decibels: f64,
    /// The error that was asked for.
    pub asked: Option<f64>,
    /// The grey floor.
    pub grey: Grey,
    /// Samples of a pixel, in the mean.
    pub samples: f64,
    /// The most samples of any pixel.
    pub most: u32,
    /// Pixels that have as many samples as they may and are not settled.
    pub capped: usize,
    /// Pixels with samples that were infinite or no number.
    pub spoilt: usize,
    /// What an audit found.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub audit: Option<Audit>,
}

/// What some pixels, rendered again with more samples and another seed, say about a frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Audit {
    /// Pixels that were rendered again and have noise.
    pub pixels: usize,
    /// The error of the picture there, against what they came to.
    pub error: f64,
    /// The least and the most that the error of the frame is by that, with 95 % certainty.
    pub from: f64,
    /// See `from`.
    pub to: f64,
}

impl FrameNoise {
    /// Of a finished film, whose pixels may have had `allowed` samples; `None` without a grey floor, or
    /// with less than two samples.
    pub fn of(
        film: &Film,
        grey: Option<Grey>,
        asked: Option<f64>,
        allowed: u32,
    ) -> Option<FrameNoise> {
        let grey = grey?;
        let most = film.taken().iter().copied().max().filter(|&most| most > 1)?;
        let error = asked.unwrap_or(f64::INFINITY);
        let reached = ErrorGoal { error, grey, most: allowed }.reached(film);
        Some(FrameNoise {
            error: reached.frame.error,
            bound: reached.frame.bound,
            // JSON has no infinity.
            decibels: decibels(reached.frame.error).min(1e3),
            asked,
            grey,
            samples: film.samples() as f64 / film.taken().len() as f64,
            most,
            capped: reached.capped,
            spoilt: reached.spoilt,
            audit: None,
        })
    }
}

/// A pixel gets so many times its samples when it is rendered again.
const MORE: u32 = 16;
/// Quantile of the normal distribution, 97.5 %.
const Z: f64 = 1.96;

/// Renders some random pixels again, with more samples and another seed. The delegate's settings are those
/// of the audit afterwards.
pub(super) fn audit(
    delegate: &mut RenderDelegate,
    tree: &LightTree<&[u8]>,
    frame: i32,
    (film, grey): (&Film, Grey),
    settings: &RenderSettings,
    (pixels, progress): (u32, &impl Progress),
) -> Result<Audit, RenderError> {
    let mut counts = vec![0; film.taken().len()];
    for number in 0..pixels {
        let at = u64::from(hash(hash(settings.seed, frame as u32), !number));
        let at = ((at * counts.len() as u64) >> 32) as usize;
        counts[at] = film.taken()[at].saturating_mul(MORE);
    }
    let seed = hash(settings.seed, u32::MAX);
    delegate.set_settings(RenderSettings { seed, aovs: Vec::new(), ..settings.clone() });
    let mut again = delegate.film(frame)?;
    delegate.expose(tree, frame, &mut again, &mut Planned(counts.clone()), progress)?;
    let again = Reference::of(&again.halves(), again.window().width() as usize);
    let own: Vec<f64> = film.halves().iter().map(Halves::luminance).collect();
    let squares: Vec<f64> = counts
        .iter()
        .zip(again.squared_errors(&own, grey))
        .filter(|(count, square)| **count > 0 && *square != 0.0)
        .map(|(_, square)| square)
        .collect();
    let count = squares.len().max(1) as f64;
    let mean = squares.iter().sum::<f64>() / count;
    let spread: f64 = squares.iter().map(|square| (square - mean).powi(2)).sum();
    let off = Z * (spread / (count * (count - 1.0).max(1.0))).sqrt();
    let root = |square: f64| square.max(0.0).sqrt();
    Ok(Audit {
        pixels: squares.len(),
        error: root(mean),
        from: root(mean - off),
        to: root(mean + off),
    })
}
