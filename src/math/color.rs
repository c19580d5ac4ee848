//! Linear colour: Rec. 709 primaries, no transfer curve, unit set by context (nits, candela, lux).

use glam::Vec3;

/// A linear Rec. 709 colour. Its unit is the unit of the quantity that it colours.
pub type Rgb = Vec3;

/// The luminance weights of linear Rec. 709 (ITU-R BT.709-6, item 3.2, rounded to four digits).
pub const LUMINANCE_WEIGHTS: Rgb = Rgb::new(0.2126, 0.7152, 0.0722);

/// Luminance of a linear colour, in the colour's own unit.
#[inline]
pub fn luminance(rgb: Rgb) -> f32 {
    rgb.dot(LUMINANCE_WEIGHTS)
}

/// Decodes one sRGB-encoded component in `[0, 1]` to linear (IEC 61966-2-1).
pub fn srgb_to_linear(encoded: f32) -> f32 {
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// Encodes one linear component in `[0, 1]` as sRGB (IEC 61966-2-1).
pub fn linear_to_srgb(linear: f32) -> f32 {
    if linear <= 0.0031308 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_transfer_curve_inverts() {
        for i in 0..=255 {
            let encoded = i as f32 / 255.0;
            assert!((linear_to_srgb(srgb_to_linear(encoded)) - encoded).abs() < 1e-6);
        }
    }
}
