//! The scale that the views of a plan share, and the ticks along it.

use super::Short;

/// Round numbers between two others, about `count` of them, and how they are written.
pub fn ticks(from: f64, to: f64, count: f64) -> Vec<(f64, String)> {
    let step = round_step((to - from) / count);
    if !(step > 0.0 && step.is_finite()) {
        return Vec::new();
    }
    // Neither side of a plan has more than a few.
    (0..=4 * count as i64)
        .map(|i| ((from / step).ceil() + i as f64) * step)
        .take_while(|&at| at <= to)
        .map(|at| (at, label(at, step)))
        .collect()
}

/// Round numbers along a logarithmic axis between two positive ones: 1, 2 and 5 times the powers of ten, or
/// these alone if there are many.
pub fn powers(from: f64, to: f64) -> Vec<(f64, String)> {
    let decades = from.log10().floor() as i32..=to.log10().ceil() as i32;
    let few = (to / from).log10() < MOST_DECADES;
    let steps: &[f64] = if few { &[1.0, 2.0, 5.0] } else { &[1.0] };
    decades
        .flat_map(|power| steps.iter().map(move |step| step * 10f64.powi(power)))
        .filter(|at| (from..=to).contains(at))
        .map(|at| (at, Short(at).to_string()))
        .collect()
}

/// Beyond so many, only the powers of ten are told.
const MOST_DECADES: f64 = 3.5;

/// 1, 2 or 5 times a power of ten, the first that is not below.
fn round_step(least: f64) -> f64 {
    let power = 10f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0].into_iter().map(|by| by * power).find(|&s| s >= least).unwrap_or(10.0 * power)
}

fn label(at: f64, step: f64) -> String {
    if at.abs() >= 1e6 || step < 1e-4 {
        return if at.abs() < 0.5 * step { "0".into() } else { format!("{at:.3e}") };
    }
    let decimals = (-step.log10() - 1e-9).ceil().max(0.0) as usize;
    // No minus before a zero.
    format!("{:.decimals$}", if at.abs() < 0.5 * step { 0.0 } else { at })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(from: f64, to: f64) -> Vec<String> {
        ticks(from, to, 5.0).into_iter().map(|(_, label)| label).collect()
    }

    #[test]
    fn ticks_are_round_and_inside() {
        assert_eq!(labels(-1.2, 4.4), ["0", "2", "4"]);
        assert_eq!(labels(-0.29, 0.21), ["-0.2", "-0.1", "0.0", "0.1", "0.2"]);
        assert_eq!(labels(1e6, 4e6), ["1.000e6", "2.000e6", "3.000e6", "4.000e6"]);
        for (from, to) in [(0.0, 1.0), (-3e-7, 5e-7), (1e5, 1.00001e5), (-7e9, 3e9)] {
            let found = ticks(from, to, 5.0);
            assert!((2..=7).contains(&found.len()), "{found:?}");
            assert!(found.iter().all(|&(at, _)| (from..=to).contains(&at)));
        }
        assert!(ticks(1.0, 1.0, 5.0).is_empty());
    }

    #[test]
    fn powers_are_round_and_inside() {
        let labels = |from, to| powers(from, to).into_iter().map(|tick| tick.1).collect::<Vec<_>>();
        assert_eq!(labels(0.015, 0.7), ["0.02", "0.05", "0.1", "0.2", "0.5"]);
        assert_eq!(labels(0.9, 90_000.0), ["1", "10", "100", "1000", "10000"]);
    }
}
