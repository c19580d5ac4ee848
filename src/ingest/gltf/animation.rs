//! Animations, merged: the file's clips are taken to run together, as one shot.
//!
//! A channel that cannot be read is left out; one whose keys are only partly good keeps those.

use super::accessors::Accessor;
use super::cones::{Form, INNER, OUTER, RANGE};
use super::document::label;
use super::lenses::{self, YFOV, YMAG};
use super::posing::Weights;
use super::strengths::{self, INTENSITY, STRENGTH, Strength};
use super::targets::{Moved, can_move, target, unread};
use super::{Output, Source};
use crate::ingest::error::Fault;
use crate::math::color::Rgb;
use crate::scene::{Category, Channel, Interpolation, Keys, LensKeys};
use glam::{Quat, Vec3};
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::animation::{Interpolation as RowInterpolation, Sampler};
use gltf::json::validation::Checked;
use std::collections::{BTreeMap, HashSet};
use std::sync::Arc;

/// How far the length of a key's quaternion may be from one without a note; small integers are coarse.
const QUATERNION_TOLERANCE: f32 = 0.03;

/// The path of a channel that animates morph targets.
pub(super) const WEIGHTS: &str = "weights";

/// The channels of nodes, by their numbers in the file.
pub(super) type Channels = BTreeMap<usize, Vec<Channel>>;

/// What animations say of a file.
pub(super) struct Animated {
    /// The channels of the nodes that have any.
    pub channels: Channels,
    /// Of the nodes and meshes whose weights of morph targets are animated.
    pub weights: BTreeMap<Moved, Weights>,
    /// Of the cameras whose height is animated.
    pub lenses: BTreeMap<usize, Arc<LensKeys>>,
    /// Of the lights whose colour or intensity is animated.
    pub strengths: BTreeMap<usize, Keys<Rgb>>,
    /// Of the materials whose emission is animated.
    pub glows: BTreeMap<usize, Keys<Rgb>>,
    /// Of the lights whose cone or range is animated.
    pub forms: BTreeMap<usize, Form>,
}

/// The keys of a sampler that can be read.
pub(super) struct Track {
    pub interpolation: Interpolation,
    pub times_s: Vec<f32>,
    /// Which values belong to the keys, three of them to one of a spline.
    pub rows: Vec<usize>,
    /// How many elements of its accessor a value is.
    pub width: usize,
    /// What had to be mended.
    mended: Option<&'static str>,
}

/// The channels and weights of every node of the file, the heights of its cameras, the strengths of what shines, and the
/// forms of its lights.
pub(super) fn compile(source: &Source, output: &mut Output) -> Result<Animated, Fault> {
    let document = source.document;
    let timeline = output.scene.timeline;
    let mut channels = Channels::new();
    let (mut weights, mut lenses) = (BTreeMap::new(), BTreeMap::new());
    let mut strengths: BTreeMap<Moved, Strength> = BTreeMap::new();
    let mut forms: BTreeMap<usize, Form> = BTreeMap::new();
    let mut moved = HashSet::new();
    for (i, animation) in document.animations.iter().enumerate() {
        let object = label("animation", i, animation.name.as_deref());
        for row in &document.beside.channels[i] {
            let Some((moves, path)) = target(&row.target) else {
                let (what, category, text) = unread(&row.target);
                output.notes.add(category, format!("{object}, {what}"), text);
                continue;
            };
            if !can_move(document, moves, path) {
                let text = "moves nothing that could move; left out";
                output.notes.add(Category::Animation, &*object, text);
                continue;
            }
            if moved.contains(&(moves, path)) {
                let text = format!("only the first animation of its {path} is read");
                output.notes.add(moves.category(), moves.label(), text);
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
                    track(path, sampler, times, values).map(|track| (track, values))
                }
            };
            match compiled {
                Ok((mut track, values)) => {
                    let put = match moves {
                        Moved::Camera(camera) => lenses::height(path, &track, values)
                            .map(|lens| _ = lenses.insert(camera, lens)),
                        Moved::Light(light) if matches!(path, OUTER | INNER | RANGE) => {
                            forms.entry(light).or_default().put(path, &track, values)
                        }
                        Moved::Light(_) | Moved::Material(_) => {
                            strengths.entry(moves).or_default().put(path, &track, values)
                        }
                        Moved::Node(_) | Moved::Mesh(_) if path == WEIGHTS => {
                            weights.insert(moves, Weights::of(&track, values, timeline));
                            Ok(())
                        }
                        Moved::Mesh(_) => Ok(()),
                        Moved::Node(node) => {
                            let own = channel(path, &mut track, values);
                            channels.entry(node).or_default().push(own);
                            Ok(())
                        }
                    };
                    if let Err(problem) = put {
                        let text = format!("{problem}; this animation is left out");
                        output.notes.add(moves.category(), &*object, text);
                        continue;
                    }
                    moved.insert((moves, path));
                    if let Some(text) = track.mended {
                        output.notes.add(moves.category(), &*object, text);
                    }
                }
                Err(problem) => {
                    let text = format!("{problem}; this animation of a {path} is left out");
                    output.notes.add(moves.category(), &*object, text);
                }
            }
        }
    }
    let [strengths, glows] = strengths::compile(strengths, source, output)?;
    Ok(Animated { channels, weights, lenses, strengths, glows, forms })
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

/// The keys of a track that can be read; else what is wrong with it.
fn track(
    path: &str,
    sampler: &Sampler,
    times: &Accessor,
    values: &Accessor,
) -> Result<Track, String> {
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
    let shape = match path {
        "rotation" => Type::Vec4,
        WEIGHTS | YFOV | YMAG | INTENSITY | STRENGTH | OUTER | INNER | RANGE => Type::Scalar,
        _ => Type::Vec3,
    };
    let typed = values.component == ComponentType::F32 || values.normalized;
    if values.shape != shape || !typed || !values.has_data() {
        return Err(format!("its {path} values have a type that they cannot have"));
    }
    let width = match path {
        WEIGHTS => (values.count / times.count / in_a_key).max(1),
        _ => 1,
    };
    let key_width = width * in_a_key;
    if values.count / key_width < times.count {
        return Err(format!("has {} keys, but {} {path} values", times.count, values.count));
    }
    let mut mended = None;
    if values.count / key_width > times.count || !values.count.is_multiple_of(key_width) {
        mended = Some("has more values than keys; those beyond are left out");
    }
    // Keys that are good, ascending.
    let mut kept = Vec::with_capacity(times.count);
    let mut last = f32::NEG_INFINITY;
    for key in 0..times.count {
        let [time] = times.vector::<1>(key, 0.0);
        let all = key * key_width..(key + 1) * key_width;
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
    Ok(Track { interpolation, times_s, rows, width, mended })
}

/// The channel of a part of a transform. Its rotations are made unit quaternions.
fn channel(path: &str, track: &mut Track, values: &Accessor) -> Channel {
    let (times_s, interpolation) = (track.times_s.clone(), track.interpolation);
    let rows = track.rows.iter();
    let vectors = || rows.clone().map(|&i| Vec3::from_array(values.vector(i, 0.0))).collect();
    match path {
        "rotation" => {
            let mut values: Vec<Quat> =
                rows.map(|&i| Quat::from_array(values.vector(i, 0.0))).collect();
            let in_a_key = if interpolation == Interpolation::Cubic { 3 } else { 1 };
            // Of a spline only the middle of each three is a rotation.
            for value in values.iter_mut().skip(in_a_key / 2).step_by(in_a_key) {
                let length = value.length();
                if (length - 1.0).abs() > QUATERNION_TOLERANCE {
                    track.mended = Some("has rotations that are not unit quaternions; mended");
                }
                let has_direction = length > 0.0 && length.is_finite();
                *value = if has_direction { *value / length } else { Quat::IDENTITY };
            }
            Channel::Rotation(Keys { times_s, values, interpolation })
        }
        "scale" => Channel::Scale(Keys { times_s, values: vectors(), interpolation }),
        _ => Channel::Translation(Keys { times_s, values: vectors(), interpolation }),
    }
}
