//! Surveys a shot frame by frame: what stands still once, then what changes.

use super::fingerprint;
use super::survey::{Group, PlacedLight, SharedBounds, SurveyedFrame};
use super::swept::Swept;
use crate::bounds::LightBounds;
use crate::emitter::{Emitters, LightEntry, LightOverflow, LightSource, PosedEmitters};
use crate::math::Similarity;
use crate::scene::{Pose, Posing, Scene};
use std::iter::once;
use std::ops::Range;
use std::sync::Arc;

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
        surveyor.still = surveyor.group(&pose, &standing)?;
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
        let group = self.group_over(&self.scene.times_of_all(number), &mut posing, &changing);
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

    /// Some lights over some times, by rows in ascending order.
    fn group_over(
        &mut self,
        times: &[f64],
        posing: &mut Posing,
        rows: &[u32],
    ) -> Result<Group, LightOverflow> {
        let own = self.shared.len();
        let mut group = self.group(posing.at_frame(times[0]), rows)?;
        if times.len() == 1 {
            return Ok(group);
        }
        let of_shared = |shared: &mut SharedBounds| Swept::new(std::mem::take(&mut shared.bounds));
        let mut flat = Swept::new(std::mem::take(&mut group.flat));
        let mut forced: Vec<Swept> = self.shared[own..].iter_mut().map(of_shared).collect();
        let brightness = |group: &Group| {
            let all = group.placed.iter().chain(&group.forced);
            all.map(|placed| f64::from(placed.brightness)).collect::<Vec<f64>>()
        };
        let mut bright = brightness(&group);
        for &time in &times[1..] {
            let kept = self.shared.len();
            let at = self.group(posing.at_frame(time), rows)?;
            flat.add(&at.flat);
            forced.iter_mut().zip(&self.shared[kept..]).for_each(|(own, at)| own.add(&at.bounds));
            bright.iter_mut().zip(brightness(&at)).for_each(|(sum, own)| *sum += own);
            self.shared.truncate(kept);
        }
        group.flat = flat.over(times.len());
        for (row, swept) in (own..).zip(forced) {
            self.shared[row] = SharedBounds::new(swept.over(times.len()));
        }
        let all = group.placed.iter_mut().chain(&mut group.forced);
        all.zip(bright).for_each(|(placed, sum)| {
            placed.brightness = (sum / times.len() as f64) as f32;
        });
        Ok(group)
    }

    /// Some lights in a pose, by rows in ascending order: those that stand still, or those that change.
    fn group(&mut self, pose: &Pose, rows: &[u32]) -> Result<Group, LightOverflow> {
        let Surveyor { scene, emitters, .. } = *self;
        let posed = PosedEmitters { scene, emitters, pose };
        let mut flat: Option<Range<u32>> = None;
        let mut group = Group::default();
        for &row in rows {
            let light = &emitters.lights()[row as usize];
            let of_light = light.first..light.first + light.count;
            if light.in_own_space || light.forced {
                let placed = self.place(&posed, row, light)?;
                if light.forced { &mut group.forced } else { &mut group.placed }.push(placed);
            } else {
                flat = Some(flat.map_or(of_light.clone(), |flat| flat.start..of_light.end));
            }
        }
        let flat = flat.unwrap_or(0..0);
        group.first = flat.start;
        group.flat = posed.bounds(flat)?;
        Ok(group)
    }

    fn place(
        &mut self,
        posed: &PosedEmitters,
        row: u32,
        light: &LightEntry,
    ) -> Result<PlacedLight, LightOverflow> {
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
            let (to_local, brightness) =
                posed.placing(row).ok_or_else(|| LightOverflow { path: light.path.to_string() })?;
            return Ok(placed(shared, to_local, brightness));
        }
        // A forced light of any other kind has a tree of its own in world space.
        let shared = self.share(posed.bounds(light.first..light.first + light.count)?);
        Ok(placed(shared, Similarity::IDENTITY, 1.0))
    }

    fn share(&mut self, bounds: Vec<LightBounds>) -> u32 {
        self.shared.push(SharedBounds::new(bounds));
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
        Err(LightOverflow { path: self.emitters.lights()[light as usize].path.to_string() })
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
