//! What a tree depends on: the bounds of all emitters in all frames, and their fingerprints.

use super::fingerprint;
use super::look::looks;
use super::surveyor::{Surveyor, energy_of, sum};
use crate::bounds::LightBounds;
use crate::emitter::{Emitters, LightEntry, LightOverflow, PosedEmitters, TextureMeans};
use crate::light_tree::{LightLook, LightRow, LightSummary, Numbering};
use crate::math::Similarity;
use crate::scene::Scene;
use glam::DVec3;
use rayon::prelude::*;
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::Arc;

/// Everything that the trees of a shot are built over.
pub struct Survey {
    /// What has a tree of its own, in its own space.
    pub shared: Vec<SharedBounds>,
    /// What stands still, in world space.
    pub still: Group,
    /// What changes, frame by frame; empty if nothing does.
    pub frames: Vec<SurveyedFrame>,
    /// Where the origin of all these bounds is in the scene's world, metres.
    pub origin: DVec3,
    /// What the file says of each light.
    pub lights: Vec<LightSummary>,
    /// What emission textures give, by ascending fingerprint. The bounds above follow from it.
    pub textures: Vec<TextureMeans>,
    /// BLAKE3 over all that the trees depend on: what stands still, the frames, and the algorithm that
    /// builds over them.
    pub fingerprint: [u8; 32],
}

/// What changes, as it is in one frame.
#[derive(Clone)]
pub struct SurveyedFrame {
    /// The frame.
    pub number: i32,
    /// The lights; frames that are alike share them.
    pub group: Arc<Group>,
    /// BLAKE3 over them.
    pub fingerprint: [u8; 32],
}

/// The bounds of a light that has a tree of its own.
pub struct SharedBounds {
    /// In the order of its emitters.
    pub bounds: Vec<LightBounds>,
    pub(super) energy: f64,
    pub(super) fingerprint: [u8; 32],
}

impl SharedBounds {
    /// Of these bounds.
    pub(super) fn new(bounds: Vec<LightBounds>) -> SharedBounds {
        let (energy, fingerprint) = (sum(&bounds), fingerprint::of_bounds(&bounds));
        SharedBounds { bounds, energy, fingerprint }
    }
}

/// Lights that are sampled together.
#[derive(Default)]
pub struct Group {
    /// The number of the first emitter that has a leaf of its own.
    pub first: u32,
    /// Bounds of those emitters, world space.
    pub flat: Vec<LightBounds>,
    /// Lights with trees of their own.
    pub placed: Vec<PlacedLight>,
    /// Forced lights, which also have trees of their own.
    pub forced: Vec<PlacedLight>,
}

/// A light with a tree of its own, and where that tree is placed.
#[derive(Clone, Copy, PartialEq)]
pub struct PlacedLight {
    /// Row of [`Survey::shared`].
    pub shared: u32,
    /// From world space to the tree's own.
    pub to_local: Similarity,
    /// What the energies of the tree's own space are multiplied by.
    pub brightness: f32,
    /// Its emitters are numbered from here on.
    pub first_emitter: u32,
    /// Its light: a row of [`Survey::lights`].
    pub light: u32,
}

/// What no tree can hold.
#[derive(Clone, Debug, thiserror::Error, PartialEq, Eq)]
pub enum SurveyError {
    /// A light that is too far away or too strong for `f32`.
    #[error(transparent)]
    Overflow(#[from] LightOverflow),
    /// Lights that change, in so many frames.
    #[error(
        "lights that change have more than {most} emitters in all, by frame {frame}; `candelabra build --frames` takes fewer frames"
    )]
    TooMany {
        /// The most that a build takes.
        most: usize,
        /// The frame that is one too many.
        frame: i32,
    },
}

/// The most emitters that change, summed over frames that are unlike.
const MOST_CHANGING: usize = 1 << 27;

/// Surveys a scene for some frames (ascending). If no light changes the frames do not matter.
///
/// # Errors
/// A light that no tree can hold, or too many that change in too many frames.
pub fn survey(scene: &Scene, emitters: &Emitters, frames: &[i32]) -> Result<Survey, SurveyError> {
    survey_within(scene, emitters, frames, MOST_CHANGING)
}

fn survey_within(
    scene: &Scene,
    emitters: &Emitters,
    frames: &[i32],
    most: usize,
) -> Result<Survey, SurveyError> {
    let mut surveyor = Surveyor::new(scene, emitters)?;
    let frames = if surveyor.is_changing() { frames } else { &[] };
    let mut surveyed: Vec<SurveyedFrame> = Vec::with_capacity(frames.len());
    let (mut seen, mut changing) = (HashMap::new(), 0);
    for &number in frames {
        let own = surveyor.shared.len();
        let mut frame = surveyor.frame(number)?;
        match seen.entry(frame.fingerprint) {
            Entry::Vacant(place) => {
                let of_forced = surveyor.shared[own..].iter().map(|light| light.bounds.len());
                changing += frame.group.flat.len() + of_forced.sum::<usize>();
                if changing > most {
                    return Err(SurveyError::TooMany { most, frame: number });
                }
                place.insert(surveyed.len());
            }
            Entry::Occupied(alike) => {
                frame.group = surveyed[*alike.get()].group.clone();
                surveyor.shared.truncate(own);
            }
        }
        surveyed.push(frame);
    }
    // The look of a changing light is that in the first frame.
    let second =
        surveyed.first().map_or(0.0, |frame| scene.timeline.seconds_at(frame.number.into()));
    let pose = scene.pose_at(second);
    let looks = looks(&PosedEmitters { scene, emitters, pose: &pose });
    let Surveyor { shared, still, still_fingerprint, .. } = surveyor;
    let prints = surveyed.iter().map(|frame| (frame.number, frame.fingerprint));
    let fingerprint = fingerprint::of_shot(&still_fingerprint, prints);
    let mut survey = Survey {
        shared,
        still,
        frames: surveyed,
        origin: scene.origin,
        lights: Vec::new(),
        textures: emitters.texture_means().to_vec(),
        fingerprint,
    };
    survey.lights = survey.summaries(emitters, &looks);
    Ok(survey)
}

/// Sum of [`LightRow::CHANGES`], [`LightRow::PLACED`] and [`LightRow::FORCED`].
pub(super) fn class_of(light: &LightEntry) -> u32 {
    let bit = |is: bool, bit: u32| if is { bit } else { 0 };
    bit(light.forced, LightRow::FORCED)
        + bit(light.changes(), LightRow::CHANGES)
        + bit(light.in_own_space || light.forced, LightRow::PLACED)
}

/// How a tree numbers some emitters.
pub(super) fn numbering_of(emitters: &Emitters) -> Numbering {
    let (lights, count) = (emitters.lights(), emitters.len() as u32);
    let first = |class: u32| {
        let row = lights.partition_point(|light| class_of(light) < class);
        lights.get(row).map_or(count, |light| light.first)
    };
    Numbering { first_of_class: [1, 2, 3, 4].map(first), count }
}

impl Group {
    /// The light of a row, if it has a tree of its own.
    fn placed_light(&self, row: u32) -> Option<&PlacedLight> {
        [&self.placed, &self.forced].into_iter().find_map(|list| {
            let found = list.binary_search_by_key(&row, |placed| placed.light).ok()?;
            Some(&list[found])
        })
    }

    /// The bounds of a light that has none.
    fn own_bounds(&self, light: &LightEntry) -> &[LightBounds] {
        let own = &self.flat[(light.first - self.first) as usize..];
        &own[..light.count as usize]
    }
}

impl Survey {
    fn summaries(&self, emitters: &Emitters, looks: &[LightLook]) -> Vec<LightSummary> {
        let summary = |(row, light): (usize, &LightEntry)| {
            let first = match (light.changes(), self.frames.first()) {
                (true, first) => first.map(|frame| &*frame.group),
                (false, _) => Some(&self.still),
            };
            let energy = first.map_or(0.0, |group| match group.placed_light(row as u32) {
                Some(placed) => energy_of(placed, &self.shared),
                None => sum(group.own_bounds(light)),
            });
            LightSummary {
                path: light.path.to_string(),
                fingerprint: self.fingerprint_of(row as u32, light),
                emitter_count: light.count,
                energy: energy.min(f64::from(f32::MAX)) as f32,
                class: class_of(light),
                look: looks[row],
                link: light.link,
            }
        };
        emitters.lights().par_iter().enumerate().map(summary).collect()
    }

    /// Over all that the trees depend on of a light, in all frames.
    fn fingerprint_of(&self, row: u32, light: &LightEntry) -> [u8; 32] {
        let mut hasher = blake3::Hasher::new();
        if self.origin != DVec3::ZERO {
            hasher.update(bytemuck::bytes_of(&self.origin));
        }
        let mut add = |group: &Group| match group.placed_light(row) {
            Some(placed) => fingerprint::hash_placed(placed, &self.shared, &mut hasher),
            None => drop(hasher.update(&fingerprint::of_bounds(group.own_bounds(light)))),
        };
        match light.changes() {
            true => self.frames.iter().for_each(|frame| add(&frame.group)),
            false => add(&self.still),
        }
        *hasher.finalize().as_bytes()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::color::Rgb;
    use crate::scene::{Interpolation, Keys, Light, LightKind, Node, Trs, Visibility};

    /// One lamp that gets brighter until the third second, at one frame a second.
    fn dimmer() -> Scene {
        let values = Keys {
            times_s: vec![0.0, 3.0],
            values: vec![Rgb::ONE, 4.0 * Rgb::ONE],
            interpolation: Interpolation::Linear,
        };
        let mut scene = Scene {
            nodes: vec![Node::fixed("/lamp", None, Trs::default())],
            lights: vec![Light {
                node: 0,
                kind: LightKind::Point { intensity_cd: Rgb::ONE },
                values: Some(values.into()),
                range_m: None,
                forced: false,
                visibility: Visibility::default(),
            }],
            ..Scene::default()
        };
        (scene.timeline.zero_frame, scene.timeline.frames_per_second) = (0.0, 1.0);
        scene
    }

    /// Frames that are alike count once: they share their lights.
    #[test]
    fn too_many_lights_that_change_are_refused_by_frame() {
        let scene = dimmer();
        let emitters = Emitters::collect(&scene);
        let within =
            |frames: &[i32], most| survey_within(&scene, &emitters, frames, most).map(drop);
        assert_eq!(within(&[0, 1, 2, 3, 4, 5, 6], 4), Ok(()));
        let refused = Err(SurveyError::TooMany { most: 3, frame: 3 });
        assert_eq!(within(&[0, 1, 2, 3, 4, 5, 6], 3), refused);
        assert_eq!(within(&[3, 4, 5, 6], 1), Ok(()));
    }

    /// A forced light has a tree of its own in each frame that is unlike.
    #[test]
    fn forced_lights_count_too() {
        let mut scene = dimmer();
        scene.lights[0].forced = true;
        let emitters = Emitters::collect(&scene);
        let within = |most| survey_within(&scene, &emitters, &[0, 1, 2, 3], most).map(drop);
        assert_eq!(within(4), Ok(()));
        assert_eq!(within(1), Err(SurveyError::TooMany { most: 1, frame: 1 }));
    }
}
