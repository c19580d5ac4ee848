//! Texture maps of MTL: options, then a file.

use super::text::cut;
use crate::scene::Wrap;
use glam::{Affine2, Mat2, Vec2};

/// What a `map_` statement says.
#[derive(Debug, PartialEq)]
pub(super) struct Map<'a> {
    pub file: &'a str,
    /// Of the scene's texture coordinates, if it scales or moves them.
    pub transform: Option<Affine2>,
    pub wrap: Wrap,
    /// What texels are multiplied by (`-mm 0 gain`).
    pub gain: f32,
    /// Whether it has options that change the picture and are not read.
    pub has_more: bool,
}

impl Map<'_> {
    /// Reads a statement; `None` if it names no file.
    pub(super) fn parse(text: &str) -> Option<Map<'_>> {
        let (mut scale, mut offset) = (Vec2::ONE, Vec2::ZERO);
        let mut map =
            Map { file: "", transform: None, wrap: Wrap::Repeat, gain: 1.0, has_more: false };
        let mut rest = text.trim();
        while let (option, after) = cut(rest)
            && option.starts_with('-')
        {
            rest = after;
            match option {
                "-s" => scale = vector(&mut rest, 1.0),
                "-o" => offset = vector(&mut rest, 0.0),
                "-t" => map.has_more |= vector(&mut rest, 0.0) != Vec2::ZERO,
                "-clamp" if word(&mut rest) == "on" => map.wrap = Wrap::Clamp,
                "-clamp" => {}
                "-mm" => {
                    let [base, gain] = [(); 2].map(|()| number(&mut rest));
                    map.gain = gain.filter(|gain| *gain >= 0.0).unwrap_or(1.0);
                    map.has_more |= base != Some(0.0) || gain != Some(map.gain);
                }
                // They choose how it is filtered, not what it shows.
                "-blendu" | "-blendv" | "-boost" | "-texres" => drop(word(&mut rest)),
                _ => {
                    word(&mut rest);
                    map.has_more = true;
                }
            }
        }
        if (scale, offset) != (Vec2::ONE, Vec2::ZERO) {
            // OBJ's v points up, the scene's down: v -> 1 - v on both sides.
            let translation = Vec2::new(offset.x, 1.0 - scale.y - offset.y);
            map.transform = Some(Affine2 { matrix2: Mat2::from_diagonal(scale), translation });
        }
        map.file = rest.trim_matches('"');
        (!rest.is_empty()).then_some(map)
    }
}

fn word<'a>(rest: &mut &'a str) -> &'a str {
    let (word, after) = cut(rest);
    *rest = after;
    word
}

/// A number, if the next word is one that can be calculated with.
fn number(rest: &mut &str) -> Option<f32> {
    let number = cut(rest).0.parse().ok().filter(|number: &f32| number.abs() < 1e9)?;
    word(rest);
    Some(number)
}

/// One to three numbers, of which two count.
fn vector(rest: &mut &str, spare: f32) -> Vec2 {
    let [x, y, _] = [(); 3].map(|()| number(rest));
    Vec2::new(x.unwrap_or(spare), y.unwrap_or(spare))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_told_from_names() {
        let plain = Map::parse("my wood.png").unwrap();
        assert_eq!((plain.file, plain.transform, plain.has_more), ("my wood.png", None, false));
        let map = Map::parse("-s 2 4 1 -o .5 -blendu on -clamp on -mm 0 3 a b.png").unwrap();
        assert_eq!((map.file, map.gain, map.wrap), ("a b.png", 3.0, Wrap::Clamp));
        let transform = map.transform.unwrap();
        // OBJ's (0.25, 0.25) is the scene's (0.25, 0.75); scaled and moved it is (1, 1) there, (1, 0) here.
        assert_eq!(transform.transform_point2(Vec2::new(0.25, 0.75)), Vec2::new(1.0, 0.0));
        for odd in ["-mm 0.5 1 a.png", "-imfchan r a.png", "-t 1 a.png", "-mm x a.png"] {
            let map = Map::parse(odd).unwrap();
            assert!(map.has_more, "{odd}");
        }
        assert_eq!(Map::parse("-clamp off \"a.png\"").unwrap().file, "a.png");
        assert!(Map::parse("-s 1 1 1").is_none() && Map::parse("").is_none());
    }
}
