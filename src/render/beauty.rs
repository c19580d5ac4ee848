//! The picture itself, as a file keeps it: what previews are made of.
//!
//! A preview that is made later, from the file, must be the one that would have been made at once. So
//! previews never see more digits than the file has.

use super::buffers::RenderBuffers;
use crate::math::color::Rgb;
use exr::prelude::{ReadChannels, ReadLayers, f16, read};
use std::io;
use std::path::Path;

/// Red, green and blue of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Beauty {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Row after row from the top, linear.
    pub pixels: Vec<Rgb>,
}

impl Beauty {
    /// What a file keeps of a frame: 32-bit floats, or 16-bit ones.
    pub fn of(buffers: &RenderBuffers, float: bool) -> Beauty {
        let stored = |value: f32| if float { value } else { half(value).to_f32() };
        let pixels = buffers.beauty().map(|rgb| Rgb::from(rgb.to_array().map(stored))).collect();
        Beauty { width: buffers.width(), height: buffers.height(), pixels }
    }

    /// Reads it from an OpenEXR file.
    ///
    /// # Errors
    /// If the file cannot be read or has no such channels.
    pub fn read(path: &Path) -> io::Result<Beauty> {
        let in_file = |error| io::Error::other(format!("{}: {error}", path.display()));
        let image = read()
            .no_deep_data()
            .largest_resolution_level()
            .rgb_channels(
                |size, _| (size.width(), vec![Rgb::ZERO; size.area()]),
                |(width, pixels), at, (r, g, b): (f32, f32, f32)| {
                    pixels[at.y() * *width + at.x()] = Rgb::new(r, g, b);
                },
            )
            .first_valid_layer()
            .all_attributes()
            .from_file(path)
            .map_err(in_file)?;
        let size = image.layer_data.size;
        let (_, pixels) = image.layer_data.channel_data.pixels;
        Ok(Beauty { width: size.width() as u32, height: size.height() as u32, pixels })
    }
}

/// A 16-bit float; what is larger than it can hold becomes its largest.
pub(super) fn half(value: f32) -> f16 {
    let largest = f32::from(f16::MAX);
    f16::from_f32(value.clamp(-largest, largest))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::crop::Window;
    use crate::render::exr::write_exr;
    use crate::render::layers::{Aov, layers_of};

    #[test]
    fn what_is_read_is_what_was_kept() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("f.exr");
        for float in [false, true] {
            let layers = layers_of(&Aov::DEFAULT, float, &[]);
            let channels: usize = layers.iter().map(|layer| layer.channels.len()).sum();
            let window = Window { x0: 2, y0: 1, x1: 9, y1: 4 };
            let mut buffers = RenderBuffers::new([20, 10], window, layers);
            for (x, y) in (0..7).flat_map(|x| (0..3).map(move |y| (x, y))) {
                let mut values = vec![0.5; channels];
                for (value, scale) in values.iter_mut().zip([0.1, 1e-9, 1e6]) {
                    *value = scale * (x + 7 * y) as f32;
                }
                buffers.set(x, y, &values);
            }
            write_exr(&path, &buffers, "{}").unwrap();
            let read = Beauty::read(&path).unwrap();
            assert_eq!(read, Beauty::of(&buffers, float));
            assert_eq!((read.width, read.height), (7, 3));
        }
        assert!(Beauty::read(folder.path()).is_err());
    }
}
