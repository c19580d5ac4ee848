//! Output names with a place for the frame number: `street.####.exr`, `street.%04d.exr`.

use super::frames::Frames;
use std::path::{PathBuf, is_separator};
use thiserror::Error;

/// A pattern that gives every frame a name. In the file's own name one run of `#` stands for the frame
/// number, padded with zeros to the run's length; alternatively `%d` or `%04d` does, as in C. There, `%%`
/// is a percent sign and `%#` a number sign. Folder names are taken literally. A number longer than its
/// place is written in full.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameNames {
    pattern: String,
    /// All that stands before the number, or the whole name.
    before: String,
    /// The least length of the number, and what stands after it.
    number: Option<(usize, String)>,
}

/// Why a pattern does not name the frames.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum FrameNamesError {
    /// Several frames, one name.
    #[error(
        "all {count} frames would be written to '{pattern}'; give the file's name a place for the \
         frame number, such as '{suggestion}'"
    )]
    Shared {
        /// The pattern.
        pattern: String,
        /// How many frames there are.
        count: usize,
        /// The same name with a place for the number.
        suggestion: String,
    },
    /// A `%` that does not begin `%d`, `%04d`, `%%` or `%#`.
    #[error("'{0}' has a % that is neither %d nor %04d; write %% for a percent sign")]
    Percent(String),
    /// `###.###`.
    #[error("'{0}' asks for parts of frames (#.#); frames are whole numbers")]
    SubFrames(String),
    /// Two places.
    #[error(
        "'{0}' has several places for the frame number; leave one, and write %# for a number sign"
    )]
    Several(String),
    /// A pattern that names a folder, or nothing.
    #[error("'{0}' names no file")]
    NoFile(String),
}

impl FrameNames {
    /// Parses a pattern.
    pub fn new(pattern: &str) -> Result<FrameNames, FrameNamesError> {
        let (folder, file) = pattern.split_at(start_of_file(pattern));
        if matches!(file, "" | "." | "..") {
            return Err(FrameNamesError::NoFile(pattern.into()));
        }
        let wrong = || FrameNamesError::Percent(pattern.into());
        let (mut before, mut number) = (folder.to_owned(), None);
        let mut rest = file;
        while let Some(next) = rest.chars().next() {
            let text = match &mut number {
                None => &mut before,
                Some((_, after)) => after,
            };
            let width = if next == '#' {
                let run = rest.len() - rest.trim_start_matches('#').len();
                rest = &rest[run..];
                run
            } else if next != '%' || rest.starts_with("%%") || rest.starts_with("%#") {
                // `%%` and `%#` stand for their second character.
                let skipped = if next == '%' { 1 } else { 0 };
                let length = rest[skipped..].chars().next().map_or(0, char::len_utf8);
                text.push_str(&rest[skipped..skipped + length]);
                rest = &rest[skipped + length..];
                continue;
            } else {
                let (width, after) = rest[1..].split_once('d').ok_or_else(wrong)?;
                rest = after;
                c_width(width).ok_or_else(wrong)?
            };
            if number.is_some() {
                let is_fraction = file.contains("#.#");
                let error =
                    if is_fraction { FrameNamesError::SubFrames } else { FrameNamesError::Several };
                return Err(error(pattern.into()));
            }
            number = Some((width, String::new()));
        }
        Ok(FrameNames { pattern: pattern.into(), before, number })
    }

    /// Makes sure that every frame has a name of its own.
    pub fn check(&self, frames: &Frames) -> Result<(), FrameNamesError> {
        let count = frames.as_slice().len();
        if count <= 1 || self.number.is_some() {
            return Ok(());
        }
        let file = start_of_file(&self.pattern);
        let dot = self.pattern[file..].rfind('.').map_or(self.pattern.len(), |at| file + at);
        let suggestion = format!("{}.####{}", &self.pattern[..dot], &self.pattern[dot..]);
        Err(FrameNamesError::Shared { pattern: self.pattern.clone(), count, suggestion })
    }

    /// The name of a frame.
    pub fn path(&self, frame: i32) -> PathBuf {
        match &self.number {
            None => self.before.clone().into(),
            Some((width, after)) => format!("{}{frame:0width$}{after}", self.before).into(),
        }
    }
}

/// Where the file's own name begins.
fn start_of_file(pattern: &str) -> usize {
    pattern.rfind(is_separator).map_or(0, |at| at + 1)
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
            ("a_%%_####.exr", 12, "a_%_0012.exr"),
            ("a%#1_####.exr", 12, "a#1_0012.exr"),
            ("a%##.exr", 12, "a#12.exr"),
            ("%#%%%d%%%#.exr", 12, "#%12%#.exr"),
            // Folders are as they are.
            ("/jobs/shot#12/f.####.exr", 7, "/jobs/shot#12/f.0007.exr"),
            ("####/%04d/50%/%%/#.#/%#/f.##.exr", 7, "####/%04d/50%/%%/#.#/%#/f.07.exr"),
            ("shot#12/still.exr", 7, "shot#12/still.exr"),
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
            ("####/still.exr", "'####/still.####.exr'"),
            ("take%#1.exr", "'take%#1.####.exr'"),
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
        for pattern in ["a.####_##.exr", "%d_%04d.exr", "#a%d", "#%##"] {
            let error = FrameNames::new(pattern).unwrap_err();
            assert!(matches!(error, FrameNamesError::Several(_)), "{pattern}: {error}");
        }
        for pattern in ["out/", "", ".", "out/..", "#/"] {
            let error = FrameNames::new(pattern).unwrap_err();
            assert!(matches!(error, FrameNamesError::NoFile(_)), "{pattern}: {error}");
        }
    }
}
