//! Animations, merged: the file's clips are taken to run together, as one shot.

use super::accessors::Accessor;
use super::document::{Target, label};
use super::{Output, Source};
use crate::ingest::error::Fault;
use crate::scene::{Channel, Interpolation, Keys};
use glam::{Quat, Vec3};
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::animation::{Interpolation as RowInterpolation, Sampler};
use gltf::json::validation::Checked;
use std::collections::HashSet;

/// The channels of every node of the file.
pub(super) fn compile(source: &Source, output: &mut Output) -> Result<Vec<Vec<Channel>>, Fault> {
    let document = source.document;
    let mut channels: Vec<Vec<Channel>> = document.nodes.iter().map(|_| Vec::new()).collect();
    let mut moved = HashSet::new();
    for (i, animation) in document.animations.iter().enumerate() {
        let object = label("animation", i, animation.name.as_deref());
        for row in &document.beside.channels[i] {
            let sampler = &animation.samplers[row.sampler.value()];
            let Some((node, path)) = target(&row.target) else {
                let (what, text) = unread(&row.target);
                output.notes.add(format!("{object}, {what}"), text);
                continue;
            };
            let values = &source.accessors[sampler.output.value()];
            let times = &source.accessors[sampler.input.value()];
            let exists = document.beside.transforms.get(node).is_some_and(|n| n.matrix.is_none());
            if !exists || !times.has_data() || !values.has_data() {
                output.notes.add(object.clone(), "moves nothing that could move; left out");
                continue;
            }
            if !moved.insert((node, path)) {
                let node = label("node", node, None);
                output.notes.add(node, format!("only the first animation of its {path} is read"));
                continue;
            }
            let bytes = (times.count + 4 * values.count) as u64 * 4;
            output.budget.take(bytes, || object.clone())?;
            channels[node].push(channel(path, sampler, times, values, &object)?);
        }
    }
    Ok(channels)
}

/// The node and the part of its transform that a channel moves, directly or by a pointer.
fn target(target: &Target) -> Option<(usize, &'static str)> {
    let part = |name: &str| ["translation", "rotation", "scale"].into_iter().find(|p| *p == name);
    match &target.extensions.pointer {
        Some(pointer) => {
            let (node, path) = pointer.pointer.strip_prefix("/nodes/")?.split_once('/')?;
            Some((node.parse().ok()?, part(path)?))
        }
        None => Some((target.node?.value(), part(&target.path)?)),
    }
}

/// What an animation that is not read is of, and what is said of its kind.
fn unread(target: &Target) -> (&str, &'static str) {
    let Some(pointer) = &target.extensions.pointer else {
        return (&target.path, "animation of shapes is not read");
    };
    let pointer = pointer.pointer.as_str();
    let text = match pointer.split('/').nth(1) {
        Some("materials") => "animation of materials is not read",
        Some("cameras") => "animation of lenses is not read",
        Some("extensions") if pointer.contains("KHR_lights_punctual") => {
            "animation of light is not read; the light is constant"
        }
        Some("meshes") => "animation of shapes is not read",
        _ if pointer.ends_with("/weights") => "animation of shapes is not read",
        _ => "animation of this is not read",
    };
    (pointer, text)
}

fn channel(
    path: &str,
    sampler: &Sampler,
    times: &Accessor,
    values: &Accessor,
    object: &str,
) -> Result<Channel, Fault> {
    let interpolation = match sampler.interpolation {
        Checked::Valid(RowInterpolation::Step) => Interpolation::Step,
        Checked::Valid(RowInterpolation::CubicSpline) => Interpolation::Cubic,
        _ => Interpolation::Linear,
    };
    // Validation has seen to this where the target is not a pointer.
    let in_a_key = if interpolation == Interpolation::Cubic { 3 } else { 1 };
    let shape = if path == "rotation" { Type::Vec4 } else { Type::Vec3 };
    let typed = values.component == ComponentType::F32 || (values.normalized && path == "rotation");
    if values.shape != shape || !typed || values.count != times.count * in_a_key {
        return Err(Fault::new(object, format!("its {path} values do not fit its keys")));
    }
    let times_s = times.vectors(0.0).into_iter().map(|[time]: [f32; 1]| time).collect();
    let vectors = || values.vectors(0.0).into_iter().map(Vec3::from_array).collect();
    Ok(match path {
        "rotation" => {
            let mut values: Vec<Quat> =
                values.vectors(0.0).into_iter().map(Quat::from_array).collect();
            // Of a spline only the middle of each three is a rotation.
            for value in values.iter_mut().skip(in_a_key / 2).step_by(in_a_key) {
                let length = value.length();
                if !(0.5..2.0).contains(&length) {
                    return Err(Fault::new(object, "has a rotation that is not a unit quaternion"));
                }
                *value /= length;
            }
            Channel::Rotation(Keys { times_s, values, interpolation })
        }
        "scale" => Channel::Scale(Keys { times_s, values: vectors(), interpolation }),
        _ => Channel::Translation(Keys { times_s, values: vectors(), interpolation }),
    })
}
