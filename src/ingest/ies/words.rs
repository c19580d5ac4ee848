//! The numbers of an IES file, in order, with the lines that they are on.

use std::ops::RangeInclusive;

/// Numbers between the line `TILT=` and the end of the file.
pub(super) struct Words<'a> {
    lines: Vec<&'a str>,
    /// The line that is being read, from 0, and what is left of it.
    at: usize,
    rest: &'a str,
    tilt: &'a str,
    is_before_1995: bool,
}

impl<'a> Words<'a> {
    /// Goes to the line `TILT=`.
    pub fn after_heading(text: &'a str) -> Result<Words<'a>, String> {
        // Old files end their lines as old systems did. A carriage return before a line feed leaves an empty line.
        let lines: Vec<&str> = text.split(['\n', '\r']).collect();
        let tilt_of = |line: &'a str| {
            let line = line.trim_start_matches(['\u{feff}', ' ', '\t']);
            line.get(..5)
                .filter(|start| start.eq_ignore_ascii_case("TILT="))
                .map(|_| line[5..].trim())
        };
        let found = lines.iter().enumerate().find_map(|(at, line)| Some((at, tilt_of(line)?)));
        let (at, tilt) = found.ok_or("it has no line TILT=, so it is no IES file (LM-63)")?;
        let first =
            lines.iter().find(|line| !line.trim().is_empty()).map_or("", |line| line.trim());
        let is_named = first.trim_start_matches('\u{feff}').starts_with("IES");
        let is_late = ["1995", "2002", "2019"].iter().any(|year| first.contains(year))
            || ["-95", "-02", "-19"].iter().any(|year| first.ends_with(year));
        let is_before_1995 = !(is_named && is_late);
        Ok(Words { lines, at: at + 1, rest: "", tilt, is_before_1995 })
    }

    /// Whether the file is of 1986 or 1991.
    pub fn is_before_1995(&self) -> bool {
        self.is_before_1995
    }

    /// Skips the tilt of the lamp; returns whether it makes a difference.
    pub fn skip_tilt(&mut self) -> Result<bool, String> {
        if !self.tilt.eq_ignore_ascii_case("INCLUDE") {
            return Ok(!self.tilt.eq_ignore_ascii_case("NONE"));
        }
        self.number("how the lamp lies in the luminaire")?;
        let pairs = self.count("angles of tilt", 0..=super::MOST_ANGLES)?;
        for _ in 0..pairs {
            self.number("an angle of tilt")?;
        }
        let mut differs = false;
        for _ in 0..pairs {
            differs |= self.number("a factor of tilt")? != 1.0;
        }
        Ok(differs)
    }

    /// The next number, finite.
    pub fn number(&mut self, what: &str) -> Result<f64, String> {
        let is_between = |c: char| c == ',' || c.is_whitespace() || c == '\u{1a}';
        loop {
            self.rest = self.rest.trim_start_matches(is_between);
            if !self.rest.is_empty() {
                break;
            }
            let Some(line) = self.lines.get(self.at) else {
                return Err(format!("it ends where {what} should be"));
            };
            (self.rest, self.at) = (line, self.at + 1);
        }
        let end = self.rest.find(is_between).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        let number = word.parse().ok().filter(|number: &f64| number.is_finite());
        number.ok_or_else(|| {
            let word: String = word.chars().take(24).collect();
            format!("{}: {word:?} stands where {what} should be", self.line())
        })
    }

    /// A whole number within limits.
    pub fn count(&mut self, what: &str, limits: RangeInclusive<usize>) -> Result<usize, String> {
        let number = self.number(what)?;
        let count = number as usize;
        if count as f64 == number && limits.contains(&count) {
            return Ok(count);
        }
        let (least, most) = (limits.start(), limits.end());
        Err(format!(
            "{}: {what}: {number} is not a whole number from {least} to {most}",
            self.line()
        ))
    }

    /// Degrees, strictly ascending.
    pub fn angles(&mut self, count: usize, what: &str) -> Result<Vec<f64>, String> {
        let mut angles: Vec<f64> = Vec::with_capacity(count);
        for _ in 0..count {
            let angle = self.number(what)?;
            if let Some(&last) = angles.last().filter(|&&last| last >= angle) {
                return Err(format!(
                    "{}: {what}, {angle}, does not ascend from {last}",
                    self.line()
                ));
            }
            angles.push(angle);
        }
        Ok(angles)
    }

    /// Bytes that were not read.
    pub fn bytes_left(&self) -> usize {
        self.rest.len() + self.lines.iter().skip(self.at).map(|line| line.len() + 1).sum::<usize>()
    }

    /// The line of the number that was read last, as an editor counts.
    pub fn line(&self) -> String {
        format!("line {}", self.at)
    }
}
