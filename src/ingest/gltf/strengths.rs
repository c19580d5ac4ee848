//! Lights that animations make brighter, darker or of another colour.
//!
//! A light's strength is its colour times its intensity, and either may be animated. The scene has keys of the product.
//! Where one of the two varies, and not by a spline, these are its own. Otherwise the product is between keys what no keys
//! can say: it is told at all keys and at each frame, linear in between.

use super::accessors::Accessor;
use super::animation::Track;
use super::document::label;
use super::{Output, Source};
use crate::ingest::error::Fault;
use crate::math::color::Rgb;
use crate::scene::{Category, Interpolation, Keys, Timeline};
use glam::Vec3;
use gltf::json::Index;
use gltf::json::extensions::scene::khr_lights_punctual::Light;
use std::collections::BTreeMap;

/// The animated colour of a light.
pub(super) const COLOR: &str = "color";
/// The animated intensity of a light, in its unit.
pub(super) const INTENSITY: &str = "intensity";

/// Keys are put at so many frames at most.
const MOST_FRAMES: f64 = 100_000.0;

/// What is animated of a light.
#[derive(Default)]
pub(super) struct Strength {
    color: Option<Keys<Vec3>>,
    intensity: Option<Keys<f32>>,
}

impl Strength {
    /// Puts an animated part in.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(super) fn put(
        &mut self,
        path: &str,
        track: &Track,
        values: &Accessor,
    ) -> Result<(), &'static str> {
        let (times_s, interpolation) = (track.times_s.clone(), track.interpolation);
        let (first, step) = if interpolation == Interpolation::Cubic { (1, 3) } else { (0, 1) };
        let rows = track.rows.iter();
        if path == COLOR {
            let values: Vec<Vec3> = rows.map(|&row| values.vector::<3>(row, 0.0).into()).collect();
            if values.iter().skip(first).step_by(step).any(|color| color.min_element() < 0.0) {
                return Err("has colours that are negative in part");
            }
            self.color = Some(Keys { times_s, values, interpolation });
        } else {
            let values: Vec<f32> = rows.map(|&row| values.vector::<1>(row, 0.0)[0]).collect();
            if values.iter().skip(first).step_by(step).any(|&intensity| intensity < 0.0) {
                return Err("has intensities that are negative");
            }
            self.intensity = Some(Keys { times_s, values, interpolation });
        }
        Ok(())
    }

    /// At most so many keys are made of it; none if no part is animated.
    fn most_keys(&self, timeline: Timeline) -> usize {
        let color = self.color.as_ref().map(|keys| &keys.times_s);
        let intensity = self.intensity.as_ref().map(|keys| &keys.times_s);
        let own: usize = color.iter().chain(&intensity).map(|times| times.len()).sum();
        let seconds = || color.into_iter().chain(intensity).flatten().map(|&time| f64::from(time));
        let (first, last) =
            (seconds().fold(f64::MAX, f64::min), seconds().fold(f64::MIN, f64::max));
        let frames = timeline.frame_at(last) - timeline.frame_at(first);
        // Two of each that jumps.
        2 * own + frames.clamp(0.0, MOST_FRAMES) as usize
    }

    /// The strength over time. The constants stand for what is not animated. `None` if it is too strong for a 32-bit
    /// number.
    fn keys(&self, color: Rgb, intensity: f32, timeline: Timeline) -> Option<Keys<Rgb>> {
        let color = color.max(Rgb::ZERO);
        let keys = match (&self.color, &self.intensity) {
            (Some(keys), None) if keys.interpolation != Interpolation::Cubic => Keys {
                times_s: keys.times_s.clone(),
                values: keys.values.iter().map(|&color| color * intensity).collect(),
                interpolation: keys.interpolation,
            },
            (None, Some(keys)) if keys.interpolation != Interpolation::Cubic => Keys {
                times_s: keys.times_s.clone(),
                values: keys.values.iter().map(|&intensity| color * intensity).collect(),
                interpolation: keys.interpolation,
            },
            _ => self.product(color, intensity, timeline),
        };
        keys.values.iter().all(|value| value.is_finite()).then(|| keys.settled())
    }

    fn product(&self, color: Rgb, intensity: f32, timeline: Timeline) -> Keys<Rgb> {
        let own_colors = self.color.as_ref().map(|keys| on_frames(keys, timeline));
        let own_intensities = self.intensity.as_ref().map(|keys| on_frames(keys, timeline));
        let colors = own_colors.as_ref().map(|keys| (&keys.times_s, keys.interpolation));
        let intensities = own_intensities.as_ref().map(|keys| (&keys.times_s, keys.interpolation));
        let parts = || colors.iter().chain(&intensities);
        let is_held = parts().all(|(_, interpolation)| *interpolation == Interpolation::Step);
        let mut times: Vec<f32> = parts().flat_map(|(times, _)| times.iter().copied()).collect();
        times.sort_by(f32::total_cmp);
        if !is_held {
            let (first, last) = (times[0], times[times.len() - 1]);
            let frame = |second: f32| timeline.frame_at(second.into());
            let count = (frame(last) - frame(first)).clamp(0.0, MOST_FRAMES) as u32;
            let frames = (0..=count).map(|i| frame(first).ceil() + f64::from(i));
            let seconds = frames.map(|frame| timeline.seconds_at(frame) as f32);
            times.extend(seconds.filter(|&second| second > first && second < last));
            // Where a part jumps there are two keys.
            for (jumps, _) in parts().filter(|(_, how)| *how == Interpolation::Step) {
                times.extend(jumps.iter().skip(1).map(|time| time.next_down()));
            }
            times.sort_by(f32::total_cmp);
        }
        times.dedup();
        let value = |&time: &f32| {
            let color = own_colors.as_ref().map_or(color, |keys| match keys.interpolation {
                Interpolation::Step => held(keys, time),
                _ => keys.at(time.into(), timeline).as_vec3(),
            });
            let intensity =
                own_intensities.as_ref().map_or(intensity, |keys| match keys.interpolation {
                    Interpolation::Step => held(keys, time),
                    _ => keys.at(time.into(), timeline) as f32,
                });
            // A spline may go below zero between keys that do not.
            color.max(Rgb::ZERO) * intensity.max(0.0)
        };
        let values = times.iter().map(value).collect();
        let interpolation = if is_held { Interpolation::Step } else { Interpolation::Linear };
        Keys { times_s: times, values, interpolation }
    }
}

/// The strengths of the lights of the file that are animated, each once, however many nodes have the light.
///
/// # Errors
/// If their keys are too many to be kept.
pub(super) fn compile(
    animated: BTreeMap<usize, Strength>,
    source: &Source,
    output: &mut Output,
) -> Result<BTreeMap<usize, Keys<Rgb>>, Fault> {
    let timeline = output.scene.timeline;
    let mut strengths = BTreeMap::new();
    for (number, strength) in animated {
        let Some(row) = source.document.get(Index::<Light>::new(number as u32)) else { continue };
        let object = label("light", number, row.name.as_deref());
        let bytes = strength.most_keys(timeline) * size_of::<(f32, Rgb)>();
        // Of some nothing could be read.
        if bytes == 0 {
            continue;
        }
        output.budget.take(bytes as u64, || object.clone())?;
        match strength.keys(row.color.into(), row.intensity, timeline) {
            Some(keys) => _ = strengths.insert(number, keys),
            None => {
                let text = "is too strong for a 32-bit number at some time; it is constant";
                output.notes.add(Category::Lights, object, text);
            }
        }
    }
    Ok(strengths)
}

/// The same keys, those that count as at a frame exactly at it: a part that jumps there jumps with the other.
fn on_frames<T: Clone>(keys: &Keys<T>, timeline: Timeline) -> Keys<T> {
    let time = |&time: &f32| {
        let frame_s = timeline.seconds_at(timeline.frame_at(time.into()).round());
        if timeline.is_same(time.into(), frame_s) { frame_s as f32 } else { time }
    };
    Keys { times_s: keys.times_s.iter().map(time).collect(), ..keys.clone() }
}

/// The value of the last key at a time or before it; exactly, not as near as frames are.
fn held<T: Copy>(keys: &Keys<T>, time: f32) -> T {
    let after = keys.times_s.partition_point(|&key| key <= time);
    keys.values[after.saturating_sub(1)]
}
