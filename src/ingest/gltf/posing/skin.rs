//! How joints move a mesh.

use super::influences::Influences;
use super::rig::Rig;
use super::{Arrays, Hung, is_near, used};
use crate::ingest::error::Fault;
use crate::ingest::gltf::accessors::Accessor;
use crate::ingest::gltf::{Output, Source};
use crate::scene::{Category, Mesh};
use glam::{DAffine3, DMat3, DMat4, Vec3};
use gltf::json::Skin;
use gltf::json::accessor::{ComponentType, Type};
use std::collections::HashSet;

/// What a joint takes at most: a matrix, places in lists and a set, and time, for it may be hundreds of nodes deep.
const JOINT_BYTES: usize = 640;

/// What a vertex takes beside its influences, while the mesh is moved.
const VERTEX_BYTES: usize = size_of::<(bool, Vec3, Option<DAffine3>)>();

/// How a mesh was moved.
struct Moved {
    hung: Hung,
    /// Whether there are vertices without weights.
    has_free: bool,
}

/// Moves a mesh by the joints of a skin; else says what is wrong with that, and leaves the mesh as it was.
pub(super) fn apply(
    source: &Source,
    output: &mut Output,
    (rig, skin): (&Rig, usize),
    arrays: &Arrays,
    mesh: &mut Mesh,
    object: &str,
) -> Result<Result<Hung, String>, Fault> {
    let Some(row) = source.document.skins.get(skin) else {
        return Ok(Err("its skin is not in the file".into()));
    };
    let of_influences = match Influences::bytes(arrays.attributes.primitive) {
        Ok(bytes) => bytes,
        Err(problem) => return Ok(Err(problem)),
    };
    let bytes = (JOINT_BYTES * row.joints.len()) as u64;
    output.budget.take(bytes, || object.to_string())?;
    let bytes = ((VERTEX_BYTES + of_influences) * mesh.positions.len()) as u64;
    output.budget.take(bytes, || object.to_string())?;
    let moved = moved(source, (rig, row), arrays, mesh);
    output.budget.put_back(bytes);
    Ok(moved.map(|Moved { hung, has_free }| {
        if has_free {
            let text = "has vertices without weights of joints; they follow their first joint";
            output.notes.add(Category::Animation, object, text);
        }
        hung
    }))
}

fn moved(
    source: &Source,
    (rig, row): (&Rig, &Skin),
    arrays: &Arrays,
    mesh: &mut Mesh,
) -> Result<Moved, String> {
    let nodes: Vec<usize> = row.joints.iter().map(|joint| joint.value()).collect();
    let inverse_bind = row.inverse_bind_matrices.map(|index| source.accessors.get(index));
    let inverse_bind = inverse_bind
        .transpose()
        .map_err(|problem| format!("its skin cannot be read: {problem}"))?;
    if inverse_bind.is_some_and(|accessor| !is_matrices(accessor, nodes.len())) {
        return Err("its skin has no inverse bind matrix for each joint".into());
    }
    let influences = Influences::read(arrays)?;
    let used = used(mesh);
    let mut moves = vec![false; nodes.len()];
    let mut has_free = false;
    for vertex in (0..used.len()).filter(|&vertex| used[vertex]) {
        has_free |= influences.is_free(vertex);
        for (joint, _) in influences.of(vertex) {
            *moves.get_mut(joint).ok_or("has a joint that its skin does not have")? = true;
        }
    }
    let moving: Vec<usize> = (0..nodes.len()).filter(|&joint| moves[joint]).collect();
    if moving.iter().any(|&joint| !rig.has(nodes[joint])) {
        return Err("its skin has joints that are not in the scene".into());
    }
    let hung = hang(rig, &nodes, &moving);
    let mut matrices = vec![DAffine3::ZERO; nodes.len()];
    for joint in moving {
        let inverse_bind = inverse_bind.map_or(DAffine3::IDENTITY, |accessor| {
            let columns = accessor.matrix(joint).map(f64::from);
            DAffine3::from_mat4(DMat4::from_cols_array(&columns))
        });
        matrices[joint] = rig.transform(nodes[joint], hung.below) * inverse_bind;
    }
    let of_vertices: Vec<Option<DAffine3>> = used
        .iter()
        .enumerate()
        .map(|(vertex, used)| used.then(|| blend(&matrices, influences.of(vertex))))
        .collect();
    bend(mesh, &of_vertices)?;
    Ok(Moved { hung, has_free })
}

/// Moves each vertex that has a matrix; else says that it goes too far, and moves none.
fn bend(mesh: &mut Mesh, matrices: &[Option<DAffine3>]) -> Result<(), String> {
    let mut places = mesh.positions.clone();
    for (place, matrix) in places.iter_mut().zip(matrices) {
        let Some(matrix) = matrix else { continue };
        let moved = matrix.transform_point3(place.as_dvec3());
        if !is_near(moved) {
            return Err("its skin leads out of all bounds".into());
        }
        *place = moved.as_vec3();
    }
    mesh.positions = places;
    for (vertex, matrix) in matrices.iter().enumerate() {
        if let Some(matrix) = matrix {
            turn(mesh, vertex, matrix.matrix3);
        }
    }
    let mirrors = |vertex: u32| {
        matrices[vertex as usize].is_some_and(|matrix| matrix.matrix3.determinant() < 0.0)
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

/// The mean of the matrices of joints.
fn blend(matrices: &[DAffine3], influences: impl Iterator<Item = (usize, f64)>) -> DAffine3 {
    let mut mean = DAffine3::ZERO;
    for (joint, weight) in influences {
        mean.matrix3 += matrices[joint].matrix3 * weight;
        mean.translation += matrices[joint].translation * weight;
    }
    mean
}

/// Turns the normal and the tangent of a vertex.
fn turn(mesh: &mut Mesh, vertex: usize, matrix: DMat3) {
    let [x, y, z] = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
    let sign = if matrix.determinant() < 0.0 { -1.0 } else { 1.0 };
    if let Some(normal) = mesh.normals.get_mut(vertex) {
        let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
        let turned = cofactors * normal.as_dvec3() * sign;
        // Scaled, for 32 bits may not hold the cofactors of a small matrix.
        *normal = (turned / turned.abs().max_element()).as_vec3();
    }
    if let Some(tangent) = mesh.tangents.get_mut(vertex) {
        let turned = matrix * tangent.truncate().as_dvec3();
        *tangent = turned.as_vec3().extend(tangent.w * sign as f32);
    }
}
