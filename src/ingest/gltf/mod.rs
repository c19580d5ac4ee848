//! glTF 2.0: container, document, then compilation to the scene index.
//!
//! Whatever is asked of the document may be wrong: a number may lead nowhere, an array may have the wrong type,
//! a parameter may be out of range. Who asks finds out, leaves the object out or mends it, and notes it. Refused
//! is only what cannot be read safely, or not at all: another version, cycles among the nodes, a truncated
//! buffer, memory out of proportion to the file.
//!
//! | file | what |
//! |---|---|
//! | `container` | the JSON and the binary chunk of a file |
//! | `document` | JSON to typed rows; nodes, of which there may be millions, by a way of their own |
//! | `extensions` | what must be supported |
//! | `forest` | which nodes are below which |
//! | `buffers`, `accessors` | arrays in the buffers |
//! | `hierarchy` | nodes, parents first, and what stands at them |
//! | `instancing`, `geometry`, `attributes` | meshes |
//! | `posing` | skins and morph targets |
//! | `materials`, `glossiness`, `coat`, `glass`, `textures` | surfaces |
//! | `lights`, `fog`, `cameras`, `lenses` | what they say |
//! | `animation`, `targets`, `strengths`, `cones`, `key_table` | what moves and what varies |
//! | `links`, `filters`, `responses` | which lights light what, what is in their way, how much is reflected |

mod accessors;
mod animation;
mod attributes;
mod buffers;
mod cameras;
mod coat;
mod cones;
mod container;
mod document;
mod extensions;
mod filters;
mod fog;
mod forest;
mod geometry;
mod glass;
mod glossiness;
mod hierarchy;
mod instancing;
mod key_table;
mod lenses;
mod lights;
mod links;
mod materials;
mod posing;
mod profiles;
mod responses;
mod strengths;
mod targets;
mod textures;

use super::budget::Budget;
use super::error::Fault;
use super::notes::Notes;
use super::uri::Folder;
use crate::scene::{Scene, Timeline};
use accessors::Accessors;
use buffers::Buffers;
use container::Container;
use document::{AssetUsd, Document};
use forest::Forest;
use std::path::Path;

/// A file, ready to be compiled.
struct Source<'a> {
    document: &'a Document,
    forest: &'a Forest,
    accessors: &'a Accessors<'a>,
    buffers: &'a Buffers<'a>,
    folder: &'a Folder,
}

/// What is being compiled.
struct Output {
    scene: Scene,
    notes: Notes,
    budget: Budget,
    picture_budget: Budget,
}

/// Reads a file. A file called `.glb` may not be anything else than glTF; a `.gltf` may be binary too.
pub(super) fn load(path: &Path, must_be_glb: bool) -> Result<Scene, Fault> {
    let (mut notes, mut budget) = (Notes::default(), Budget::for_geometry());
    let (bytes, read) = super::read_file(path)?;
    let file = Container::parse(bytes, must_be_glb, &mut notes)?;
    let folder = Folder::of(path)?;
    budget.grow(file.size() as u64);
    let document = Document::parse(file.json(), &mut budget, &mut notes)?;
    let file = file.parsed();
    extensions::check(&document, &mut notes)?;
    let forest = Forest::new(&document, &mut notes)?;
    let buffers = Buffers::read(&document, &file, &folder)?;
    budget.grow(buffers.size());
    let accessors = Accessors::open(&document, &buffers, &mut budget)?;
    let source = Source {
        document: &document,
        forest: &forest,
        accessors: &accessors,
        buffers: &buffers,
        folder: &folder,
    };
    let scene = Scene { timeline: timeline(&document)?, ..Scene::default() };
    let mut output = Output { scene, notes, budget, picture_budget: Budget::for_pictures() };
    hierarchy::compile(&source, &mut output)?;
    output.scene.notes = output.notes.into_list();
    output.scene.files = folder.into_files(read);
    Ok(output.scene)
}

/// The clock of the stage that the file was exported from, if it says.
fn timeline(document: &Document) -> Result<Timeline, Fault> {
    let Some(usd) = AssetUsd::of(&document.asset.extras)? else { return Ok(Timeline::default()) };
    let default = Timeline::default();
    let rate = usd.time_codes_per_second.map_or(default.frames_per_second, |rate| rate.f64());
    if rate <= 0.0 {
        return Err(Fault::new("asset, extras.usd", "timeCodesPerSecond is not positive"));
    }
    let first_frame = usd.start_time_code.map_or(default.first_frame, |code| code.f64());
    Ok(Timeline {
        zero_frame: usd.zero_time_code.map_or(first_frame, |code| code.f64()),
        first_frame,
        frames_per_second: rate,
        last_frame: usd.end_time_code.map(|code| code.f64()),
    })
}
