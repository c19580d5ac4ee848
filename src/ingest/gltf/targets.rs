//! What animations move: nodes, or what `KHR_animation_pointer` points at.

use super::animation::WEIGHTS;
use super::cones::{INNER, OUTER, RANGE};
use super::document::{Document, Node, Target, label};
use super::lenses::{YFOV, YMAG};
use super::strengths::{COLOR, FACTOR, INTENSITY, STRENGTH};
use crate::scene::Category;
use gltf::json::Index;
use gltf::json::extensions::scene::khr_lights_punctual::{Light, Type};
use gltf::json::validation::Checked;

/// Where pointers to lights begin.
const LIGHTS: &str = "/extensions/KHR_lights_punctual/lights/";

/// What is read of the animation of a node.
const OF_NODES: [&str; 4] = ["translation", "rotation", "scale", WEIGHTS];

/// Where pointers to rows of a table begin, what these are, and what is read of their animation.
type Kind = (&'static str, fn(usize) -> Moved, &'static [&'static str]);

/// What a channel animates a part of, by its number in the file.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) enum Moved {
    Node(usize),
    Camera(usize),
    Light(usize),
    Material(usize),
    Mesh(usize),
}

impl Moved {
    pub(super) fn category(self) -> Category {
        match self {
            Moved::Node(_) | Moved::Mesh(_) => Category::Animation,
            Moved::Camera(_) => Category::Cameras,
            // Of materials it is their emission alone.
            Moved::Light(_) | Moved::Material(_) => Category::Lights,
        }
    }

    pub(super) fn label(self) -> String {
        match self {
            Moved::Node(node) => label("node", node, None),
            Moved::Camera(camera) => label("camera", camera, None),
            Moved::Light(light) => label("light", light, None),
            Moved::Material(material) => label("material", material, None),
            Moved::Mesh(mesh) => label("mesh", mesh, None),
        }
    }
}

/// Whether the file has such a part.
pub(super) fn can_move(document: &Document, moves: Moved, path: &str) -> bool {
    match moves {
        Moved::Node(node) => {
            let can = |node: &Node| path == WEIGHTS || node.transform.matrix.is_none();
            document.nodes.get(node).is_some_and(can)
        }
        Moved::Camera(camera) if path == YFOV => {
            document.cameras.get(camera).is_some_and(|camera| camera.perspective.is_some())
        }
        // One that is both is read as perspective.
        Moved::Camera(camera) => {
            document.cameras.get(camera).is_some_and(|camera| camera.perspective.is_none())
                && document.beside.magnifications.get(camera).is_some_and(Option::is_some)
        }
        Moved::Light(light) => {
            let row = (light < document.light_count()).then(|| Index::<Light>::new(light as u32));
            row.and_then(|row| document.get(row)).is_some_and(|row| match path {
                OUTER | INNER => row.type_ == Checked::Valid(Type::Spot),
                RANGE => row.type_ != Checked::Valid(Type::Directional),
                _ => true,
            })
        }
        Moved::Material(material) => material < document.materials.len(),
        Moved::Mesh(mesh) => mesh < document.meshes.len(),
    }
}

/// What a channel moves and which part of it, directly or by a pointer.
pub(super) fn target(target: &Target) -> Option<(Moved, &'static str)> {
    let Some(pointer) = &target.extensions.pointer else {
        return Some((Moved::Node(target.node?.value()), find(&OF_NODES, &target.path)?));
    };
    let kinds: [Kind; 5] = [
        ("/nodes/", Moved::Node, &OF_NODES),
        ("/cameras/", Moved::Camera, &[YFOV, YMAG]),
        (LIGHTS, Moved::Light, &[COLOR, INTENSITY, OUTER, INNER, RANGE]),
        ("/materials/", Moved::Material, &[FACTOR, STRENGTH]),
        ("/meshes/", Moved::Mesh, &[WEIGHTS]),
    ];
    kinds.into_iter().find_map(|(table, moved, parts)| {
        let (number, path) = pointer.pointer.strip_prefix(table)?.split_once('/')?;
        Some((moved(number.parse().ok()?), find(parts, path)?))
    })
}

fn find(parts: &[&'static str], path: &str) -> Option<&'static str> {
    parts.iter().copied().find(|part| *part == path)
}

/// What an animation that is not read is of, and what is said of its kind.
pub(super) fn unread(target: &Target) -> (&str, Category, &'static str) {
    let Some(pointer) = &target.extensions.pointer else {
        return (&target.path, Category::Animation, "animation of shapes is not read");
    };
    let pointer = pointer.pointer.as_str();
    let (category, text) = match pointer.split('/').nth(1) {
        Some("materials") if pointer.contains("emissive") => {
            (Category::Lights, "animation of this part of an emission is not read; it is constant")
        }
        Some("materials") => (Category::Materials, "animation of materials is not read"),
        Some("cameras") => (Category::Cameras, "animation of this part of a lens is not read"),
        Some("extensions") if pointer.contains("KHR_lights_punctual") => {
            (Category::Lights, "animation of this part of a light is not read; it is constant")
        }
        Some("meshes") => (Category::Animation, "animation of shapes is not read"),
        _ => (Category::Animation, "animation of this is not read"),
    };
    (pointer, category, text)
}
