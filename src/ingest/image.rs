//! Decoding pictures, within limits.

use super::budget::Budget;
use super::error::Fault;
use super::open_exr;
use crate::scene::Pixels;
use image::{ImageFormat, ImageReader, Limits};
use std::io::Cursor;

/// No side of a picture is longer.
const LONGEST_SIDE: u32 = 1 << 16;

/// A picture takes no more memory than this while it is decoded.
const MOST_BYTES: u64 = 4 << 30;

/// What infinite radiance in a picture becomes: the largest number that a half float holds.
const BRIGHTEST: f32 = 65504.0;

/// A decoded picture.
pub(super) struct Picture {
    pub width: u32,
    pub height: u32,
    pub pixels: Pixels,
}

/// What 8-bit values of a picture stand for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Coding {
    Srgb,
    Linear,
}

/// Whether these are the bytes of a picture in a format that surfaces' textures can have.
pub(super) fn is_surface_format(bytes: &[u8]) -> bool {
    matches!(image::guess_format(bytes), Ok(ImageFormat::Png | ImageFormat::Jpeg))
}

/// Decodes PNG and JPEG to eight bits; OpenEXR and Radiance HDR to floats, which are linear.
pub(super) fn decode(
    bytes: &[u8],
    coding: Coding,
    object: &str,
    budget: &mut Budget,
) -> Result<Picture, Fault> {
    budget.grow(bytes.len() as u64);
    const OPENEXR: &[u8] = b"\x76\x2f\x31\x01";
    if bytes.starts_with(OPENEXR) {
        return open_exr::decode(bytes, object, |size| reserve(size, 12, object, budget));
    }
    let damaged = |error: image::ImageError| {
        Fault::new(object, format!("cannot be decoded: {error}"))
            .remedy("open it in an image viewer and save it again as PNG or JPEG")
    };
    let format = match image::guess_format(bytes) {
        Ok(format @ (ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::Hdr)) => format,
        _ => {
            return Err(Fault::new(object, "is in a format that is not read")
                .remedy("convert it to PNG or JPEG; domes may be OpenEXR or Radiance HDR too"));
        }
    };
    let mut limits = Limits::default();
    limits.max_image_width = Some(LONGEST_SIDE);
    limits.max_image_height = Some(LONGEST_SIDE);
    limits.max_alloc = Some(MOST_BYTES);
    let header = ImageReader::with_format(Cursor::new(bytes), format);
    let (width, height) = header.into_dimensions().map_err(damaged)?;
    let pixel_bytes = if format == ImageFormat::Hdr { 12 } else { 4 };
    reserve((width as usize, height as usize), pixel_bytes, object, budget)?;
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    reader.limits(limits);
    let image = reader.decode().map_err(damaged)?;
    let pixels = if format == ImageFormat::Hdr {
        let values = image.into_rgb32f().into_raw();
        Pixels::Float(values.chunks_exact(3).map(|p| [p[0], p[1], p[2]].map(radiance)).collect())
    } else {
        let values = image.into_rgba8().into_raw();
        let texels = values.chunks_exact(4).map(|p| [p[0], p[1], p[2], p[3]]).collect();
        match coding {
            Coding::Srgb => Pixels::Srgb8(texels),
            Coding::Linear => Pixels::Linear8(texels),
        }
    };
    Ok(Picture { width, height, pixels })
}

/// Checks a picture's size before it is decoded.
fn reserve(
    (width, height): (usize, usize),
    pixel_bytes: u64,
    object: &str,
    budget: &mut Budget,
) -> Result<(), Fault> {
    let bytes = (width as u64).saturating_mul(height as u64).saturating_mul(pixel_bytes);
    let longest = width.max(height);
    if longest > LONGEST_SIDE as usize || bytes > MOST_BYTES || bytes == 0 {
        return Err(Fault::new(object, format!("is {width} x {height} pixels large"))
            .remedy("scale the picture"));
    }
    budget.take(bytes, || object.to_string())
}

/// Light is neither negative nor infinite.
pub(super) fn radiance(value: f32) -> f32 {
    match value {
        f32::INFINITY => BRIGHTEST,
        value if value > 0.0 => value,
        _ => 0.0,
    }
}
