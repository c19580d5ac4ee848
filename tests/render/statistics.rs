//! What a noisy picture says, and how sure it is of it.

use candelabra::render::buffers::RenderBuffers;
use glam::{DVec3, Vec3};
use std::fmt;

/// The layers that are written unless others are asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pixel {
    pub beauty: Vec3,
    pub alpha: f32,
    pub depth_m: f32,
    pub variance: Vec3,
}

/// All pixels of a picture, row after row.
pub fn pixels(buffers: &RenderBuffers) -> Vec<Pixel> {
    let plane = |name: &str| {
        let values = buffers.channel(name).unwrap_or_else(|| panic!("there is no {name}"));
        values.collect::<Vec<f32>>()
    };
    let [alpha, depth, x, y, z] = ["A", "Z", "variance.R", "variance.G", "variance.B"].map(plane);
    let pixel = |(i, beauty): (usize, Vec3)| Pixel {
        beauty,
        alpha: alpha[i],
        depth_m: depth[i],
        variance: Vec3::new(x[i], y[i], z[i]),
    };
    buffers.beauty().enumerate().map(pixel).collect()
}

/// A mean with the standard error that the picture's own variance buffer gives it. Sobol samples
/// are better than independent ones, so the error is an upper bound, often a generous one.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    pub mean: DVec3,
    pub error: DVec3,
}

impl Estimate {
    /// Of the mean over some pixels.
    pub fn of<'a>(pixels: impl IntoIterator<Item = &'a Pixel>) -> Estimate {
        let (mut count, mut sum, mut variance) = (0.0, DVec3::ZERO, DVec3::ZERO);
        for pixel in pixels {
            count += 1.0;
            sum += pixel.beauty.as_dvec3();
            variance += pixel.variance.as_dvec3();
        }
        Estimate { mean: sum / count, error: root(variance) / count }
    }

    /// Of the whole picture.
    pub fn of_picture(buffers: &RenderBuffers) -> Estimate {
        Estimate::of(&pixels(buffers))
    }

    /// Of the mean difference between two pictures, from the spread of the pixels' differences. Each
    /// pixel has samples of its own, so this is what the error really is.
    pub fn of_difference(a: &RenderBuffers, b: &RenderBuffers) -> Estimate {
        let pairs = || a.beauty().zip(b.beauty());
        let differences = || pairs().map(|(a, b)| a.as_dvec3() - b.as_dvec3());
        let count = a.beauty().count() as f64;
        let mean = differences().sum::<DVec3>() / count;
        let spread = differences().map(|d| (d - mean) * (d - mean)).sum::<DVec3>();
        let variance = spread / (count * (count - 1.0));
        Estimate { mean, error: root(variance) }
    }

    /// The largest standard error of a channel, as a share of its mean.
    pub fn relative_error(&self) -> f64 {
        (self.error / self.mean).max_element()
    }

    /// How many standard errors lie between two estimates, in the channel where it is most.
    pub fn distance(&self, other: &Estimate) -> f64 {
        let error = root(self.error * self.error + other.error * other.error);
        Estimate { mean: self.mean - other.mean, error }.distance_from_zero(self.mean)
    }

    /// How many standard errors lie between a difference and nothing. Numbers without any noise may
    /// still differ by the rounding of what they are the difference of.
    pub fn distance_from_zero(&self, of: DVec3) -> f64 {
        (self.mean.abs() / (self.error + 1e-5 * of + f64::MIN_POSITIVE)).max_element()
    }
}

impl fmt::Display for Estimate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.5} +- {:.5}", self.mean, self.error)
    }
}

fn root(squares: DVec3) -> DVec3 {
    DVec3::from_array(squares.to_array().map(f64::sqrt))
}

/// Asserts that an evenly grey picture shows a number, within five standard errors, and that these
/// are small: `precision` bounds them as a share of the number. The pixels, each of which has a
/// sequence of its own, are so many measurements of the same thing: their spread is the error.
#[track_caller]
pub fn assert_even(what: &str, buffers: &RenderBuffers, expected: f64, precision: f64) {
    let count = buffers.beauty().count() as f64;
    for channel in 0..3 {
        let values = || buffers.beauty().map(|beauty| f64::from(beauty[channel]));
        let mean = values().sum::<f64>() / count;
        let spread = values().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0);
        let error = (spread / count).sqrt();
        let told = format!("{what}: {mean} +- {error}, expected {expected}");
        assert!(error <= precision * expected, "{told}: too noisy to tell");
        // The roundings of a path are allowed for where there is no noise at all.
        let off = mean - expected;
        assert!(
            off.abs() <= 5.0 * error + 1e-4 * expected,
            "{told}: {:+.3} %",
            100.0 * off / expected
        );
    }
}

/// The pixels of a picture in squares of `side`, each with its place.
pub fn blocks(buffers: &RenderBuffers, side: u32) -> impl Iterator<Item = Vec<usize>> {
    let (width, height) = (buffers.width(), buffers.height());
    let columns = width.div_ceil(side);
    (0..columns * height.div_ceil(side)).map(move |block| {
        let (left, top) = (block % columns * side, block / columns * side);
        let rows = top..(top + side).min(height);
        rows.flat_map(|y| (left..(left + side).min(width)).map(move |x| (y * width + x) as usize))
            .collect()
    })
}
