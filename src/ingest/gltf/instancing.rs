//! `EXT_mesh_gpu_instancing`: one transform an instance.

use super::accessors::Accessor;
use super::document::Instancing;
use super::{Output, Source};
use crate::ingest::error::Fault;
use crate::scene::{Category, Trs};
use glam::{DQuat, DVec3};
use gltf::json::accessor::{ComponentType, Type};

/// Local transforms of the instances, below the node's own; else what is wrong with them.
pub(super) fn transforms(
    source: &Source,
    output: &mut Output,
    instancing: &Instancing,
    object: &str,
) -> Result<Result<Vec<Trs>, String>, Fault> {
    let attribute = |semantic: &str, shape: Type| {
        let Some(&index) = instancing.attributes.get(semantic) else { return Ok(None) };
        let accessor = source.accessors.get(index)?;
        match is_allowed(accessor, shape) {
            true => Ok(Some(accessor)),
            false => Err(format!("their {semantic} has a type that it cannot have")),
        }
    };
    let attributes = || -> Result<[Option<&Accessor>; 3], String> {
        Ok([
            attribute("TRANSLATION", Type::Vec3)?,
            attribute("ROTATION", Type::Vec4)?,
            attribute("SCALE", Type::Vec3)?,
        ])
    };
    let [translations, rotations, scales] = match attributes() {
        Ok(attributes) => attributes,
        Err(problem) => return Ok(Err(problem)),
    };
    let counts = [translations, rotations, scales].into_iter().flatten().map(|a| a.count);
    let (least, most) = (counts.clone().min().unwrap_or(0), counts.max().unwrap_or(0));
    if least != most || most == 0 {
        return Ok(Err("their attributes are absent or of different lengths".into()));
    }
    output.budget.take((most * size_of::<Trs>()) as u64, || object.to_string())?;
    let vector = |accessor: Option<&Accessor>, i: usize, spare: DVec3| {
        let vector = accessor.map(|accessor| DVec3::from(accessor.vector(i, 0.0).map(f64::from)));
        vector.unwrap_or(spare)
    };
    let mut transforms = Vec::with_capacity(most);
    for i in 0..most {
        let rotation = match rotations {
            Some(rotations) => DQuat::from_array(rotations.vector::<4>(i, 0.0).map(f64::from)),
            None => DQuat::IDENTITY,
        };
        let translation = vector(translations, i, DVec3::ZERO);
        let scale = vector(scales, i, DVec3::ONE);
        if !(translation.is_finite() && scale.is_finite() && rotation.is_finite()) {
            return Ok(Err("they hold numbers that are not finite".into()));
        }
        if (rotation.length_squared() - 1.0).abs() > 0.5 {
            let text = "has instances whose rotation is no unit quaternion; mended";
            output.notes.add(Category::Geometry, object, text);
        }
        let is_zero = rotation.length_squared() == 0.0;
        let rotation = if is_zero { DQuat::IDENTITY } else { rotation.normalize() };
        transforms.push(Trs::Parts { translation, rotation, scale });
    }
    Ok(Ok(transforms))
}

fn is_allowed(accessor: &Accessor, shape: Type) -> bool {
    let float = accessor.component == ComponentType::F32;
    let signed_norm = accessor.normalized && !accessor.is_unsigned();
    accessor.shape == shape && (float || signed_norm && shape == Type::Vec4)
}
