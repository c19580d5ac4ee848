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
//! half pictures whose samples are scrambled independently; their difference tells the variance of their mean,
//! however well the samples of each are stratified (Owen 1997; the noise of *one* such sequence cannot be told
//! from its own samples). How far off that is in the logarithm depends on how samples miss light ([`Halves`]).
//! One pixel's number is rough, so [`Estimate`] pools those of
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

    /// The floor of pictures with these luminances: a tenth of the geometric mean of what is lit.
    pub fn of(luminances: impl Iterator<Item = f64>) -> Grey {
        let lit = luminances.filter(|light| *light > 0.0 && light.is_finite());
        let (sum, count) =
            lit.fold((0.0, 0.0), |(sum, count), light| (sum + light.log2(), count + 1.0));
        Grey::below(if count > 0.0 { f64::exp2(sum / count) } else { 0.0 })
    }

    /// A floor; positive and finite, or `None`.
    pub fn new(luminance: f64) -> Option<Grey> {
        (luminance > 0.0 && luminance.is_finite()).then_some(Grey(luminance))
    }

    /// The floor of pictures whose middle is at a luminance. Of black pictures, which tell of none, it is that of middle
    /// grey, 0.18 of white: relative to no floor at all, the first light would be an error without end.
    pub fn below(middle: f64) -> Grey {
        Grey::new(Grey::SHARE * middle).unwrap_or(Grey(Grey::SHARE * 0.18))
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

/// An error as a ratio of light to noise in decibels: 20 for 0.1, 40 for 0.01.
pub fn decibels(error: f64) -> f64 {
    -20.0 * error.log10()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Over many decades: small errors are deviations over light and floor; the unit does not show; order
        /// does not matter; and no error is larger than its deviation over the floor.
        #[test]
        fn the_error_is_relative_in_the_light_and_absolute_in_the_dark(
            log_grey in -30.0..30.0f64,
            log_light in -6.0..6.0f64,
            log_off in -8.0..3.0f64,
        ) {
            let grey = Grey::new(10f64.powf(log_grey)).unwrap();
            let light = grey.luminance() * 10f64.powf(log_light);
            let scale = light + grey.luminance();
            let off = 10f64.powf(log_off) * scale;
            let error = grey.squared_error(light + off, light).sqrt();
            if log_off < -3.0 {
                let deviation = grey.of_deviation(off * off, light).sqrt();
                prop_assert!((error / deviation - 1.0).abs() < 2e-3, "{error} {deviation}");
            }
            let back = grey.squared_error(light, light + off).sqrt();
            prop_assert!((back / error - 1.0).abs() < 1e-6, "{error} {back}");
            let unit = Grey::new(1.0).unwrap();
            let scaled = unit.squared_error((light + off) / grey.luminance(), light / grey.luminance());
            prop_assert!((scaled.sqrt() / error - 1.0).abs() < 1e-4, "{error} {scaled}");
            prop_assert!(error <= off / grey.luminance() * 1.000_001);
        }
    }

    #[test]
    fn pictures_without_light_have_the_floor_of_middle_grey() {
        let floor = Grey::of([0.0, f64::NAN, f64::INFINITY].into_iter());
        assert_eq!(floor, Grey::below(0.18));
        assert_eq!(floor.squared_error(0.0, 0.0), 0.0);
        assert!((Grey::of([0.0, 1.0, 100.0].into_iter()).luminance() - 1.0).abs() < 1e-9);
        assert_eq!([Grey::new(0.0), Grey::new(f64::NAN), Grey::new(-1.0)], [None; 3]);
    }

    #[test]
    fn an_error_of_a_hundredth_is_forty_decibels() {
        assert!((decibels(0.01) - 40.0).abs() < 1e-9);
    }
}
