//! Morph targets: displacements of positions, normals and tangents, each times its weight.

use super::{Arrays, used};
use crate::ingest::error::Fault;
use crate::ingest::gltf::Output;
use crate::ingest::gltf::document::morph_targets;
use crate::scene::{Category, Mesh, Shape, Target, is_near};
use glam::Vec3;
use gltf::json::mesh::Semantic;

/// What of a target a vertex may take in memory, or in time to read it.
const BYTES: u64 = size_of::<[Vec3; 3]>() as u64;

/// Moves a mesh by its targets, and returns those; else says what is wrong with them, and leaves it as it was. A
/// primitive without targets has none. Targets without a weight are not read, unless `all` of them are wanted.
pub(super) fn apply(
    output: &mut Output,
    arrays: &Arrays,
    (weights, all): (&[f32], bool),
    mesh: &mut Mesh,
    object: &str,
) -> Result<Result<Vec<Target>, String>, Fault> {
    let count = morph_targets(arrays.attributes.primitive);
    if count == 0 {
        return Ok(Ok(Vec::new()));
    }
    if weights.len() != count {
        return Ok(Err(format!("has {count} morph targets and {} weights", weights.len())));
    }
    let is_read = |target: usize| all || weights[target] != 0.0;
    let read = (0..count).filter(|&target| is_read(target)).count();
    let bytes = BYTES * (read as u64 + 2) * mesh.positions.len() as u64;
    output.budget.take(bytes, || object.to_string())?;
    let used = used(mesh, mesh.positions.len());
    let target = |target: usize| match is_read(target) {
        true => read_target(arrays, target, (mesh, &used)),
        false => Ok(Target::default()),
    };
    let targets = match (0..count).map(target).collect::<Result<Vec<Target>, String>>() {
        Ok(targets) => targets,
        Err(problem) => return Ok(Err(problem)),
    };
    if let Err(problem) = moved(&targets, weights, (mesh, &used)) {
        return Ok(Err(problem));
    }
    if arrays.attributes.targets_color() {
        let text = "has morph targets of colours or texture coordinates, which are not read";
        output.notes.add(Category::Animation, object, text);
    }
    Ok(Ok(targets))
}

/// Vertices that no triangle uses are not displaced.
fn read_target(
    arrays: &Arrays,
    target: usize,
    (mesh, used): (&Mesh, &[bool]),
) -> Result<Target, String> {
    let by = |semantic: Semantic, is_wanted: bool| {
        if !is_wanted {
            return Ok(Vec::new());
        }
        let found = arrays.attributes.of_target(target, semantic, arrays.positions)?;
        let read = |accessor| arrays.vertices.read(accessor, 0.0, Vec3::from_array);
        Ok::<_, String>(found.map(read).unwrap_or_default())
    };
    let mut positions = by(Semantic::Positions, true)?;
    let moves = positions.iter_mut().zip(used);
    moves.filter(|(_, used)| !**used).for_each(|(by, _)| *by = Vec3::ZERO);
    Ok(Target {
        positions,
        normals: by(Semantic::Normals, !mesh.normals.is_empty())?,
        tangents: by(Semantic::Tangents, !mesh.tangents.is_empty())?,
    })
}

fn moved(
    targets: &[Target],
    weights: &[f32],
    (mesh, used): (&mut Mesh, &[bool]),
) -> Result<(), String> {
    let rest = Shape::take(mesh);
    let mut shape = rest.clone();
    for (target, &weight) in targets.iter().zip(weights).filter(|(_, weight)| **weight != 0.0) {
        target.add_to(&mut shape, weight);
    }
    let mut places = shape.positions.iter().zip(used).filter(|(_, used)| **used);
    let is_sound = places.all(|(place, _)| is_near(place.as_dvec3()));
    if is_sound { shape } else { rest }.put(mesh);
    if is_sound { Ok(()) } else { Err("its morph targets lead out of all bounds".into()) }
}
