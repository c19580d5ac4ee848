//! A ground of density: points too many to be drawn, summed in cells.

use super::raster::Raster;
use image::{Rgba, RgbaImage};

/// Sums of weights on a grid.
#[derive(Clone, Debug)]
pub struct Shade {
    columns: u32,
    sums: Vec<f64>,
}

/// Cells of at most this share of the heaviest cell's weight get the lowest opacity.
const FAINTEST: f64 = 1e-4;
/// A grey that stands out from black and from white.
const COLOR: [u8; 3] = [128, 128, 128];

impl Shade {
    pub fn new(columns: u32, rows: u32) -> Shade {
        Shade { columns, sums: vec![0.0; columns as usize * rows as usize] }
    }

    /// Adds a weight at a place, from (0, 0) at the top left to (1, 1).
    pub fn add(&mut self, at: [f64; 2], weight: f64) {
        let columns = self.columns as usize;
        let rows = self.sums.len() / columns;
        let cell = |share: f64, count: usize| ((share * count as f64) as usize).min(count - 1);
        self.sums[cell(at[1], rows) * columns + cell(at[0], columns)] += weight;
    }

    /// An image of the cells. The opacity grows with the logarithm of the weight; empty cells are clear.
    pub fn raster(&self) -> Raster {
        let most = self.sums.iter().fold(0.0, |a: f64, &b| a.max(b));
        let columns = self.columns as usize;
        let rows = (self.sums.len() / columns) as u32;
        Raster(RgbaImage::from_fn(self.columns, rows, |x, y| {
            let sum = self.sums[y as usize * columns + x as usize];
            if sum <= 0.0 {
                return Rgba([0; 4]);
            }
            let depth = ((sum / most).max(FAINTEST).ln() / FAINTEST.ln()).clamp(0.0, 1.0);
            let [r, g, b] = COLOR;
            Rgba([r, g, b, (255.0 - 215.0 * depth) as u8])
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_fall_into_their_cells() {
        let mut shade = Shade::new(2, 2);
        shade.add([0.1, 0.1], 1.0);
        shade.add([1.0, 1.0], 1e-6);
        shade.add([0.9, 0.6], 1e-6);
        let Raster(pixels) = shade.raster();
        let opacity = |x, y| pixels.get_pixel(x, y).0[3];
        assert_eq!([opacity(0, 0), opacity(1, 0), opacity(0, 1), opacity(1, 1)], [255, 0, 0, 40]);
    }
}
