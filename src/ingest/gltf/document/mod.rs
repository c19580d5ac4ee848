//! The glTF document: crate `gltf`'s, parsed object by object, so that an error names the object.
//!
//! Its JSON types are taken, its readers are not: they panic on what is not sound. And what the
//! types cannot say, or confuse, is taken out of an object [beside] before it is parsed.

mod beside;
mod extras;
mod real;
mod reference;

pub(super) use beside::{Beside, Channel, Instancing, Target, Transform};
pub(super) use extras::{AssetUsd, UsdCamera, UsdFog, UsdLux, UsdValues, usd_path};
pub(super) use real::{Real, reals};

use crate::ingest::error::Fault;
use gltf::json::extensions::root::{KhrLightsPunctual, Root as RootExtensions};
use gltf::json::extensions::scene::khr_lights_punctual::Light;
use gltf::json::mesh::Primitive;
use gltf::json::{Image, Index, Root, Texture, texture};
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};
use std::error::Error;
use std::ops::Deref;

/// More JSON than this is not parsed: a plain value takes up to thirty times the memory of its text.
const MOST_JSON_BYTES: usize = 512 << 20;

/// Longer tables are refused: a row of two bytes takes about a kilobyte when it is parsed.
const MOST_ROWS: usize = 1 << 22;

/// An object of the file that is not parsed yet.
type Row = Map<String, Value>;

/// The file's JSON, typed, and nothing that it implies.
pub(super) struct Document {
    root: Root,
    pub beside: Beside,
}

impl Deref for Document {
    type Target = Root;

    fn deref(&self) -> &Root {
        &self.root
    }
}

impl Document {
    pub(super) fn parse(json: &[u8]) -> Result<Document, Fault> {
        if json.len() > MOST_JSON_BYTES {
            let problem = format!("{} bytes of JSON are more than can be read", json.len());
            return Err(Fault::new("JSON", problem).remedy("keep binary data in buffers"));
        }
        let marks: [&[u8]; 3] = [b"\xEF\xBB\xBF", b"\xFF\xFE", b"\xFE\xFF"];
        if marks.iter().any(|mark| json.starts_with(mark)) {
            return Err(Fault::new("JSON", "starts with a byte order mark")
                .remedy("save the file as UTF-8 without one"));
        }
        let json: Value = serde_json::from_slice(json)
            .map_err(|error| Fault::new("JSON", format!("cannot be parsed: {error}")))?;
        let Value::Object(mut json) = json else {
            return Err(Fault::new("JSON", "is not an object"));
        };
        let asset = json.remove("asset").ok_or_else(|| Fault::new("asset", "is missing"))?;
        let mut extensions: Row = optional(&mut json, "extensions")?.unwrap_or_default();
        let lights = match optional::<Row>(&mut extensions, "KHR_lights_punctual")? {
            Some(mut punctual) if punctual.contains_key("lights") => {
                table(&mut punctual, "lights", "light", beside::light)?
            }
            Some(_) => return Err(Fault::new("KHR_lights_punctual", "has no list of lights")),
            None => Vec::new(),
        };
        let (json, mut beside) = (&mut json, Beside::default());
        let root = Root {
            asset: typed(asset, "asset")?,
            extensions_used: optional(json, "extensionsUsed")?.unwrap_or_default(),
            extensions_required: optional(json, "extensionsRequired")?.unwrap_or_default(),
            extensions: Some(RootExtensions {
                khr_lights_punctual: Some(KhrLightsPunctual { lights }),
                ..RootExtensions::default()
            }),
            scene: optional(json, "scene")?.map(Index::new),
            scenes: table(json, "scenes", "scene", beside::scene)?,
            nodes: table(json, "nodes", "node", |row| beside.node(row))?,
            meshes: table(json, "meshes", "mesh", beside::mesh)?,
            accessors: table(json, "accessors", "accessor", beside::accessor)?,
            buffer_views: table(json, "bufferViews", "buffer view", |_| Ok(()))?,
            buffers: table(json, "buffers", "buffer", |_| Ok(()))?,
            materials: table(json, "materials", "material", |row| beside.material(row))?,
            textures: table(json, "textures", "texture", |_| Ok(()))?,
            images: table(json, "images", "image", |_| Ok(()))?,
            samplers: table(json, "samplers", "sampler", |_| Ok(()))?,
            cameras: table(json, "cameras", "camera", |row| beside.camera(row))?,
            animations: table(json, "animations", "animation", |row| beside.animation(row))?,
            skins: table(json, "skins", "skin", |_| Ok(()))?,
            ..Root::default()
        };
        Ok(Document { root, beside })
    }

    /// `KHR_lights_punctual`.
    pub(super) fn lights(&self) -> &[Light] {
        self.as_ref()
    }

    /// The light at a node.
    pub(super) fn light_at(&self, node: usize) -> Option<Index<Light>> {
        let extensions = self.nodes[node].extensions.as_ref()?;
        extensions.khr_lights_punctual.as_ref().map(|punctual| punctual.light)
    }

    /// Every use of a texture by a material, read or not, but for its occlusion map.
    pub(super) fn texture_uses(&self, material: usize) -> impl Iterator<Item = &texture::Info> {
        let (row, normal) = (&self.materials[material], &self.beside.normal_maps[material]);
        let pbr = &row.pbr_metallic_roughness;
        let extensions = row.extensions.as_ref();
        let specular = extensions.and_then(|extensions| extensions.specular.as_ref());
        let glossy = extensions.and_then(|extensions| extensions.pbr_specular_glossiness.as_ref());
        let core = [
            normal,
            &row.emissive_texture,
            &pbr.base_color_texture,
            &pbr.metallic_roughness_texture,
        ];
        core.into_iter()
            .chain(
                specular.into_iter().flat_map(|s| [&s.specular_texture, &s.specular_color_texture]),
            )
            .chain(
                glossy
                    .into_iter()
                    .flat_map(|g| [&g.diffuse_texture, &g.specular_glossiness_texture]),
            )
            .flatten()
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

fn typed<T: DeserializeOwned>(value: Value, object: &str) -> Result<T, Fault> {
    T::deserialize(value).map_err(|error| Fault::new(object, error))
}

fn optional<T: DeserializeOwned>(json: &mut Row, key: &str) -> Result<Option<T>, Fault> {
    json.remove(key).map(|value| typed(value, key)).transpose()
}

/// Parses a table row by row, each after it has been prepared.
fn table<T: DeserializeOwned>(
    json: &mut Row,
    key: &str,
    kind: &str,
    mut prepare: impl FnMut(&mut Row) -> Result<(), Box<dyn Error>>,
) -> Result<Vec<T>, Fault> {
    let rows: Vec<Value> = optional(json, key)?.unwrap_or_default();
    if rows.len() > MOST_ROWS {
        let problem = format!("{} of them are more than the {MOST_ROWS} that are read", rows.len());
        return Err(Fault::new(key, problem).remedy("divide the scene"));
    }
    let row = |(i, mut value): (usize, Value)| {
        let object = label(kind, i, value.get("name").and_then(Value::as_str));
        let Some(row) = value.as_object_mut() else {
            return Err(Fault::new(object, "is not an object"));
        };
        reference::check(row).map_err(|problem| Fault::new(&object, problem))?;
        prepare(row).map_err(|problem| Fault::new(&object, problem))?;
        typed(value, &object)
    };
    rows.into_iter().enumerate().map(row).collect()
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
