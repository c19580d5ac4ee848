//! OpenEXR pictures of light: what the file says of its own pixels is heeded, or refused.
//!
//! The picture is the display window (the technical introduction's "display window"): pixels outside
//! the data window are dark. Colours go from the file's primaries and white to linear Rec. 709, white to
//! white (Bradford's adaptation), which is the space of a file that names none. A single channel,
//! or `Y`, is grey. Cube maps, subsampled or luminance-chroma pixels, deep pixels and files without
//! plain `R`, `G`, `B` are refused.

use super::error::Fault;
use super::image::{Picture, radiance};
use crate::scene::Pixels;
use exr::meta::attribute::{Chromaticities, EnvironmentMap};
use exr::meta::header::Header;
use exr::prelude as openexr;
use glam::{DMat3, DVec2, DVec3};
use openexr::{ReadChannels, ReadLayers, ReadSpecificChannel};
use std::io::Cursor;

const REC_709: [DVec2; 4] = [
    DVec2::new(0.64, 0.33),
    DVec2::new(0.30, 0.60),
    DVec2::new(0.15, 0.06),
    DVec2::new(0.3127, 0.3290),
];

/// XYZ to the responses in which one white is scaled to another (Lam 1985).
const BRADFORD: DMat3 = DMat3::from_cols_array(&[
    0.8951, -0.7502, 0.0389, 0.2664, 1.7135, -0.0685, -0.1614, 0.0367, 1.0296,
]);

/// Decodes the first part that holds colours. `reserve` is asked before pixels are allocated.
pub(super) fn decode(
    bytes: &[u8],
    object: &str,
    mut reserve: impl FnMut((usize, usize)) -> Result<(), Fault>,
) -> Result<Picture, Fault> {
    let damaged = |error: openexr::Error| {
        Fault::new(object, format!("cannot be decoded: {error}"))
            .remedy("open it in an image viewer and save it again as flat RGB OpenEXR")
    };
    let meta = openexr::MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(damaged)?;
    for header in &meta.headers {
        reserve((header.layer_size.width(), header.layer_size.height()))?;
    }
    let (header, names) = colours(&meta.headers).map_err(|problem| {
        Fault::new(object, problem).remedy("save it as flat RGB OpenEXR in latitude and longitude")
    })?;
    let to_rec_709 = header.shared_attributes.chromaticities.map(to_rec_709);
    let Some(to_rec_709) = to_rec_709.unwrap_or(Some(DMat3::IDENTITY)) else {
        return Err(Fault::new(object, "has chromaticities that span no colours")
            .remedy("save it with those of Rec. 709"));
    };
    let window = header.shared_attributes.display_window;
    if window.size != header.layer_size {
        reserve((window.size.width(), window.size.height()))?;
    }
    let offset = header.own_attributes.layer_position - window.position;
    let (width, height) = (window.size.width(), window.size.height());
    let dark = move || vec![[0.0f32; 3]; width * height];
    let put = move |pixels: &mut Vec<[f32; 3]>, at: openexr::Vec2<usize>, color: [f32; 3]| {
        let inside = |at: usize, offset: i32, length: usize| {
            let at = usize::try_from(at as i64 + i64::from(offset)).ok()?;
            (at < length).then_some(at)
        };
        let x = inside(at.x(), offset.x(), width);
        if let (Some(x), Some(y)) = (x, inside(at.y(), offset.y(), height)) {
            pixels[y * width + x] = color;
        }
    };
    let read = openexr::read().no_deep_data().largest_resolution_level();
    let mut pixels = match names {
        Colours::Rgb => {
            let read = read.rgb_channels(
                move |_, _| dark(),
                move |pixels, at, (r, g, b): (f32, f32, f32)| put(pixels, at, [r, g, b]),
            );
            let image = read.first_valid_layer().all_attributes();
            image.from_buffered(Cursor::new(bytes)).map_err(damaged)?.layer_data.channel_data.pixels
        }
        Colours::Grey(name) => {
            let read = read.specific_channels().required(name).collect_pixels(
                move |_, _| dark(),
                move |pixels, at, (y,): (f32,)| put(pixels, at, [y; 3]),
            );
            let image = read.first_valid_layer().all_attributes();
            image.from_buffered(Cursor::new(bytes)).map_err(damaged)?.layer_data.channel_data.pixels
        }
    };
    for pixel in &mut pixels {
        *pixel = pixel.map(radiance);
        if to_rec_709 != DMat3::IDENTITY {
            let color = to_rec_709 * DVec3::from(pixel.map(f64::from));
            *pixel = color.as_vec3().to_array().map(radiance);
        }
    }
    Ok(Picture { width: width as u32, height: height as u32, pixels: Pixels::Float(pixels) })
}

/// Which channels hold the colours.
enum Colours {
    Rgb,
    Grey(openexr::Text),
}

/// The first part with `R`, `G` and `B`, else with `Y`, else with one channel beside alpha.
fn colours(headers: &[Header]) -> Result<(&Header, Colours), String> {
    let flat = || headers.iter().filter(|header| !header.deep);
    let names = |header: &Header| -> Vec<String> {
        header.channels.list.iter().map(|channel| channel.name.to_string()).collect()
    };
    let has = |header: &Header, name: &str| names(header).iter().any(|other| other == name);
    if flat().any(|header| has(header, "RY") || has(header, "BY")) {
        return Err("stores luminance and chroma".into());
    }
    let lone = |header: &Header| match names(header).as_slice() {
        [name] => Some(name.clone()),
        [alpha, name] | [name, alpha] if alpha == "A" => Some(name.clone()),
        _ => None,
    };
    let rgb = flat().find(|header| ["R", "G", "B"].iter().all(|name| has(header, name)));
    let found = rgb.map(|header| (header, Colours::Rgb)).or_else(|| {
        let grey = flat().any(|header| has(header, "Y")).then(|| "Y".into());
        let name = grey.or_else(|| flat().find_map(lone))?;
        // The part that is read is the first that has the channel.
        let header = flat().find(|header| has(header, &name))?;
        (name == "Y" || lone(header).is_some())
            .then(|| (header, Colours::Grey(name.as_str().into())))
    });
    let Some((header, colours)) = found else {
        let mut names: Vec<String> = headers.iter().flat_map(names).collect();
        names.truncate(16);
        return Err(format!("has no plain R, G, B or Y; its channels are {}", names.join(", ")));
    };
    if header.own_attributes.environment_map == Some(EnvironmentMap::Cube) {
        return Err("is a cube map".into());
    }
    if header.channels.list.iter().any(|c| c.sampling != openexr::Vec2(1, 1)) {
        return Err("has channels of different resolutions".into());
    }
    Ok((header, colours))
}

/// The matrix from a file's colours to linear Rec. 709; `None` if they are no colours.
fn to_rec_709(theirs: Chromaticities) -> Option<DMat3> {
    let point = |at: openexr::Vec2<f32>| DVec2::new(at.x().into(), at.y().into());
    let theirs = [theirs.red, theirs.green, theirs.blue, theirs.white].map(point);
    if theirs.iter().zip(REC_709).all(|(a, b)| a.abs_diff_eq(b, 1e-4)) {
        return Some(DMat3::IDENTITY);
    }
    let (from, to) = (to_xyz(theirs)?, to_xyz(REC_709)?);
    let white = |matrix: DMat3| BRADFORD * (matrix * DVec3::ONE);
    if white(from).abs().min_element() < 1e-6 {
        return None;
    }
    let adapt = BRADFORD.inverse() * DMat3::from_diagonal(white(to) / white(from)) * BRADFORD;
    Some(to.inverse() * adapt * from)
}

/// The matrix from RGB to XYZ, with white at Y = 1, from the xy of red, green, blue and white.
fn to_xyz(points: [DVec2; 4]) -> Option<DMat3> {
    if points.iter().any(|at| !at.is_finite() || at.y == 0.0) {
        return None;
    }
    let [red, green, blue, white] =
        points.map(|at| DVec3::new(at.x / at.y, 1.0, (1.0 - at.x - at.y) / at.y));
    let primaries = DMat3::from_cols(red, green, blue);
    let volume = primaries.determinant().abs();
    if !volume.is_finite() || volume < 1e-6 {
        return None;
    }
    Some(primaries * DMat3::from_diagonal(primaries.inverse() * white))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_goes_to_white_and_acescg_to_its_known_matrix() {
        let at = |x, y| openexr::Vec2(x, y);
        let acescg = Chromaticities {
            red: at(0.713, 0.293),
            green: at(0.165, 0.830),
            blue: at(0.128, 0.044),
            white: at(0.32168, 0.33767),
        };
        let matrix = to_rec_709(acescg).unwrap();
        assert!((matrix * DVec3::ONE).abs_diff_eq(DVec3::ONE, 1e-6));
        // colour-science, RGB_to_RGB("ACEScg", "sRGB", "Bradford").
        let red = DVec3::new(1.70505, -0.13026, -0.02400);
        assert!(matrix.x_axis.abs_diff_eq(red, 2e-4), "{}", matrix.x_axis);
    }

    #[test]
    fn primaries_that_span_nothing_are_none() {
        let same = openexr::Vec2(0.3, 0.3);
        let none = Chromaticities { red: same, green: same, blue: same, white: same };
        assert_eq!(to_rec_709(none), None);
    }
}
