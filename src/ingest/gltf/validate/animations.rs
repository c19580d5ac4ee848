//! Animation channels: key times that ascend, values of the type and number that their target asks.

use super::data::Facts;
use crate::ingest::error::Fault;
use crate::ingest::gltf::accessors::Accessor;
use crate::ingest::gltf::document::{Channel, Document, label, morph_targets};
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::animation::{Interpolation, Sampler};
use gltf::json::validation::Checked;
use std::collections::HashSet;

/// How far the length of a key's quaternion may be from one; more for coarse integers.
const QUATERNION_TOLERANCE: f32 = 0.01;
const COARSE_QUATERNION_TOLERANCE: f32 = 0.03;

pub(super) fn check(
    document: &Document,
    accessors: &[Accessor],
    facts: &[Facts],
) -> Result<(), Fault> {
    // Arrays of rotations that were found good, so that a shared one is looked at once.
    let mut rotations = HashSet::new();
    for (i, animation) in document.animations.iter().enumerate() {
        let fault = |problem| Fault::new(label("animation", i, animation.name.as_deref()), problem);
        for sampler in &animation.samplers {
            let input = &document.accessors[sampler.input.value()];
            if input.min.is_none() || input.max.is_none() {
                return Err(fault("its key times have no min and max".into()));
            }
            let input = sampler.input.value();
            check_times(&accessors[input], &facts[input]).map_err(fault)?;
        }
        let mut targets = HashSet::new();
        for channel in &document.beside.channels[i] {
            let sampler = &animation.samplers[channel.sampler.value()];
            check_target(channel, document).map_err(fault)?;
            check_values(channel, sampler, document, accessors).map_err(fault)?;
            let (values, cubic) = (sampler.output.value(), is_cubic(sampler));
            if channel.target.path == "rotation"
                && rotations.insert((values, cubic))
                && !quaternions_are_unit(&accessors[values], cubic)
            {
                return Err(fault("has a rotation that is not a unit quaternion".into()));
            }
            if let Some(node) = channel.target.node
                && !targets.insert((node, channel.target.path.as_str()))
            {
                let path = &channel.target.path;
                return Err(fault(format!("animates the {path} of node {node} twice")));
            }
        }
    }
    Ok(())
}

fn is_cubic(sampler: &Sampler) -> bool {
    sampler.interpolation == Checked::Valid(Interpolation::CubicSpline)
}

fn check_times(times: &Accessor, facts: &Facts) -> Result<(), String> {
    let floats = times.component == ComponentType::F32 && times.shape == Type::Scalar;
    if !floats || times.is_interleaved() {
        return Err("its key times are not a packed array of floats".into());
    }
    match facts.ascends || !times.has_data() {
        true => Ok(()),
        false => Err("its key times are negative or do not ascend".into()),
    }
}

fn check_target(channel: &Channel, document: &Document) -> Result<(), String> {
    let target = &channel.target;
    if let Some(pointer) = &target.extensions.pointer {
        return match (target.path.as_str(), target.node, pointer.pointer.starts_with('/')) {
            ("pointer", None, true) => Ok(()),
            _ => Err("its animation pointer is not one, or has a node beside it".into()),
        };
    }
    let Some(node) = target.node else { return Ok(()) };
    let has_matrix = document.beside.transforms[node.value()].matrix.is_some();
    let node = &document.nodes[node.value()];
    match target.path.as_str() {
        "translation" | "rotation" | "scale" if has_matrix => {
            Err("moves a node that has a matrix".into())
        }
        "weights" => match node.mesh.map(|mesh| &document.meshes[mesh.value()].primitives[0]) {
            Some(primitive) if morph_targets(primitive) > 0 => Ok(()),
            _ => Err("animates the weights of a mesh without morph targets".into()),
        },
        _ => Ok(()),
    }
}

fn check_values(
    channel: &Channel,
    sampler: &Sampler,
    document: &Document,
    accessors: &[Accessor],
) -> Result<(), String> {
    let keys = accessors[sampler.input.value()].count;
    let values = &accessors[sampler.output.value()];
    let cubic = is_cubic(sampler);
    if cubic && keys < 2 {
        return Err("is a spline with fewer than two keys".into());
    }
    if values.is_interleaved() {
        return Err("its values are not a packed array".into());
    }
    let signed_or_unsigned_norm = values.normalized && values.component != ComponentType::U32;
    let is_number = values.component == ComponentType::F32 || signed_or_unsigned_norm;
    let path = channel.target.path.as_str();
    let (allowed, in_a_key) = match path {
        "translation" | "scale" => {
            (values.component == ComponentType::F32 && values.shape == Type::Vec3, 1)
        }
        "rotation" => (is_number && values.shape == Type::Vec4, 1),
        "weights" => {
            let node = channel.target.node.map(|node| &document.nodes[node.value()]);
            let mesh = node.and_then(|node| node.mesh).map(|mesh| &document.meshes[mesh.value()]);
            let targets = mesh.map_or(1, |mesh| morph_targets(&mesh.primitives[0]));
            (is_number && values.shape == Type::Scalar, targets)
        }
        // What an animation pointer leads to is checked where it is read.
        _ => return Ok(()),
    };
    if !allowed {
        return Err(format!("its {path} values have a type that they cannot have"));
    }
    let expected = keys.checked_mul(in_a_key * if cubic { 3 } else { 1 });
    if expected != Some(values.count) {
        return Err(format!("has {keys} keys, but {} {path} values", values.count));
    }
    Ok(())
}

/// Of a spline only the middle of each three is a rotation. Arrays without data are not read.
fn quaternions_are_unit(values: &Accessor, cubic: bool) -> bool {
    let tolerance = match values.component {
        ComponentType::F32 => QUATERNION_TOLERANCE,
        _ => COARSE_QUATERNION_TOLERANCE,
    };
    let (first, step) = if cubic { (1, 3) } else { (0, 1) };
    let is_unit = |quaternion: &[f32; 4]| {
        let length = quaternion.iter().map(|part| part * part).sum::<f32>().sqrt();
        (length - 1.0).abs() <= tolerance
    };
    !values.has_data() || values.vectors(0.0).iter().skip(first).step_by(step).all(is_unit)
}
