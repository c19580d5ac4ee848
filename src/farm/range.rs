//! Frames as OpenCue writes them: `1-10`, `1-10x3`, `1-10y3`, `1-10:3`, and lists of these.
//!
//! Source: `FileSequence.FrameSet` of OpenCue's Python library, which tests compare with, and Cuebot's
//! class of that name. `x3` takes every third frame, `y3` all but every third. `:3` takes all frames
//! in an interleaved order: first every third, then those in between in ever smaller steps. A range whose
//! last frame is the smaller one needs a negative step, if any. Where the programs' own frame ranges
//! ([`crate::render::frames`]) differ, they are more lenient.

use std::collections::HashSet;
use thiserror::Error;

/// Cuebot takes no more frames in a job.
pub const MOST_FRAMES: usize = 100_000;

/// Why a text does not say which frames.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum RangeError {
    /// Neither a frame nor a range.
    #[error(
        "'{0}' is no frame range; write 1001-1048, 1001-1048x2, 1001-1048y2, 1001-1048:2 or 1,5,9"
    )]
    Syntax(String),
    /// A step of zero, or one that leads away from the last frame.
    #[error("the step of '{0}' never reaches its last frame; descend as 10-1x-3")]
    Step(String),
    /// `1-9y1`.
    #[error("'{0}' leaves no frame out of which to make a task")]
    Empty(String),
    /// More than [`MOST_FRAMES`].
    #[error("'{0}' is more than the {MOST_FRAMES} frames that Cuebot takes; divide the job")]
    TooMany(String),
}

/// The frames of a text, in its order, each once; at least one.
pub fn parse(text: &str) -> Result<Vec<i32>, RangeError> {
    let too_many = || RangeError::TooMany(shortened(text));
    let (mut frames, mut seen, mut expanded) = (Vec::new(), HashSet::new(), 0);
    for part in text.trim().split(',') {
        for frame in expand(part)? {
            expanded += 1;
            if expanded > MOST_FRAMES {
                return Err(too_many());
            }
            if seen.insert(frame) {
                frames.push(frame);
            }
        }
    }
    match frames.is_empty() {
        true => Err(RangeError::Empty(shortened(text))),
        false => Ok(frames),
    }
}

/// Frames as a text that [`parse`] reads back: ranges of equal steps, as short as one pass finds them.
pub fn format(frames: &[i32]) -> String {
    let mut parts = Vec::new();
    let mut rest = frames;
    while let [first, ..] = rest {
        let step_to = |i: usize| i64::from(rest[i]) - i64::from(rest[i - 1]);
        let step = if rest.len() > 1 { step_to(1) } else { 0 };
        let run = 1 + (1..rest.len()).take_while(|&i| step != 0 && step_to(i) == step).count();
        let last = rest[run - 1];
        let taken = match (run, step) {
            (1, _) => (1, first.to_string()),
            (_, 1 | -1) => (run, format!("{first}-{last}")),
            (2, _) => (1, first.to_string()),
            _ => (run, format!("{first}-{last}x{step}")),
        };
        rest = &rest[taken.0..];
        parts.push(taken.1);
    }
    parts.join(",")
}

/// How the frames of a part of a list are taken.
enum Step {
    By(i64),
    AllBut(i64),
    Interleaved(i64),
}

fn expand(part: &str) -> Result<Vec<i32>, RangeError> {
    let wrong = || RangeError::Syntax(shortened(part));
    if let Some(frame) = number(part) {
        return Ok(vec![frame]);
    }
    // A dash that is not the sign of the first number.
    let dash = part.char_indices().skip(1).find(|&(_, c)| c == '-').map(|(at, _)| at);
    let (first, rest) = dash.map(|at| (&part[..at], &part[at + 1..])).ok_or_else(wrong)?;
    let mark = rest.find(['x', 'y', ':']);
    let (last, step) = mark.map_or((rest, None), |at| (&rest[..at], Some(&rest[at..])));
    let number = |text| number(text).map(i64::from).ok_or_else(wrong);
    let (first, last) = (number(first)?, number(last)?);
    let default = if last < first { -1 } else { 1 };
    let step = match step.map(|text| text.split_at(1)) {
        None => Step::By(default),
        Some(("x", step)) => Step::By(number(step)?),
        Some(("y", step)) => Step::AllBut(number(step)?),
        Some((_, step)) => Step::Interleaved(number(step)?),
    };
    let (Step::By(size) | Step::AllBut(size) | Step::Interleaved(size)) = step;
    // As in OpenCue, one frame has no descending step.
    if size.signum() != default {
        return Err(RangeError::Step(shortened(part)));
    }
    let taken = if matches!(step, Step::By(_)) { size } else { default };
    if ((last - first) / taken) as usize >= MOST_FRAMES {
        return Err(RangeError::TooMany(shortened(part)));
    }
    let by = |first: i64, size: i64| {
        let count = if (last - first) * size < 0 { 0 } else { (last - first) / size + 1 };
        (0..count).map(move |i| (first + i * size) as i32)
    };
    Ok(match step {
        Step::By(size) => by(first, size).collect(),
        Step::AllBut(size) => {
            let out: HashSet<i32> = by(first, size).collect();
            by(first, default).filter(|frame| !out.contains(frame)).collect()
        }
        Step::Interleaved(mut size) => {
            let (mut start, mut frames, mut seen) = (first, Vec::new(), HashSet::new());
            while size != 0 {
                frames.extend(by(start, size).filter(|&frame| seen.insert(frame)));
                start += default;
                size /= 2;
            }
            frames
        }
    })
}

/// A whole number without a plus sign.
fn number(text: &str) -> Option<i32> {
    let digits = text.strip_prefix('-').unwrap_or(text);
    let is_number = !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
    is_number.then(|| text.parse().ok()).flatten()
}

/// A text that fits into a message.
fn shortened(text: &str) -> String {
    match text.char_indices().nth(60) {
        Some((at, _)) => format!("{}...", &text[..at]),
        None => text.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn every_form_names_the_frames_that_opencue_means() {
        // What FileSequence.FrameSet gave; tests/farm compares many more.
        for (text, expected) in [
            ("7", vec![7]),
            ("1-10x3", vec![1, 4, 7, 10]),
            ("1-10y3", vec![2, 3, 5, 6, 8, 9]),
            ("10-1y-3", vec![9, 8, 6, 5, 3, 2]),
            ("1-10:3", vec![1, 4, 7, 10, 2, 3, 5, 6, 8, 9]),
            ("1-10:5", vec![1, 6, 2, 4, 8, 10, 3, 5, 7, 9]),
            ("10-1:-3", vec![10, 7, 4, 1, 9, 8, 6, 5, 3, 2]),
            ("4-1", vec![4, 3, 2, 1]),
            ("10-1x-3", vec![10, 7, 4, 1]),
            ("-5--3", vec![-5, -4, -3]),
            ("5-5x3,1,5", vec![5, 1]),
            (" 1-2 ", vec![1, 2]),
            ("2147483646-2147483647", vec![i32::MAX - 1, i32::MAX]),
        ] {
            assert_eq!(parse(text).unwrap(), expected, "{text}");
        }
    }

    #[test]
    fn nonsense_is_refused() {
        for text in
            ["", ",", "1,", "a", "1-", "--1", "+1", "1 - 2", "1-2z3", "1-2x", "1:3", "99999999999"]
        {
            assert!(matches!(parse(text), Err(RangeError::Syntax(_))), "{text}");
        }
        for text in ["1-5x0", "1-5:0", "1-5x-1", "10-1x3", "10-1x1", "5-5x-1"] {
            assert!(matches!(parse(text), Err(RangeError::Step(_))), "{text}");
        }
        assert!(matches!(parse("1-9y1"), Err(RangeError::Empty(_))));
        // The same frames again and again are work, too.
        let again = vec!["1-100000"; 1000].join(",");
        for text in ["0-100000", "-2147483648-2147483647", "1-200000y2", "1-200000:2", &again] {
            assert!(matches!(parse(text), Err(RangeError::TooMany(_))), "{text}");
        }
    }

    #[test]
    fn a_message_is_short_whatever_was_written() {
        let zeros = "0".repeat(1 << 20);
        for text in [
            format!("a{zeros}"),
            format!("1-5x{zeros}"),
            format!("1-{zeros}500000"),
            format!("1-9y{zeros}1"),
            format!("1-5:{zeros}"),
        ] {
            let message = parse(&text).unwrap_err().to_string();
            assert!(message.len() < 200, "{} bytes", message.len());
        }
    }

    #[test]
    fn frames_are_written_shortly() {
        for text in ["7", "1-2", "1,3", "1-9x2", "4-1", "10-1x-3", "1-3,7", "1,3,4,9", "-5--3"] {
            let shorter = format(&parse(text).unwrap());
            assert!(shorter.len() <= text.len(), "{text}: {shorter}");
        }
        assert_eq!(format(&[1, 2, 3, 5, 7, 9, 4, 20]), "1-3,5-9x2,4,20");
        assert_eq!(format(&[i32::MIN, i32::MAX]), "-2147483648,2147483647");
    }

    proptest! {
        #[test]
        fn what_is_written_is_read_back(frames in prop::collection::hash_set(-30..30, 1..20)) {
            let frames: Vec<i32> = frames.into_iter().collect();
            prop_assert_eq!(parse(&format(&frames)).unwrap(), frames);
        }
    }
}
