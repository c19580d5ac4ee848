//! What curves of error against time say: their slopes, what reaches an error first, and which points no
//! other beats.

use serde::{Deserialize, Serialize};

/// One budget of a way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Samples of each pixel.
    pub samples: f64,
    /// Seconds a picture.
    pub seconds: f64,
    /// Its error.
    pub error: f64,
}

/// What an error takes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reach {
    /// Samples of each pixel.
    pub samples: u32,
    /// Seconds a picture.
    pub seconds: f64,
    /// No budget that was measured has so small an error: it is assumed to fall with the root of the samples, and time to rise with them.
    pub is_beyond: bool,
}

/// The exponent of time in the error, by least squares over the logarithms: -0.5 for independent
/// samples, if a picture takes no time before its first. `None` if there are less than two times.
pub fn slope(points: &[Point]) -> Option<f64> {
    let logs: Vec<(f64, f64)> = points
        .iter()
        .filter(|point| point.seconds > 0.0 && point.error > 0.0)
        .map(|point| (point.seconds.ln(), point.error.ln()))
        .collect();
    let count = logs.len() as f64;
    let (x, y) = logs.iter().fold((0.0, 0.0), |(x, y), log| (x + log.0 / count, y + log.1 / count));
    let (mut across, mut both) = (0.0, 0.0);
    for log in &logs {
        across += (log.0 - x) * (log.0 - x);
        both += (log.0 - x) * (log.1 - y);
    }
    (logs.len() > 1 && across > 0.0).then(|| both / across)
}

/// What an error takes on a curve of rising samples: between two budgets the error is a power of the
/// samples and the time rises evenly. Less than the first budget is never told. `None` without points.
pub fn reach(points: &[Point], error: f64) -> Option<Reach> {
    let first = points.first()?;
    // The last budget that is not good enough: noise may have let an earlier one seem so.
    let Some(last) = points.iter().rposition(|point| point.error > error) else {
        let (samples, seconds) = (first.samples.ceil() as u32, first.seconds);
        return Some(Reach { samples, seconds, is_beyond: false });
    };
    let low = points[last];
    let (exponent, per_sample, is_beyond) = match points.get(last + 1) {
        // Two errors may have been asked for and have taken as many.
        Some(high) if high.samples <= low.samples => {
            let (samples, seconds) = (high.samples.ceil() as u32, high.seconds);
            return Some(Reach { samples, seconds, is_beyond: false });
        }
        Some(high) => (
            (high.samples / low.samples).ln() / (low.error / high.error).ln(),
            (high.seconds - low.seconds) / (high.samples - low.samples),
            false,
        ),
        None => (2.0, low.seconds / low.samples, true),
    };
    let samples = (low.samples * (low.error / error).powf(exponent)).ceil();
    let seconds = low.seconds + per_sample.max(0.0) * (samples - low.samples);
    Some(Reach { samples: samples as u32, seconds, is_beyond })
}

/// Of each point, whether no other has less error in no more time, or as little in less: Pareto's frontier.
pub fn frontier(points: &[Point]) -> Vec<bool> {
    let beats = |a: &Point, b: &Point| {
        let no_worse = a.error <= b.error && a.seconds <= b.seconds;
        no_worse && (a.error < b.error || a.seconds < b.seconds)
    };
    points.iter().map(|point| !points.iter().any(|other| beats(other, point))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_errors_that_took_as_many_samples_have_a_time() {
        let point = |seconds, error| Point { samples: 8.0, seconds, error };
        let found = reach(&[point(1.0, 0.06), point(1.5, 0.04)], 0.05).unwrap();
        assert_eq!((found.samples, found.seconds, found.is_beyond), (8, 1.5, false));
    }

    fn point(samples: f64, seconds: f64, error: f64) -> Point {
        Point { samples, seconds, error }
    }

    /// A picture that takes nothing before its first sample.
    fn curve(scale: f64, exponent: f64) -> Vec<Point> {
        let samples = [2.0_f64, 4.0, 8.0, 16.0];
        samples.map(|n| point(n, 0.5 * n, scale * n.powf(exponent))).into()
    }

    #[test]
    fn a_power_is_found_and_followed() {
        for exponent in [-0.5, -0.7] {
            let points = curve(0.4, exponent);
            assert!((slope(&points).unwrap() - exponent).abs() < 1e-12);
            let wanted = 0.4 * 11.5_f64.powf(exponent);
            let found = reach(&points, wanted).unwrap();
            assert_eq!((found.samples, found.is_beyond), (12, false));
            assert!((found.seconds - 6.0).abs() < 1e-9, "{found:?}");
        }
        // Beyond what was measured the root is assumed.
        let found = reach(&curve(0.4, -0.7), 0.4 * 16.0_f64.powf(-0.7) / 2.0).unwrap();
        assert_eq!((found.samples.div_ceil(2), found.is_beyond), (32, true));
        assert_eq!(
            (slope(&[]), slope(&curve(1.0, -0.5)[..1]), reach(&[], 0.1)),
            (None, None, None)
        );
        assert_eq!(reach(&curve(0.4, -0.5), 1.0).unwrap().samples, 2);
    }

    #[test]
    fn lucky_budgets_are_not_trusted() {
        let mut points = curve(0.4, -0.5);
        points[0].error = 0.01;
        assert!(reach(&points, 0.12).unwrap().samples > 8);
    }

    #[test]
    fn no_point_of_the_frontier_is_beaten() {
        let points = [
            point(1.0, 1.0, 0.4),
            point(1.0, 2.0, 0.2),
            point(1.0, 2.0, 0.3),
            point(1.0, 3.0, 0.2),
            point(1.0, 4.0, 0.1),
            point(1.0, 0.5, 0.5),
        ];
        assert_eq!(frontier(&points), [true, true, false, false, true, true]);
        // Twins beat nobody.
        assert_eq!(frontier(&[points[0], points[0]]), [true, true]);
    }
}
