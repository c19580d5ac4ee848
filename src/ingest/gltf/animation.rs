//! Animations, merged: the file's clips are taken to run together, as one shot.
//!
//! A channel that cannot be read is left out; one whose keys are only partly good keeps those.

use super::accessors::Accessor;
use super::document::{Target, label};
use super::{Output, Source};
use crate::ingest::error::Fault;
use crate::scene::{Category, Channel, Interpolation, Keys};
use glam::{Quat, Vec3};
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::animation::{Interpolation as RowInterpolation, Sampler};
use gltf::json::validation::Checked;
use std::collections::HashSet;

/// How far the length of a key's quaternion may be from one without a note; small integers are coarse.
const QUATERNION_TOLERANCE: f32 = 0.03;

/// The channels of every node of the file.
pub(super) fn compile(source: &Source, output: &mut Output) -> Result<Vec<Vec<Channel>>, Fault> {
    let document = source.document;
    let mut channels: Vec<Vec<Channel>> = document.nodes.iter().map(|_| Vec::new()).collect();
    let mut moved = HashSet::new();
    for (i, animation) in document.animations.iter().enumerate() {
        let object = label("animation", i, animation.name.as_deref());
        for row in &document.beside.channels[i] {
            let Some((node, path)) = target(&row.target) else {
                let (what, category, text) = unread(&row.target);
                output.notes.add(category, format!("{object}, {what}"), text);
                continue;
            };
            let transform = document.beside.transforms.get(node);
            if transform.is_none_or(|transform| transform.matrix.is_some()) {
                let text = "moves nothing that could move; left out";
                output.notes.add(Category::Animation, &*object, text);
                continue;
            }
            if moved.contains(&(node, path)) {
                let node = label("node", node, None);
                let text = format!("only the first animation of its {path} is read");
                output.notes.add(Category::Animation, node, text);
                continue;
            }
            let sampler = animation.samplers.get(row.sampler.value());
            let arrays = sampler.ok_or("its sampler is not in the file".to_string());
            let arrays = arrays.and_then(|sampler| {
                let times = source.accessors.get(sampler.input)?;
                Ok((sampler, times, source.accessors.get(sampler.output)?))
            });
            let compiled = match arrays {
                Err(problem) => Err(problem),
                Ok((sampler, times, values)) => {
                    let bytes = (times.count as u64 + 4 * values.count as u64) * 4;
                    output.budget.take(bytes, || object.clone())?;
                    channel(path, sampler, times, values)
                }
            };
            match compiled {
                Ok((channel, mended)) => {
                    moved.insert((node, path));
                    channels[node].push(channel);
                    if let Some(text) = mended {
                        output.notes.add(Category::Animation, &*object, text);
                    }
                }
                Err(problem) => {
                    let text = format!("{problem}; this animation of a {path} is left out");
                    output.notes.add(Category::Animation, &*object, text);
                }
            }
        }
    }
    Ok(channels)
}

/// How many bytes the keys of a channel take.
pub(super) fn byte_length(channel: &Channel) -> u64 {
    fn of<T>(keys: &Keys<T>) -> u64 {
        (size_of_val(&*keys.times_s) + size_of_val(&*keys.values)) as u64
    }
    match channel {
        Channel::Translation(keys) | Channel::Scale(keys) => of(keys),
        Channel::Rotation(keys) => of(keys),
    }
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
fn unread(target: &Target) -> (&str, Category, &'static str) {
    let Some(pointer) = &target.extensions.pointer else {
        return (&target.path, Category::Animation, "animation of shapes is not read");
    };
    let pointer = pointer.pointer.as_str();
    let emits = pointer.contains("emissive");
    let (category, text) = match pointer.split('/').nth(1) {
        Some("materials") if emits => {
            (Category::Lights, "animation of emission is not read; the light is constant")
        }
        Some("materials") => (Category::Materials, "animation of materials is not read"),
        Some("cameras") => (Category::Cameras, "animation of lenses is not read"),
        Some("extensions") if pointer.contains("KHR_lights_punctual") => {
            (Category::Lights, "animation of light is not read; the light is constant")
        }
        Some("meshes") => (Category::Animation, "animation of shapes is not read"),
        _ if pointer.ends_with("/weights") => {
            (Category::Animation, "animation of shapes is not read")
        }
        _ => (Category::Animation, "animation of this is not read"),
    };
    (pointer, category, text)
}

/// A channel, and what had to be mended in it; else what is wrong with it.
fn channel(
    path: &str,
    sampler: &Sampler,
    times: &Accessor,
    values: &Accessor,
) -> Result<(Channel, Option<&'static str>), String> {
    let mut interpolation = match sampler.interpolation {
        Checked::Valid(RowInterpolation::Step) => Interpolation::Step,
        Checked::Valid(RowInterpolation::CubicSpline) => Interpolation::Cubic,
        Checked::Valid(RowInterpolation::Linear) => Interpolation::Linear,
        Checked::Invalid => return Err("its interpolation is unknown".into()),
    };
    if times.component != ComponentType::F32 || times.shape != Type::Scalar || !times.has_data() {
        return Err("its key times are not floats".into());
    }
    let in_a_key = if interpolation == Interpolation::Cubic { 3 } else { 1 };
    let shape = if path == "rotation" { Type::Vec4 } else { Type::Vec3 };
    let typed = values.component == ComponentType::F32 || values.normalized;
    if values.shape != shape || !typed || !values.has_data() {
        return Err(format!("its {path} values have a type that they cannot have"));
    }
    if values.count / in_a_key < times.count {
        return Err(format!("has {} keys, but {} {path} values", times.count, values.count));
    }
    let mut mended = None;
    if values.count != times.count * in_a_key {
        mended = Some("has more values than keys; those beyond are left out");
    }
    // Keys that are good, ascending.
    let mut kept = Vec::with_capacity(times.count);
    let mut last = f32::NEG_INFINITY;
    for key in 0..times.count {
        let [time] = times.vector::<1>(key, 0.0);
        let all = key * in_a_key..(key + 1) * in_a_key;
        let is_finite =
            all.map(|i| values.vector::<4>(i, 0.0)).all(|v| Quat::from_array(v).is_finite());
        if time.is_finite() && time > last && is_finite {
            kept.push(key);
            last = time;
        } else {
            mended = Some("has keys that do not ascend or are not finite; they are left out");
        }
    }
    if kept.is_empty() {
        return Err("has no keys that can be read".into());
    }
    let times_s = kept.iter().map(|&key| times.vector::<1>(key, 0.0)[0]).collect();
    // A spline of one key is its value.
    let is_point = in_a_key == 3 && kept.len() == 1;
    let rows: Vec<usize> = match is_point {
        true => vec![kept[0] * 3 + 1],
        false => kept.iter().flat_map(|key| key * in_a_key..(key + 1) * in_a_key).collect(),
    };
    if is_point {
        interpolation = Interpolation::Linear;
    }
    let vectors = || rows.iter().map(|&i| Vec3::from_array(values.vector(i, 0.0))).collect();
    let channel = match path {
        "rotation" => {
            let mut values: Vec<Quat> =
                rows.iter().map(|&i| Quat::from_array(values.vector(i, 0.0))).collect();
            let in_a_key = if is_point { 1 } else { in_a_key };
            // Of a spline only the middle of each three is a rotation.
            for value in values.iter_mut().skip(in_a_key / 2).step_by(in_a_key) {
                let length = value.length();
                if (length - 1.0).abs() > QUATERNION_TOLERANCE {
                    mended = Some("has rotations that are not unit quaternions; mended");
                }
                let has_direction = length > 0.0 && length.is_finite();
                *value = if has_direction { *value / length } else { Quat::IDENTITY };
            }
            Channel::Rotation(Keys { times_s, values, interpolation })
        }
        "scale" => Channel::Scale(Keys { times_s, values: vectors(), interpolation }),
        _ => Channel::Translation(Keys { times_s, values: vectors(), interpolation }),
    };
    Ok((channel, mended))
}
