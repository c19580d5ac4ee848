//! Which joints move a vertex, and how much: `JOINTS_n` and `WEIGHTS_n`.

use super::Arrays;
use crate::ingest::error::Fault;
use crate::ingest::gltf::Output;
use crate::ingest::gltf::accessors::Accessor;
use glam::Vec4;
use gltf::json::mesh::Semantic;
use gltf::json::validation::Checked;

/// The influences on the vertices of a primitive. Each set has four for each vertex.
pub(super) struct Influences {
    sets: Vec<Set>,
}

struct Set {
    joints: Vec<[f32; 4]>,
    weights: Vec<Vec4>,
}

impl Influences {
    /// Reads all sets; else says what is wrong with one.
    pub(super) fn read(
        output: &mut Output,
        arrays: &Arrays,
        vertices: usize,
        object: &str,
    ) -> Result<Result<Influences, String>, Fault> {
        let mut sets = Vec::new();
        for (joints, weights) in (0..).map(|set| (Semantic::Joints(set), Semantic::Weights(set))) {
            let attributes = &arrays.attributes.primitive.attributes;
            if !attributes.contains_key(&Checked::Valid(joints.clone())) {
                break;
            }
            let accessors = both(arrays, joints, weights);
            let (joints, weights) = match accessors {
                Ok(accessors) => accessors,
                Err(problem) => return Ok(Err(problem)),
            };
            let bytes = vertices * size_of::<([f32; 4], Vec4)>();
            output.budget.take(bytes as u64, || object.to_string())?;
            sets.push(Set {
                joints: arrays.vertices.read(joints, 0.0, |joints| joints),
                weights: arrays.vertices.read(weights, 0.0, Vec4::from_array),
            });
        }
        Ok(Ok(Influences { sets }))
    }

    /// The joints that move a vertex, by their place in the skin, with weights that sum to one but for
    /// rounding. A vertex without weights follows its first joint.
    pub(super) fn of(&self, vertex: usize) -> impl Iterator<Item = (usize, f64)> {
        let all = || {
            self.sets.iter().flat_map(move |set| {
                let weights = set.weights[vertex].to_array().map(f64::from);
                set.joints[vertex].into_iter().zip(weights).filter(|(_, weight)| *weight > 0.0)
            })
        };
        let sum: f64 = all().map(|(_, weight)| weight).sum();
        let spare =
            self.sets.first().map(|set| (set.joints[vertex][0], 1.0)).filter(|_| sum == 0.0);
        let divisor = if sum == 0.0 { 1.0 } else { sum };
        all().chain(spare).map(move |(joint, weight)| (joint as usize, weight / divisor))
    }

    /// Whether nothing tells what a vertex follows.
    pub(super) fn is_free(&self, vertex: usize) -> bool {
        self.sets.iter().all(|set| !(set.weights[vertex].cmpgt(Vec4::ZERO).any()))
    }
}

fn both<'a>(
    arrays: &Arrays<'a>,
    joints: Semantic,
    weights: Semantic,
) -> Result<(&'a Accessor<'a>, &'a Accessor<'a>), String> {
    let name = Checked::Valid(weights.clone()).to_string();
    let get = |semantic| arrays.attributes.beside(semantic, arrays.positions);
    match (get(joints)?, get(weights)?) {
        (Some(joints), Some(weights)) => Ok((joints, weights)),
        _ => Err(format!("has joints, but no {name}")),
    }
}
