//! Render buffers as OpenEXR files.
//!
//! A file has one part with ZIP-compressed scan lines and all layers of the buffers; `docs/layers.md` is
//! the list. The data window is the part that was rendered, the display window the whole picture. The
//! same buffers give the same bytes. Metadata is one JSON text in the attribute [`METADATA`],
//! with a [seal](crate::store::set_seal): a file with rot anywhere is not taken for the picture that was
//! written. Cryptomatte has attributes of its own.

use super::beauty::half;
use super::buffers::RenderBuffers;
use super::crop::Window;
use super::cryptomatte;
use super::exr_header::sort_attributes;
use super::layers::SampleType;
use crate::store::{BLANK, is_sealed, read_regular, set_seal, write_atomically};
use exr::block::reader::Reader;
use exr::block::writer::{ChunksWriter, ParallelBlocksCompressor};
use exr::block::{BlockIndex, UncompressedBlock};
use exr::compression::Compression;
use exr::meta::attribute::{AttributeValue, ChannelDescription, IntegerBounds, LineOrder, Text};
use exr::meta::header::{Header, LayerAttributes};
use exr::meta::{BlockDescription, MetaData};
use exr::prelude::{ReadChannels, ReadLayers, SmallVec, Vec2, read};
use std::io::{self, Cursor, Write};
use std::path::Path;

/// Name of the attribute that holds the JSON text.
pub const METADATA: &str = "candelabra";

/// Larger files are none of ours.
const MOST_BYTES: u64 = 64 << 30;

/// Writes a frame, all or nothing, and seals it. `metadata` is a JSON object. Returns the length of the file.
///
/// The buffers need not be those of the frame that is being rendered: another thread may write them
/// meanwhile.
pub fn write_exr(path: &Path, buffers: &RenderBuffers, metadata: &str) -> io::Result<u64> {
    let mut bytes = encode(buffers, &with_seal(metadata))?;
    set_seal(&mut bytes);
    write_atomically(path, |file| file.write_all(&bytes))?;
    Ok(bytes.len() as u64)
}

fn encode(buffers: &RenderBuffers, metadata: &str) -> io::Result<Vec<u8>> {
    let mut file = Cursor::new(Vec::new());
    let channels = Channels::of(buffers);
    let header = header(buffers, &channels, metadata);
    let headers = SmallVec::from_elem(header, 1);
    exr::block::write(&mut file, headers, true, |meta, chunks| {
        let blocks = meta.collect_ordered_blocks(|index| channels.block(&meta, index));
        let chunks = chunks.on_progress(|_| ());
        compress(&meta, chunks, blocks)
    })
    .map_err(into_io)?;
    sort_attributes(&mut file)?;
    Ok(file.into_inner())
}

/// Compresses blocks and writes them. By threads of their own, since another frame may be rendered
/// meanwhile, but by no more than render.
fn compress(
    meta: &MetaData,
    mut chunks: impl ChunksWriter,
    blocks: impl Iterator<Item = (usize, UncompressedBlock)>,
) -> exr::error::UnitResult {
    let threads = rayon::current_num_threads();
    let pool = || rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let own = if threads > 1 {
        ParallelBlocksCompressor::new_with_thread_pool(meta, &mut chunks, pool)
    } else {
        None
    };
    let Some(mut compressor) = own else {
        return chunks.compress_all_blocks_sequential(meta, blocks);
    };
    for (index, block) in blocks {
        compressor.add_block_to_compression_queue(index, block)?;
    }
    // The last block waits for all others.
    Ok(())
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

/// A channel of a file, row after row, and which part of the whole picture it is of.
///
/// # Errors
/// If the file cannot be read or has no such channel.
pub fn read_channel(path: &Path, name: &str) -> io::Result<(Window, Vec<f32>)> {
    let in_file = |error: String| io::Error::other(format!("{}: {error}", path.display()));
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_file(path)
        .map_err(|error| in_file(error.to_string()))?;
    let layer = image.layer_data;
    let mut channels = layer.channel_data.list.into_iter();
    let Some(channel) = channels.find(|channel| channel.name.to_string() == name) else {
        return Err(in_file(format!("has no layer {name}; write it with --aov")));
    };
    let at = layer.attributes.layer_position;
    let corner = [at.x(), at.y()].map(|edge| u32::try_from(edge).unwrap_or(0));
    let [x1, y1] = [layer.size.width() as u32 + corner[0], layer.size.height() as u32 + corner[1]];
    let values = channel.sample_data.values_as_f32().collect();
    Ok((Window { x0: corner[0], y0: corner[1], x1, y1 }, values))
}

/// A JSON object with a blank seal as its first member.
fn with_seal(metadata: &str) -> String {
    let members = metadata.trim_start().strip_prefix('{').unwrap_or("}").trim_start();
    let comma = if members.starts_with('}') { "" } else { "," };
    format!("{{\"seal\":\"{BLANK}\"{comma}{members}")
}

fn header(buffers: &RenderBuffers, channels: &Channels, metadata: &str) -> Header {
    let window = buffers.window();
    let extent = |width: u32, height: u32| Vec2(width as usize, height as usize);
    let mut attributes = LayerAttributes {
        layer_position: Vec2(window.x0 as i32, window.y0 as i32),
        ..Default::default()
    };
    let own = [(METADATA.to_string(), ascii(metadata))];
    let of_matte = buffers.manifest().map(|manifest| cryptomatte::attributes(&ascii(manifest)));
    for (name, value) in own.into_iter().chain(of_matte.into_iter().flatten()) {
        let value = AttributeValue::Text(Text::new_or_panic(value));
        attributes.other.insert(Text::new_or_panic(name), value);
    }
    let [width, height] = buffers.size();
    Header::new(Text::default(), extent(window.width(), window.height()), channels.described())
        .with_encoding(Compression::ZIP16, BlockDescription::ScanLines, LineOrder::Increasing)
        .with_attributes(attributes)
        .with_display_window(IntegerBounds::from_dimensions(extent(width, height)))
}

/// The channels of buffers, sorted by name as the format asks.
struct Channels<'a> {
    buffers: &'a RenderBuffers,
    /// Name, type, and number in the buffers.
    list: Vec<(String, SampleType, usize)>,
}

impl Channels<'_> {
    fn of(buffers: &RenderBuffers) -> Channels<'_> {
        let layers = buffers.layers().iter();
        let named =
            layers.flat_map(|layer| layer.channel_names().map(|name| (name, layer.sample_type)));
        let mut list: Vec<_> =
            named.enumerate().map(|(number, (name, kind))| (name, kind, number)).collect();
        list.sort_unstable_by(|a, b| a.0.cmp(&b.0));
        Channels { buffers, list }
    }

    fn described(&self) -> SmallVec<[ChannelDescription; 5]> {
        let described = |(name, kind, _): &(String, SampleType, usize)| {
            let kind = match kind {
                SampleType::Half => exr::meta::attribute::SampleType::F16,
                SampleType::Float => exr::meta::attribute::SampleType::F32,
            };
            ChannelDescription::named(name.as_str(), kind)
        };
        self.list.iter().map(described).collect()
    }

    /// Some rows, ready to be compressed.
    fn block(&self, meta: &MetaData, index: BlockIndex) -> UncompressedBlock {
        UncompressedBlock::from_lines(&meta.headers[0].channels, index, |line| {
            let at = line.location;
            let (_, kind, number) = &self.list[at.channel];
            let row = self.buffers.row(*number, at.position.y());
            let written = match kind {
                SampleType::Float => line.write_samples_from_slice(row),
                SampleType::Half => line.write_samples(|x| half(row[x])),
            };
            written.expect("a line has room for its samples");
        })
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
    use crate::render::crop::Window;
    use crate::render::layers::{Aov, Layer, layers_of};
    use clap::ValueEnum;
    use exr::image::{AnyChannel, FlatSamples};
    use exr::prelude::{ReadChannels, ReadLayers, read};
    use std::fs;

    fn frame(aovs: &[Aov], float_beauty: bool) -> RenderBuffers {
        let layers = layers_of(aovs, float_beauty, &["default".into(), "key".into()]);
        let mut buffers = RenderBuffers::new([37, 50], Window::whole(37, 50), layers);
        fill(&mut buffers);
        buffers
    }

    /// Every channel of every pixel has a value of its own.
    fn fill(buffers: &mut RenderBuffers) {
        let channels: usize = buffers.layers().iter().map(|layer| layer.channels.len()).sum();
        let Window { x0, y0, x1, y1 } = buffers.window();
        for (x, y) in (y0..y1).flat_map(|y| (x0..x1).map(move |x| (x, y))) {
            let value = |channel: usize| (y * 64 + x) as f32 + 0.01 * channel as f32;
            let values: Vec<f32> = (0..channels).map(value).collect();
            buffers.set(x - x0, y - y0, &values);
        }
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
    fn every_channel_comes_back_under_its_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new/f.exr");
        let buffers = frame(Aov::value_variants(), true);
        write_exr(&path, &buffers, "{}").unwrap();
        let read = channels(&path);
        let mut names: Vec<_> = buffers.layers().iter().flat_map(Layer::channel_names).collect();
        names.sort();
        assert_eq!(read.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>(), names);
        for (name, values) in read {
            assert!(buffers.channel(&name).unwrap().eq(values), "{name}");
        }
    }

    #[test]
    fn half_beauty_is_clamped_and_rounded() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("f.exr");
        let mut buffers = frame(&[], false);
        buffers.set(3, 0, &[1e6, f32::INFINITY, 2049.0, 0.1]);
        write_exr(&path, &buffers, "{}").unwrap();
        let at_3 = channels(&path).into_iter().map(|(name, values)| (name, values[3]));
        let expected = [("A", half(0.1).to_f32()), ("B", 2048.0), ("G", 65504.0), ("R", 65504.0)];
        assert!(at_3.eq(expected.map(|(name, value)| (name.to_string(), value))));
    }

    #[test]
    fn a_part_of_a_picture_says_which() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("f.exr");
        let window = Window { x0: 5, y0: 7, x1: 20, y1: 40 };
        let mut buffers = RenderBuffers::new([37, 50], window, layers_of(&[], true, &[]));
        fill(&mut buffers);
        write_exr(&path, &buffers, "{}").unwrap();
        let meta = MetaData::read_from_file(&path, true).unwrap();
        let header = &meta.headers[0];
        assert_eq!(header.data_window(), IntegerBounds::new((5, 7), (15, 33)));
        assert_eq!(header.shared_attributes.display_window, IntegerBounds::new((0, 0), (37, 50)));
        let (whole, part) = (frame(&[], true), channels(&path));
        let whole = whole.channel("G").unwrap().collect::<Vec<_>>();
        let rows = whole.chunks(37).skip(7).take(33);
        assert!(rows.flat_map(|row| &row[5..20]).eq(&part[2].1));
    }

    #[test]
    fn the_same_frame_is_the_same_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let bytes = |name: &str| {
            let path = folder.path().join(name);
            let mut buffers = frame(Aov::value_variants(), false);
            buffers.manifest = Some(r#"{"/lamp":"0123abcd"}"#.into());
            write_exr(&path, &buffers, r#"{"seed":1}"#).unwrap();
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
        write_exr(&path, &frame(&Aov::DEFAULT, false), json).unwrap();
        let text = read_metadata(&path).unwrap();
        let parse = |text: &str| serde_json::from_str::<serde_json::Value>(text).unwrap();
        let mut told = parse(&text);
        assert!(told.as_object_mut().unwrap().remove("seal").is_some());
        assert_eq!(told, parse(json));
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
        write_exr(&path, &frame(&[], false), "{}").unwrap();
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
