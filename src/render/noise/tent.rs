//! What is around a pixel: sums over its neighbours, weighted by a tent.

use rayon::prelude::*;

/// The tent reaches so many pixels to each side, where its weight would be 0.
const REACH: usize = 4;

/// For each pixel of a picture, the sum of some values over its neighbours, weighted by a tent that is
/// `REACH` pixels wide to each side; the pixel itself counts with `own` times its weight. Beyond the
/// picture there is nothing.
///
/// # Panics
/// If the values are not whole rows.
pub fn around(values: &[f64], width: usize, own: f64) -> Vec<f64> {
    assert!(width > 0 && values.len().is_multiple_of(width), "whole rows");
    // Along a row, without the pixel itself.
    let beside = |row: &[f64], at: usize| -> f64 {
        let from = at.saturating_sub(REACH - 1);
        let to = (at + REACH).min(row.len());
        let weighted = |i: usize| (REACH - at.abs_diff(i)) as f64 * row[i];
        (from..at).map(weighted).sum::<f64>() + (at + 1..to).map(weighted).sum::<f64>()
    };
    let whole = REACH as f64;
    let mut rows = vec![0.0; values.len()];
    rows.par_chunks_mut(width).zip(values.par_chunks(width)).for_each(|(sums, row)| {
        (0..width).for_each(|x| sums[x] = beside(row, x) + whole * row[x]);
    });
    let height = values.len() / width;
    let mut sums = vec![0.0; values.len()];
    sums.par_chunks_mut(width).enumerate().for_each(|(y, sums)| {
        let row = &values[y * width..][..width];
        // Not taken off afterwards: rounding would leave something of it.
        (0..width).for_each(|x| sums[x] = whole * (beside(row, x) + own * whole * row[x]));
        for near in (y.saturating_sub(REACH - 1)..(y + REACH).min(height)).filter(|&n| n != y) {
            let weight = (REACH - y.abs_diff(near)) as f64;
            let row = &rows[near * width..][..width];
            sums.iter_mut().zip(row).for_each(|(sum, value)| *sum += weight * value);
        }
    });
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_those_of_the_tent() {
        let (width, height) = (9, 7);
        let value = |i: usize| (i * i % 31) as f64;
        let values: Vec<f64> = (0..width * height).map(value).collect();
        for own in [0.0, 1.0] {
            let sums = around(&values, width, own);
            for y in 0..height as i64 {
                for x in 0..width as i64 {
                    let mut expected = 0.0;
                    for (dx, dy) in (-3..=3).flat_map(|dx| (-3..=3).map(move |dy| (dx, dy))) {
                        let (nx, ny): (i64, i64) = (x + dx, y + dy);
                        if (0..width as i64).contains(&nx) && (0..height as i64).contains(&ny) {
                            let weight = ((4 - i64::abs(dx)) * (4 - i64::abs(dy))) as f64;
                            let weight = if (dx, dy) == (0, 0) { own * weight } else { weight };
                            expected += weight * values[(ny as usize) * width + nx as usize];
                        }
                    }
                    let found = sums[y as usize * width + x as usize];
                    assert!((found - expected).abs() < 1e-9, "{x},{y}: {found}, {expected}");
                }
            }
        }
    }
}
