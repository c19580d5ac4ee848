//! The glTF document: crate `gltf`'s, parsed object by object, so that an error names the object.
//!
//! Its JSON types are taken, its readers are not: they panic on what is not sound. And what the
//! types cannot say, or confuse, is taken out of an object [beside] before it is parsed. Numbers of other
//! objects may lead nowhere: who follows one asks.

mod beside;
mod extras;
mod node;
mod real;
mod reference;

pub(super) use beside::{Beside, Instancing, Target};
pub(super) use extras::{
    AssetUsd, UsdCamera, UsdFog, UsdIes, UsdLens, UsdLightFilter, UsdLinks, UsdLux, UsdValues,
    usd_path,
};
pub(super) use node::{Node, Transform};
pub(super) use real::{Real, reals};

use crate::ingest::budget::Budget;
use crate::ingest::error::Fault;
use crate::ingest::notes::Notes;
use crate::scene::Category;
use gltf::json::asset::Asset;
use gltf::json::extensions::root::{KhrLightsPunctual, Root as RootExtensions};
use gltf::json::mesh::Primitive;
use gltf::json::{Image, Index, Root, Scene, Texture};
use rayon::prelude::*;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::value::RawValue;
use serde_json::{Map, Value};
use std::collections::HashMap;
use std::error::Error;
use std::fmt::Display;
use std::ops::Deref;

/// More JSON than this is not parsed.
const MOST_JSON_BYTES: usize = 512 << 20;
/// So many nodes are parsed side by side.
const BLOCK: usize = 1 << 14;

/// An object of the file that is not parsed yet.
type Row = Map<String, Value>;

/// The file's JSON, typed, and nothing that it implies.
pub(super) struct Document {
    root: Root,
    pub nodes: Vec<Node>,
    pub beside: Beside,
}

impl Deref for Document {
    type Target = Root;

    fn deref(&self) -> &Root {
        &self.root
    }
}

impl Document {
    /// Parses the JSON table by table and row by row, so that no more than a row is in memory twice. A row
    /// that is not what it should be is left out: an empty one takes its place and its number.
    pub(super) fn parse(
        json: &[u8],
        budget: &mut Budget,
        notes: &mut Notes,
    ) -> Result<Document, Fault> {
        let json = text(json, notes)?;
        let members = serde_json::from_slice(json)
            .map_err(|error| Fault::new("JSON", format!("cannot be parsed: {error}")))?;
        let mut tables = Tables { members, budget, notes };
        let mut beside = Beside::default();
        let asset = match tables.members.remove("asset") {
            Some(asset) => typed(asset, "asset")?,
            None => {
                tables.notes.add(Category::Other, "asset", "is missing; read as glTF 2.0");
                Asset { version: "2.0".into(), ..Asset::default() }
            }
        };
        let lights = Kind("light", Category::Lights, r#"{"type": "point", "intensity": 0}"#);
        let lights = tables
            .within("extensions", "KHR_lights_punctual")?
            .map_or(Ok(Vec::new()), |mut punctual| {
                punctual.table("lights", &lights, |row, _| beside::light(row))
            })?;
        // Whether what is left out would emit is not known.
        let node = Kind("node", Category::Lights, "{}");
        let mesh = Kind("mesh", Category::Lights, r#"{"primitives": []}"#);
        let accessor = Kind(
            "accessor",
            Category::Geometry,
            r#"{"componentType": 0, "count": 0, "type": "?"}"#,
        );
        let view = Kind("buffer view", Category::Geometry, r#"{"buffer": 0, "byteLength": 0}"#);
        let buffer = Kind("buffer", Category::Geometry, r#"{"byteLength": 0}"#);
        let material = Kind("material", Category::Lights, "{}");
        let texture = Kind("texture", Category::Materials, "{}");
        let image = Kind("image", Category::Materials, "{}");
        let sampler = Kind("sampler", Category::Materials, "{}");
        let camera = Kind("camera", Category::Cameras, r#"{"type": "none"}"#);
        let animation =
            Kind("animation", Category::Animation, r#"{"channels": [], "samplers": []}"#);
        let skin = Kind("skin", Category::Animation, r#"{"joints": []}"#);
        let scene = Kind("scene", Category::Geometry, r#"{"nodes": []}"#);
        let plain = |_: &mut Row, _| Ok(());
        let nodes = tables.nodes(&node, &mut beside)?;
        let root = Root {
            asset,
            extensions_used: tables.optional("extensionsUsed")?.unwrap_or_default(),
            extensions_required: tables.optional("extensionsRequired")?.unwrap_or_default(),
            extensions: Some(RootExtensions {
                khr_lights_punctual: Some(KhrLightsPunctual { lights }),
                ..RootExtensions::default()
            }),
            scene: tables.optional("scene")?.map(Index::new),
            scenes: tables.table("scenes", &scene, |row, _| beside::scene(row))?,
            meshes: tables.table("meshes", &mesh, |row, _| beside::mesh(row))?,
            accessors: tables.table("accessors", &accessor, |row, _| beside::accessor(row))?,
            buffer_views: tables.table("bufferViews", &view, plain)?,
            buffers: tables.table("buffers", &buffer, plain)?,
            materials: tables.table("materials", &material, |row, i| beside.material(row, i))?,
            textures: tables.table("textures", &texture, plain)?,
            images: tables.table("images", &image, plain)?,
            samplers: tables.table("samplers", &sampler, plain)?,
            cameras: tables.table("cameras", &camera, |row, i| beside.camera(row, i))?,
            skins: tables.table("skins", &skin, |row, _| beside::skin(row))?,
            animations: tables
                .table("animations", &animation, |row, i| beside.animation(row, i))?,
            ..Root::default()
        };
        Ok(Document { root, nodes, beside })
    }

    /// The scene that is read, and its number: the default if it is there, else the first.
    pub(super) fn default_scene(&self) -> Option<(usize, &Scene)> {
        let wanted = self.scene.map_or(0, |scene| scene.value());
        let number = if wanted < self.scenes.len() { wanted } else { 0 };
        Some((number, self.scenes.get(number)?))
    }

    /// How many lights `KHR_lights_punctual` lists.
    pub(super) fn light_count(&self) -> usize {
        let extensions = self.extensions.as_ref();
        let punctual = extensions.and_then(|all| all.khr_lights_punctual.as_ref());
        punctual.map_or(0, |punctual| punctual.lights.len())
    }
}

/// The image of a texture; the crate gives one without the number that no row has.
pub(super) fn source(texture: &Texture) -> Option<Index<Image>> {
    Some(texture.source).filter(|source| source.value() != u32::MAX as usize)
}

/// How many morph targets a primitive has.
pub(super) fn morph_targets(primitive: &Primitive) -> usize {
    primitive.targets.as_ref().map_or(0, Vec::len)
}

/// What kind of object a table holds: its name, what notes about it are about, and the JSON of an object
/// that stands for one that was left out.
struct Kind(&'static str, Category, &'static str);

/// The members of a JSON object that are not parsed yet.
struct Tables<'a, 'n> {
    members: HashMap<String, &'a RawValue>,
    budget: &'n mut Budget,
    notes: &'n mut Notes,
}

impl<'a> Tables<'a, '_> {
    /// The members of an object inside an object.
    fn within(&mut self, outer: &str, inner: &str) -> Result<Option<Tables<'a, '_>>, Fault> {
        let Some(outer_members) = self.optional::<HashMap<String, &RawValue>>(outer)? else {
            return Ok(None);
        };
        let Some(inner) = outer_members.get(inner) else { return Ok(None) };
        let members = typed(inner, outer)?;
        Ok(Some(Tables { members, budget: self.budget, notes: self.notes }))
    }

    fn optional<T: Deserialize<'a>>(&mut self, key: &str) -> Result<Option<T>, Fault> {
        self.members.remove(key).map(|json| typed(json, key)).transpose()
    }

    /// Parses a table row by row, each after it has been prepared.
    fn table<T: DeserializeOwned>(
        &mut self,
        key: &str,
        kind: &Kind,
        mut prepare: impl FnMut(&mut Row, usize) -> Result<(), Box<dyn Error>>,
    ) -> Result<Vec<T>, Fault> {
        let rows = self.rows(key, kind, size_of::<T>())?;
        let row = |(i, row): (usize, &&RawValue)| Ok(self.row(row, kind, i, &mut prepare)?.0);
        rows.iter().enumerate().map(row).collect()
    }

    /// Parses the nodes.
    fn nodes(&mut self, kind: &Kind, beside: &mut Beside) -> Result<Vec<Node>, Fault> {
        let rows = self.rows("nodes", kind, size_of::<Node>())?;
        let plain = |row: &&RawValue| Node::plain(row.get());
        let mut nodes = Vec::with_capacity(rows.len());
        for block in rows.chunks(BLOCK) {
            let read: Vec<Option<Node>> = block.par_iter().map(plain).collect();
            for (node, row) in read.into_iter().zip(block) {
                let node = match node {
                    Some(node) => node,
                    None => {
                        let number = nodes.len();
                        let prepare = |row: &mut Row, number| beside.node(row, number);
                        let (row, transform) = self.row(row, kind, number, prepare)?;
                        Node::of(row, transform)
                    }
                };
                nodes.push(node);
            }
        }
        Ok(nodes)
    }

    /// The rows of a table, each of which will take so many bytes; none if it is no table.
    fn rows(&mut self, key: &str, kind: &Kind, bytes: usize) -> Result<Vec<&'a RawValue>, Fault> {
        let rows: Vec<&RawValue> = match self.optional(key) {
            Ok(rows) => rows.unwrap_or_default(),
            Err(fault) => {
                let text = format!("{}; all are left out", fault.into_problem());
                self.notes.add(kind.1, key, text);
                return Ok(Vec::new());
            }
        };
        let text: u64 = rows.par_iter().map(|row| weight(row.get())).sum();
        self.budget.take(text + (rows.len() * bytes) as u64, || key.to_string())?;
        Ok(rows)
    }

    /// Parses a row after it has been prepared, or what stands for it.
    fn row<T: DeserializeOwned, P>(
        &mut self,
        row: &RawValue,
        kind: &Kind,
        i: usize,
        mut prepare: impl FnMut(&mut Row, usize) -> Result<P, Box<dyn Error>>,
    ) -> Result<(T, P), Fault> {
        let Kind(name, category, spare) = *kind;
        let mut parse = |json: &str| -> Result<(T, P), Fault> {
            let mut value: Value =
                serde_json::from_str(json).map_err(|e| Fault::new(label(name, i, None), e))?;
            let own = value.get("name").and_then(Value::as_str).map(String::from);
            let fault = |problem: &dyn Display| Fault::new(label(name, i, own.as_deref()), problem);
            let row = value.as_object_mut().ok_or_else(|| fault(&"is not an object"))?;
            reference::check(row).map_err(|problem| fault(&problem))?;
            let prepared = prepare(row, i).map_err(|problem| fault(&problem))?;
            Ok((T::deserialize(value).map_err(|error| fault(&error))?, prepared))
        };
        parse(row.get()).or_else(|fault| {
            let (object, problem) = fault.parts();
            self.notes.add(category, object, format!("{problem}; left out"));
            parse(spare)
        })
    }
}

/// The text of the JSON, without what some writers put before and after it.
fn text<'a>(json: &'a [u8], notes: &mut Notes) -> Result<&'a [u8], Fault> {
    if json.len() > MOST_JSON_BYTES {
        let problem = format!("{} bytes of JSON are more than can be read", json.len());
        return Err(Fault::new("JSON", problem).remedy("keep binary data in buffers"));
    }
    if json.starts_with(b"\xFF\xFE") || json.starts_with(b"\xFE\xFF") {
        return Err(Fault::new("JSON", "is UTF-16").remedy("save the file as UTF-8"));
    }
    let text = json.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(json);
    if text.len() < json.len() {
        notes.add(Category::Other, "JSON", "starts with a byte order mark");
    }
    let end = text.iter().rposition(|&byte| byte != 0).map_or(0, |last| last + 1);
    if end < text.len() {
        notes.add(Category::Other, "JSON", "is padded with zero bytes and not with spaces");
    }
    let text = text[..end].trim_ascii();
    match text.first() {
        Some(b'{') | None => Ok(text),
        Some(_) => Err(Fault::new("JSON", "is not an object")),
    }
}

/// How many bytes of memory the JSON of a row takes at most while and after it is parsed: maps have room
/// for eleven members, lists for four.
fn weight(json: &str) -> u64 {
    const MAP: u64 = (11 * (size_of::<String>() + size_of::<Value>()) + 16) as u64;
    const LIST: u64 = 4 * size_of::<Value>() as u64;
    let bytes = json.bytes().map(|byte| match byte {
        b'{' => MAP,
        b'[' => LIST,
        b',' | b':' => LIST / 2,
        _ => 1,
    });
    bytes.sum()
}

fn typed<'a, T: Deserialize<'a>>(json: &'a RawValue, object: &str) -> Result<T, Fault> {
    serde_json::from_str(json.get()).map_err(|error| {
        // The place that it tells is not one of the file.
        let error = error.to_string();
        Fault::new(object, error.split(" at line ").next().unwrap_or_default())
    })
}

/// What a message calls an object: `node 3 "lamp"`.
pub(super) fn label(kind: &str, index: usize, name: Option<&str>) -> String {
    match name {
        Some(name) if !name.is_empty() => {
            let short: String = name.chars().take(64).collect();
            format!("{kind} {index} {short:?}")
        }
        _ => format!("{kind} {index}"),
    }
}
