//! A ground of means: numbers that boxes have, as colours, where many boxes lie above each other.

use super::Scale;
use super::raster::Raster;
use image::RgbaImage;

/// Sums of numbers over rectangles on a grid. Each rectangle changes four places only, however large it is.
#[derive(Clone, Debug)]
pub struct Ground {
    columns: usize,
    rows: usize,
    /// Changes of the count and of the sum, from one place to the next on either axis: one more each way than
    /// there are cells.
    changes: Vec<[f64; 2]>,
}

impl Ground {
    pub fn new(columns: u32, rows: u32) -> Ground {
        let (columns, rows) = (columns as usize, rows as usize);
        Ground { columns, rows, changes: vec![[0.0; 2]; (columns + 1) * (rows + 1)] }
    }

    /// Adds a number in all cells that a rectangle touches. Its corners are from (0, 0) at the top left to
    /// (1, 1).
    pub fn add(&mut self, a: [f64; 2], b: [f64; 2], value: f64) {
        let span = |axis: usize, count: usize| {
            let cell = |share: f64| ((share * count as f64) as usize).min(count - 1);
            let (from, to) = (a[axis].min(b[axis]), a[axis].max(b[axis]));
            // An end on a line between two cells does not touch the second.
            let last = ((to * count as f64).ceil() as usize).clamp(1, count) - 1;
            (cell(from), last.max(cell(from)) + 1)
        };
        let (columns, rows) = (span(0, self.columns), span(1, self.rows));
        for (y, sign_y) in [(rows.0, 1.0), (rows.1, -1.0)] {
            for (x, sign_x) in [(columns.0, 1.0), (columns.1, -1.0)] {
                let [count, sum] = &mut self.changes[y * (self.columns + 1) + x];
                *count += sign_x * sign_y;
                *sum += sign_x * sign_y * value;
            }
        }
    }

    /// An image of the means; clear where there are no numbers.
    pub fn raster(&self, scale: &Scale) -> Raster {
        let across = self.columns + 1;
        let mut sums = self.changes.clone();
        for at in 0..sums.len() {
            let (x, y) = (at % across, at / across);
            let of = |there: bool, back: usize| if there { sums[at - back] } else { [0.0; 2] };
            let (left, up) = (of(x > 0, 1), of(y > 0, across));
            let both = of(x > 0 && y > 0, across + 1);
            let sum = |i: usize| sums[at][i] + left[i] + up[i] - both[i];
            sums[at] = [sum(0), sum(1)];
        }
        Raster(RgbaImage::from_fn(self.columns as u32, self.rows as u32, |x, y| {
            let [count, sum] = sums[y as usize * across + x as usize];
            scale.color(if count > 0.5 { (sum / count) as f32 } else { f32::NAN })
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn grey(white: f32) -> Scale {
        Scale::Grey { white }
    }

    proptest! {
        /// As if each rectangle were painted cell by cell.
        #[test]
        fn a_cell_has_the_mean_of_what_touches_it(
            boxes in prop::collection::vec(
                (prop::array::uniform4(-0.2..1.2f64), 0u8..=255), 0..20
            )
        ) {
            let mut ground = Ground::new(7, 5);
            let mut painted = vec![(0u32, 0u32); 35];
            for &([x, y, to_x, to_y], value) in &boxes {
                ground.add([x, y], [to_x, to_y], f64::from(value) / 255.0);
                let touches = |from: f64, to: f64, cell: usize, count: usize| {
                    let (from, to) = (from.min(to), from.max(to));
                    let inside = |share: f64| (share * count as f64).clamp(0.0, count as f64);
                    let (from, to) = (inside(from), inside(to));
                    let first = (from as usize).min(count - 1);
                    cell == first || (from < (cell + 1) as f64 && to > cell as f64)
                };
                for (at, (count, sum)) in painted.iter_mut().enumerate() {
                    if touches(x, to_x, at % 7, 7) && touches(y, to_y, at / 7, 5) {
                        *count += 1;
                        *sum += u32::from(value);
                    }
                }
            }
            let Raster(pixels) = ground.raster(&grey(1.0));
            for (pixel, (count, sum)) in pixels.pixels().zip(painted) {
                prop_assert_eq!(pixel.0[3] == 0, count == 0);
                if count > 0 {
                    let mean = f64::from(sum) / f64::from(count) / 255.0;
                    prop_assert!((f64::from(pixel.0[0]) - 255.0 * mean.sqrt()).abs() < 1.0);
                }
            }
        }
    }

    #[test]
    fn no_rectangle_is_too_small_or_too_far_out() {
        for at in [-1e30, 0.0, 0.5, 1.0, 1e30, f64::NAN] {
            let mut ground = Ground::new(3, 3);
            ground.add([at, at], [at, at], 1.0);
            let Raster(pixels) = ground.raster(&grey(1.0));
            assert_eq!(pixels.pixels().filter(|pixel| pixel.0[3] > 0).count(), 1, "{at}");
        }
    }
}
