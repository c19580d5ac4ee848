//! Morph targets and skins: meshes in the shape of the shot's first frame, and what changes that later.
//!
//! Source: glTF 2.0, 3.7.2.2 (morph targets) and 3.7.3.3 (skins). The exporter writes whatever deforms on a USD stage as
//! morph targets, `scripts/usd_gltf/deformation.py`.
//!
//! - A vertex is moved by the morph targets first, then by the joints: by the mean, by its weights, of what each joint's
//!   global transform makes of the inverse bind matrix.
//! - Weights of morph targets are those of the node's animation at the first frame, else the node's, else those of the
//!   mesh's animation, else the mesh's.
//! - The transform of a skinned mesh's node has no meaning. The mesh is *hung* at a node that its joints have in
//!   common, and its vertices are in that node's space; so it is carried as a whole by whatever moves there. Where the
//!   joints never move against each other, that is the deepest common one. Else the mesh
//!   [deforms](crate::scene::Deformation), and hangs above its skeleton.
//! - Where joints mirror at the first frame, triangles are turned over, so that their fronts stay fronts.
//! - What cannot be read is left out, with a note: a skin, or all morph targets of a primitive.
//!
//! | file | what |
//! |---|---|
//! | `weights` | how far morph targets are applied |
//! | `morph` | their displacements |
//! | `rig` | where joints are |
//! | `influences` | which joints move a vertex |
//! | `skin` | how joints move a mesh |

mod influences;
mod morph;
mod rig;
mod skin;
mod weights;

pub(super) use weights::Weights;

use super::animation::Channels;
use super::attributes::Attributes;
use super::document::{Node, label, morph_targets};
use super::geometry::Vertices;
use super::targets::Moved;
use super::{Output, Source};
use crate::ingest::error::Fault;
use crate::scene::{Category, Deformation, Mesh, Shape};
use glam::{Vec3, Vec4};
use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{Index, Mesh as Row};
use rig::Rig;
use std::collections::BTreeMap;

/// What poses the meshes of a file.
pub(super) struct Poses {
    rig: Rig,
    /// Of the nodes and meshes whose animations give them.
    weights: BTreeMap<Moved, Weights>,
}

/// How a mesh is posed at a node. Meshes that are posed alike are one.
#[derive(Clone, Default, PartialEq, Eq, Hash)]
pub(super) struct Pose {
    /// The number of the skin.
    skin: Option<usize>,
    /// The bits of the weights of its morph targets at the first frame; none if all are zero, now and later.
    weights: Vec<u32>,
    /// The node or mesh whose animation changes them later.
    animated: Option<Moved>,
}

/// Where a skinned mesh hangs.
#[derive(Clone, Copy)]
pub(super) struct Hung {
    /// The node of the file in whose space its vertices are; `None` is the world.
    pub below: Option<usize>,
    /// Whether its joints move against each other, or against that node, in the shot.
    deforms: bool,
}

/// A mesh that is posed.
#[derive(Default)]
pub(super) struct Posed {
    /// Where it hangs, if joints move it.
    pub hung: Option<Hung>,
    /// How it changes its shape later.
    pub deformation: Option<Deformation>,
}

/// The arrays of a primitive that is posed.
pub(super) struct Arrays<'a> {
    pub attributes: &'a Attributes<'a>,
    pub vertices: &'a Vertices,
    /// How many positions the primitive has in the file.
    pub positions: usize,
}

impl Poses {
    pub(super) fn new(
        source: &Source,
        output: &mut Output,
        channels: &Channels,
        weights: BTreeMap<Moved, Weights>,
    ) -> Result<Poses, Fault> {
        Ok(Poses { rig: Rig::new(source, output, channels)?, weights })
    }

    /// How a mesh is posed at a node of the file.
    pub(super) fn of(
        &self,
        source: &Source,
        output: &mut Output,
        (number, node): (usize, &Node),
        mesh: Index<Row>,
    ) -> Result<Pose, Fault> {
        let from_mesh = Moved::Mesh(mesh.value());
        let mesh = &source.document.meshes[mesh.value()];
        let mut pose = Pose::default();
        if mesh.primitives.iter().any(is_bound) {
            pose.skin = node.skin().map(|skin| skin.value());
        }
        if mesh.primitives.iter().any(|primitive| morph_targets(primitive) > 0) {
            // A node's own weights take the place of the mesh's.
            let mut by = Moved::Node(number);
            if !self.weights.contains_key(&by) && node.weights().is_none() {
                by = from_mesh;
            }
            let animated = self.weights.get(&by);
            let varies = animated.is_some_and(|weights| !weights.keys.is_empty());
            pose.animated = varies.then_some(by);
            let first = animated.map(|weights| &weights.first);
            let weights = first.or(node.weights()).or(mesh.weights.as_ref());
            let is_needed =
                |weights: &&Vec<f32>| varies || weights.iter().any(|&weight| weight != 0.0);
            let weights = weights.filter(is_needed);
            let object = || label("node", number, node.name.as_deref());
            let bytes = 4 * weights.map_or(0, Vec::len);
            output.budget.take(bytes as u64, object)?;
            pose.weights = weights.into_iter().flatten().map(|weight| weight.to_bits()).collect();
        }
        Ok(pose)
    }

    /// Poses a mesh whose normals and tangents are as they are in the file.
    pub(super) fn apply(
        &self,
        source: &Source,
        output: &mut Output,
        (pose, arrays): (&Pose, &Arrays),
        mesh: &mut Mesh,
        object: &str,
    ) -> Result<Posed, Fault> {
        let is_bound = pose.skin.is_some() && is_bound(arrays.attributes.primitive);
        if pose.weights.is_empty() && !is_bound {
            return Ok(Posed::default());
        }
        let bytes = size_of::<(Vec3, Vec3, Vec4)>() * mesh.positions.len();
        output.budget.take(bytes as u64, || object.to_string())?;
        let shape = Shape::take(mesh);
        let rest = shape.clone();
        shape.put(mesh);
        let (mut targets, mut weights) = (Vec::new(), Vec::new());
        if !pose.weights.is_empty() {
            let first: Vec<f32> = pose.weights.iter().map(|&bits| f32::from_bits(bits)).collect();
            match morph::apply(output, arrays, (&first, pose.animated.is_some()), mesh, object)? {
                Ok(read) => (targets, weights) = (read, first),
                Err(problem) => {
                    let text = format!("{problem}; drawn without its morph targets");
                    output.notes.add(Category::Animation, object, text);
                }
            }
        }
        let mut bound = None;
        if let Some(skin) = pose.skin.filter(|_| is_bound) {
            let (skin, is_animated) = ((&self.rig, skin), pose.animated.is_some());
            match skin::apply(source, output, skin, arrays, (mesh, is_animated), object)? {
                Ok(joints) => bound = Some(joints),
                Err(problem) => {
                    let text = format!("{problem}; drawn in its rest pose");
                    output.notes.add(Category::Animation, object, text);
                }
            }
        }
        let hung = bound.as_ref().map(|bound| bound.hung);
        let is_morphed = pose.animated.is_some() && !targets.is_empty();
        let deforms = is_morphed || hung.is_some_and(|hung| hung.deforms);
        let weights = match pose.animated.filter(|_| is_morphed) {
            Some(by) => self.weights[&by].keys.clone(),
            None => weights::constant(&weights),
        };
        let skin = bound.map(|bound| bound.skin);
        let deformation = deforms.then_some(Deformation { rest, targets, weights, skin });
        Ok(Posed { hung, deformation })
    }
}

impl Pose {
    pub(super) fn is_skinned(&self) -> bool {
        self.skin.is_some()
    }

    pub(super) fn without_skin(self) -> Pose {
        Pose { skin: None, ..self }
    }

    /// How many bytes a copy takes.
    pub(super) fn byte_length(&self) -> u64 {
        (size_of::<Pose>() + size_of_val(&*self.weights)) as u64
    }
}

/// Whether joints are to move a primitive.
fn is_bound(primitive: &Primitive) -> bool {
    primitive.attributes.contains_key(&Checked::Valid(Semantic::Joints(0)))
}

/// For each of so many vertices, whether a triangle uses it. Others may be anywhere, and follow nothing.
fn used(mesh: &Mesh, count: usize) -> Vec<bool> {
    let mut used = vec![false; count];
    mesh.triangles.as_flattened().iter().for_each(|&corner| used[corner as usize] = true);
    used
}
