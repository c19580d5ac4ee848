//! The converged picture that others are compared with.
//!
//! It is made of two halves with scrambles of their own and with seeds that no other picture has: pictures of
//! the same seed share their noise and would seem better than they are. The halves' difference tells the
//! noise of their mean, so that it can be taken off every comparison.

use super::picture::luminances;
use crate::render::beauty::Beauty;
use crate::render::noise::{Grey, Reference};

/// A converged picture.
pub struct Converged {
    /// What is compared with.
    pub reference: Reference,
    /// What is shown.
    pub beauty: Beauty,
    /// The grey floor of all comparisons.
    pub grey: Grey,
    /// Its own error.
    pub error: f64,
}

impl Converged {
    /// Of two halves of one size. The grey floor follows from the picture unless it is given.
    pub fn of(halves: &[Beauty; 2], grey: Option<Grey>) -> Converged {
        let [a, b] = halves.each_ref().map(luminances);
        let Beauty { width, height, .. } = halves[0];
        let pixels = halves[0].pixels.iter().zip(&halves[1].pixels);
        let pixels = pixels.map(|(a, b)| 0.5 * (*a + *b)).collect();
        let reference = Reference {
            width: width as usize,
            halves: a.into_iter().zip(b).map(Into::into).collect(),
        };
        let grey = grey.unwrap_or_else(|| Grey::of(reference.luminance()));
        let noisy: Vec<f64> = reference
            .halves
            .iter()
            .filter(|[a, b]| a != b)
            // The mean of two has a quarter of the squared error between them.
            .map(|&[a, b]| 0.25 * grey.squared_error(a, b))
            .collect();
        let error = (noisy.iter().sum::<f64>() / noisy.len().max(1) as f64).sqrt();
        Converged { reference, beauty: Beauty { width, height, pixels }, grey, error }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::color::Rgb;

    #[test]
    fn the_error_of_a_reference_is_that_of_the_mean_of_its_halves() {
        let half =
            |light: f32| Beauty { width: 2, height: 1, pixels: vec![Rgb::splat(light), Rgb::ONE] };
        let converged = Converged::of(&[half(2.1), half(1.9)], Grey::new(2.0));
        let light: Vec<f64> = converged.reference.luminance().collect();
        assert!(light.iter().zip([2.0, 1.0]).all(|(a, b)| (a - b).abs() < 1e-6));
        // A deviation of 0.1 over the light and the floor; the pixel without noise does not count.
        assert!((converged.error - 0.025).abs() < 1e-4, "{}", converged.error);
        let floor = Converged::of(&[half(3.0), half(1.0)], None).grey;
        assert!((floor.luminance() - 0.1 * 2.0_f64.sqrt()).abs() < 1e-6);
    }
}
