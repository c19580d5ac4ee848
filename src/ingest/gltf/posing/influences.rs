//! Which joints move a vertex, and how much: `JOINTS_n` and `WEIGHTS_n`.

use super::Arrays;
use crate::ingest::gltf::accessors::Accessor;
use glam::Vec4;
use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::validation::Checked;

/// More sets than this are not read: sixty-four joints a vertex.
const MOST_SETS: usize = 16;

/// The influences on the vertices of a primitive. Each set has four for each vertex.
pub(super) struct Influences {
    sets: Vec<Set>,
}

struct Set {
    joints: Vec<[f32; 4]>,
    weights: Vec<Vec4>,
}

impl Influences {
    /// How many bytes the influences on a vertex of a primitive take; else it has more than are read.
    pub(super) fn bytes(primitive: &Primitive) -> Result<usize, String> {
        match sets(primitive).count() {
            count if count > MOST_SETS => Err(format!("has {count} sets of joints")),
            count => Ok(count * size_of::<([f32; 4], Vec4)>()),
        }
    }

    /// Reads all sets; else says what is wrong with one.
    pub(super) fn read(arrays: &Arrays) -> Result<Influences, String> {
        let set = |(joints, weights)| {
            let (joints, weights) = both(arrays, joints, weights)?;
            Ok(Set {
                joints: arrays.vertices.read(joints, 0.0, |joints| joints),
                weights: arrays.vertices.read(weights, 0.0, Vec4::from_array),
            })
        };
        let sets = sets(arrays.attributes.primitive).map(set).collect::<Result<_, String>>()?;
        Ok(Influences { sets })
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

/// The sets that a primitive has, numbered without a gap.
fn sets(primitive: &Primitive) -> impl Iterator<Item = (Semantic, Semantic)> {
    let all = (0..).map(|set| (Semantic::Joints(set), Semantic::Weights(set)));
    all.take_while(|(joints, _)| primitive.attributes.contains_key(&Checked::Valid(joints.clone())))
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
