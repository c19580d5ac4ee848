//! Which frames: `1001-1048`, `1001-1048x2`, `1,5,9`, `1001:1048x2`.
//!
//! A list is comma-separated; a range is `first-last` or, as usdrecord writes it, `first:last`,
//! with an optional step `xN`. Numbers are whole and may be negative; a range whose last frame is
//! the smaller one descends. `first-last:N` is refused, since it means two things (see
//! [`FramesError::Ambiguous`]).

use std::str::FromStr;
use thiserror::Error;

/// More frames than any shot has: a slip of the keyboard.
const MOST_FRAMES: u64 = 1_000_000;

/// Frames in the order they were asked for, each once.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frames(Vec<i32>);

/// Why a text does not say which frames.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum FramesError {
    /// Neither a frame nor a range.
    #[error(
        "'{0}' is not a frame range; write frames as 1001-1048, 1001-1048x2, 1001:1048x2 or 1,5,9 \
         (whole numbers)"
    )]
    Syntax(String),
    /// `a-b:c`.
    #[error(
        "'{first}-{last}:{step}' means two things: every {step}. frame from {first} to {last} to \
         Slurm and OpenJD, but all of them in an interleaved order to OpenCue. For the former write \
         {first}-{last}x{step}, for all frames {first}-{last}"
    )]
    Ambiguous {
        /// What stands before the dash.
        first: String,
        /// What stands between dash and colon.
        last: String,
        /// What stands after the colon.
        step: String,
    },
    /// A step of zero, or one that leads away from the last frame.
    #[error("the step of '{0}' never reaches the last frame")]
    Step(String),
    /// More than a million.
    #[error("'{0}' is more than a million frames")]
    TooMany(String),
}

impl Frames {
    /// A single frame.
    pub fn one(frame: i32) -> Frames {
        Frames(vec![frame])
    }

    /// The frames, in order; at least one.
    pub fn as_slice(&self) -> &[i32] {
        &self.0
    }
}

impl FromStr for Frames {
    type Err = FramesError;

    fn from_str(text: &str) -> Result<Frames, FramesError> {
        let mut frames = Vec::new();
        let mut seen = std::collections::HashSet::new();
        for part in text.split(',') {
            for frame in expand(part.trim())? {
                if seen.insert(frame) {
                    frames.push(frame);
                }
                if frames.len() as u64 > MOST_FRAMES {
                    return Err(FramesError::TooMany(text.into()));
                }
            }
        }
        Ok(Frames(frames))
    }
}

/// The frames of one part of a list.
fn expand(part: &str) -> Result<impl Iterator<Item = i32>, FramesError> {
    let wrong = || FramesError::Syntax(part.into());
    let number = |text: &str| text.parse::<i32>().map_err(|_| wrong());
    let (range, step) = match part.split_once('x') {
        Some((range, step)) => (range, Some(number(step)?)),
        None => (part, None),
    };
    // A dash that is not the sign of the first number.
    let dash = range.char_indices().skip(1).find(|&(_, c)| c == '-').map(|(at, _)| at);
    let colon = range.find(':');
    if let (Some(dash), Some(colon)) = (dash, colon)
        && dash < colon
        && !range[..colon].ends_with('-')
    {
        return Err(FramesError::Ambiguous {
            first: range[..dash].into(),
            last: range[dash + 1..colon].into(),
            step: range[colon + 1..].into(),
        });
    }
    let (first, last) = match colon.or(dash) {
        Some(at) => (number(&range[..at])?, number(&range[at + 1..])?),
        None if step.is_none() => (number(range)?, number(range)?),
        None => return Err(wrong()),
    };
    let distance = i64::from(last) - i64::from(first);
    // The sign of a step may be left out of a range that descends.
    let step = match step.map(i64::from) {
        None => {
            if distance < 0 {
                -1
            } else {
                1
            }
        }
        Some(step) if distance < 0 && step > 0 => -step,
        Some(step) => step,
    };
    if step == 0 || distance.signum() * step < 0 {
        return Err(FramesError::Step(part.into()));
    }
    let count = (distance / step) as u64;
    if count >= MOST_FRAMES {
        return Err(FramesError::TooMany(part.into()));
    }
    Ok((0..=count as i64).map(move |i| (i64::from(first) + i * step) as i32))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frames(text: &str) -> Vec<i32> {
        text.parse::<Frames>().unwrap_or_else(|error| panic!("{error}")).0
    }

    #[test]
    fn every_form_names_its_frames() {
        for (text, expected) in [
            ("7", vec![7]),
            ("1-4", vec![1, 2, 3, 4]),
            ("1001-1007x3", vec![1001, 1004, 1007]),
            ("1001-1008x3", vec![1001, 1004, 1007]),
            ("1,5,9", vec![1, 5, 9]),
            ("1001:1005x2", vec![1001, 1003, 1005]),
            ("101:103", vec![101, 102, 103]),
            ("4-1", vec![4, 3, 2, 1]),
            ("105:101x2", vec![105, 103, 101]),
            ("10-1x-3", vec![10, 7, 4, 1]),
            ("-5--3", vec![-5, -4, -3]),
            ("-1-1", vec![-1, 0, 1]),
            ("-1:-3", vec![-1, -2, -3]),
            ("5-5", vec![5]),
            ("5-5x4", vec![5]),
            ("1-3, 2-5 ,1", vec![1, 2, 3, 4, 5]),
            ("2147483646-2147483647", vec![i32::MAX - 1, i32::MAX]),
        ] {
            assert_eq!(frames(text), expected, "{text}");
        }
    }

    #[test]
    fn what_means_two_things_is_refused_with_both() {
        let error = "1001-1048:2".parse::<Frames>().unwrap_err().to_string();
        for word in ["Slurm", "OpenJD", "OpenCue", "interleaved", "1001-1048x2", "every 2."] {
            assert!(error.contains(word), "{error}");
        }
        assert!(matches!("-5--1:2".parse::<Frames>(), Err(FramesError::Ambiguous { .. })));
    }

    #[test]
    fn nonsense_is_refused_and_named() {
        for text in [
            "",
            ",",
            "1,",
            "a",
            "1-",
            "-",
            "1--",
            "1-2-3",
            "1:2:3",
            "1.5",
            "1-2y3",
            "x2",
            "3x2",
            "1-9x",
            "1 - 3",
            "1-99999999999",
            "0x10",
            "1-3x2x1",
        ] {
            let error = text.parse::<Frames>().unwrap_err();
            assert!(matches!(error, FramesError::Syntax(_)), "{text}: {error}");
        }
        for text in ["1-5x0", "1:5x-1", "1-1x0"] {
            assert!(matches!(text.parse::<Frames>(), Err(FramesError::Step(_))), "{text}");
        }
        for text in ["0-2000000000", "0-999999,1000000-1000001"] {
            assert!(matches!(text.parse::<Frames>(), Err(FramesError::TooMany(_))), "{text}");
        }
    }
}
