//! Decoding pictures, within limits.

use super::budget::Budget;
use super::error::Fault;
use super::open_exr;
use crate::scene::Pixels;
use bytemuck::Pod;
use image::{ColorType, DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use std::io::Cursor;

/// No side of a picture is longer.
const LONGEST_SIDE: u32 = 1 << 16;

/// A picture takes no more memory than this, all in all, while it is decoded.
const MOST_BYTES: u64 = 4 << 30;

/// What stands in for a base colour that cannot be read is multiplied by this: half of the light is
/// reflected, where nobody knows whether it should be none or all.
pub(super) const MISSING_REFLECTANCE: f32 = 0.5;

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

/// Decodes the picture of a surface's texture, which is PNG or JPEG.
pub(super) fn decode_surface(
    bytes: &[u8],
    coding: Coding,
    object: &str,
    budget: &mut Budget,
) -> Result<Picture, Fault> {
    match image::guess_format(bytes) {
        Ok(ImageFormat::Png | ImageFormat::Jpeg) => decode(bytes, coding, object, budget),
        _ => Err(Fault::new(object, "is neither PNG nor JPEG").remedy("convert it to PNG or JPEG")),
    }
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
        // Its blocks are unpacked one by one.
        return open_exr::decode(bytes, object, |size| {
            let bytes = pixels(size.0, size.1).saturating_mul(12);
            reserve(size, 12, bytes, object, budget)
        });
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
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(damaged)?;
    let (width, height) = decoder.dimensions();
    // What the decoder fills and keeps beside it, and what that is converted to.
    let (kept, decoded) = (if format == ImageFormat::Hdr { 12 } else { 4 }, decoder.total_bytes());
    let is_kept = matches!(decoder.color_type(), ColorType::Rgba8 | ColorType::Rgb32F);
    let beside = match format {
        // The coefficients of a progressive picture, 16 bits each.
        ImageFormat::Jpeg => 2 * decoded,
        _ => 0,
    };
    let converted = if is_kept { 0 } else { pixels(width as usize, height as usize) * kept };
    let peak = decoded.saturating_add(beside).saturating_add(converted);
    reserve((width as usize, height as usize), kept, peak, object, budget)?;
    let image = DynamicImage::from_decoder(decoder).map_err(damaged)?;
    let pixels = if format == ImageFormat::Hdr {
        let mut values = image.into_rgb32f().into_raw();
        values.iter_mut().for_each(|value| *value = radiance(*value));
        Pixels::Float(grouped(values))
    } else {
        let texels = grouped(image.into_rgba8().into_raw());
        match coding {
            Coding::Srgb => Pixels::Srgb8(texels),
            Coding::Linear => Pixels::Linear8(texels),
        }
    };
    Ok(Picture { width, height, pixels })
}

/// The same numbers in groups of `N`, without a copy.
fn grouped<T: Pod, const N: usize>(values: Vec<T>) -> Vec<[T; N]>
where
    [T; N]: Pod,
{
    bytemuck::allocation::try_cast_vec(values)
        .unwrap_or_else(|(_, values)| values.as_chunks().0.to_vec())
}

fn pixels(width: usize, height: usize) -> u64 {
    (width as u64).saturating_mul(height as u64)
}

/// Checks a picture's size before it is decoded: what a pixel takes for good, and what the whole picture
/// takes at most while it is decoded.
fn reserve(
    (width, height): (usize, usize),
    pixel_bytes: u64,
    peak_bytes: u64,
    object: &str,
    budget: &mut Budget,
) -> Result<(), Fault> {
    let bytes = pixels(width, height).saturating_mul(pixel_bytes);
    let longest = width.max(height);
    if longest > LONGEST_SIDE as usize || bytes.max(peak_bytes) > MOST_BYTES || bytes == 0 {
        return Err(Fault::new(object, format!("is {width} x {height} pixels large, which takes more memory than the {MOST_BYTES} bytes that a picture may"))
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
