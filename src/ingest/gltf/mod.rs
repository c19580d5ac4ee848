//! glTF 2.0: container, document, validation, then compilation to the scene index.

mod accessors;
mod animation;
mod buffers;
mod cameras;
mod container;
mod document;
mod fog;
mod geometry;
mod hierarchy;
mod instancing;
mod lights;
mod materials;
mod textures;
mod validate;

use super::budget::Budget;
use super::error::Fault;
use super::notes::Notes;
use super::uri::Folder;
use crate::scene::{Scene, Timeline};
use accessors::Accessor;
use buffers::Buffers;
use container::Container;
use document::{AssetUsd, Document};
use std::path::Path;

/// A validated file, ready to be compiled.
struct Source<'a> {
    document: &'a Document,
    accessors: &'a [Accessor<'a>],
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

/// Reads a file. Only a file called `.glb` must be binary: a `.gltf` may be either.
pub(super) fn load(path: &Path, must_be_glb: bool) -> Result<Scene, Fault> {
    let file = Container::parse(super::read_file(path)?, must_be_glb)?;
    let folder = Folder::of(path)?;
    let document = Document::parse(file.json())?;
    validate::structure(&document)?;
    let buffers = Buffers::read(&document, &file, &folder)?;
    let accessors = Accessor::open_all(&document, &buffers)?;
    validate::contents(&document, &accessors)?;
    let source =
        Source { document: &document, accessors: &accessors, buffers: &buffers, folder: &folder };
    let mut output = Output {
        scene: Scene::default(),
        notes: Notes::default(),
        budget: Budget::for_geometry(),
        picture_budget: Budget::for_pictures(),
    };
    output.budget.grow(buffers.size().saturating_add(file.size() as u64));
    output.scene.timeline = timeline(&document)?;
    note_unread_extensions(&document, &mut output.notes);
    textures::check_references(&source)?;
    hierarchy::compile(&source, &mut output)?;
    output.scene.notes = output.notes.into_lines();
    output.scene.files = folder.into_files(path);
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
    Ok(Timeline {
        first_frame: usd.start_time_code.map_or(default.first_frame, |code| code.f64()),
        frames_per_second: rate,
        last_frame: usd.end_time_code.map(|code| code.f64()),
    })
}

/// Extensions that change a picture and are not noted at the object that uses them.
fn note_unread_extensions(document: &Document, notes: &mut Notes) {
    for extension in &document.extensions_used {
        let whole_file = ["EXT_lights_image_based", "EXT_lights_ies", "EXT_lights_area"];
        if whole_file.contains(&extension.as_str()) {
            notes.add("file", format!("{extension} is not read"));
        }
    }
}
