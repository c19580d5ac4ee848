//! How joints move a mesh.

use super::influences::Influences;
use super::rig::Rig;
use super::{Arrays, Hung, used};
use crate::ingest::error::Fault;
use crate::ingest::gltf::accessors::Accessor;
use crate::ingest::gltf::{Output, Source};
use crate::scene::{Category, Mesh, Shape, Skin};
use glam::{DAffine3, DMat4, Vec3, Vec4};
use gltf::json::Skin as Row;
use gltf::json::accessor::{ComponentType, Type};
use std::collections::HashSet;

/// What a joint takes at most: a matrix, places in lists and a set, and time, for it may be hundreds of nodes deep.
const JOINT_BYTES: usize = 640;

/// What a vertex takes beside its influences, while the mesh is moved.
const VERTEX_BYTES: usize = size_of::<(bool, u32, [Vec3; 2], Vec4)>();

/// How joints move a mesh.
pub(super) struct Bound {
    pub hung: Hung,
    pub skin: Skin,
    /// Whether there are vertices without weights.
    has_free: bool,
}

/// Moves a mesh by the joints of a skin; else says what is wrong with that, and leaves the mesh as it was. The weights of
/// its morph targets may be animated.
pub(super) fn apply(
    source: &Source,
    output: &mut Output,
    (rig, skin): (&Rig, usize),
    arrays: &Arrays,
    (mesh, is_animated): (&mut Mesh, bool),
    object: &str,
) -> Result<Result<Bound, String>, Fault> {
    let Some(row) = source.document.skins.get(skin) else {
        return Ok(Err("its skin is not in the file".into()));
    };
    let of_influences = match Influences::bytes(arrays.attributes.primitive) {
        Ok(bytes) => bytes,
        Err(problem) => return Ok(Err(problem)),
    };
    let bytes = (JOINT_BYTES * row.joints.len()) as u64;
    output.budget.take(bytes, || object.to_string())?;
    let bytes = ((VERTEX_BYTES + 2 * of_influences) * mesh.positions.len()) as u64;
    output.budget.take(bytes, || object.to_string())?;
    let bound = bind(source, (rig, skin, row), arrays, mesh);
    let bound = bound.and_then(|bound| bend(mesh, &bound.skin, output).map(|()| bound));
    if !bound.as_ref().is_ok_and(|bound| bound.hung.deforms || is_animated) {
        output.budget.put_back(bytes);
    }
    if bound.as_ref().is_ok_and(|bound| bound.has_free) {
        let text = "has vertices without weights of joints; they follow their first joint";
        output.notes.add(Category::Animation, object, text);
    }
    Ok(bound)
}

fn bind(
    source: &Source,
    (rig, number, row): (&Rig, usize, &Row),
    arrays: &Arrays,
    mesh: &Mesh,
) -> Result<Bound, String> {
    let nodes: Vec<usize> = row.joints.iter().map(|joint| joint.value()).collect();
    let inverse_bind = row.inverse_bind_matrices.map(|index| source.accessors.get(index));
    let inverse_bind = inverse_bind
        .transpose()
        .map_err(|problem| format!("its skin cannot be read: {problem}"))?;
    if inverse_bind.is_some_and(|accessor| !is_matrices(accessor, nodes.len())) {
        return Err("its skin has no inverse bind matrix for each joint".into());
    }
    let inverse_bind = |joint: usize| {
        inverse_bind.map_or(DAffine3::IDENTITY, |accessor| {
            let columns = accessor.matrix(joint).map(f64::from);
            DAffine3::from_mat4(DMat4::from_cols_array(&columns))
        })
    };
    let read = Influences::read(arrays)?;
    let (mut ends, mut influences) = (Vec::with_capacity(mesh.positions.len()), Vec::new());
    let mut moves = vec![false; nodes.len()];
    let mut has_free = false;
    for (vertex, used) in used(mesh, mesh.positions.len()).into_iter().enumerate() {
        if used {
            has_free |= read.is_free(vertex);
            for (joint, weight) in read.of(vertex) {
                *moves.get_mut(joint).ok_or("has a joint that its skin does not have")? = true;
                influences.push((joint as u32, weight));
            }
        }
        ends.push(influences.len() as u32);
    }
    let moving: Vec<usize> = (0..nodes.len()).filter(|&joint| moves[joint]).collect();
    if moving.iter().any(|&joint| !rig.has(nodes[joint])) {
        return Err("its skin has joints that are not in the scene".into());
    }
    let hung = hang(rig, &nodes, &moving);
    let skeleton = rig.skeleton((number, hung.below), &nodes, inverse_bind);
    Ok(Bound { hung, skin: Skin { skeleton, ends, influences }, has_free })
}

/// Moves each vertex that joints move, as at the first frame; else says that one goes too far, and moves none.
fn bend(mesh: &mut Mesh, skin: &Skin, output: &Output) -> Result<(), String> {
    let timeline = output.scene.timeline;
    let joints = skin.skeleton.at(timeline.seconds_at(timeline.first_frame), timeline);
    let rest = Shape::take(mesh);
    let mut bent = rest.clone();
    if !skin.bend(&mut bent, &joints) {
        rest.put(mesh);
        return Err("its skin leads out of all bounds".into());
    }
    bent.put(mesh);
    // Where joints mirror, triangles are turned over, so that their fronts stay fronts.
    let mirrors = |vertex: u32| {
        let matrix = skin.matrix(vertex as usize, &joints);
        matrix.is_some_and(|matrix| matrix.matrix3.determinant() < 0.0)
    };
    for triangle in &mut mesh.triangles {
        if triangle.iter().filter(|&&vertex| mirrors(vertex)).count() > 1 {
            triangle.swap(1, 2);
        }
    }
    Ok(())
}

fn is_matrices(accessor: &Accessor, joints: usize) -> bool {
    accessor.shape == Type::Mat4
        && accessor.component == ComponentType::F32
        && accessor.has_data()
        && accessor.count >= joints
}

/// Where a mesh hangs that some joints of a skin move.
fn hang(rig: &Rig, nodes: &[usize], moving: &[usize]) -> Hung {
    let mut moving = moving.iter().map(|&joint| nodes[joint]);
    let first = moving.clone().next();
    let common = moving.clone().fold(first, |common, joint| rig.meet(common, Some(joint)));
    if !moving.any(|joint| rig.moves(joint, common)) {
        return Hung { below: common, deforms: false };
    }
    let skeleton: HashSet<usize> = nodes.iter().copied().collect();
    Hung { below: rig.above(common, &skeleton), deforms: true }
}
