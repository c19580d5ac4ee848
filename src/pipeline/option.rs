//! Values of command-line options, read alike by both programs.
//!
//! Each function reads the text of one value and refuses what no render can use: what is no number,
//! not finite, or out of range. The error tells what to write.

use super::render_job::Quality;
use crate::render::noise::Grey;
use crate::scene::Medium;
use glam::{DVec3, Vec3};

/// The largest width and height of a picture.
const LARGEST_SIDE: u32 = 1 << 16;
/// The most pixels: a pixel takes about 250 bytes while a frame is rendered.
const MOST_PIXELS: u64 = 1 << 26;
/// More stops than this are beyond the range of a 32-bit number.
const MOST_STOPS: f32 = 126.0;
/// Coordinates in the world stay below this many metres, as those of a scene do.
const FARTHEST_M: f64 = 1e18;

/// A knob: a number from 0 to 1.
pub fn knob(text: &str) -> Result<f32, String> {
    number(text, |knob| (0.0..=1.0).contains(knob), "write a number from 0 to 1")
}

/// The error of a frame: a name, or a number from 0.0001 to 10.
pub fn error(text: &str) -> Result<f64, String> {
    let named = text.parse::<Quality>().map(Quality::error);
    let number = || text.parse().ok().filter(|error| (1e-4..=10.0).contains(error));
    named.ok().or_else(number).ok_or_else(|| {
        "write draft (0.1), preview (0.05), final (0.02), or a number from 0.0001 to 10".into()
    })
}

/// A time in seconds: `90`, `90s`, `10m`, `1.5h`.
pub fn duration(text: &str) -> Result<f64, String> {
    let (digits, unit) = match text.char_indices().last() {
        Some((at, 's')) => (&text[..at], 1.0),
        Some((at, 'm')) => (&text[..at], 60.0),
        Some((at, 'h')) => (&text[..at], 3600.0),
        _ => (text, 1.0),
    };
    let seconds = digits.parse::<f64>().ok().map(|number| number * unit);
    seconds
        .filter(|seconds| (0.01..=1e8).contains(seconds))
        .ok_or_else(|| "write seconds, or a number with s, m or h: 90, 90s, 10m, 1.5h".into())
}

/// A grey floor: a luminance above 0.
pub fn grey(text: &str) -> Result<Grey, String> {
    let floor = text.parse().ok().and_then(Grey::new);
    floor.ok_or_else(|| "write a luminance above 0, in the unit of the picture".into())
}

/// An exposure in stops.
pub fn stops(text: &str) -> Result<f32, String> {
    let help = format!("write stops from {} to {MOST_STOPS}", -MOST_STOPS);
    number(text, |stops| stops.abs() <= MOST_STOPS, &help)
}

/// A full field of view in degrees.
pub fn field_of_view(text: &str) -> Result<f32, String> {
    number(text, |angle| (0.001..=179.0).contains(angle), "write degrees from 0.001 to 179")
}

/// A place or a direction in the world, metres: `1,2.5,-3`.
pub fn point(text: &str) -> Result<DVec3, String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    let inside = |number: &f64| number.abs() < FARTHEST_M;
    match numbers.as_deref() {
        Some(&[x, y, z]) if [x, y, z].iter().all(inside) => Ok(DVec3::new(x, y, z)),
        _ => Err(format!("write X,Y,Z in metres, each below {FARTHEST_M:e}, such as 1,2.5,-3")),
    }
}

/// The size of a picture in pixels: `1280x720`.
pub fn size(text: &str) -> Result<(u32, u32), String> {
    let sides = text.split_once(['x', 'X']);
    let parsed = sides.and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    match parsed {
        Some((w, h)) if u64::from(w) * u64::from(h) > MOST_PIXELS => {
            Err(format!("{w}x{h} is more than {MOST_PIXELS} pixels"))
        }
        Some((w, h)) if (1..=LARGEST_SIDE).contains(&w) && (1..=LARGEST_SIDE).contains(&h) => {
            Ok((w, h))
        }
        _ => Err(format!("write WIDTHxHEIGHT, such as 1280x720, each from 1 to {LARGEST_SIDE}")),
    }
}

/// The size of a picture whose height is given and whose width follows from its aspect.
pub fn size_of(aspect: f32, height: u32) -> (u32, u32) {
    let width = (aspect * height as f32).round() as u32;
    (width.clamp(1, LARGEST_SIDE), height)
}

/// Fog that fills a scene: `EXTINCTION[,ALBEDO[,G]]`; extinction is per metre, the albedo 1 and the
/// anisotropy 0 if not given.
pub fn fog(text: &str) -> Result<Medium, String> {
    let numbers: Option<Vec<f32>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    let (extinction, albedo, anisotropy) = match numbers.as_deref() {
        Some(&[extinction]) => (extinction, 1.0, 0.0),
        Some(&[extinction, albedo]) => (extinction, albedo, 0.0),
        Some(&[extinction, albedo, g]) => (extinction, albedo, g),
        _ => return Err("write EXTINCTION,ALBEDO,G, such as 0.02,0.9,0.3".into()),
    };
    if !(extinction >= 0.0 && extinction.is_finite()) {
        Err("extinction is not a positive number".into())
    } else if !(0.0..=1.0).contains(&albedo) {
        Err("albedo is not in [0, 1]".into())
    } else if !(-1.0..1.0).contains(&anisotropy) || anisotropy == -1.0 {
        Err("g is not between -1 and 1".into())
    } else {
        Ok(Medium {
            scattering: Vec3::splat(extinction * albedo),
            absorption: Vec3::splat(extinction * (1.0 - albedo)),
            anisotropy,
            region: None,
        })
    }
}

fn number(text: &str, is_allowed: impl Fn(&f32) -> bool, help: &str) -> Result<f32, String> {
    // What is not a number is in no range.
    text.trim().parse().ok().filter(is_allowed).ok_or_else(|| help.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is no number, and what no option takes.
    const NONSENSE: [&str; 9] = ["", "a", "nan", "-nan", "inf", "-inf", "1e39", "1,", "0x10"];

    #[test]
    fn nonsense_is_no_value_of_any_option() {
        for text in NONSENSE {
            assert!(knob(text).is_err() && stops(text).is_err(), "{text}");
            assert!(field_of_view(text).is_err() && fog(text).is_err(), "{text}");
            for place in 0..3 {
                let mut parts = ["0"; 3];
                parts[place] = text;
                assert!(point(&parts.join(",")).is_err(), "{text} in place {place}");
            }
            assert!(size(&format!("{text}x8")).is_err() && size(&format!("8x{text}")).is_err());
        }
        for text in ["-0.1", "1.1"] {
            assert!(knob(text).is_err());
        }
        for text in ["0", "-40", "180", "1e-9"] {
            assert!(field_of_view(text).is_err(), "{text}");
        }
        for text in ["127", "-1e4"] {
            assert!(stops(text).is_err(), "{text}");
        }
        for text in ["-1", "1,2", "1,-0.1", "1,1,1", "1,1,-1", "1,1,0,0", "1,nan", "1,1,nan"] {
            assert!(fog(text).is_err(), "{text}");
        }
        for text in ["1,2", "1,2,3,4", "1,2,1e18", "1 2 3"] {
            assert!(point(text).is_err(), "{text}");
        }
        for text in ["12", "0x8", "8x0", "-8x8", "65537x1", "65536x65536", "8x8x8"] {
            assert!(size(text).is_err(), "{text}");
        }
    }

    #[test]
    fn what_a_render_can_use_is_read() {
        assert_eq!((knob("0"), knob("1"), knob(" 0.25")), (Ok(0.0), Ok(1.0), Ok(0.25)));
        assert_eq!((stops("-3.5"), stops("126")), (Ok(-3.5), Ok(126.0)));
        assert_eq!((field_of_view("40"), field_of_view("179")), (Ok(40.0), Ok(179.0)));
        assert_eq!(point("-1, 2.5,1e6"), Ok(DVec3::new(-1.0, 2.5, 1e6)));
        assert_eq!((size("12x8"), size("1X65536")), (Ok((12, 8)), Ok((1, 65536))));
        assert_eq!(size_of(1.5, 720), (1080, 720));
        assert_eq!((size_of(1e9, 720).0, size_of(1e-9, 720).0), (LARGEST_SIDE, 1));
        let medium = fog("0.5,0.25,-0.5").unwrap();
        assert_eq!(
            (medium.scattering, medium.absorption),
            (Vec3::splat(0.125), Vec3::splat(0.375))
        );
        assert_eq!((medium.anisotropy, fog("0").unwrap().scattering), (-0.5, Vec3::ZERO));
    }
}
