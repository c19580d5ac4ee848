//! Output names with a place for the frame number: `street.####.exr`, `street.%04d.exr`.

use super::frames::Frames;
use std::path::PathBuf;
use thiserror::Error;

/// A pattern from which every frame gets its name. Each run of `#` is the frame number padded with
/// zeros to the run's length; `%d` and `%04d` do as in C; `%%` is a percent sign. A number that is
/// longer than its place is written in full.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameNames {
    pattern: String,
    parts: Vec<Part>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum Part {
    Text(String),
    /// The frame number, at least so many characters long.
    Number(usize),
}

/// Why a pattern does not name the frames.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum FrameNamesError {
    /// Several frames, one name.
    #[error(
        "all {count} frames would be written to '{pattern}'; give the name a place for the frame \
         number, such as '{suggestion}'"
    )]
    Shared {
        /// The pattern.
        pattern: String,
        /// How many frames there are.
        count: usize,
        /// The same name with a place for the number.
        suggestion: String,
    },
    /// A `%` that does not begin `%d`, `%04d` or `%%`.
    #[error("'{0}' has a % that is neither %d nor %04d; write %% for a percent sign")]
    Percent(String),
    /// `###.###`.
    #[error("'{0}' asks for parts of frames (#.#); frames are whole numbers")]
    SubFrames(String),
    /// A pattern that names a folder, or nothing.
    #[error("'{0}' names no file")]
    NoFile(String),
}

impl FrameNames {
    /// Understands a pattern.
    pub fn new(pattern: &str) -> Result<FrameNames, FrameNamesError> {
        if pattern.contains("#.#") {
            return Err(FrameNamesError::SubFrames(pattern.into()));
        }
        if pattern.is_empty() || pattern.ends_with(std::path::is_separator) {
            return Err(FrameNamesError::NoFile(pattern.into()));
        }
        let wrong = || FrameNamesError::Percent(pattern.into());
        let (mut parts, mut text, mut rest) = (Vec::new(), String::new(), pattern);
        while let Some(next) = rest.chars().next() {
            let width = match next {
                '#' => {
                    let run = rest.len() - rest.trim_start_matches('#').len();
                    rest = &rest[run..];
                    run
                }
                '%' if rest.starts_with("%%") => {
                    text.push('%');
                    rest = &rest[2..];
                    continue;
                }
                '%' => {
                    let (width, after) = rest[1..].split_once('d').ok_or_else(wrong)?;
                    rest = after;
                    c_width(width).ok_or_else(wrong)?
                }
                other => {
                    text.push(other);
                    rest = &rest[other.len_utf8()..];
                    continue;
                }
            };
            parts.extend([Part::Text(std::mem::take(&mut text)), Part::Number(width)]);
        }
        parts.push(Part::Text(text));
        Ok(FrameNames { pattern: pattern.into(), parts })
    }

    /// Makes sure that every frame has a name of its own.
    pub fn check(&self, frames: &Frames) -> Result<(), FrameNamesError> {
        let count = frames.as_slice().len();
        let numbered = self.parts.iter().any(|part| matches!(part, Part::Number(_)));
        if count <= 1 || numbered {
            return Ok(());
        }
        let file = self.pattern.rfind(std::path::is_separator).map_or(0, |at| at + 1);
        let dot = self.pattern[file..].rfind('.').map_or(self.pattern.len(), |at| file + at);
        let suggestion = format!("{}.####{}", &self.pattern[..dot], &self.pattern[dot..]);
        Err(FrameNamesError::Shared { pattern: self.pattern.clone(), count, suggestion })
    }

    /// The name of a frame.
    pub fn path(&self, frame: i32) -> PathBuf {
        let text = |part: &Part| match part {
            Part::Text(text) => text.clone(),
            Part::Number(width) => format!("{frame:0width$}"),
        };
        self.parts.iter().map(text).collect::<String>().into()
    }
}

/// The width between `%` and `d`: nothing, or `0` and one or two digits.
fn c_width(text: &str) -> Option<usize> {
    match text.strip_prefix('0') {
        None => text.is_empty().then_some(1),
        Some(digits) => {
            let is_short = (1..=2).contains(&digits.len());
            let is_number = is_short && digits.bytes().all(|b| b.is_ascii_digit());
            if is_number { digits.parse().ok() } else { None }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn name(pattern: &str, frame: i32) -> String {
        FrameNames::new(pattern).unwrap().path(frame).to_str().unwrap().into()
    }

    #[test]
    fn places_take_the_number() {
        for (pattern, frame, expected) in [
            ("out/street.####.exr", 7, "out/street.0007.exr"),
            ("out/street.%04d.exr", 7, "out/street.0007.exr"),
            ("a.%d.exr", 1001, "a.1001.exr"),
            ("a.#.exr", 1001, "a.1001.exr"),
            ("a.##.exr", 1001, "a.1001.exr"),
            ("a.####.exr", -5, "a.-005.exr"),
            ("f####/a_%%_####.exr", 12, "f0012/a_%_0012.exr"),
            ("straße.###.exr", 3, "straße.003.exr"),
            ("still.exr", 3, "still.exr"),
        ] {
            assert_eq!(name(pattern, frame), expected, "{pattern}");
        }
    }

    #[test]
    fn frames_never_share_a_name() {
        let check = |pattern: &str, frames: &str| {
            FrameNames::new(pattern).unwrap().check(&frames.parse().unwrap())
        };
        assert!(check("still.exr", "7").is_ok() && check("a.####.exr", "1-9").is_ok());
        for (pattern, suggestion) in [
            ("out.v2/still.exr", "'out.v2/still.####.exr'"),
            ("out.v2/still", "'out.v2/still.####'"),
            ("100%%.exr", "'100%%.####.exr'"),
        ] {
            let error = check(pattern, "1-3").unwrap_err().to_string();
            assert!(error.contains(suggestion) && error.contains("all 3 frames"), "{error}");
        }
    }

    #[test]
    fn patterns_that_name_nothing_are_refused() {
        for pattern in
            ["a.%s.exr", "a%.exr", "a.%4d.exr", "a.%0d.exr", "a.%0999d.exr", "%", "a.%-4d"]
        {
            let error = FrameNames::new(pattern).unwrap_err();
            assert!(matches!(error, FrameNamesError::Percent(_)), "{pattern}: {error}");
        }
        assert!(matches!(FrameNames::new("a.###.###.exr"), Err(FrameNamesError::SubFrames(_))));
        assert!(matches!(FrameNames::new("out/"), Err(FrameNamesError::NoFile(_))));
        assert!(matches!(FrameNames::new(""), Err(FrameNamesError::NoFile(_))));
    }
}
