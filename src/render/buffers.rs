//! Render buffers: what a render leaves behind for each pixel, in the layers that were asked for.
//!
//! Values are 32-bit floats, whatever a file keeps of them. A row holds its first channel from left to
//! right, then its second: the layout of OpenEXR's scan lines.

use super::crop::Window;
use super::layers::Layer;
use crate::math::color::Rgb;
use rayon::prelude::*;

/// All pixels of a frame or of a part of it, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderBuffers {
    size: [u32; 2],
    window: Window,
    layers: Vec<Layer>,
    channels: usize,
    values: Vec<f32>,
    pub(super) manifest: Option<String>,
}

impl RenderBuffers {
    /// Black pixels of a window of a picture of `size`, columns and rows. The first layer must be the
    /// beauty.
    pub fn new(size: [u32; 2], window: Window, layers: Vec<Layer>) -> RenderBuffers {
        let channels = layers.iter().map(|layer| layer.channels.len()).sum();
        let values = vec![0.0; window.width() as usize * window.height() as usize * channels];
        RenderBuffers { size, window, layers, channels, values, manifest: None }
    }

    /// Columns and rows of the whole picture.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Which part of the picture this is.
    pub fn window(&self) -> Window {
        self.window
    }

    /// Columns of the window.
    pub fn width(&self) -> u32 {
        self.window.width()
    }

    /// Rows of the window.
    pub fn height(&self) -> u32 {
        self.window.height()
    }

    /// Bytes of all values.
    pub fn byte_length(&self) -> u64 {
        size_of_val(self.values.as_slice()) as u64
    }

    /// What is there, in the order of the channels.
    pub fn layers(&self) -> &[Layer] {
        &self.layers
    }

    /// Cryptomatte's manifest, if its layers are there: names and ids of the prims that are seen, JSON.
    pub fn manifest(&self) -> Option<&str> {
        self.manifest.as_deref()
    }

    /// A row of a channel, both by number.
    pub fn row(&self, channel: usize, y: usize) -> &[f32] {
        let width = self.width() as usize;
        &self.values[(y * self.channels + channel) * width..][..width]
    }

    /// All values of a channel by number, row after row.
    pub fn plane(&self, channel: usize) -> impl Iterator<Item = f32> + '_ {
        (0..self.height() as usize).flat_map(move |y| self.row(channel, y).iter().copied())
    }

    /// All values of a channel by its full name, such as `N.X`; `None` if it is not there.
    pub fn channel(&self, name: &str) -> Option<impl Iterator<Item = f32> + '_> {
        let mut names = self.layers.iter().flat_map(Layer::channel_names);
        Some(self.plane(names.position(|own| own == name)?))
    }

    /// The beauty of all pixels, row after row: linear radiance in the scene's unit times the camera's
    /// exposure scale, premultiplied by alpha.
    pub fn beauty(&self) -> impl Iterator<Item = Rgb> + '_ {
        (0..self.height() as usize).flat_map(move |y| {
            let [red, green, blue] = [0, 1, 2].map(|channel| self.row(channel, y));
            (0..red.len()).map(move |x| Rgb::new(red[x], green[x], blue[x]))
        })
    }

    /// Sets all channels of a pixel of the window.
    pub fn set(&mut self, x: u32, y: u32, values: &[f32]) {
        let (width, channels) = (self.width() as usize, self.channels);
        let row = &mut self.values[y as usize * channels * width..][..channels * width];
        set_pixel(row, width, x as usize, values);
    }

    /// Rows to be filled in parallel; see [`set_pixel`].
    pub(super) fn rows_mut(&mut self) -> impl IndexedParallelIterator<Item = &mut [f32]> {
        self.values.par_chunks_mut(self.channels * self.window.width() as usize)
    }
}

/// Sets all channels of the pixel at a column of a row.
pub(super) fn set_pixel(row: &mut [f32], width: usize, x: usize, values: &[f32]) {
    for (channel, value) in row[x..].iter_mut().step_by(width).zip(values) {
        *channel = *value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::layers::{Aov, layers_of};

    #[test]
    fn channels_come_back_by_number_and_by_name() {
        let window = Window { x0: 5, y0: 1, x1: 8, y1: 3 };
        let layers = layers_of(&[Aov::Normal], true, &[]);
        let mut buffers = RenderBuffers::new([9, 4], window, layers);
        let value = |x: u32, y: u32, channel: usize| (100 * y + 10 * x) as f32 + channel as f32;
        for (x, y) in [(0, 0), (1, 0), (2, 0), (0, 1), (1, 1), (2, 1)] {
            buffers.set(x, y, &[0, 1, 2, 3, 4, 5, 6].map(|channel| value(x, y, channel)));
        }
        assert_eq!((buffers.width(), buffers.height()), (3, 2));
        let normal_y: Vec<f32> = buffers.channel("N.Y").unwrap().collect();
        assert_eq!(normal_y, [5.0, 15.0, 25.0, 105.0, 115.0, 125.0]);
        assert!(normal_y.iter().copied().eq(buffers.plane(5)));
        assert_eq!(buffers.beauty().nth(4), Some(Rgb::new(110.0, 111.0, 112.0)));
        assert!(buffers.channel("Z").is_none());
    }
}
