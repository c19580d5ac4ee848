//! Nodes. A file may have millions, so each is kept small, and those that say only what most nodes say are read at
//! once into what they come to; the others take the way of all objects.

use super::Real;
use gltf::json::extensions::scene::khr_lights_punctual::Light;
use gltf::json::{Camera, Extras, Index, Mesh, Skin};
use serde::Deserialize;
use serde_json::Value;
use serde_json::value::{RawValue, to_raw_value};
use std::borrow::Cow;

/// A node of the file.
#[derive(Debug)]
pub(in crate::ingest::gltf) struct Node {
    pub name: Option<Box<str>>,
    pub children: Box<[u32]>,
    pub transform: Transform,
    pub mesh: Option<Index<Mesh>>,
    pub light: Option<Index<Light>>,
    pub extras: Extras,
    rare: Option<Box<Rare>>,
}

/// What few nodes have.
#[derive(Debug)]
struct Rare {
    camera: Option<Index<Camera>>,
    skin: Option<Index<Skin>>,
    weights: Option<Vec<f32>>,
}

/// A node's place below its parent, in double precision: large translations cancel and leave small ones.
#[derive(Debug, Default, PartialEq)]
pub(in crate::ingest::gltf) struct Transform {
    pub matrix: Option<Box<[Real; 16]>>,
    pub translation: Option<[Real; 3]>,
    pub rotation: Option<Box<[Real; 4]>>,
    pub scale: Option<Box<[Real; 3]>>,
}

/// What most nodes say.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Plain<'a> {
    #[serde(borrow)]
    name: Option<Cow<'a, str>>,
    children: Option<Box<[Number]>>,
    matrix: Option<Box<[Real; 16]>>,
    translation: Option<[Real; 3]>,
    rotation: Option<Box<[Real; 4]>>,
    scale: Option<Box<[Real; 3]>>,
    mesh: Option<Number>,
    #[serde(borrow)]
    extensions: Option<&'a RawValue>,
    #[serde(borrow)]
    extras: Option<&'a RawValue>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Extensions<'a> {
    #[serde(borrow, rename = "KHR_lights_punctual")]
    punctual: Option<&'a RawValue>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Punctual {
    light: Number,
}

/// The number of an object; the largest stands for none, and is refused.
#[derive(Clone, Copy, Deserialize)]
#[serde(try_from = "u32")]
struct Number(u32);

impl TryFrom<u32> for Number {
    type Error = &'static str;

    fn try_from(number: u32) -> Result<Number, &'static str> {
        if number < u32::MAX { Ok(Number(number)) } else { Err("is no object's number") }
    }
}

impl Number {
    fn index<T>(self) -> Index<T> {
        Index::new(self.0)
    }
}

/// An object; serde would take a list for one, too.
fn object<'a, T: Deserialize<'a>>(json: &'a str) -> Option<T> {
    json.trim_start().starts_with('{').then(|| serde_json::from_str(json).ok()).flatten()
}

/// An object that may be absent; `None` if it cannot be read.
fn within<'a, T: Deserialize<'a>>(json: Option<&'a RawValue>) -> Option<Option<T>> {
    json.map_or(Some(None), |json| object(json.get()).map(Some))
}

/// As all objects are read: of members with one name the last is kept.
fn rewritten(json: &RawValue) -> serde_json::Result<Box<RawValue>> {
    to_raw_value(&serde_json::from_str::<Value>(json.get())?)
}

impl Node {
    /// Of a node that says only what most do and nothing wrong; `None` for any other.
    pub(super) fn plain(json: &str) -> Option<Node> {
        let plain: Plain = object(json)?;
        let Plain { matrix, translation, rotation, scale, .. } = plain;
        let extensions: Option<Extensions> = within(plain.extensions)?;
        let punctual = extensions.and_then(|extensions| extensions.punctual);
        let punctual: Option<Punctual> = within(punctual)?;
        let children = plain.children.unwrap_or_default();
        Some(Node {
            name: plain.name.map(|name| name.into()),
            children: children.iter().map(|child| child.0).collect(),
            transform: Transform { matrix, translation, rotation, scale },
            mesh: plain.mesh.map(Number::index),
            light: punctual.map(|punctual| punctual.light.index()),
            extras: plain.extras.map(rewritten).transpose().ok()?,
            rare: None,
        })
    }

    /// Of a row that the crate has parsed, with the transform that was taken out of it.
    pub(super) fn of(row: gltf::json::Node, transform: Transform) -> Node {
        let extensions = row.extensions.and_then(|extensions| extensions.khr_lights_punctual);
        let children = row.children.unwrap_or_default();
        let rare = Rare { camera: row.camera, skin: row.skin, weights: row.weights };
        let has_any = rare.camera.is_some() || rare.skin.is_some() || rare.weights.is_some();
        Node {
            name: row.name.map(String::into_boxed_str),
            children: children.iter().map(|child| child.value() as u32).collect(),
            transform,
            mesh: row.mesh,
            light: extensions.map(|punctual| punctual.light),
            extras: row.extras,
            rare: has_any.then(|| Box::new(rare)),
        }
    }

    pub fn camera(&self) -> Option<Index<Camera>> {
        self.rare.as_ref()?.camera
    }

    pub fn skin(&self) -> Option<Index<Skin>> {
        self.rare.as_ref()?.skin
    }

    /// Of the morph targets.
    pub fn weights(&self) -> Option<&Vec<f32>> {
        self.rare.as_ref()?.weights.as_ref()
    }
}

#[cfg(test)]
mod tests {
    use super::super::Document;
    use super::*;
    use crate::ingest::budget::Budget;
    use crate::ingest::notes::Notes;
    use proptest::prelude::*;

    /// A node as a file with it and another one is read: by the way of all objects, if a member that no one knows is
    /// put into it.
    fn read(node: &str, is_plain: bool) -> (String, String) {
        let end = if node == "{}" { r#""unknown": 0}"# } else { r#", "unknown": 0}"# };
        let node = match is_plain {
            true => node.to_string(),
            false => format!("{}{end}", &node[..node.len() - 1]),
        };
        assert!(is_plain || Node::plain(&node).is_none());
        let json = format!(r#"{{"asset": {{"version": "2.0"}}, "nodes": [{node}, {{}}]}}"#);
        let mut budget = Budget::for_geometry();
        budget.grow(1 << 20);
        let mut notes = Notes::default();
        let document = Document::parse(json.as_bytes(), &mut budget, &mut notes).unwrap();
        let nodes = format!("{:?}", document.nodes).replace([' ', '\n'], "");
        (nodes, format!("{:?}", notes.into_list()))
    }

    /// Members that most nodes have, sound and not.
    fn member() -> impl Strategy<Value = String> {
        let number = prop_oneof![
            Just("0".to_string()),
            Just("4294967294".to_string()),
            Just("4294967295".to_string()),
            Just("-1".to_string()),
            Just("1e39".to_string()),
            (-40.0..38.0f64).prop_map(|log| format!("{:e}", 10f64.powf(log))),
        ];
        let list = |size| prop::collection::vec(number.clone(), size);
        let joined = |values: Vec<String>| format!("[{}]", values.join(", "));
        prop_oneof![
            prop_oneof![Just("lamp"), Just(r#"\u00e9 \"x\""#), Just("")]
                .prop_map(|n| format!(r#""name": "{n}""#)),
            Just(r#""name": null"#.to_string()),
            list(0..4).prop_map(move |v| format!(r#""children": {}"#, joined(v))),
            list(2..5).prop_map(move |v| format!(r#""translation": {}"#, joined(v))),
            list(4..5).prop_map(move |v| format!(r#""rotation": {}"#, joined(v))),
            list(3..4).prop_map(move |v| format!(r#""scale": {}"#, joined(v))),
            list(16..17).prop_map(move |v| format!(r#""matrix": {}"#, joined(v))),
            number.clone().prop_map(|n| format!(r#""mesh": {n}"#)),
            number.clone().prop_map(|n| format!(
                r#""extensions": {{"KHR_lights_punctual": {{"light": {n}}}}}"#
            )),
            Just(r#""extras": {"n":[1,2.5],"usdPath":"/a"}"#.to_string()),
            Just(r#""extras": {"usdLux":{"radius":1,"radius":2},"n":1e-7}"#.to_string()),
            Just(r#""extras": {"n":1e999}"#.to_string()),
            Just(r#""extras": {"\ud800":1}"#.to_string()),
            Just(r#""extensions": {}"#.to_string()),
            Just(r#""extensions": [[5]]"#.to_string()),
            Just(r#""extensions": {"KHR_lights_punctual": [5]}"#.to_string()),
        ]
    }

    proptest! {
        /// The short way gives what the long way gives, or leaves the node to it.
        #[test]
        fn a_plain_node_is_what_any_node_is(members in prop::collection::vec(member(), 0..5)) {
            let node = format!("{{{}}}", members.join(", "));
            prop_assert_eq!(read(&node, true), read(&node, false));
        }
    }

    #[test]
    fn most_nodes_are_plain() {
        let node = r#"{"name": "lamp", "translation": [1, 2, 3],
            "extensions": {"KHR_lights_punctual": {"light": 4}}, "extras": {"usdPath": "/lamp"}}"#;
        let plain = Node::plain(node).unwrap();
        assert_eq!((plain.name.as_deref(), plain.light), (Some("lamp"), Some(Index::new(4))));
        assert!(Node::plain(r#"{"camera": 0}"#).is_none());
    }
}
