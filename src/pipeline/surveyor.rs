//! Surveys a shot frame by frame: what stands still once, then what changes.

use super::fingerprint;
use super::survey::{Group, PlacedLight, SharedBounds, SurveyedFrame};
use crate::bounds::LightBounds;
use crate::emitter::{Emitters, LightEntry, LightOverflow, LightSource, PosedEmitters};
use crate::math::Similarity;
use crate::scene::{Pose, Posing, Scene};
use std::iter::once;
use std::ops::Range;
use std::slice;
use std::sync::Arc;

/// Emitters whose bounds are found together, at all times of a frame.
const TOGETHER: usize = 1 << 12;

/// A shot, of which what stands still has been surveyed.
pub(super) struct Surveyor<'a> {
    scene: &'a Scene,
    emitters: &'a Emitters,
    /// Made with the first frame.
    posing: Option<Posing<'a>>,
    /// Rows of the lights that change.
    changing: Vec<u32>,
    /// What has a tree of its own: first what is there in every frame; then, frame after frame, the forced
    /// lights that are not carried along, as they are then.
    pub shared: Vec<SharedBounds>,
    /// For each mesh light its row of `shared`, if it has one.
    own: Vec<Option<u32>>,
    /// How many rows of `shared` are there in every frame.
    pub lasting: usize,
    pub still: Group,
    still_energy: f64,
    pub still_fingerprint: [u8; 32],
}

impl<'a> Surveyor<'a> {
    /// Surveys what stands still.
    ///
    /// # Errors
    /// A light that is too far away or too strong for `f32`.
    pub fn new(scene: &'a Scene, emitters: &'a Emitters) -> Result<Surveyor<'a>, LightOverflow> {
        let (changing, standing): (Vec<u32>, Vec<u32>) = (0..emitters.lights().len() as u32)
            .partition(|&row| emitters.lights()[row as usize].changes());
        let mut surveyor = Surveyor {
            scene,
            emitters,
            posing: None,
            changing,
            shared: Vec::new(),
            own: vec![None; emitters.mesh_lights().len()],
            lasting: 0,
            still: Group::default(),
            still_energy: 0.0,
            still_fingerprint: [0; 32],
        };
        let pose = scene.pose_at(0.0);
        surveyor.share_meshes(&pose)?;
        surveyor.still = surveyor.group(slice::from_ref(&pose), &standing)?;
        surveyor.lasting = surveyor.shared.len();
        surveyor.still_energy = surveyor.energy_of(&surveyor.still);
        surveyor.check_total(&surveyor.still, 0.0)?;
        let Surveyor { still, shared, .. } = &surveyor;
        surveyor.still_fingerprint = fingerprint::of_still(scene.origin, emitters, still, shared);
        Ok(surveyor)
    }

    /// Whether any light changes.
    pub fn is_changing(&self) -> bool {
        !self.changing.is_empty()
    }

    /// Surveys what changes, in a frame: over all times at which a camera of the scene may see it.
    ///
    /// # Errors
    /// A light that is too far away or too strong for `f32`.
    pub fn frame(&mut self, number: i32) -> Result<SurveyedFrame, LightOverflow> {
        let mut posing = self.posing.take().unwrap_or_else(|| Posing::new(self.scene));
        let changing = std::mem::take(&mut self.changing);
        let group = match *self.scene.times_of_all(number) {
            [time] => self.group(slice::from_ref(posing.at_frame(time)), &changing),
            ref times => {
                let at = |&time: &f64| posing.at_frame(time).clone();
                let poses: Vec<Pose> = times.iter().map(at).collect();
                self.group(&poses, &changing)
            }
        };
        (self.posing, self.changing) = (Some(posing), changing);
        let group = group?;
        self.check_total(&group, self.still_energy)?;
        let fingerprint = fingerprint::of_group(&group, &self.shared);
        Ok(SurveyedFrame { number, group: Arc::new(group), fingerprint })
    }

    /// The same for who looks at one frame at a time: the forced lights of the frame before are let go of.
    ///
    /// # Errors
    /// A light that is too far away or too strong for `f32`.
    pub fn frame_alone(&mut self, number: i32) -> Result<SurveyedFrame, LightOverflow> {
        self.shared.truncate(self.lasting);
        self.frame(number)
    }

    /// Lets go of the bounds that stand still, once their tree is built or compared.
    pub fn forget_still(&mut self) {
        self.still.flat = Vec::new();
        for shared in &mut self.shared[..self.lasting] {
            shared.bounds = Vec::new();
        }
    }

    /// Surveys each mesh light in its own space that is shared or carried along.
    fn share_meshes(&mut self, pose: &Pose) -> Result<(), LightOverflow> {
        let Surveyor { scene, emitters, .. } = *self;
        let posed = PosedEmitters { scene, emitters, pose };
        for light in emitters.lights().iter().filter(|light| light.in_own_space) {
            if let LightSource::Mesh { mesh_light, .. } = light.source
                && self.own[mesh_light as usize].is_none()
            {
                let shared = self.share(posed.bounds_in_own_space(mesh_light)?);
                self.own[mesh_light as usize] = Some(shared);
            }
        }
        Ok(())
    }

    /// Some lights over some poses, by rows in ascending order: those that stand still, or those that change.
    fn group(&mut self, poses: &[Pose], rows: &[u32]) -> Result<Group, LightOverflow> {
        let emitters = self.emitters;
        let mut flat: Option<Range<u32>> = None;
        let mut group = Group::default();
        for &row in rows {
            let light = &emitters.lights()[row as usize];
            let of_light = light.first..light.first + light.count;
            if light.in_own_space || light.forced {
                let placed = self.place(poses, row, light)?;
                if light.forced { &mut group.forced } else { &mut group.placed }.push(placed);
            } else {
                flat = Some(flat.map_or(of_light.clone(), |flat| flat.start..of_light.end));
            }
        }
        let flat = flat.unwrap_or(0..0);
        group.first = flat.start;
        group.flat = self.bounds(poses, flat)?;
        Ok(group)
    }

    /// The bounds of some emitters over some poses, world space.
    fn bounds(&self, poses: &[Pose], range: Range<u32>) -> Result<Vec<LightBounds>, LightOverflow> {
        let Surveyor { scene, emitters, .. } = *self;
        let at = |pose, range| PosedEmitters { scene, emitters, pose }.bounds(range);
        if let [pose] = poses {
            return at(pose, range);
        }
        let mut swept = Vec::with_capacity(range.len());
        for first in range.clone().step_by(TOGETHER) {
            let part = first..range.end.min(first + TOGETHER as u32);
            let at_times = poses.iter().map(|pose| at(pose, part.clone()));
            let at_times = at_times.collect::<Result<Vec<_>, _>>()?;
            let of_emitter = |i: usize| LightBounds::over_time(at_times.iter().map(|all| all[i]));
            swept.extend((0..part.len()).map(of_emitter));
        }
        Ok(swept)
    }

    fn place(
        &mut self,
        poses: &[Pose],
        row: u32,
        light: &LightEntry,
    ) -> Result<PlacedLight, LightOverflow> {
        let Surveyor { scene, emitters, .. } = *self;
        let placed = |shared, to_local, brightness| PlacedLight {
            shared,
            to_local,
            brightness,
            first_emitter: light.first,
            light: row,
        };
        if let LightSource::Mesh { mesh_light, .. } = light.source
            && let Some(shared) = self.own[mesh_light as usize].filter(|_| light.in_own_space)
        {
            // It stands still while a shutter is open, but its strength may change.
            let at = |pose| PosedEmitters { scene, emitters, pose }.placing(row);
            let placings: Option<Vec<_>> = poses.iter().map(at).collect();
            let placings = placings.ok_or_else(|| LightOverflow { path: light.path.clone() })?;
            let sum: f64 = placings.iter().map(|(_, brightness)| f64::from(*brightness)).sum();
            let brightness = (sum / placings.len() as f64) as f32;
            return Ok(placed(shared, placings[0].0, brightness));
        }
        // A forced light of any other kind has a tree of its own in world space.
        let bounds = self.bounds(poses, light.first..light.first + light.count)?;
        let shared = self.share(bounds);
        Ok(placed(shared, Similarity::IDENTITY, 1.0))
    }

    fn share(&mut self, bounds: Vec<LightBounds>) -> u32 {
        let (energy, fingerprint) = (sum(&bounds), fingerprint::of_bounds(&bounds));
        self.shared.push(SharedBounds { bounds, energy, fingerprint });
        self.shared.len() as u32 - 1
    }

    fn energy_of(&self, group: &Group) -> f64 {
        let placed = group.placed.iter().map(|placed| energy_of(placed, &self.shared));
        sum(&group.flat) + placed.sum::<f64>()
    }

    /// Clusters store the sum of their leaves' energies, so the sum over a whole frame must fit into `f32`.
    /// `beside` is the energy that shines besides a group.
    fn check_total(&self, group: &Group, beside: f64) -> Result<(), LightOverflow> {
        // Roundings on the way up may add to it.
        let largest = f64::from(f32::MAX) * 0.99;
        let fits = |own: &SharedBounds| own.energy <= largest;
        if beside + self.energy_of(group) <= largest && self.shared.iter().all(fits) {
            return Ok(());
        }
        let strongest = once(&self.still)
            .chain([group])
            .flat_map(|group| self.energies(group))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        let light = strongest.map_or(0, |(light, _)| light);
        Err(LightOverflow { path: self.emitters.lights()[light as usize].path.clone() })
    }

    /// The lights of a group, emitter by emitter, with the energies that must fit.
    fn energies<'g>(&'g self, group: &'g Group) -> impl Iterator<Item = (u32, f64)> + 'g {
        let flat = (group.first..).zip(&group.flat);
        let flat = flat.map(|(emitter, b)| (self.emitters.get(emitter).light, b.energy.into()));
        let placed = group.placed.iter().chain(&group.forced).map(|placed| {
            let own = self.shared[placed.shared as usize].energy;
            (placed.light, energy_of(placed, &self.shared).max(own))
        });
        flat.chain(placed)
    }
}

pub(super) fn sum(bounds: &[LightBounds]) -> f64 {
    bounds.iter().map(|b| f64::from(b.energy)).sum()
}

pub(super) fn energy_of(placed: &PlacedLight, shared: &[SharedBounds]) -> f64 {
    shared[placed.shared as usize].energy * f64::from(placed.brightness)
}
