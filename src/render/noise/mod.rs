//! Noise: one measure of error, how it is estimated from a picture, and where further samples go.
//!
//! **The error of a pixel is the standard deviation of its luminance over that luminance plus the grey
//! floor.** Where a picture is bright, 0.05 is noise of 5 % of the light; where it is darker than the
//! [`Grey`] floor, 5 % of the floor, because nobody looks for less. The error of a frame is the
//! root of the mean squared error of its pixels; pixels without any noise, such as a lamp that is seen
//! directly, do not count, or a frame would be the better the more of the sky it shows. Halving the error
//! takes four times the time.
//!
//! Every command and test uses this measure. A renderer does not know the true deviation. It keeps two half
//! pictures whose samples are scrambled independently; their difference tells the noise of their
//! mean without bias, however well the samples of each are stratified (Owen 1997; the variance of
//! *one* such sequence cannot be told from its own samples). One difference is a rough number, so
//! [`Estimate`] pools those of neighbours. [`Allotment`] decides from it where samples are missing.
//!
//! | module | question |
//! |---|---|
//! | [`estimate`] | how noisy is a picture in the making, and how sure is that? |
//! | [`allotment`] | how many samples should each pixel have? |
//! | [`compare`] | how far off is a picture from a converged one? |
//! | `tent` | what is around a pixel? |

pub mod allotment;
pub mod compare;
pub mod estimate;
mod tent;

pub use allotment::{Allotment, mask};
pub use compare::{Compared, Reference};
pub use estimate::{Estimate, FrameError, Halves};

use serde::{Deserialize, Serialize};

/// The grey floor: the luminance below which error is absolute, in the unit of the picture.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Grey(f64);

impl Grey {
    /// The floor that is this share of a shot's middle luminance, unless another one is asked for.
    pub const SHARE: f64 = 0.1;

    /// A floor; positive and finite, or `None`.
    pub fn new(luminance: f64) -> Option<Grey> {
        (luminance > 0.0 && luminance.is_finite()).then_some(Grey(luminance))
    }

    /// The floor of pictures whose middle is at a luminance. Black pictures have the smallest floor there
    /// is.
    pub fn below(middle: f64) -> Grey {
        Grey::new(Grey::SHARE * middle).unwrap_or(Grey(f64::MIN_POSITIVE))
    }

    /// Its luminance.
    pub fn luminance(self) -> f64 {
        self.0
    }

    /// The squared error of a pixel: a variance of its luminance, relative to that luminance.
    #[inline]
    pub fn squared_error(self, variance: f64, luminance: f64) -> f64 {
        let scale = luminance.max(0.0) + self.0;
        // In two steps: the square of a small scale may be 0.
        variance / scale / scale
    }
}

/// The mean of a number over each pixel and what is around it.
///
/// # Panics
/// If the values are not whole rows.
pub fn pool(values: &[f64], width: usize) -> Vec<f64> {
    let weights = tent::around(&vec![1.0; values.len()], width, 1.0);
    let sums = tent::around(values, width, 1.0);
    sums.iter().zip(weights).map(|(sum, weight)| sum / weight).collect()
}

/// An error as a ratio of light to noise in decibels: 20 for 0.1, 40 for 0.01.
pub fn decibels(error: f64) -> f64 {
    -20.0 * error.log10()
}
