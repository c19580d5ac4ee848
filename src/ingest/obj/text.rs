//! The text of OBJ and MTL files, made fit for `tobj`.

use crate::ingest::error::Fault;
use std::borrow::Cow;

/// How far into a file a zero byte tells that it is no text.
const LOOKED_AT_BYTES: usize = 4096;

/// The text of a file; what is not UTF-8 in it (names and comments, in practice) is replaced.
pub(super) fn decode(bytes: &[u8]) -> Result<Cow<'_, str>, &'static str> {
    if bytes.starts_with(b"\xFF\xFE") || bytes.starts_with(b"\xFE\xFF") {
        return Err("is UTF-16");
    }
    if bytes[..bytes.len().min(LOOKED_AT_BYTES)].contains(&0) {
        return Err("is not text");
    }
    Ok(String::from_utf8_lossy(bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes)))
}

/// What a look at every line told.
pub(super) struct Lines {
    /// There are polylines, which `tobj` would take for faces.
    pub polylines: bool,
}

/// Checks the corners of faces: `tobj` computes with indices before it looks at their range.
pub(super) fn check(text: &str) -> Result<Lines, Fault> {
    let mut lines = Lines { polylines: false };
    // Positions, texture coordinates and normals so far: what a negative index counts back from.
    let mut counts = [0i64; 3];
    for (i, line) in text.lines().enumerate() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => counts[0] += 1,
            Some("vt") => counts[1] += 1,
            Some("vn") => counts[2] += 1,
            Some("l") => lines.polylines = true,
            Some("f") => {
                for corner in words {
                    check_corner(corner, &counts).map_err(|problem| {
                        Fault::new(format!("line {}", i + 1), format!("{corner:?} {problem}"))
                    })?;
                }
            }
            _ => {}
        }
    }
    Ok(lines)
}

fn check_corner(corner: &str, counts: &[i64; 3]) -> Result<(), &'static str> {
    for (i, index) in corner.split('/').enumerate() {
        let Some(count) = counts.get(i) else { return Err("has more than three indices") };
        if index.is_empty() && i > 0 {
            continue;
        }
        match index.parse::<i64>() {
            Ok(0) => return Err("has an index of 0; OBJ counts from 1"),
            Ok(index) if -*count <= index && index <= i64::from(u32::MAX) => {}
            Ok(_) => return Err("has an index out of range"),
            Err(_) => return Err("is not a corner of a face"),
        }
    }
    Ok(())
}

/// The text without polylines.
pub(super) fn without_polylines(text: &str) -> String {
    let is_polyline = |line: &&str| line.split_whitespace().next() == Some("l");
    let kept: Vec<&str> = text.lines().filter(|line| !is_polyline(line)).collect();
    kept.join("\n")
}

/// The text of a material library in which colours have three numbers each, as `tobj` takes for granted:
/// by the MTL specification one alone stands for all three.
pub(super) fn with_whole_colors(text: &str) -> Result<String, String> {
    let whole = |(i, line): (usize, &str)| {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            [name @ ("Ka" | "Kd" | "Ks" | "Ke"), grey] => {
                Ok(format!("{name} {grey} {grey} {grey}"))
            }
            ["Ka" | "Kd" | "Ks" | "Ke"] | ["Ka" | "Kd" | "Ks" | "Ke", _, _] => {
                Err(format!("line {}: a colour has one number or three", i + 1))
            }
            _ => Ok(line.to_string()),
        }
    };
    let lines: Result<Vec<String>, String> = text.lines().enumerate().map(whole).collect();
    Ok(lines?.join("\n"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_colour_of_one_number_is_grey_and_of_two_is_none() {
        let text = "newmtl a\n Ke 4\nKd 1 .5 0\n# Ks 1";
        let whole = with_whole_colors(text).unwrap();
        assert_eq!(whole, "newmtl a\nKe 4 4 4\nKd 1 .5 0\n# Ks 1");
        for bad in ["Ke", "newmtl a\nKs 1 2"] {
            assert!(with_whole_colors(bad).unwrap_err().contains("one number or three"), "{bad}");
        }
    }

    #[test]
    fn indices_are_looked_at_before_they_are_used() {
        let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\n";
        for good in ["f 1 2 3", "f -3//-1 -2//1 -1//1", "f 1/ 2/ 3/"] {
            assert!(check(&format!("{vertices}{good}")).is_ok(), "{good}");
        }
        for bad in
            ["f 0 1 2", "f -4 1 2", "f 1/-1 2 3", "f 1 2 9999999999", "f 1/1/1/1 2 3", "f a b c"]
        {
            let fault = check(&format!("{vertices}{bad}")).err().expect(bad);
            assert!(fault.in_file("a".as_ref()).object.contains("line 5"), "{bad}");
        }
    }

    #[test]
    fn polylines_are_no_faces() {
        let text = "v 0 0 0\n l 1 2 3\nf 1 2 3";
        assert!(check(&text.replace("f 1 2 3", "")).unwrap().polylines);
        assert_eq!(without_polylines(text), "v 0 0 0\nf 1 2 3");
    }
}
