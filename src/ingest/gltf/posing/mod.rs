//! Morph targets and skins: meshes in the shape of the shot's first frame.
//!
//! Source: glTF 2.0, 3.7.2.2 (morph targets) and 3.7.3.3 (skins); UsdSkel's exporter, `scripts/usd_gltf/skinning.py`,
//! keeps to the same rules.
//!
//! - A vertex is moved by the morph targets first, then by the joints: by the mean, by its weights, of what each joint's
//!   global transform makes of the inverse bind matrix.
//! - Weights of morph targets are those of the node's animation at the first frame, else the node's, else the mesh's.
//! - The transform of a skinned mesh's node has no meaning. The mesh is *hung* at a node that its joints have in
//!   common, and its vertices are in that node's space; so it is carried as a whole by whatever moves there. Where the
//!   joints never move against each other, that is the deepest common one. Else the mesh deforms, and hangs above its
//!   skeleton, which holds still as it was at the first frame; a note says so.
//! - Normals follow by the cofactors of the matrix, which are its inverse transpose but for a factor, and exist where
//!   a joint has scale 0. Where joints mirror, triangles are turned over, so that their fronts stay fronts.
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

use super::attributes::Attributes;
use super::document::{label, morph_targets};
use super::geometry::Vertices;
use super::{Output, Source};
use crate::ingest::error::Fault;
use crate::ingest::extent::FARTHEST_M;
use crate::scene::{Category, Channel, Mesh};
use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{Index, Mesh as Row, Node};
use rig::Rig;
use std::collections::BTreeMap;

/// The text of the note on a mesh that changes its shape.
const DEFORMS: &str = "deforms after the first frame; it keeps the shape of the first frame";

/// What poses the meshes of a file.
pub(super) struct Poses {
    rig: Rig,
    /// Of the nodes whose animation gives them.
    weights: BTreeMap<usize, Weights>,
}

/// How a mesh is posed at a node. Meshes that are posed alike are one.
#[derive(Clone, Default, PartialEq, Eq, Hash)]
pub(super) struct Pose {
    /// The number of the skin.
    skin: Option<usize>,
    /// The bits of the weights of its morph targets; none if all are zero.
    weights: Vec<u32>,
}

/// Where a skinned mesh hangs.
#[derive(Clone, Copy)]
pub(super) struct Hung {
    /// The node of the file in whose space its vertices are; `None` is the world.
    pub below: Option<usize>,
    /// Whether its joints move against each other, or against that node, in the shot.
    pub deforms: bool,
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
        channels: &[Vec<Channel>],
        weights: BTreeMap<usize, Weights>,
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
        let mesh = &source.document.meshes[mesh.value()];
        let mut pose = Pose::default();
        if mesh.primitives.iter().any(is_bound) {
            pose.skin = node.skin.map(|skin| skin.value());
        }
        if mesh.primitives.iter().any(|primitive| morph_targets(primitive) > 0) {
            let animated = self.weights.get(&number);
            let first = animated.map(|weights| &weights.first);
            let weights = first.or(node.weights.as_ref()).or(mesh.weights.as_ref());
            let weights = weights.filter(|weights| weights.iter().any(|&weight| weight != 0.0));
            let object = || label("node", number, node.name.as_deref());
            let bytes = 4 * weights.map_or(0, Vec::len);
            output.budget.take(bytes as u64, object)?;
            pose.weights = weights.into_iter().flatten().map(|weight| weight.to_bits()).collect();
            if animated.is_some_and(|weights| weights.varies) {
                output.notes.add(Category::Animation, object(), DEFORMS);
            }
        }
        Ok(pose)
    }

    /// Poses a mesh whose normals and tangents are as they are in the file. Returns where it hangs, if joints
    /// move it.
    pub(super) fn apply(
        &self,
        source: &Source,
        output: &mut Output,
        (pose, arrays): (&Pose, &Arrays),
        mesh: &mut Mesh,
        object: &str,
    ) -> Result<Option<Hung>, Fault> {
        let weights: Vec<f32> = pose.weights.iter().map(|&bits| f32::from_bits(bits)).collect();
        if !weights.is_empty()
            && let Err(problem) = morph::apply(output, arrays, &weights, mesh, object)?
        {
            let text = format!("{problem}; drawn without its morph targets");
            output.notes.add(Category::Animation, object, text);
        }
        let Some(skin) = pose.skin.filter(|_| is_bound(arrays.attributes.primitive)) else {
            return Ok(None);
        };
        match skin::apply(source, output, (&self.rig, skin), arrays, mesh, object)? {
            Ok(hung) => Ok(Some(hung)),
            Err(problem) => {
                let text = format!("{problem}; drawn in its rest pose");
                output.notes.add(Category::Animation, object, text);
                Ok(None)
            }
        }
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

impl Hung {
    /// Notes that a mesh deforms, if it does.
    pub(super) fn note(&self, output: &mut Output, object: &str) {
        if self.deforms {
            output.notes.add(Category::Animation, object, DEFORMS);
        }
    }
}

/// Whether joints are to move a primitive.
fn is_bound(primitive: &Primitive) -> bool {
    primitive.attributes.contains_key(&Checked::Valid(Semantic::Joints(0)))
}

/// For each vertex, whether a triangle uses it. Others may be anywhere, and follow nothing.
fn used(mesh: &Mesh) -> Vec<bool> {
    let mut used = vec![false; mesh.positions.len()];
    mesh.triangles.as_flattened().iter().for_each(|&corner| used[corner as usize] = true);
    used
}

/// Whether a place can be calculated with.
fn is_near(place: glam::DVec3) -> bool {
    place.is_finite() && place.abs().max_element() < f64::from(FARTHEST_M)
}
