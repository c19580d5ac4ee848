//! Pixels as an image inside the page.

use base64::display::Base64Display;
use base64::engine::general_purpose::STANDARD;
use image::{ImageFormat, RgbaImage};
use std::fmt::{self, Display};
use std::io::Cursor;

/// A picture that displays itself as a `data:` URI of a PNG.
#[derive(Clone, Debug)]
pub struct Raster(pub RgbaImage);

impl Display for Raster {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut png = Cursor::new(Vec::new());
        self.0.write_to(&mut png, ImageFormat::Png).map_err(|_| fmt::Error)?;
        write!(f, "data:image/png;base64,{}", Base64Display::new(png.get_ref(), &STANDARD))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use base64::Engine;

    #[test]
    fn what_is_written_can_be_read() {
        let pixels = RgbaImage::from_fn(3, 2, |x, y| image::Rgba([x as u8, y as u8, 7, 200]));
        let uri = Raster(pixels.clone()).to_string();
        let png = STANDARD.decode(uri.strip_prefix("data:image/png;base64,").unwrap()).unwrap();
        assert_eq!(image::load_from_memory(&png).unwrap().to_rgba8(), pixels);
    }
}
