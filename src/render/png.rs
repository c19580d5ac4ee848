//! A preview that any viewer shows: 8-bit sRGB PNG.
//!
//! Not a measurement: the EXR beside it is. Beauty is scaled by `2^exposure`, bent by Narkowicz's
//! fit of the ACES film curve (2016; 1 becomes 0.80, whites roll off) and encoded as sRGB, over
//! black. A part of a frame gives a preview of that part alone. Scenes in photometric units are
//! thousands of nits bright, so the exposure can be chosen from the picture: [`exposure_for`].

use super::beauty::Beauty;
use crate::math::color::{Rgb, linear_to_srgb, luminance};
use crate::store::{read_regular, write_atomically};
use png::{BitDepth, ColorType, Decoder, Encoder, EncodingError};
use std::io::{self, Cursor};
use std::path::Path;

/// What the middle of a picture is exposed for.
const MIDDLE_GREY: f64 = 0.18;
/// Keyword of the text that a preview carries.
const KEYWORD: &str = "candelabra";
/// Larger files are none of ours.
const MOST_BYTES: u64 = 4 << 30;

/// Writes a preview, all or nothing, with an ASCII text in it.
pub fn write_png(path: &Path, picture: &Beauty, exposure_stops: f32, text: &str) -> io::Result<()> {
    let pixels = shown(picture, exposure_stops);
    write_atomically(path, |file| {
        let mut encoder = Encoder::new(file, picture.width, picture.height);
        encoder.set_color(ColorType::Rgb);
        encoder.set_depth(BitDepth::Eight);
        encoder.add_text_chunk(KEYWORD.into(), text.into()).map_err(into_io)?;
        let mut writer = encoder.write_header().map_err(into_io)?;
        writer.write_image_data(&pixels).map_err(into_io)?;
        writer.finish().map_err(into_io)
    })
}

/// The bytes of a preview's pixels: red, green and blue, row after row.
pub fn shown(picture: &Beauty, exposure_stops: f32) -> Vec<u8> {
    let scale = exposure_stops.exp2();
    let encode = |linear: f32| (linear_to_srgb(film(linear * scale)) * 255.0 + 0.5) as u8;
    picture.pixels.iter().flat_map(|color| color.to_array().map(encode)).collect()
}

/// Keeps the kind of an error: a full disk has a remedy.
fn into_io(error: EncodingError) -> io::Error {
    match error {
        EncodingError::IoError(error) => error,
        other => io::Error::other(other),
    }
}

/// The text of a preview that [`write_png`] made, if the file is whole: PNG has a checksum for every chunk.
pub fn read_text(path: &Path) -> Option<String> {
    let bytes = read_regular(path, MOST_BYTES).ok()?;
    let mut reader = Decoder::new(Cursor::new(bytes)).read_info().ok()?;
    let mut row = vec![0; reader.output_line_size(reader.info().width)?];
    while reader.read_row(&mut row).ok()?.is_some() {}
    reader.finish().ok()?;
    let texts = &reader.info().uncompressed_latin1_text;
    texts.iter().find(|text| text.keyword == KEYWORD).map(|text| text.text.clone())
}

/// Stops that bring the geometric mean of the lit pixels' luminance to middle grey; 0 for a black
/// picture.
pub fn exposure_for(picture: &Beauty) -> f32 {
    let lit = |color: Rgb| Some(f64::from(luminance(color))).filter(|y| *y > 0.0 && y.is_finite());
    let (sum, count) = picture
        .pixels
        .iter()
        .filter_map(|&color| lit(color))
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

    #[test]
    fn brighter_stays_brighter_and_wild_values_stay_inside() {
        let steps: Vec<f32> = (0..200).map(|i| film((i as f32 - 100.0).exp2())).collect();
        assert!(steps.windows(2).all(|pair| pair[0] <= pair[1]));
        assert_eq!(film(f32::INFINITY), 1.0);
        assert_eq!((film(f32::NAN), film(-1.0), film(0.0)), (0.0, 0.0, 0.0));
    }

    fn black(width: u32, height: u32) -> Beauty {
        let pixels = vec![Rgb::ZERO; (width * height) as usize];
        Beauty { width, height, pixels }
    }

    #[test]
    fn the_exposure_brings_any_brightness_to_the_middle() {
        for level in [1e-6, 1.0, 1e9] {
            let mut picture = black(8, 8);
            picture.pixels[0] = Rgb::NAN;
            picture.pixels[2..].fill(Rgb::splat(level));
            let scaled = level * exposure_for(&picture).exp2();
            assert!((scaled / 0.18 - 1.0).abs() < 1e-4);
        }
        assert_eq!(exposure_for(&black(2, 2)), 0.0);
    }

    #[test]
    fn the_file_reads_back_with_its_text_if_it_is_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("p/preview.png");
        let mut picture = black(3, 2);
        picture.pixels[4] = Rgb::new(1e6, 0.0, f32::NAN);
        write_png(&path, &picture, 0.0, "of this and that").unwrap();
        let read = image::open(&path).unwrap().into_rgb8();
        assert_eq!(read.dimensions(), (3, 2));
        assert_eq!(read.get_pixel(1, 1).0, [255, 0, 0]);
        assert_eq!(read.get_pixel(0, 0).0, [0, 0, 0]);
        assert_eq!(read_text(&path).unwrap(), "of this and that");
        let whole = std::fs::read(&path).unwrap();
        for at in 0..whole.len() {
            let mut rotten = whole.clone();
            rotten[at] ^= 4;
            std::fs::write(&path, &rotten).unwrap();
            assert_eq!(read_text(&path), None, "byte {at} of {}", whole.len());
            std::fs::write(&path, &whole[..at]).unwrap();
            assert_eq!(read_text(&path), None, "{at} bytes");
        }
        assert_eq!(read_text(folder.path()), None);
    }
}
