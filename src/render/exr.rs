//! Render buffers as OpenEXR files.
//!
//! A file has one part with ZIP-compressed scan lines: beauty as the unnamed RGBA layer, and those of
//! `Z`, `N.X/Y/Z`, `albedo.R/G/B`, `variance.R/G/B` and `sampleCount` that are asked for. Beauty is half
//! or float, everything else float. The same buffers give the same bytes. For that reason all metadata is
//! one JSON text in the attribute [`METADATA`]: crate `exr` keeps custom attributes in a hash map and
//! would write several in a random order. The text has a [seal](crate::store::set_seal), so that a file with
//! rot anywhere is not taken for the picture that was written.

use super::beauty::half;
use super::buffers::{Pixel, RenderBuffers};
use crate::store::{BLANK, is_sealed, read_regular, set_seal, write_atomically};
use exr::block::reader::Reader;
use exr::image::write::WritableImage;
use exr::image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer};
use exr::meta::attribute::{AttributeValue, Text};
use exr::meta::header::LayerAttributes;
use exr::prelude::SmallVec;
use std::io::{self, Cursor, Write};
use std::path::Path;

/// Name of the attribute that holds the JSON text.
pub const METADATA: &str = "candelabra";

/// What to write.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ExrOptions {
    /// Beauty as 32-bit floats; otherwise 16-bit, clamped to what they hold (65504).
    pub float_beauty: bool,
    /// `Z`: metres in front of the camera.
    pub depth: bool,
    /// `N.X`, `N.Y`, `N.Z`: shading normal, world space.
    pub normal: bool,
    /// `albedo.R`, `albedo.G`, `albedo.B`.
    pub albedo: bool,
    /// `variance.R`, `variance.G`, `variance.B`: of the pixel's mean.
    pub variance: bool,
    /// `sampleCount`.
    pub sample_count: bool,
}

/// Larger files are none of ours.
const MOST_BYTES: u64 = 64 << 30;

/// Writes a frame, all or nothing, and seals it. `metadata` is a JSON object. Returns the length of the file.
pub fn write_exr(
    path: &Path,
    buffers: &RenderBuffers,
    options: &ExrOptions,
    metadata: &str,
) -> io::Result<u64> {
    let mut bytes = Vec::new();
    let image = image_of(buffers, options, &with_seal(metadata));
    let writer = image.write();
    // Crate exr starts threads of its own, as many as there are cores.
    let written = if rayon::current_num_threads() > 1 {
        writer.to_buffered(Cursor::new(&mut bytes))
    } else {
        writer.non_parallel().to_buffered(Cursor::new(&mut bytes))
    };
    written.map_err(into_io)?;
    set_seal(&mut bytes);
    write_atomically(path, |file| file.write_all(&bytes))?;
    Ok(bytes.len() as u64)
}

/// The JSON text of a file that [`write_exr`] made, if every byte of the file is as it was written. `None`
/// if it is not there or is no such file.
pub fn read_metadata(path: &Path) -> Option<String> {
    let bytes = read_regular(path, MOST_BYTES).ok()?;
    let reader = Reader::read_from_buffered(Cursor::new(&bytes), false).ok()?;
    let attribute = reader.headers().first()?.own_attributes.other.get(METADATA.as_bytes())?;
    let AttributeValue::Text(text) = attribute else { return None };
    let text = text.to_string();
    is_sealed(bytes).then_some(text)
}

/// A JSON object with a blank seal as its first member.
fn with_seal(metadata: &str) -> String {
    let members = metadata.trim_start().strip_prefix('{').unwrap_or("}").trim_start();
    let comma = if members.starts_with('}') { "" } else { "," };
    format!("{{\"seal\":\"{BLANK}\"{comma}{members}")
}

fn image_of(
    buffers: &RenderBuffers,
    options: &ExrOptions,
    metadata: &str,
) -> Image<Layer<AnyChannels<FlatSamples>>> {
    let mut channels = Channels { pixels: buffers.pixels(), list: Default::default() };
    let rgb = ["R", "G", "B"];
    for (axis, name) in rgb.into_iter().enumerate() {
        channels.add_beauty(name, options.float_beauty, |pixel| pixel.beauty[axis]);
        let layered = |layer: &str| format!("{layer}.{name}");
        if options.albedo {
            channels.add(layered("albedo"), |pixel| pixel.albedo[axis]);
        }
        if options.variance {
            channels.add(layered("variance"), |pixel| pixel.variance[axis]);
        }
        if options.normal {
            channels.add(format!("N.{}", ["X", "Y", "Z"][axis]), |pixel| pixel.normal[axis]);
        }
    }
    channels.add_beauty("A", options.float_beauty, |pixel| pixel.alpha);
    if options.depth {
        channels.add("Z".into(), |pixel| pixel.depth_m);
    }
    if options.sample_count {
        channels.add("sampleCount".into(), |pixel| pixel.samples as f32);
    }
    let size = (buffers.width() as usize, buffers.height() as usize);
    let channels = AnyChannels::sort(channels.list);
    let layer = Layer::new(size, LayerAttributes::default(), Encoding::SMALL_LOSSLESS, channels);
    let mut image = Image::from_layer(layer);
    let text = AttributeValue::Text(Text::new_or_panic(ascii(metadata)));
    image.layer_data.attributes.other.insert(Text::new_or_panic(METADATA), text);
    image
}

struct Channels<'a> {
    pixels: &'a [Pixel],
    list: SmallVec<[AnyChannel<FlatSamples>; 4]>,
}

impl Channels<'_> {
    fn add(&mut self, name: String, value: impl Fn(&Pixel) -> f32) {
        let samples = FlatSamples::F32(self.pixels.iter().map(value).collect());
        self.list.push(AnyChannel::new(name.as_str(), samples));
    }

    fn add_beauty(&mut self, name: &str, float: bool, value: impl Fn(&Pixel) -> f32) {
        if float {
            return self.add(name.into(), value);
        }
        let samples =
            FlatSamples::F16(self.pixels.iter().map(|pixel| half(value(pixel))).collect());
        self.list.push(AnyChannel::new(name, samples));
    }
}

/// The same JSON with non-ASCII characters escaped: an EXR text has one byte per character.
fn ascii(json: &str) -> String {
    let mut text = String::with_capacity(json.len());
    for character in json.chars() {
        if character.is_ascii() {
            text.push(character);
        } else {
            for unit in character.encode_utf16(&mut [0; 2]) {
                text.push_str(&format!("\\u{unit:04x}"));
            }
        }
    }
    text
}

fn into_io(error: exr::error::Error) -> io::Error {
    match error {
        exr::error::Error::Io(error) => error,
        other => io::Error::other(other.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use exr::prelude::{ReadChannels, ReadLayers, read};
    use glam::Vec3;
    use std::fs;

    const ALL: ExrOptions = ExrOptions {
        float_beauty: true,
        depth: true,
        normal: true,
        albedo: true,
        variance: true,
        sample_count: true,
    };
    const NONE: ExrOptions = ExrOptions {
        float_beauty: false,
        depth: false,
        normal: false,
        albedo: false,
        variance: false,
        sample_count: false,
    };

    fn frame() -> RenderBuffers {
        let mut buffers = RenderBuffers::new(37, 50);
        for (i, pixel) in buffers.pixels_mut().iter_mut().enumerate() {
            let x = i as f32;
            *pixel = Pixel {
                beauty: Vec3::new(x, 1e6, 0.3 * x),
                alpha: 0.25,
                depth_m: x * 0.5,
                normal: Vec3::new(0.0, -1.0, x),
                albedo: Vec3::new(0.1, 0.2, 0.3),
                variance: Vec3::new(1e-9, x, 2.0),
                samples: i as u32,
            };
        }
        buffers
    }

    /// Every channel of a file by name, as floats.
    fn channels(path: &Path) -> Vec<(String, Vec<f32>)> {
        let layer = read().no_deep_data().largest_resolution_level().all_channels();
        let image = layer.first_valid_layer().all_attributes().from_file(path).unwrap();
        let list = image.layer_data.channel_data.list;
        let named = |c: AnyChannel<FlatSamples>| {
            (c.name.to_string(), c.sample_data.values_as_f32().collect())
        };
        list.into_iter().map(named).collect()
    }

    #[test]
    fn every_buffer_comes_back_under_its_name() {
        let folder = tempfile::tempdir().unwrap();
        let (path, buffers) = (folder.path().join("new/f.exr"), frame());
        write_exr(&path, &buffers, &ALL, "{}").unwrap();
        let read = channels(&path);
        let names: Vec<_> = read.iter().map(|channel| channel.0.as_str()).collect();
        let expected = [
            "A",
            "B",
            "G",
            "N.X",
            "N.Y",
            "N.Z",
            "R",
            "Z",
            "albedo.B",
            "albedo.G",
            "albedo.R",
            "sampleCount",
            "variance.B",
            "variance.G",
            "variance.R",
        ];
        assert_eq!(names, expected);
        let value = |name: &str, i: usize| read.iter().find(|c| c.0 == name).unwrap().1[i];
        for (i, pixel) in buffers.pixels().iter().enumerate() {
            assert_eq!(value("R", i), pixel.beauty.x);
            assert_eq!(value("A", i), 0.25);
            assert_eq!(value("Z", i), pixel.depth_m);
            assert_eq!(value("N.Z", i), pixel.normal.z);
            assert_eq!(value("albedo.B", i), 0.3);
            assert_eq!(value("variance.G", i), pixel.variance.y);
            assert_eq!(value("sampleCount", i), i as f32);
        }
        write_exr(&path, &buffers, &NONE, "{}").unwrap();
        let read = channels(&path);
        assert_eq!(read.len(), 4);
        assert_eq!(read[2].1[3], 65504.0);
        assert!((read[3].1[1000] - 1000.0).abs() < 1.0);
    }

    #[test]
    fn the_same_frame_is_the_same_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let bytes = |name: &str| {
            let path = folder.path().join(name);
            write_exr(&path, &frame(), &ALL, r#"{"seed":1}"#).unwrap();
            fs::read(path).unwrap()
        };
        let first = bytes("a.exr");
        for name in ["b.exr", "c.exr", "d.exr"] {
            assert_eq!(first, bytes(name));
        }
    }

    #[test]
    fn metadata_comes_back_from_whole_files_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("f.exr");
        let json = r#"{"scene":"straße 💡.gltf","frame":1001}"#;
        write_exr(&path, &frame(), &ALL, json).unwrap();
        let text = read_metadata(&path).unwrap();
        let parse = |text: &str| serde_json::from_str::<serde_json::Value>(text).unwrap();
        let mut read = parse(&text);
        assert!(read.as_object_mut().unwrap().remove("seal").is_some());
        assert_eq!(read, parse(json));
        let whole = fs::read(&path).unwrap();
        let part = folder.path().join("part.exr");
        for length in [0, 3, 100, whole.len() / 2, whole.len() - 100, whole.len() - 1] {
            fs::write(&part, &whole[..length]).unwrap();
            assert_eq!(read_metadata(&part), None, "{length} bytes of {}", whole.len());
        }
        // Rot anywhere: blocks that could not be compressed have no checksum of their own.
        for at in (0..whole.len()).step_by(97) {
            let mut rotten = whole.clone();
            rotten[at] ^= 16;
            fs::write(&part, &rotten).unwrap();
            assert_eq!(read_metadata(&part), None, "byte {at}");
        }
        write_exr(&path, &frame(), &NONE, "{}").unwrap();
        assert!(read_metadata(&path).is_some());
        fs::write(&part, vec![b'x'; 5000]).unwrap();
        assert_eq!(read_metadata(&part), None);
        assert_eq!(read_metadata(&folder.path().join("absent.exr")), None);
        assert_eq!(read_metadata(folder.path()), None);
    }

    #[test]
    fn a_file_of_another_program_has_no_metadata() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("other.exr");
        exr::prelude::write_rgba_file(&path, 4, 4, |_, _| (0.0, 0.0, 0.0, 1.0)).unwrap();
        assert_eq!(read_metadata(&path), None);
    }
}
