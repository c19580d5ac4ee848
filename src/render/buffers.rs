//! Render buffers (AOVs): what a render leaves behind for each pixel.

use crate::math::color::Rgb;
use glam::Vec3;

/// The finished values of one pixel: means over its samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pixel {
    /// Linear radiance in the scene's unit times the camera's exposure scale, premultiplied by `alpha`.
    pub beauty: Rgb,
    /// Coverage in `[0, 1]`.
    pub alpha: f32,
    /// Metres in front of the camera along its axis; infinite where nothing was hit.
    pub depth_m: f32,
    /// Shading normal of the first hit, world space; zero where nothing was hit.
    pub normal: Vec3,
    /// Reflectance of the first hit.
    pub albedo: Rgb,
    /// Variance of the mean in `beauty` (not of a sample), in its unit squared.
    pub variance: Rgb,
    /// Samples taken.
    pub samples: u32,
}

impl Default for Pixel {
    /// A pixel that saw nothing.
    fn default() -> Self {
        Pixel {
            beauty: Rgb::ZERO,
            alpha: 0.0,
            depth_m: f32::INFINITY,
            normal: Vec3::ZERO,
            albedo: Rgb::ZERO,
            variance: Rgb::ZERO,
            samples: 0,
        }
    }
}

/// All pixels of a frame, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderBuffers {
    width: u32,
    height: u32,
    pixels: Vec<Pixel>,
}

impl RenderBuffers {
    /// Pixels that saw nothing. Both sizes must be at least 1.
    pub fn new(width: u32, height: u32) -> RenderBuffers {
        let pixels = vec![Pixel::default(); width as usize * height as usize];
        RenderBuffers { width, height, pixels }
    }

    /// Columns.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Bytes of all values.
    pub fn byte_length(&self) -> u64 {
        size_of_val(self.pixels()) as u64
    }

    /// All pixels, row after row.
    pub fn pixels(&self) -> &[Pixel] {
        &self.pixels
    }

    /// All pixels, row after row; split it by [`width`](Self::width) to fill rows in parallel.
    pub fn pixels_mut(&mut self) -> &mut [Pixel] {
        &mut self.pixels
    }
}
