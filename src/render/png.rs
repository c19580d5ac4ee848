//! A preview that any viewer shows: 8-bit sRGB PNG.
//!
//! Not a measurement: the EXR beside it is. Beauty is scaled by `2^exposure`, bent by Narkowicz's
//! fit of the ACES film curve (2016; 1 becomes 0.80, whites roll off) and encoded as sRGB, over
//! black. A part of a frame gives a preview of that part alone. Scenes in photometric units are thousands of nits bright, so the exposure can be chosen
//! from the picture: [`exposure_for`].

use super::buffers::RenderBuffers;
use crate::math::color::{Rgb, linear_to_srgb, luminance};
use crate::store::write_atomically;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use std::io;
use std::path::Path;

/// What the middle of a picture is exposed for.
const MIDDLE_GREY: f64 = 0.18;

/// Writes the preview, all or nothing.
pub fn write_png(path: &Path, buffers: &RenderBuffers, exposure_stops: f32) -> io::Result<()> {
    let scale = exposure_stops.exp2();
    let encode = |linear: f32| (linear_to_srgb(film(linear * scale)) * 255.0 + 0.5) as u8;
    let bytes: Vec<u8> =
        buffers.beauty().flat_map(|beauty| beauty.to_array().map(encode)).collect();
    write_atomically(path, |file| {
        PngEncoder::new(file)
            .write_image(&bytes, buffers.width(), buffers.height(), ExtendedColorType::Rgb8)
            .map_err(io::Error::other)
    })
}

/// Stops that bring the geometric mean of the lit pixels' luminance to middle grey; 0 for a black
/// picture.
pub fn exposure_for(buffers: &RenderBuffers) -> f32 {
    let lit = |color: Rgb| Some(f64::from(luminance(color))).filter(|y| *y > 0.0 && y.is_finite());
    let (sum, count) = buffers
        .beauty()
        .filter_map(lit)
        .fold((0.0, 0_u32), |(sum, count), y| (sum + y.log2(), count + 1));
    if count == 0 { 0.0 } else { (MIDDLE_GREY.log2() - sum / f64::from(count)) as f32 }
}

/// The film curve, from `[0, inf)` to `[0, 1]`; what is not a number is black.
fn film(x: f32) -> f32 {
    // Beyond 1e4 it is 1 to eight bits, and infinity over infinity is avoided.
    let x = if x.is_nan() { 0.0 } else { x.clamp(0.0, 1e4) };
    (x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::crop::Window;
    use crate::render::layers::layers_of;

    fn black(width: u32, height: u32) -> RenderBuffers {
        let window = Window::whole(width, height);
        RenderBuffers::new([width, height], window, layers_of(&[], true, &[]))
    }

    #[test]
    fn brighter_stays_brighter_and_wild_values_stay_inside() {
        let steps: Vec<f32> = (0..200).map(|i| film((i as f32 - 100.0).exp2())).collect();
        assert!(steps.windows(2).all(|pair| pair[0] <= pair[1]));
        assert_eq!(film(f32::INFINITY), 1.0);
        assert_eq!((film(f32::NAN), film(-1.0), film(0.0)), (0.0, 0.0, 0.0));
    }

    #[test]
    fn the_exposure_brings_any_brightness_to_the_middle() {
        for level in [1e-6, 1.0, 1e9] {
            let mut buffers = black(8, 8);
            (0..64).for_each(|i| buffers.set(i % 8, i / 8, &[level; 4]));
            buffers.set(0, 0, &[f32::NAN; 4]);
            buffers.set(1, 0, &[0.0; 4]);
            let scaled = level * exposure_for(&buffers).exp2();
            assert!((scaled / 0.18 - 1.0).abs() < 1e-4);
        }
        assert_eq!(exposure_for(&black(2, 2)), 0.0);
    }

    #[test]
    fn the_file_reads_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("p/preview.png");
        let mut buffers = black(3, 2);
        buffers.set(1, 1, &[1e6, 0.0, f32::NAN, 1.0]);
        write_png(&path, &buffers, 0.0).unwrap();
        let read = image::open(&path).unwrap().into_rgb8();
        assert_eq!(read.dimensions(), (3, 2));
        assert_eq!(read.get_pixel(1, 1).0, [255, 0, 0]);
        assert_eq!(read.get_pixel(0, 0).0, [0, 0, 0]);
    }
}
