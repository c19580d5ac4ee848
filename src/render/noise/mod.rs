//! Noise: one measure of error, how it is estimated from a picture, and where further samples go.
//!
//! **The error of a pixel is how far it is off in the logarithm of its luminance plus the grey floor.** In
//! the light that is noise as a share of the light: 0.05 is 5 %, or a fourteenth of a stop. Where it is
//! darker than the [`Grey`] floor it is 5 % of the floor, because nobody looks for less. The error of a
//! frame is the root of the mean squared error of its pixels; pixels without any noise, such as a lamp that
//! is seen directly, do not count, or a frame would be the better the more of the sky it shows. To halve
//! the error takes four times the time.
//!
//! Every command and test uses this measure. A renderer does not know the converged picture. It keeps two
//! half pictures whose samples are scrambled independently; their difference tells the noise of their
//! mean, however well the samples of each are stratified (Owen 1997; the noise of *one* such sequence
//! cannot be told from its own samples). One difference is a rough number, so [`Estimate`] pools those of
//! neighbours. [`Allotment`] decides from it where samples are missing.
//!
//! Why the logarithm: an error relative to the luminance itself hangs on a few pixels in which light is
//! rare, and cannot be told from few samples. For small errors both are the same.
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

    /// The squared error between two luminances of a pixel.
    #[inline]
    pub fn squared_error(self, a: f64, b: f64) -> f64 {
        // The logarithm of the ratio, which is exact where the two are alike.
        let (a, b) = (a.max(0.0), b.max(0.0));
        let off = ((a - b) / (b + self.0)).ln_1p();
        off * off
    }

    /// The squared error that a small squared deviation of a luminance is.
    #[inline]
    pub fn of_deviation(self, squared: f64, luminance: f64) -> f64 {
        let scale = luminance.max(0.0) + self.0;
        // In two steps: the square of a small scale may be 0.
        squared / scale / scale
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

/// An error in stops.
pub fn stops(error: f64) -> f64 {
    error / std::f64::consts::LN_2
}

/// An error as a ratio of light to noise in decibels: 20 for 0.1, 40 for 0.01.
pub fn decibels(error: f64) -> f64 {
    -20.0 * error.log10()
}
