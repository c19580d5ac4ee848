//! What a file says and the `gltf` crate's types do not, or not well enough.

use super::{Real, Row, Transform};
use gltf::json::animation::Sampler;
use gltf::json::mesh::Semantic;
use gltf::json::validation::Checked;
use gltf::json::{Accessor, Index, Node, texture};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, from_value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::error::Error;
use std::mem;

type Prepared<T = ()> = Result<T, Box<dyn Error>>;

/// What was taken out, by the number of the object.
#[derive(Default)]
pub(in crate::ingest::gltf) struct Beside {
    /// `EXT_mesh_gpu_instancing` of nodes.
    pub instances: BTreeMap<usize, Instancing>,
    /// Nodes that `KHR_node_visibility` hides.
    pub hidden: BTreeSet<usize>,
    /// Normal map of every material: the crate's has no `KHR_texture_transform`.
    pub normal_maps: Vec<Option<texture::Info>>,
    /// Of every camera, in case it is orthographic: the crate's cannot do without clipping planes.
    pub magnifications: Vec<Option<Magnification>>,
    /// Channels of every animation: the crate's need a node and have no `KHR_animation_pointer`.
    pub channels: Vec<Vec<Channel>>,
}

/// What an orthographic camera sees, from the middle to the edge.
#[derive(Clone, Copy, Deserialize)]
pub(in crate::ingest::gltf) struct Magnification {
    #[serde(default)]
    pub xmag: Real,
    #[serde(default)]
    pub ymag: Real,
}

#[derive(Deserialize)]
pub(in crate::ingest::gltf) struct Instancing {
    pub attributes: BTreeMap<String, Index<Accessor>>,
}

#[derive(Deserialize)]
struct Visibility {
    visible: Option<bool>,
}

#[derive(Deserialize)]
pub(in crate::ingest::gltf) struct Channel {
    pub sampler: Index<Sampler>,
    pub target: Target,
}

#[derive(Deserialize)]
pub(in crate::ingest::gltf) struct Target {
    pub node: Option<Index<Node>>,
    pub path: String,
    #[serde(default)]
    pub extensions: TargetExtensions,
}

#[derive(Default, Deserialize)]
pub(in crate::ingest::gltf) struct TargetExtensions {
    #[serde(rename = "KHR_animation_pointer")]
    pub pointer: Option<Pointer>,
}

#[derive(Deserialize)]
pub(in crate::ingest::gltf) struct Pointer {
    pub pointer: String,
}

impl Beside {
    /// Takes from a row what is kept beside it, and its transform. A row may come twice, the second time as what stands
    /// for it.
    pub(super) fn node(&mut self, row: &mut Row, number: usize) -> Prepared<Transform> {
        let transform = Transform {
            matrix: take(row, "matrix")?,
            translation: take(row, "translation")?,
            rotation: take(row, "rotation")?,
            scale: take(row, "scale")?,
        };
        self.instances.remove(&number);
        self.hidden.remove(&number);
        if let Some(extensions) = row.get_mut("extensions").and_then(Value::as_object_mut) {
            let instances = take(extensions, "EXT_mesh_gpu_instancing")?;
            self.instances.extend(instances.map(|instances| (number, instances)));
            let visibility: Option<Visibility> = take(extensions, "KHR_node_visibility")?;
            let visible = visibility.and_then(|visibility| visibility.visible).unwrap_or(true);
            self.hidden.extend((!visible).then_some(number));
        }
        Ok(transform)
    }

    pub(super) fn material(&mut self, row: &mut Row, number: usize) -> Prepared {
        let normal_map = row.get("normalTexture").map_or(Ok(None), Option::deserialize)?;
        put(&mut self.normal_maps, number, normal_map);
        Ok(())
    }

    pub(super) fn camera(&mut self, row: &mut Row, number: usize) -> Prepared {
        put(&mut self.magnifications, number, take(row, "orthographic")?);
        // glTF's clipping planes are not read: see `carriers.md`.
        if let Some(lens) = row.get_mut("perspective").and_then(Value::as_object_mut) {
            lens.remove("zfar");
            lens.insert("znear".into(), json!(0));
        }
        Ok(())
    }

    pub(super) fn animation(&mut self, row: &mut Row, number: usize) -> Prepared {
        let channels = row.insert("channels".into(), json!([])).ok_or("has no channels")?;
        put(&mut self.channels, number, from_value(channels)?);
        Ok(())
    }
}

/// Gives the row of a number, which is the last or the next one.
fn put<T>(rows: &mut Vec<T>, number: usize, row: T) {
    rows.truncate(number);
    rows.push(row);
}

/// The crate cuts numbers to 32 bits before it looks what they mean.
pub(super) fn accessor(row: &mut Row) -> Prepared {
    let sparse = row.get("sparse").and_then(|sparse| sparse.pointer("/indices/componentType"));
    for kind in row.get("componentType").into_iter().chain(sparse) {
        if kind.as_u64().is_some_and(|kind| kind > u64::from(u32::MAX)) {
            return Err(format!("has unknown component type {kind}").into());
        }
    }
    Ok(())
}

/// A light without a type is of an unknown one.
pub(super) fn light(row: &mut Row) -> Prepared {
    row.entry("type").or_insert_with(|| json!("none"));
    Ok(())
}

/// An empty scene has no nodes; the crate wants the list.
pub(super) fn scene(row: &mut Row) -> Prepared {
    row.entry("nodes").or_insert_with(|| json!([]));
    Ok(())
}

/// What is called a skeleton decides nothing, and some writers number one that is not there. The crate cannot do
/// without joints.
pub(super) fn skin(row: &mut Row) -> Prepared {
    row.remove("skeleton");
    row.entry("joints").or_insert_with(|| json!([]));
    Ok(())
}

/// The crate takes all attributes with odd names for one, and ignores those of morph targets. They
/// become the application's own, `target 0 NORMAL` of the first target.
pub(super) fn mesh(row: &mut Row) -> Prepared {
    for primitive in rows(row, "primitives") {
        if primitive.get("mode").and_then(Value::as_u64).is_some_and(|mode| mode > 6) {
            // The crate would cut it to eight bits.
            primitive.insert("mode".into(), json!(u8::MAX));
        }
        let targets = primitive.get("targets").map_or(Ok(Vec::new()), Vec::<Row>::deserialize)?;
        if let Some(attributes) = primitive.get_mut("attributes").and_then(Value::as_object_mut) {
            for (name, index) in mem::take(attributes) {
                let semantic: Checked<Semantic> = from_value(json!(name))?;
                let unchanged = semantic.to_string() == name;
                attributes.insert(if unchanged { name } else { format!("_{name}") }, index);
            }
            for (i, target) in targets.into_iter().enumerate() {
                let own = |(name, index)| (format!("_target {i} {name}"), index);
                attributes.extend(target.into_iter().map(own));
            }
        }
    }
    Ok(())
}

fn take<T: DeserializeOwned>(row: &mut Row, key: &str) -> serde_json::Result<Option<T>> {
    from_value(row.remove(key).unwrap_or_default())
}

/// The objects in a list of an object.
fn rows<'a>(row: &'a mut Row, key: &str) -> impl Iterator<Item = &'a mut Row> {
    let list = row.get_mut(key).and_then(Value::as_array_mut);
    list.into_iter().flatten().filter_map(Value::as_object_mut)
}
