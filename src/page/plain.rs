//! Text that a terminal shows and does not obey.
//!
//! Names in scenes and tree files, and names of files, may hold anything: escape sequences, line ends,
//! characters that turn the direction of writing. [`Plain`] spells such characters out, and [`Lines`]
//! does so for all that a program writes, line by line.

use std::fmt::{self, Display};
use std::io::{self, Write};

/// Displays a text as one line, with every character that is not visible spelled out: `\n`,
/// `\u{1b}`, `\u{202e}`. Backslashes and quotes stay as they are.
pub struct Plain<T>(pub T);

impl<T: Display> Display for Plain<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Write::write_fmt(&mut Spelling(f), format_args!("{}", self.0))
    }
}

/// Spells out what it passes on.
struct Spelling<'a, 'b>(&'a mut fmt::Formatter<'b>);

impl fmt::Write for Spelling<'_, '_> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let mut rest = text;
        while let Some(at) = rest.find(|char| !is_visible(char)) {
            self.0.write_str(&rest[..at])?;
            let Some(char) = rest[at..].chars().next() else { break };
            write!(self.0, "{}", char.escape_debug())?;
            rest = &rest[at + char.len_utf8()..];
        }
        self.0.write_str(rest)
    }
}

/// Whether a character shows itself and does nothing else. Not visible are controls, formats (those
/// of direction among them), separators other than the space, and what Unicode does not assign.
pub(super) fn is_visible(char: char) -> bool {
    if char.is_ascii() {
        return matches!(char, ' '..='~');
    }
    // `str::escape_debug` escapes no combining character after a letter, so accents stay as they are.
    let mut bytes = [b'a', 0, 0, 0, 0];
    let length = 1 + char.encode_utf8(&mut bytes[1..]).len();
    let pair = std::str::from_utf8(&bytes[..length]).unwrap_or_default();
    pair.escape_debug().nth(1) != Some('\\')
}

/// A writer of lines. What one `writeln!` writes is one line of [`Plain`] text, whatever names are in
/// it; only [`write_all`](Write::write_all) passes bytes on as they are.
pub struct Lines<W>(pub W);

impl<W: Write> Write for Lines<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }

    fn write_fmt(&mut self, text: fmt::Arguments<'_>) -> io::Result<()> {
        let text = text.to_string();
        let (line, end) = match text.strip_suffix('\n') {
            Some(line) => (line, "\n"),
            None => (&*text, ""),
        };
        self.0.write_all(format!("{}{end}", Plain(line)).as_bytes())
    }
}

/// JSON text whose strings hold only visible characters. All others become JSON escapes, so the text
/// keeps its meaning.
pub fn plain_json(json: &str) -> String {
    let mut plain = String::with_capacity(json.len());
    for char in json.chars() {
        // Line ends are between strings only: inside them the serializer has escaped them.
        if is_visible(char) || char == '\n' {
            plain.push(char);
        } else {
            let units = &mut [0; 2];
            char.encode_utf16(units).iter().for_each(|unit| plain += &format!("\\u{unit:04x}"));
        }
    }
    plain
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const EVIL: &str = "\u{1b}[31mred\u{1b}[0m\nerror: \u{202e}x\0\u{7f}\u{9b}2J\u{2028}\u{feff}";

    proptest! {
        #[test]
        fn a_line_is_one_line_of_visible_characters(text in any::<String>()) {
            let plain = Plain(&text).to_string();
            prop_assert!(plain.chars().all(is_visible), "{plain:?}");
            let mut lines = Lines(Vec::new());
            writeln!(lines, "a {text} b").unwrap();
            prop_assert_eq!(String::from_utf8(lines.0).unwrap(), format!("a {plain} b\n"));
        }

        #[test]
        fn plain_json_means_the_same(texts in any::<Vec<String>>()) {
            for json in [serde_json::to_string(&texts), serde_json::to_string_pretty(&texts)] {
                let plain = plain_json(&json.unwrap());
                prop_assert!(plain.chars().all(|char| is_visible(char) || char == '\n'));
                prop_assert_eq!(&serde_json::from_str::<Vec<String>>(&plain).unwrap(), &texts);
            }
        }
    }

    #[test]
    fn what_a_terminal_would_obey_is_spelled_out() {
        assert_eq!(
            Plain(EVIL).to_string(),
            r"\u{1b}[31mred\u{1b}[0m\nerror: \u{202e}x\0\u{7f}\u{9b}2J\u{2028}\u{feff}"
        );
    }

    #[test]
    fn names_of_all_languages_stay_as_they_are() {
        let fine = "/World/Straße/e\u{301}/हिन्दी/灯_12[3] = \"1/2\" \\ 'x' 😀";
        assert_eq!(Plain(fine).to_string(), fine);
    }
}
