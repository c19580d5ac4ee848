//! Morph targets: displacements of positions, normals and tangents, each times its weight.

use super::{Arrays, is_near, used};
use crate::ingest::error::Fault;
use crate::ingest::gltf::Output;
use crate::ingest::gltf::document::morph_targets;
use crate::scene::{Category, Mesh};
use glam::{Vec3, Vec4};
use gltf::json::mesh::Semantic;

/// Positions, normals and tangents.
type Shape = (Vec<Vec3>, Vec<Vec3>, Vec<Vec4>);

/// What of a target a vertex may take in memory, or in time to read it.
const BYTES: u64 = size_of::<[Vec3; 3]>() as u64;

/// Moves a mesh by its targets; else says what is wrong with them, and leaves it as it was. A primitive without
/// targets has no part in it.
pub(super) fn apply(
    output: &mut Output,
    arrays: &Arrays,
    weights: &[f32],
    mesh: &mut Mesh,
    object: &str,
) -> Result<Result<(), String>, Fault> {
    let targets = morph_targets(arrays.attributes.primitive);
    if targets == 0 {
        return Ok(Ok(()));
    }
    if weights.len() != targets {
        return Ok(Err(format!("has {targets} morph targets and {} weights", weights.len())));
    }
    let weights = weights.iter().copied().enumerate().filter(|(_, weight)| *weight != 0.0);
    let weights: Vec<(usize, f32)> = weights.collect();
    let bytes = BYTES * (weights.len() as u64 + 2) * mesh.positions.len() as u64;
    output.budget.take(bytes, || object.to_string())?;
    match moved(arrays, &weights, mesh) {
        Ok(shape) => {
            (mesh.positions, mesh.normals, mesh.tangents) = shape;
            if arrays.attributes.targets_color() {
                let text =
                    "has morph targets of colours or texture coordinates, which are not read";
                output.notes.add(Category::Animation, object, text);
            }
            Ok(Ok(()))
        }
        Err(problem) => Ok(Err(problem)),
    }
}

fn moved(arrays: &Arrays, weights: &[(usize, f32)], mesh: &Mesh) -> Result<Shape, String> {
    let (mut positions, mut normals) = (mesh.positions.clone(), mesh.normals.clone());
    let mut tangents = mesh.tangents.clone();
    for &(target, weight) in weights {
        let by = |semantic: Semantic| {
            let found = arrays.attributes.of_target(target, semantic, arrays.positions)?;
            let read = |accessor| arrays.vertices.read(accessor, 0.0, Vec3::from_array);
            Ok::<_, String>(found.map(read).unwrap_or_default())
        };
        let moves = positions.iter_mut().zip(by(Semantic::Positions)?);
        moves.for_each(|(place, by)| *place += weight * by);
        if !normals.is_empty() {
            let turns = normals.iter_mut().zip(by(Semantic::Normals)?);
            turns.for_each(|(normal, by)| *normal += weight * by);
        }
        if !tangents.is_empty() {
            let turns = tangents.iter_mut().zip(by(Semantic::Tangents)?);
            turns.for_each(|(tangent, by)| *tangent += (weight * by).extend(0.0));
        }
    }
    for ((place, rest), used) in positions.iter_mut().zip(&mesh.positions).zip(used(mesh)) {
        match used {
            true if !is_near(place.as_dvec3()) => {
                return Err("its morph targets lead out of all bounds".into());
            }
            true => {}
            false => *place = *rest,
        }
    }
    Ok((positions, normals, tangents))
}
