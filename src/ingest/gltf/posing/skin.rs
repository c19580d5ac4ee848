//! How joints move a mesh.

use super::influences::Influences;
use super::rig::Rig;
use super::{Arrays, Hung, is_near, used};
use crate::ingest::error::Fault;
use crate::ingest::gltf::accessors::Accessor;
use crate::ingest::gltf::{Output, Source};
use crate::scene::{Category, Mesh};
use glam::{DAffine3, DMat3, DMat4, Vec3};
use gltf::json::accessor::{ComponentType, Type};
use std::collections::HashSet;

/// What a joint that moves a primitive takes at most, in memory and in time: it may be hundreds of nodes deep.
const JOINT_BYTES: u64 = 512;

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
    let inverse_bind = match row.inverse_bind_matrices.map(|index| source.accessors.get(index)) {
        Some(Err(problem)) => return Ok(Err(format!("its skin cannot be read: {problem}"))),
        Some(Ok(accessor)) if !is_matrices(accessor, row.joints.len()) => {
            return Ok(Err("its skin has no inverse bind matrix for each joint".into()));
        }
        Some(Ok(accessor)) => Some(accessor),
        None => None,
    };
    let influences = match Influences::read(output, arrays, mesh.positions.len(), object)? {
        Ok(influences) => influences,
        Err(problem) => return Ok(Err(problem)),
    };
    // A matrix and a place in a set that is half empty.
    let bytes = row.joints.len() * size_of::<(DAffine3, bool, [usize; 4])>()
        + mesh.positions.len() * size_of::<(bool, Vec3, Option<DAffine3>)>();
    output.budget.take(bytes as u64, || object.to_string())?;

    let used = used(mesh);
    let of_mesh = (0..mesh.positions.len()).filter(|&vertex| used[vertex]);
    let mut moves = vec![false; row.joints.len()];
    let mut free = false;
    for vertex in of_mesh {
        free |= influences.is_free(vertex);
        for (joint, _) in influences.of(vertex) {
            match moves.get_mut(joint) {
                Some(moves) => *moves = true,
                None => return Ok(Err("has a joint that its skin does not have".into())),
            }
        }
    }
    let nodes: Vec<usize> = row.joints.iter().map(|joint| joint.value()).collect();
    let moving: Vec<usize> = (0..nodes.len()).filter(|&joint| moves[joint]).collect();
    if moving.iter().any(|&joint| !rig.has(nodes[joint])) {
        return Ok(Err("its skin has joints that are not in the scene".into()));
    }
    output.budget.take(JOINT_BYTES * moving.len() as u64, || object.to_string())?;
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
    let mut places = mesh.positions.clone();
    for (place, matrix) in places.iter_mut().zip(&of_vertices) {
        let Some(matrix) = matrix else { continue };
        let moved = matrix.transform_point3(place.as_dvec3());
        if !is_near(moved) {
            return Ok(Err("its skin leads out of all bounds".into()));
        }
        *place = moved.as_vec3();
    }
    mesh.positions = places;
    for (vertex, matrix) in of_vertices.iter().enumerate() {
        if let Some(matrix) = matrix {
            turn(mesh, vertex, matrix.matrix3);
        }
    }
    let mirrors = |vertex: u32| {
        of_vertices[vertex as usize].is_some_and(|matrix| matrix.matrix3.determinant() < 0.0)
    };
    for triangle in &mut mesh.triangles {
        if triangle.iter().filter(|&&vertex| mirrors(vertex)).count() > 1 {
            triangle.swap(1, 2);
        }
    }
    if free {
        let text = "has vertices without weights of joints; they follow their first joint";
        output.notes.add(Category::Animation, object, text);
    }
    Ok(Ok(hung))
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
