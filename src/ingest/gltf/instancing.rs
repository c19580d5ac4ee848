//! `EXT_mesh_gpu_instancing`: one transform an instance.

use super::document::Instancing;
use super::{Output, Source};
use crate::ingest::error::Fault;
use crate::scene::Trs;
use glam::{DQuat, DVec3};

/// Local transforms of the instances, below the node's own.
pub(super) fn transforms(
    source: &Source,
    output: &mut Output,
    instancing: &Instancing,
    object: &str,
) -> Result<Vec<Trs>, Fault> {
    let attribute = |semantic: &str| {
        instancing.attributes.get(semantic).map(|&index| &source.accessors[index.value()])
    };
    // Validation has seen that there is an attribute and that all are of one length.
    let first = instancing.attributes.values().next();
    let count = first.map_or(0, |&index| source.accessors[index.value()].count);
    output.budget.take((count * size_of::<Trs>()) as u64, || object.to_string())?;
    let (translations, rotations, scales) =
        (attribute("TRANSLATION"), attribute("ROTATION"), attribute("SCALE"));
    let vector = |values: [f32; 3]| DVec3::from(values.map(f64::from));
    let transform = |i: usize| {
        let rotation = match rotations.map(|rotations| rotations.vector::<4>(i, 0.0)) {
            Some(parts) => DQuat::from_array(parts.map(f64::from)),
            None => DQuat::IDENTITY,
        };
        if rotation.length_squared() < 0.5 {
            return Err(Fault::new(object, format!("instance {i} has no unit rotation")));
        }
        Ok(Trs::Parts {
            translation: translations.map_or(DVec3::ZERO, |t| vector(t.vector(i, 0.0))),
            rotation: rotation.normalize(),
            scale: scales.map_or(DVec3::ONE, |s| vector(s.vector(i, 0.0))),
        })
    };
    (0..count).map(transform).collect()
}
