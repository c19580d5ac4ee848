//! Lenses over time: `extras.usdCamera.values`, and animations of a camera's field of view.
//!
//! A table that makes no sense is left out and noted, as everything of cameras; the lens is constant then.

use super::Output;
use super::accessors::Accessor;
use super::animation::Track;
use super::cameras::{is_field_of_view, lens_radius};
use super::document::{Real, UsdCamera, UsdLens, reals};
use super::lights::MOST_KEYS;
use crate::ingest::error::Fault;
use crate::scene::{Camera, Category, Interpolation, Keys, LensKeys, Projection};
use glam::Vec2;
use std::sync::Arc;

/// The animated field of view of a perspective camera, as `KHR_animation_pointer` names it, radians.
pub(super) const YFOV: &str = "perspective/yfov";
/// The animated half height of an orthographic camera, metres.
pub(super) const YMAG: &str = "orthographic/ymag";

/// The keys of a camera's height; one alone where it does not vary.
///
/// # Errors
/// What is wrong with them.
pub(super) fn height(
    path: &str,
    track: &Track,
    values: &Accessor,
) -> Result<Arc<LensKeys>, &'static str> {
    let interpolation = track.interpolation;
    let number = |&row: &usize| values.vector::<1>(row, 0.0)[0];
    let mut values: Vec<f32> = track.rows.iter().map(number).collect();
    let is_spline = interpolation == Interpolation::Cubic;
    let (first, step) = if is_spline { (1, 3) } else { (0, 1) };
    let mut keys = values.iter().skip(first).step_by(step);
    match path {
        YFOV if keys.any(|&yfov| !is_field_of_view(yfov)) => {
            return Err("has fields of view that are not between 0 and pi");
        }
        YMAG if keys.any(|&half| half <= 0.0) => return Err("has heights that are not positive"),
        YMAG => values.iter_mut().for_each(|half| *half *= 2.0),
        _ => {}
    }
    let keys = Keys { times_s: track.times_s.clone(), values, interpolation };
    let height = Some(match keys.steady_number() {
        Some(value) => Keys {
            times_s: vec![keys.times_s[0]],
            values: vec![value],
            interpolation: Interpolation::Step,
        },
        None => keys,
    });
    Ok(Arc::new(LensKeys { height, ..LensKeys::default() }))
}

/// Gives a camera, which has its constants, what `extras.usdCamera.values` says.
///
/// # Errors
/// If its keys are too many to be kept.
pub(super) fn apply(
    usd: &UsdCamera,
    camera: &mut Camera,
    object: &str,
    output: &mut Output,
) -> Result<(), Fault> {
    let Some(values) = &usd.values else { return Ok(()) };
    let mut note = |problem: String| {
        let text = format!("extras.usdCamera.values: {problem}");
        output.notes.add(Category::Cameras, object, text);
    };
    let read = || {
        let told: UsdLens =
            serde_json::from_str(values.get()).map_err(|error| error.to_string())?;
        Ok::<_, String>((Table::new(&told)?, told))
    };
    let (table, told) = match read() {
        Ok(read) => read,
        Err(problem) => {
            note(format!("{problem}; its lens is constant"));
            return Ok(());
        }
    };
    let mut lens = LensKeys::default();
    // An animation of the height holds where the extras say nothing of it.
    if let Some(animated) = &camera.over_time {
        lens.height = animated.height.clone();
    }
    let mut say = |problem: &str| note(format!("{problem}; constant"));
    let heights = match camera.projection {
        Projection::Perspective { .. } => table.numbers(&told.yfov, "yfov", is_field_of_view),
        Projection::Orthographic { .. } => {
            let halves = table.numbers(&told.ymag, "ymag", |half| half > 0.0);
            let whole = |halves: Vec<f32>| halves.into_iter().map(|half| 2.0 * half).collect();
            halves.map(|halves| halves.map(whole))
        }
    };
    match (heights.map(|heights| heights.map(|heights| table.keys(heights))), camera.projection) {
        (Err(problem), _) => say(&problem),
        (Ok(None), _) => {}
        (Ok(Some(keys)), projection) => match (keys.steady_number(), projection) {
            (None, _) => lens.height = Some(keys),
            (Some(yfov_rad), Projection::Perspective { .. }) => {
                camera.projection = Projection::Perspective { yfov_rad };
                lens.height = None;
            }
            (Some(height_m), Projection::Orthographic { .. }) => {
                camera.projection = Projection::Orthographic { height_m };
                lens.height = None;
            }
        },
    }
    match table.lens(usd, &told, matches!(camera.projection, Projection::Orthographic { .. })) {
        Err(problem) => say(&problem),
        Ok(None) => {}
        Ok(Some(Optics { radii, focus })) => {
            settle(table.keys(radii), &mut lens.lens_radius_m, &mut camera.lens_radius_m);
            settle(table.keys(focus), &mut lens.focus_distance_m, &mut camera.focus_distance_m);
        }
    }
    match table.numbers(&told.exposure_scale, "exposureScale", |scale| scale >= 0.0) {
        Err(problem) => say(&problem),
        Ok(None) => {}
        Ok(Some(scales)) => {
            settle(table.keys(scales), &mut lens.exposure_scale, &mut camera.exposure_scale);
        }
    }
    match table.pairs(&told.film_offset, "filmOffset", |_| true) {
        Err(problem) => say(&problem),
        Ok(None) => {}
        Ok(Some(pairs)) => {
            settle_pairs(table.keys(pairs), &mut lens.film_offset, &mut camera.film_offset);
        }
    }
    match table.pairs(&told.clipping_range_m, "clippingRange_m", |clip| clip.y > clip.x.max(0.0)) {
        Err(problem) => say(&problem),
        Ok(None) => {}
        Ok(Some(pairs)) => {
            let pairs = pairs.into_iter().map(|clip| Vec2::new(clip.x.max(0.0), clip.y)).collect();
            settle_pairs(table.keys(pairs), &mut lens.clip_m, &mut camera.clip_m);
        }
    }
    output.budget.take(lens.byte_length(), || object.to_string())?;
    camera.over_time = (!lens.is_empty()).then(|| Arc::new(lens));
    Ok(())
}

/// Keys become those of a lens, or its constant if they do not vary.
fn settle(keys: Keys<f32>, varying: &mut Option<Keys<f32>>, constant: &mut f32) {
    match keys.steady_number() {
        Some(value) => *constant = value,
        None => *varying = Some(keys),
    }
}

fn settle_pairs(keys: Keys<Vec2>, varying: &mut Option<Keys<Vec2>>, constant: &mut [f32; 2]) {
    match keys.steady_pair() {
        Some(value) => *constant = value.into(),
        None => *varying = Some(keys),
    }
}

/// The times of a table.
struct Table {
    times_s: Vec<f32>,
}

/// The radius of a lens and the distance in focus, time by time, metres.
struct Optics {
    radii: Vec<f32>,
    focus: Vec<f32>,
}

/// `None` if the file does not have it.
type Column<T> = Result<Option<Vec<T>>, String>;

impl Table {
    fn new(told: &UsdLens) -> Result<Table, String> {
        let count = told.times.len();
        if count == 0 || count > MOST_KEYS {
            return Err(format!("{count} times are not 1 to {MOST_KEYS}"));
        }
        let times_s: Vec<f32> = told.times.iter().map(|time| time.f32()).collect();
        match times_s.is_sorted_by(|before, after| before < after) {
            true => Ok(Table { times_s }),
            false => Err("its times do not ascend".into()),
        }
    }

    fn keys<T>(&self, values: Vec<T>) -> Keys<T> {
        Keys { times_s: self.times_s.clone(), values, interpolation: Interpolation::Linear }
    }

    /// One value for each time, all of them good.
    fn column<T: Copy, V>(
        &self,
        told: &Option<Vec<T>>,
        name: &str,
        value: impl Fn(T) -> V,
        is_good: impl Fn(&V) -> bool,
    ) -> Column<V> {
        let Some(told) = told else { return Ok(None) };
        if told.len() != self.times_s.len() {
            return Err(format!("{} times and {} of {name}", self.times_s.len(), told.len()));
        }
        let values: Vec<V> = told.iter().map(|&told| value(told)).collect();
        match values.iter().all(is_good) {
            true => Ok(Some(values)),
            false => Err(format!("{name} has values that it cannot have")),
        }
    }

    fn numbers(
        &self,
        told: &Option<Vec<Real>>,
        name: &str,
        is_good: impl Fn(f32) -> bool,
    ) -> Column<f32> {
        self.column(told, name, Real::f32, |&value| is_good(value))
    }

    fn pairs(
        &self,
        told: &Option<Vec<[Real; 2]>>,
        name: &str,
        is_good: impl Fn(Vec2) -> bool,
    ) -> Column<Vec2> {
        self.column(told, name, |pair| Vec2::from(reals(pair)), |&pair| is_good(pair))
    }

    /// The radius of the lens and the distance in focus at each time, if any of what they follow from varies.
    fn lens(
        &self,
        usd: &UsdCamera,
        told: &UsdLens,
        is_parallel: bool,
    ) -> Result<Option<Optics>, String> {
        let parts = [
            (&told.f_stop, usd.f_stop, "fStop"),
            (&told.focal_length_m, usd.focal_length_m, "focalLength_m"),
            (&told.focus_distance_m, usd.focus_distance_m, "focusDistance_m"),
        ];
        if parts.iter().all(|(column, ..)| column.is_none()) {
            return Ok(None);
        }
        let mut columns = Vec::with_capacity(3);
        for (column, constant, name) in parts {
            let told = self.numbers(column, name, |_| true)?;
            columns.push(told.unwrap_or_else(|| vec![constant.f32(); self.times_s.len()]));
        }
        let [f_stops, focal_lengths, mut focus] =
            <[Vec<f32>; 3]>::try_from(columns).expect("three");
        if is_parallel {
            let has_lens = told.f_stop.is_some() && f_stops.iter().any(|&f_stop| f_stop > 0.0);
            return if has_lens {
                Err("an orthographic camera has no lens".into())
            } else {
                Ok(None)
            };
        }
        let mut radii = Vec::with_capacity(focus.len());
        for (at, &focus) in focus.iter().enumerate() {
            let radius = lens_radius(f_stops[at], focal_lengths[at], focus)?;
            radii.push(radius.unwrap_or(0.0));
        }
        // A pinhole that is focused nowhere is not on its way there.
        let first = focus.iter().copied().find(|&focus| focus > 0.0);
        let mut last = first.unwrap_or(1.0);
        for focus in &mut focus {
            match *focus > 0.0 {
                true => last = *focus,
                false => *focus = last,
            }
        }
        Ok(Some(Optics { radii, focus }))
    }
}
