//! The glTF document: what its JSON says, typed, and nothing that it implies.
//!
//! The structures hold only what is read. They are parsed object by object, so that an error names
//! the object. (The `gltf` crate's own refuse valid files: textures without a source, channels
//! with `KHR_animation_pointer`, required extensions that it does not know.)

mod extras;
mod material;
mod real;

pub(super) use extras::{AssetUsd, UsdCamera, UsdLux, usd_path};
pub(super) use material::{
    AlphaMode, Image, Material, Sampler, SpecularGlossiness, Texture, TextureInfo,
};
pub(super) use real::{Real, reals};

use crate::ingest::error::Fault;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};
use std::collections::BTreeMap;

/// More JSON than this is not parsed: a value takes up to thirty times the memory of its text.
const MOST_JSON_BYTES: usize = 512 << 20;

/// Named things that nobody here reads.
pub(super) type Unread = BTreeMap<String, serde::de::IgnoredAny>;

/// Everything in the file's JSON that is read.
pub(super) struct Document {
    pub asset: Asset,
    pub extensions_used: Vec<String>,
    pub extensions_required: Vec<String>,
    pub scene: Option<u32>,
    pub scenes: Vec<Scene>,
    pub nodes: Vec<Node>,
    pub meshes: Vec<Mesh>,
    pub accessors: Vec<Accessor>,
    pub buffer_views: Vec<BufferView>,
    pub buffers: Vec<Buffer>,
    pub materials: Vec<Material>,
    pub textures: Vec<Texture>,
    pub images: Vec<Image>,
    pub samplers: Vec<Sampler>,
    pub cameras: Vec<Camera>,
    pub animations: Vec<Animation>,
    pub skins: Vec<Skin>,
    /// `KHR_lights_punctual`.
    pub lights: Vec<Light>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Asset {
    pub version: String,
    pub min_version: Option<String>,
    #[serde(default)]
    pub extras: Value,
}

#[derive(Deserialize)]
pub(super) struct Scene {
    pub name: Option<String>,
    #[serde(default)]
    pub nodes: Vec<u32>,
}

#[derive(Deserialize)]
pub(super) struct Node {
    pub name: Option<String>,
    #[serde(default)]
    pub children: Vec<u32>,
    pub matrix: Option<[Real; 16]>,
    pub translation: Option<[Real; 3]>,
    pub rotation: Option<[Real; 4]>,
    pub scale: Option<[Real; 3]>,
    pub mesh: Option<u32>,
    pub camera: Option<u32>,
    pub skin: Option<u32>,
    pub weights: Option<Vec<Real>>,
    #[serde(default)]
    pub extensions: NodeExtensions,
    #[serde(default)]
    pub extras: Value,
}

#[derive(Default, Deserialize)]
pub(super) struct NodeExtensions {
    #[serde(rename = "KHR_lights_punctual")]
    pub light: Option<NodeLight>,
    #[serde(rename = "EXT_mesh_gpu_instancing")]
    pub instancing: Option<Instancing>,
    #[serde(rename = "KHR_node_visibility")]
    pub visibility: Option<Visibility>,
}

#[derive(Deserialize)]
pub(super) struct NodeLight {
    pub light: u32,
}

#[derive(Deserialize)]
pub(super) struct Instancing {
    pub attributes: BTreeMap<String, u32>,
}

#[derive(Deserialize)]
pub(super) struct Visibility {
    #[serde(default = "yes")]
    pub visible: bool,
}

#[derive(Deserialize)]
pub(super) struct Mesh {
    pub name: Option<String>,
    pub primitives: Vec<Primitive>,
    pub weights: Option<Vec<Real>>,
}

#[derive(Deserialize)]
pub(super) struct Primitive {
    pub attributes: BTreeMap<String, u32>,
    pub indices: Option<u32>,
    pub material: Option<u32>,
    #[serde(default = "triangles")]
    pub mode: u32,
    #[serde(default)]
    pub targets: Vec<BTreeMap<String, u32>>,
    #[serde(default)]
    pub extensions: Unread,
    #[serde(default)]
    pub extras: Value,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub name: Option<String>,
    pub buffer_view: Option<u32>,
    pub byte_offset: Option<u64>,
    pub component_type: u32,
    #[serde(default)]
    pub normalized: bool,
    pub count: u64,
    #[serde(rename = "type")]
    pub shape: String,
    pub min: Option<Vec<Real>>,
    pub max: Option<Vec<Real>>,
    pub sparse: Option<Sparse>,
}

#[derive(Deserialize)]
pub(super) struct Sparse {
    pub count: u64,
    pub indices: SparseIndices,
    pub values: SparseValues,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseIndices {
    pub buffer_view: u32,
    #[serde(default)]
    pub byte_offset: u64,
    pub component_type: u32,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseValues {
    pub buffer_view: u32,
    #[serde(default)]
    pub byte_offset: u64,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct BufferView {
    pub buffer: u32,
    #[serde(default)]
    pub byte_offset: u64,
    pub byte_length: u64,
    pub byte_stride: Option<u64>,
    pub target: Option<u32>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer {
    pub byte_length: u64,
    pub uri: Option<String>,
}

#[derive(Deserialize)]
pub(super) struct Camera {
    pub name: Option<String>,
    #[serde(rename = "type")]
    pub kind: String,
    pub perspective: Option<Perspective>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Perspective {
    pub yfov: Real,
    pub aspect_ratio: Option<Real>,
}

#[derive(Deserialize)]
pub(super) struct Animation {
    pub name: Option<String>,
    pub channels: Vec<Channel>,
    pub samplers: Vec<AnimationSampler>,
}

#[derive(Deserialize)]
pub(super) struct Channel {
    pub sampler: u32,
    pub target: Target,
}

#[derive(Deserialize)]
pub(super) struct Target {
    pub node: Option<u32>,
    pub path: String,
    #[serde(default)]
    pub extensions: TargetExtensions,
}

#[derive(Default, Deserialize)]
pub(super) struct TargetExtensions {
    #[serde(rename = "KHR_animation_pointer")]
    pub pointer: Option<Pointer>,
}

#[derive(Deserialize)]
pub(super) struct Pointer {
    pub pointer: String,
}

#[derive(Deserialize)]
pub(super) struct AnimationSampler {
    pub input: u32,
    pub output: u32,
    #[serde(default = "linear")]
    pub interpolation: String,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Skin {
    pub inverse_bind_matrices: Option<u32>,
    pub skeleton: Option<u32>,
    pub joints: Vec<u32>,
}

#[derive(Deserialize)]
pub(super) struct Light {
    pub name: Option<String>,
    #[serde(rename = "type")]
    pub kind: String,
    #[serde(default = "real::white")]
    pub color: [Real; 3],
    #[serde(default = "real::one")]
    pub intensity: Real,
    pub range: Option<Real>,
    pub spot: Option<Spot>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Spot {
    #[serde(default)]
    pub inner_cone_angle: Real,
    #[serde(default = "real::eighth_turn")]
    pub outer_cone_angle: Real,
}

#[derive(Default, Deserialize)]
struct RootExtensions {
    #[serde(rename = "KHR_lights_punctual")]
    lights: Option<RootLights>,
}

#[derive(Deserialize)]
struct RootLights {
    lights: Vec<Value>,
}

fn yes() -> bool {
    true
}

fn triangles() -> u32 {
    4
}

fn linear() -> String {
    "LINEAR".into()
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
        let root: Value = serde_json::from_slice(json)
            .map_err(|error| Fault::new("JSON", format!("cannot be parsed: {error}")))?;
        let Value::Object(mut root) = root else {
            return Err(Fault::new("JSON", "is not an object"));
        };
        let asset = root.remove("asset").ok_or_else(|| Fault::new("asset", "is missing"))?;
        let extensions: RootExtensions = optional(&mut root, "extensions")?.unwrap_or_default();
        let lights = extensions.lights.map_or_else(Vec::new, |root| root.lights);
        Ok(Document {
            asset: typed(asset, "asset")?,
            extensions_used: optional(&mut root, "extensionsUsed")?.unwrap_or_default(),
            extensions_required: optional(&mut root, "extensionsRequired")?.unwrap_or_default(),
            scene: optional(&mut root, "scene")?,
            scenes: table(&mut root, "scenes", "scene")?,
            nodes: table(&mut root, "nodes", "node")?,
            meshes: table(&mut root, "meshes", "mesh")?,
            accessors: table(&mut root, "accessors", "accessor")?,
            buffer_views: table(&mut root, "bufferViews", "buffer view")?,
            buffers: table(&mut root, "buffers", "buffer")?,
            materials: table(&mut root, "materials", "material")?,
            textures: table(&mut root, "textures", "texture")?,
            images: table(&mut root, "images", "image")?,
            samplers: table(&mut root, "samplers", "sampler")?,
            cameras: table(&mut root, "cameras", "camera")?,
            animations: table(&mut root, "animations", "animation")?,
            skins: table(&mut root, "skins", "skin")?,
            lights: rows(lights, "light")?,
        })
    }
}

fn typed<T: DeserializeOwned>(value: Value, object: &str) -> Result<T, Fault> {
    T::deserialize(value).map_err(|error| Fault::new(object, error))
}

fn optional<T: DeserializeOwned>(
    root: &mut Map<String, Value>,
    key: &str,
) -> Result<Option<T>, Fault> {
    root.remove(key).map(|value| typed(value, key)).transpose()
}

fn table<T: DeserializeOwned>(
    root: &mut Map<String, Value>,
    key: &str,
    kind: &str,
) -> Result<Vec<T>, Fault> {
    rows(optional(root, key)?.unwrap_or_default(), kind)
}

fn rows<T: DeserializeOwned>(values: Vec<Value>, kind: &str) -> Result<Vec<T>, Fault> {
    let row = |(i, value): (usize, Value)| {
        let object = label(kind, i, value.get("name").and_then(Value::as_str));
        match value {
            Value::Object(_) => typed(value, &object),
            _ => Err(Fault::new(object, "is not an object")),
        }
    };
    values.into_iter().enumerate().map(row).collect()
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
