//! Parts that sum to a whole to the last bit.
//!
//! The parts of a pixel's light (by light group, or by scatterings) and the whole are means of their
//! own, each rounded to 32 bits, so that their sum is off by some last places. [`settle`] moves the
//! largest part by that, a few last places of its own where there are a dozen parts. Small parts keep all
//! their digits, dark ones stay dark, and the whole does not depend on which parts are asked for.

/// Changes the largest part so that all parts, added in order in 32-bit arithmetic, give `whole`. All
/// numbers must be finite and at least 0, and the parts must sum to the whole but for roundings.
pub fn settle(parts: &mut [f32], whole: f32) {
    if sum(parts) == whole {
        return;
    }
    debug_assert!(is_near(parts, whole), "{parts:?} are not the parts of {whole}");
    let larger = |best: usize, at: usize| if parts[at] > parts[best] { at } else { best };
    let Some(largest) = (0..parts.len()).reduce(larger) else { return };
    // The bits of floats that are not negative are in the order of the floats. One last place of the
    // largest part is at most one of each sum that it is in. So the sum takes every value between, and
    // the least part with which it reaches the whole is a part with which it is the whole.
    let (mut below, mut reaches) = (0, f32::MAX.to_bits());
    while below < reaches {
        let middle = below + (reaches - below) / 2;
        parts[largest] = f32::from_bits(middle);
        if sum(parts) < whole {
            below = middle + 1;
        } else {
            reaches = middle;
        }
    }
    parts[largest] = f32::from_bits(reaches);
}

fn sum(parts: &[f32]) -> f32 {
    parts.iter().fold(0.0, |sum, part| sum + part)
}

fn is_near(parts: &[f32], whole: f32) -> bool {
    let sum: f64 = parts.iter().map(|&part| f64::from(part)).sum();
    (sum - f64::from(whole)).abs() <= 1e-4 * f64::from(whole) + f64::from(f32::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Parts of any sizes, from the smallest number to the largest.
        #[test]
        fn parts_sum_to_the_whole_and_hardly_change(
            exponents in prop::collection::vec(-44.0..36.0f64, 1..200),
            dark in any::<u64>(),
        ) {
            let exact: Vec<f64> = exponents
                .iter()
                .enumerate()
                .map(|(i, e)| if dark >> (i % 64) & 1 == 1 { 0.0 } else { 10f64.powf(*e) })
                .collect();
            let whole = exact.iter().sum::<f64>() as f32;
            let rounded: Vec<f32> = exact.iter().map(|&part| part as f32).collect();
            let mut parts = rounded.clone();
            settle(&mut parts, whole);
            prop_assert_eq!(sum(&parts).to_bits(), whole.to_bits());
            let changed: Vec<usize> = (0..parts.len()).filter(|&i| parts[i] != rounded[i]).collect();
            prop_assert!(changed.len() <= 1);
            for i in changed {
                let off = (f64::from(parts[i]) - exact[i]).abs();
                prop_assert!(off <= 2e-5 * exact[i] + f64::from(f32::MIN_POSITIVE), "{} {}", parts[i], exact[i]);
            }
        }
    }
}
