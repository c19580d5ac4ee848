//! Sums over runs of texels: what makes the integral over a triangle cost its rows and not its area.
//!
//! Each row of a texture is summed in blocks of 16 texels, pairs of blocks, pairs of these, and so on.
//! A run is put together from the largest parts that fit. Nothing is subtracted, so a sum of
//! emissions is zero only if all of them are: one bright texel is never lost to rounding.

use crate::scene::{Texture, Wrap};
use glam::DVec3;
use std::ops::Range;
use std::sync::OnceLock;

/// Texels of the smallest block.
const BLOCK: usize = 16;

/// A texture, each of whose rows is summed when it is first asked for.
pub struct TexelRows<'a> {
    texture: &'a Texture,
    rows: Vec<OnceLock<Row>>,
    whole: OnceLock<DVec3>,
}

/// The sums of the blocks of a row; then those of pairs of blocks; and so on.
struct Row(Vec<Vec<DVec3>>);

impl<'a> TexelRows<'a> {
    /// Sums nothing yet.
    pub fn new(texture: &'a Texture) -> TexelRows<'a> {
        let rows = (0..texture.height).map(|_| OnceLock::new()).collect();
        TexelRows { texture, rows, whole: OnceLock::new() }
    }

    /// The texture.
    pub fn texture(&self) -> &'a Texture {
        self.texture
    }

    /// The mean of all texels.
    pub fn mean(&self) -> DVec3 {
        *self.whole.get_or_init(|| {
            let (width, height) = (self.texture.width as usize, self.texture.height as usize);
            let sum: DVec3 = (0..height).map(|row| self.sum_inside(row, 0..width)).sum();
            sum / (width * height) as f64
        })
    }

    /// The sum of some texels of a row, first and last included. Both numbers may lie outside the
    /// texture, which is then wrapped.
    pub fn sum(&self, row: i64, first: i64, last: i64) -> DVec3 {
        let row = self.texture.wrap[1].index(row, self.texture.height);
        let mut sum = DVec3::ZERO;
        for_each_piece(self.texture.wrap[0], self.texture.width, first, last, |piece, times| {
            sum += self.sum_inside(row, piece) * times;
        });
        sum
    }

    fn sum_inside(&self, row: usize, texels: Range<usize>) -> DVec3 {
        let (first, last) = (texels.start.div_ceil(BLOCK), texels.end / BLOCK);
        if first >= last {
            return self.texture.sum(texels, row);
        }
        self.texture.sum(texels.start..first * BLOCK, row)
            + self.rows[row].get_or_init(|| self.sum_row(row)).sum(first, last)
            + self.texture.sum(last * BLOCK..texels.end, row)
    }

    fn sum_row(&self, row: usize) -> Row {
        let blocks = 0..self.texture.width as usize / BLOCK;
        let sum = |block: usize| self.texture.sum(block * BLOCK..(block + 1) * BLOCK, row);
        let mut levels: Vec<Vec<DVec3>> = vec![blocks.map(sum).collect()];
        while let Some(below) = levels.last().filter(|below| below.len() > 1) {
            levels.push(below.chunks_exact(2).map(|pair| pair[0] + pair[1]).collect());
        }
        Row(levels)
    }
}

impl Row {
    /// The sum of some blocks, the last not included.
    fn sum(&self, mut first: usize, mut last: usize) -> DVec3 {
        let mut sum = DVec3::ZERO;
        for level in &self.0 {
            if first % 2 == 1 && first < last {
                sum += level[first];
                first += 1;
            }
            if last % 2 == 1 && first < last {
                last -= 1;
                sum += level[last];
            }
            (first, last) = (first / 2, last / 2);
            if first >= last {
                break;
            }
        }
        sum
    }
}

/// Calls `visit` with the parts of a row that a run of texels covers, and how often it covers each.
/// First and last texel are included.
fn for_each_piece(
    wrap: Wrap,
    width: u32,
    first: i64,
    last: i64,
    mut visit: impl FnMut(Range<usize>, f64),
) {
    let width = i64::from(width);
    let mut visit = |from: i64, to: i64, times: i64| {
        if from < to && times > 0 {
            visit(from as usize..to as usize, times as f64);
        }
    };
    let count = last - first + 1;
    match wrap {
        Wrap::Clamp => {
            visit(0, 1, count.min(-first));
            visit(first.max(0), (last + 1).min(width), 1);
            visit(width - 1, width, count.min(last + 1 - width));
        }
        Wrap::Repeat => {
            let (start, rest) = (first.rem_euclid(width), count % width);
            visit(0, width, count / width);
            visit(start, (start + rest).min(width), 1);
            visit(0, start + rest - width, 1);
        }
        Wrap::Mirror => {
            // There, back, and there again, of which the rest is a part.
            let (start, rest) = (first.rem_euclid(2 * width), count % (2 * width));
            let end = start + rest;
            visit(0, width, 2 * (count / (2 * width)));
            visit(start, end.min(width), 1);
            visit(2 * width - end.min(2 * width), 2 * width - start.max(width), 1);
            visit(0, (end - 2 * width).min(width), 1);
            visit(4 * width - end, width, 1);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Pixels;

    /// Every run of small textures, against texel after texel.
    #[test]
    fn runs_are_summed_however_they_wrap() {
        for width in [1u32, 2, 15, 16, 17, 40, 75] {
            let pixels = Pixels::Float((0..2 * width).map(|i| [i as f32, 1.0, 0.0]).collect());
            for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
                let texture = Texture {
                    name: "numbers".into(),
                    width,
                    height: 2,
                    pixels: pixels.clone(),
                    wrap: [wrap; 2],
                    bilinear: true,
                };
                let rows = TexelRows::new(&texture);
                let reach = 3 * i64::from(width) + 2;
                for first in (-reach..reach).step_by(1 + width as usize / 20) {
                    let mut sum = DVec3::ZERO;
                    for last in first..reach {
                        sum += texture.texel(last, first).truncate().as_dvec3();
                        assert_eq!(rows.sum(first, first, last), sum, "{width} {wrap:?} {first}");
                    }
                }
            }
        }
    }

    /// What a large neighbour would swallow in a difference of sums.
    #[test]
    fn a_faint_texel_beside_a_sun_is_not_lost() {
        let mut pixels = vec![[0.0; 3]; 100];
        (pixels[10], pixels[90]) = ([1e30; 3], [1e-30; 3]);
        let texture = Texture {
            name: "sun".into(),
            width: 100,
            height: 1,
            pixels: Pixels::Float(pixels),
            wrap: [Wrap::Clamp; 2],
            bilinear: true,
        };
        let rows = TexelRows::new(&texture);
        assert!(rows.sum(0, 20, 95).x > 0.0);
        assert_eq!(rows.sum(0, 20, 89).x, 0.0);
        assert_eq!(rows.sum(0, 91, 99).x, 0.0);
    }
}
