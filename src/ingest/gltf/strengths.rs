//! Lights and materials whose light animations make brighter, darker or of another colour.
//!
//! The strength is a colour times an intensity, and either may be animated. The scene has keys of the product.
//! Where one of the two varies, and not by a spline, these are its own. Otherwise the product is between keys what no keys
//! can say: it is told at all keys and at each frame, linear in between.

use super::accessors::Accessor;
use super::animation::Track;
use super::document::label;
use super::key_table::{self, Beats, on_frames, value};
use super::targets::Moved;
use super::{Output, Source, materials};
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

/// The animated factor of a material's emission, which is its colour.
pub(super) const FACTOR: &str = "emissiveFactor";
/// The animated strength of a material's emission.
pub(super) const STRENGTH: &str = "extensions/KHR_materials_emissive_strength/emissiveStrength";

/// What is animated of a light, or of a material's emission.
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
        if matches!(path, COLOR | FACTOR) {
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

    /// A strength that has a share in a light, given the light's own keys if it has any.
    pub(super) fn shared(own: Option<Keys<Rgb>>, share: Keys<f32>) -> Strength {
        Strength { color: own, intensity: Some(share) }
    }

    /// At most so many keys are made of it; none if no part is animated.
    pub(super) fn most_keys(&self, timeline: Timeline) -> usize {
        let color = self.color.as_ref().map(|keys| &*keys.times_s);
        let intensity = self.intensity.as_ref().map(|keys| &*keys.times_s);
        key_table::most_keys(color.into_iter().chain(intensity), timeline)
    }

    /// The strength over time. The constants stand for what is not animated. `None` if it is too strong for a 32-bit
    /// number.
    pub(super) fn keys(&self, color: Rgb, intensity: f32, timeline: Timeline) -> Option<Keys<Rgb>> {
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
        let colors = self.color.as_ref().map(|keys| on_frames(keys, timeline));
        let intensities = self.intensity.as_ref().map(|keys| on_frames(keys, timeline));
        let of_colors = colors.as_ref().map(|keys| (&*keys.times_s, keys.interpolation));
        let of_intensities = intensities.as_ref().map(|keys| (&*keys.times_s, keys.interpolation));
        let tracks: Vec<Beats> = of_colors.into_iter().chain(of_intensities).collect();
        let (times_s, interpolation) = key_table::times(&tracks, timeline);
        let value = |&time: &f32| {
            let color = colors.as_ref().map_or(color, |keys| value(keys, time, timeline).as_vec3());
            let intensity =
                intensities.as_ref().map_or(intensity, |keys| value(keys, time, timeline) as f32);
            // A spline may go below zero between keys that do not.
            color.max(Rgb::ZERO) * intensity.max(0.0)
        };
        let values = times_s.iter().map(value).collect();
        Keys { times_s, values, interpolation }
    }
}

/// The strengths of what shines in the file and is animated, each once, however many nodes have it: of lights and of
/// materials, by their numbers.
///
/// # Errors
/// If their keys are too many to be kept.
pub(super) fn compile(
    animated: BTreeMap<Moved, Strength>,
    source: &Source,
    output: &mut Output,
) -> Result<[BTreeMap<usize, Keys<Rgb>>; 2], Fault> {
    let timeline = output.scene.timeline;
    let (mut lights, mut glows) = (BTreeMap::new(), BTreeMap::new());
    for (moved, strength) in animated {
        let (object, color, intensity, (keys, number)) = match moved {
            Moved::Light(number) => {
                let row = source.document.get(Index::<Light>::new(number as u32));
                let Some(row) = row else { continue };
                let object = label("light", number, row.name.as_deref());
                (object, row.color.into(), row.intensity, (&mut lights, number))
            }
            Moved::Material(number) => {
                let Some(row) = source.document.materials.get(number) else { continue };
                let object = label("material", number, row.name.as_deref());
                let (color, intensity) = materials::emission(row);
                (object, color, intensity, (&mut glows, number))
            }
            _ => continue,
        };
        let bytes = strength.most_keys(timeline) * size_of::<(f32, Rgb)>();
        // Of some nothing could be read. A constant that is no strength is noted where it is read.
        if bytes == 0 || (strength.intensity.is_none() && intensity < 0.0) {
            continue;
        }
        output.budget.take(bytes as u64, || object.clone())?;
        match strength.keys(color, intensity, timeline) {
            Some(own) => _ = keys.insert(number, own),
            None => {
                let text = "is too strong for a 32-bit number at some time; it is constant";
                output.notes.add(Category::Lights, object, text);
            }
        }
    }
    Ok([lights, glows])
}
