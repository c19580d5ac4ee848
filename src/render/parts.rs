//! Parts that sum to a whole to the last bit.
//!
//! The parts of a pixel's light (by light group, or by scatterings) and the whole are means of their
//! own, each rounded to 32 bits, so that their sum is off by some last places. [`settle`] lets the largest
//! part take that up, which changes it by a few of its own last places where there are a dozen parts.
//! Small parts keep their digits, dark ones stay dark, and the whole does not depend on which parts are
//! asked for.

/// Changes parts in their last places so that all of them, added in order in 32-bit arithmetic, give
/// `whole`. All numbers must be finite and at least 0, and the parts must sum to the whole but for
/// roundings.
pub fn settle(parts: &mut [f32], whole: f32) {
    debug_assert!(is_near(parts, whole), "{parts:?} are not the parts of {whole}");
    // Once is enough, but for numbers so small that the roundings are larger than the largest part: it
    // is 0 then, and the next one follows.
    for _ in 0..parts.len() {
        if sum(parts) == whole {
            break;
        }
        settle_largest(parts, whole);
    }
}

fn settle_largest(parts: &mut [f32], whole: f32) {
    let larger = |best: usize, at: usize| if parts[at] > parts[best] { at } else { best };
    let Some(largest) = (0..parts.len()).reduce(larger) else { return };
    // From the end to the largest part: what must the sum before each be? The numbers that give a sum
    // with a part lie in an interval as wide as the sum's last place, so one of them is a float, but
    // where both ends are ties and neither is rounded to the sum. A part that makes ties has finer
    // digits than the sum, and its last place moves it off them.
    let mut target = whole;
    for part in parts[largest + 1..].iter_mut().rev() {
        let before = missing(target, *part).or_else(|| {
            *part = part.next_up();
            missing(target, *part)
        });
        target = before.unwrap_or((target - *part).max(0.0));
    }
    let (before, rest) = parts.split_at_mut(largest);
    let own = missing(target, sum(before)).or_else(|| {
        settle(before, sum(before).next_up());
        missing(target, sum(before))
    });
    rest[0] = own.unwrap_or((target - sum(before)).max(0.0));
}

/// The number that gives `sum` with `part`, rounded to 32 bits; `None` if all that are near are ties.
fn missing(sum: f32, part: f32) -> Option<f32> {
    let near = ((f64::from(sum) - f64::from(part)) as f32).max(0.0);
    [near, near.next_up(), near.next_down()].into_iter().find(|other| other + part == sum)
}

fn sum(parts: &[f32]) -> f32 {
    parts.iter().fold(0.0, |sum, part| sum + part)
}

fn is_near(parts: &[f32], whole: f32) -> bool {
    let sum: f64 = parts.iter().map(|&part| f64::from(part)).sum();
    (sum - f64::from(whole)).abs() <= 1e-3 * f64::from(whole) + f64::from(f32::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4000))]

        /// Parts of any sizes, from the smallest number to the largest, alike or not.
        #[test]
        fn parts_sum_to_the_whole_and_hardly_change(
            exponents in prop::collection::vec(0.0..1.0f64, 1..200),
            (lowest, range) in (-44.0..0.0f64, prop::sample::select(vec![0.0, 0.5, 2.0, 10.0, 36.0])),
            dark in any::<u64>(),
        ) {
            let part = |(i, e): (usize, &f64)| match dark >> (i % 64) & 1 {
                1 => 0.0,
                _ => 10f64.powf(lowest + e * range),
            };
            let exact: Vec<f64> = exponents.iter().enumerate().map(part).collect();
            let whole = exact.iter().sum::<f64>() as f32;
            let rounded: Vec<f32> = exact.iter().map(|&part| part as f32).collect();
            let mut parts = rounded.clone();
            settle(&mut parts, whole);
            prop_assert_eq!(sum(&parts).to_bits(), whole.to_bits());
            // The roundings of the sum, each a last place of it, as a share of the largest part.
            let lit = exact.iter().filter(|part| **part > 0.0).count() as f64;
            let tolerance = lit * lit * f64::from(f32::EPSILON);
            for (part, (rounded, exact)) in parts.iter().zip(rounded.iter().zip(&exact)) {
                let off = (f64::from(*part) - exact).abs();
                prop_assert!(off <= tolerance * exact + lit * f64::from(f32::from_bits(1)), "{part} {exact}");
                prop_assert!(*rounded > 0.0 || *part == 0.0);
            }
        }
    }
}
