//! The text of OBJ and MTL files: decoded, and cut into statements.

use std::borrow::Cow;

/// How far into a file a zero byte tells that it is no text.
const LOOKED_AT_BYTES: usize = 4096;

/// The text of a file. What is not UTF-8 in it (names and comments, in practice) is replaced.
pub(super) fn decode(bytes: &[u8]) -> Result<Cow<'_, str>, &'static str> {
    if bytes.starts_with(b"\xFF\xFE") || bytes.starts_with(b"\xFE\xFF") {
        return Err("is UTF-16");
    }
    if bytes[..bytes.len().min(LOOKED_AT_BYTES)].contains(&0) {
        return Err("is not text");
    }
    Ok(String::from_utf8_lossy(bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes)))
}

/// One statement: a keyword and what follows it.
#[derive(Debug, PartialEq)]
pub(super) struct Statement<'a> {
    /// Number of its first line, from 1 on.
    pub line: usize,
    pub keyword: Cow<'a, str>,
    /// The rest, trimmed.
    pub rest: Cow<'a, str>,
}

/// The statements of a text. A backslash at the end of a line joins the next one to it.
pub(super) fn statements(text: &str) -> impl Iterator<Item = Statement<'_>> {
    let mut lines = text.lines().enumerate();
    std::iter::from_fn(move || {
        loop {
            let (number, first) = lines.next()?;
            let mut whole = Cow::Borrowed(first.trim());
            while let Some(head) = whole.strip_suffix('\\') {
                let next = lines.next().map_or("", |(_, next)| next.trim());
                whole = Cow::Owned(format!("{head} {next}"));
            }
            if whole.is_empty() || whole.starts_with('#') {
                continue;
            }
            let line = number + 1;
            return Some(match whole {
                Cow::Borrowed(whole) => {
                    let (keyword, rest) = cut(whole);
                    Statement { line, keyword: keyword.into(), rest: rest.into() }
                }
                Cow::Owned(whole) => {
                    let (keyword, rest) = cut(&whole);
                    let (keyword, rest) = (keyword.to_string(), rest.to_string());
                    Statement { line, keyword: keyword.into(), rest: rest.into() }
                }
            });
        }
    })
}

/// The first word, and the rest without the space around it.
pub(super) fn cut(text: &str) -> (&str, &str) {
    let (word, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
    (word, rest.trim())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statements_are_cut() {
        let text = "# a\n\n  f 1 2 \\\n 3\r\nusemtl\tred wall \r\nv\n f 1 \\";
        let cut: Vec<_> =
            statements(text).map(|s| (s.line, s.keyword.to_string(), s.rest.to_string())).collect();
        let expected = [(3, "f", "1 2  3"), (5, "usemtl", "red wall"), (6, "v", ""), (7, "f", "1")];
        assert_eq!(cut, expected.map(|(l, k, r)| (l, k.to_string(), r.to_string())));
    }

    #[test]
    fn what_is_no_text_is_told() {
        assert!(decode(b"\xFF\xFEv\0").is_err() && decode(b"v 0\0").is_err());
        assert_eq!(decode(b"\xEF\xBB\xBFv").unwrap(), "v");
        assert_eq!(decode(b"caf\xe9").unwrap(), "caf\u{fffd}");
    }
}
