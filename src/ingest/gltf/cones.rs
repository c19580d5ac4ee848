//! Punctual lights whose cones or ranges are animated.
//!
//! A light of the scene has one cone and one range. A light that changes them is as many lights in one place, each dark but
//! at its own times; between two of these, one fades into the next. The exporter carries shaping over time in the same
//! way.

use super::accessors::Accessor;
use super::animation::Track;
use super::document::label;
use super::key_table::{self, Beats};
use super::lights::cone;
use super::strengths::Strength;
use super::{Output, Source};
use crate::ingest::error::Fault;
use crate::math::color::Rgb;
use crate::scene::{Category, Interpolation, Keys, Light, LightKind, Shaping, Timeline};
use gltf::json::Index;
use gltf::json::extensions::scene::khr_lights_punctual::{Light as Row, Spot};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::f32::consts::FRAC_PI_4;

/// The animated half angle beyond which a spot is dark, radians.
pub(super) const OUTER: &str = "spot/outerConeAngle";
/// The animated half angle of a spot's full intensity, radians.
pub(super) const INNER: &str = "spot/innerConeAngle";
/// The animated range, metres.
pub(super) const RANGE: &str = "range";

/// Of more cones and ranges than this a light keeps those that do not vary.
const MOST: usize = 2000;

/// What is animated of a light's cone and range.
#[derive(Default)]
pub(super) struct Form {
    outer: Option<Keys<f32>>,
    inner: Option<Keys<f32>>,
    range: Option<Keys<f32>>,
}

/// A light for some of the time.
struct Part {
    shaping: Option<Shaping>,
    range_m: Option<f32>,
    /// How much of the light it is.
    share: Keys<f32>,
}

impl Form {
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
        let interpolation = track.interpolation;
        let (first, step) = if interpolation == Interpolation::Cubic { (1, 3) } else { (0, 1) };
        let number = |&row: &usize| values.vector::<1>(row, 0.0)[0];
        let values: Vec<f32> = track.rows.iter().map(number).collect();
        let least = values.iter().skip(first).step_by(step).copied().fold(f32::MAX, f32::min);
        match path {
            RANGE if least <= 0.0 => return Err("has ranges that are not positive"),
            _ if least < 0.0 => return Err("has cone angles that are negative"),
            _ => {}
        }
        let keys = Some(Keys { times_s: track.times_s.clone(), values, interpolation });
        match path {
            OUTER => self.outer = keys,
            INNER => self.inner = keys,
            _ => self.range = keys,
        }
        Ok(())
    }

    /// A row without the constants that animations take the place of, which need not make sense.
    fn opened(&self, row: &Row) -> Row {
        let mut row = row.clone();
        if let (Some(_), Some(spot)) = (&self.outer, &mut row.spot) {
            (spot.inner_cone_angle, spot.outer_cone_angle) = (0.0, FRAC_PI_4);
        }
        row.range = row.range.filter(|_| self.range.is_none());
        row
    }

    /// The light at each of its times; none while it is dark. `None` if it has more than are kept.
    fn parts(
        &self,
        row: &Row,
        (has_cone, still_range_m): (bool, Option<f32>),
        timeline: Timeline,
        note: &mut impl FnMut(String),
    ) -> Option<Vec<Part>> {
        let on_frames = |keys: &Keys<f32>| key_table::on_frames(keys, timeline);
        let outer = self.outer.as_ref().filter(|_| has_cone).map(on_frames);
        let inner = self.inner.as_ref().filter(|_| has_cone).map(on_frames);
        let range = self.range.as_ref().map(on_frames);
        let tracks = [&outer, &inner, &range].into_iter().flatten();
        let tracks: Vec<Beats> = tracks.map(|keys| (&*keys.times_s, keys.interpolation)).collect();
        if tracks.is_empty() {
            return None;
        }
        let (times, interpolation) = key_table::times(&tracks, timeline);
        let at = |keys: &Option<Keys<f32>>, time: f32| {
            keys.as_ref().map(|keys| key_table::value(keys, time, timeline) as f32)
        };
        let mut numbers: HashMap<[u32; 3], usize> = HashMap::new();
        let mut parts: Vec<Part> = Vec::new();
        let mut lit = Vec::with_capacity(times.len());
        let none = Spot { inner_cone_angle: 0.0, outer_cone_angle: FRAC_PI_4 };
        let still = row.spot.as_ref().unwrap_or(&none);
        let mut then = row.clone();
        for &time in &times {
            let outer_rad = at(&outer, time).unwrap_or(still.outer_cone_angle);
            let inner_rad = at(&inner, time).unwrap_or(still.inner_cone_angle).max(0.0);
            // Angles that are one at the keys may differ by a rounding in between.
            let is_one = inner_rad > outer_rad && inner_rad <= outer_rad * (1.0 + 1e-6);
            let inner_rad = if is_one { outer_rad } else { inner_rad };
            let range_m = at(&range, time).or(still_range_m);
            // A spline may go below zero between keys that do not.
            if (has_cone && outer_rad <= 0.0) || (range.is_some() && range_m <= Some(0.0)) {
                lit.push(None);
                continue;
            }
            let spot = Spot { inner_cone_angle: inner_rad, outer_cone_angle: outer_rad };
            then.spot = Some(spot);
            let shaping = if has_cone { cone(&then, note) } else { None };
            let bits = [outer_rad, inner_rad, range_m.unwrap_or(f32::MAX)].map(f32::to_bits);
            let number = *numbers.entry(bits).or_insert(parts.len());
            if number == parts.len() {
                if number == MOST {
                    note(format!(
                        "has more than {MOST} cones and ranges over time; they are constant"
                    ));
                    return None;
                }
                let share = Keys { times_s: Vec::new(), values: Vec::new(), interpolation };
                parts.push(Part { shaping, range_m, share });
            }
            lit.push(Some(number));
        }
        for i in 0..times.len() {
            let before = i.checked_sub(1).map(|before| lit[before]);
            if before == Some(lit[i]) {
                continue;
            }
            for (number, share) in
                before.flatten().map(|n| (n, 0.0)).into_iter().chain(lit[i].map(|n| (n, 1.0)))
            {
                let keys = &mut parts[number].share;
                // Where it is held, the jump is at the key itself.
                if i > 0 && (interpolation == Interpolation::Linear || keys.times_s.is_empty()) {
                    let earlier = if interpolation == Interpolation::Linear { i - 1 } else { 0 };
                    if keys.times_s.last() != Some(&times[earlier]) {
                        keys.times_s.push(times[earlier]);
                        keys.values.push(1.0 - share);
                    }
                }
                keys.times_s.push(times[i]);
                keys.values.push(share);
            }
        }
        Some(parts)
    }
}

/// The row of a light of the file, as it is where nothing varies.
pub(super) fn opened(forms: &BTreeMap<usize, Form>, number: usize, row: &Row) -> Row {
    forms.get(&number).map_or_else(|| row.clone(), |form| form.opened(row))
}

/// The lights that the light at a node is, with the frames at which they first shine; the first has the node's own name.
///
/// # Errors
/// If their keys are too many to be kept.
pub(super) fn split(
    source: &Source,
    output: &mut Output,
    number: usize,
    light: Light,
    forms: &BTreeMap<usize, Form>,
) -> Result<Vec<(f64, Light)>, Fault> {
    let timeline = output.scene.timeline;
    let index = source.document.nodes[number].light.filter(|_| !light.kind.is_infinite());
    let form = index.and_then(|index| Some((index, forms.get(&index.value())?)));
    let Some((index, form)) = form else { return Ok(vec![(0.0, light)]) };
    let Some(row) = source.document.get(Index::<Row>::new(index.value() as u32)) else {
        return Ok(vec![(0.0, light)]);
    };
    let object = label("light", index.value(), row.name.as_deref());
    let tracks = || [&form.outer, &form.inner, &form.range].into_iter().flatten();
    let count = key_table::most_keys(tracks().map(|keys| &*keys.times_s), timeline);
    let bytes = count * (size_of::<Part>() + 4 * size_of::<(f32, Rgb)>());
    output.budget.take(bytes as u64, || object.clone())?;
    let has_cone = matches!(light.kind, LightKind::Spot { shaping: Shaping::Khr { .. }, .. });
    let mut notes = BTreeSet::new();
    let parts =
        form.parts(row, (has_cone, light.range_m), timeline, &mut |text| _ = notes.insert(text));
    for text in notes {
        output.notes.add(Category::Lights, &*object, text);
    }
    let Some(parts) = parts else { return Ok(vec![(0.0, light)]) };
    let mut lights = Vec::with_capacity(parts.len());
    for Part { shaping, range_m, share } in parts {
        let is_lit = |&at: &usize| share.values[at] > 0.0;
        let first = (0..share.values.len()).find(is_lit).map_or(0.0, |at| share.times_s[at].into());
        let mut part = Light { range_m, ..light.clone() };
        if let (LightKind::Spot { shaping, .. }, Some(own)) = (&mut part.kind, shaping) {
            *shaping = own;
        }
        let own = part.values.take().map(|keys| within(*keys, &share));
        let rgb = part.kind.rgb();
        let strength = Strength::shared(own, share);
        let bytes = strength.most_keys(timeline) * size_of::<(f32, Rgb)>();
        output.budget.take(bytes as u64, || object.clone())?;
        // No share is larger than one: what was a number stays one.
        part.values = strength.keys(rgb, 1.0, timeline).map(Box::new);
        lights.push((timeline.frame_at(first), part));
    }
    if lights.is_empty() {
        let keys = Keys {
            times_s: vec![0.0],
            values: vec![Rgb::ZERO],
            interpolation: Interpolation::Step,
        };
        lights.push((0.0, Light { values: Some(Box::new(keys)), ..light }));
    }
    Ok(lights)
}

/// Those of a light's keys that matter while it has a share.
fn within(keys: Keys<Rgb>, share: &Keys<f32>) -> Keys<Rgb> {
    let (times, values) = (&share.times_s, &share.values);
    let last = times.len() - 1;
    let from = match values[0] {
        0.0 => keys.times_s.partition_point(|&time| time <= times[0]).saturating_sub(1),
        _ => 0,
    };
    let to = match values[last] {
        0.0 => {
            (keys.times_s.partition_point(|&time| time < times[last]) + 1).min(keys.times_s.len())
        }
        _ => keys.times_s.len(),
    };
    Keys {
        times_s: keys.times_s[from..to].into(),
        values: keys.values[from..to].into(),
        interpolation: keys.interpolation,
    }
}
