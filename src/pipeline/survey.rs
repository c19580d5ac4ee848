//! What a tree depends on: the bounds of all emitters in all frames, and their fingerprints.

use super::look::looks;
use crate::bounds::LightBounds;
use crate::emitter::{
    Emitters, LightEntry, LightOverflow, LightSource, PosedEmitters, TextureMeans,
};
use crate::light_tree::{ALGORITHM_VERSION, LightLook, LightRow, LightSummary};
use crate::math::Similarity;
use crate::scene::{Pose, Posing, Scene};
use glam::DVec3;
use rayon::prelude::*;
use std::ops::Range;

/// Everything that the trees of a shot are built over.
pub struct Survey {
    /// What has a tree of its own, in its own space.
    pub shared: Vec<SharedBounds>,
    /// What stands still, in world space.
    pub still: Group,
    /// What changes, frame by frame; empty if nothing does.
    pub frames: Vec<(i32, Group)>,
    /// Where the origin of all these bounds is in the scene's world, metres.
    pub origin: DVec3,
    /// What the file says of each light.
    pub lights: Vec<LightSummary>,
    /// What emission textures give, by ascending fingerprint. The bounds above follow from it.
    pub textures: Vec<TextureMeans>,
    /// BLAKE3 over all that the trees depend on: the lights above, the frames, and the algorithm that
    /// builds over them.
    pub fingerprint: [u8; 32],
}

/// The bounds of a light that has a tree of its own.
pub struct SharedBounds {
    /// In the order of its emitters.
    pub bounds: Vec<LightBounds>,
    energy: f64,
    fingerprint: [u8; 32],
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

/// Surveys a scene for some frames (ascending). If no light changes the frames do not matter.
///
/// # Errors
/// A light that is too far away or too strong for `f32`.
pub fn survey(scene: &Scene, emitters: &Emitters, frames: &[i32]) -> Result<Survey, LightOverflow> {
    let own = vec![None; emitters.mesh_lights().len()];
    let mut surveyor = Surveyor { scene, emitters, shared: Vec::new(), own };
    let (changing, still): (Vec<u32>, Vec<u32>) = (0..emitters.lights().len() as u32)
        .partition(|&row| emitters.lights()[row as usize].changes());
    let mut posing = Posing::new(scene);
    let pose = scene.pose_at(0.0);
    let still = surveyor.group(&pose, &still)?;
    let frames = if changing.is_empty() { &[] } else { frames };
    let frames = frames
        .iter()
        .map(|&frame| Ok((frame, surveyor.group(posing.at_frame(frame), &changing)?)))
        .collect::<Result<Vec<_>, LightOverflow>>()?;
    let shared = surveyor.shared;
    check_total(emitters, &shared, &still, &frames)?;
    // The look of a changing light is that in the first frame.
    let pose = frames.first().map_or(&pose, |(frame, _)| posing.at_frame(*frame));
    let looks = looks(&PosedEmitters { scene, emitters, pose });
    let lights = summaries(scene, emitters, &looks, &shared, &still, &frames);
    let fingerprint = whole(&lights, &frames);
    let textures = emitters.texture_means().to_vec();
    let origin = scene.origin;
    Ok(Survey { shared, still, frames, origin, lights, textures, fingerprint })
}

struct Surveyor<'a> {
    scene: &'a Scene,
    emitters: &'a Emitters,
    shared: Vec<SharedBounds>,
    /// For each mesh light its row of `shared`, once it is known.
    own: Vec<Option<u32>>,
}

impl Surveyor<'_> {
    /// Some lights, by rows in ascending order: those that stand still, or those that change.
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
            && light.in_own_space
        {
            let (to_local, brightness) =
                posed.placing(row).ok_or_else(|| LightOverflow { path: light.path.clone() })?;
            let shared = match self.own[mesh_light as usize] {
                Some(shared) => shared,
                None => self.share(posed.bounds_in_own_space(mesh_light)?),
            };
            self.own[mesh_light as usize] = Some(shared);
            return Ok(placed(shared, to_local, brightness));
        }
        // A forced light of any other kind has a tree of its own in world space.
        let shared = self.share(posed.bounds(light.first..light.first + light.count)?);
        Ok(placed(shared, Similarity::IDENTITY, 1.0))
    }

    fn share(&mut self, bounds: Vec<LightBounds>) -> u32 {
        let fingerprint = *hash_bounds(&bounds).finalize().as_bytes();
        let energy = sum(&bounds);
        self.shared.push(SharedBounds { bounds, energy, fingerprint });
        self.shared.len() as u32 - 1
    }
}

fn sum(bounds: &[LightBounds]) -> f64 {
    bounds.iter().map(|b| f64::from(b.energy)).sum()
}

fn energy_of(placed: &PlacedLight, shared: &[SharedBounds]) -> f64 {
    shared[placed.shared as usize].energy * f64::from(placed.brightness)
}

/// Clusters store the sum of their leaves' energies, so the sum over a whole frame must fit into `f32`.
fn check_total(
    emitters: &Emitters,
    shared: &[SharedBounds],
    still: &Group,
    frames: &[(i32, Group)],
) -> Result<(), LightOverflow> {
    let of_placed = |group: &Group| group.placed.iter().map(|p| energy_of(p, shared)).sum::<f64>();
    let of_group = |group: &Group| sum(&group.flat) + of_placed(group);
    let most = frames.iter().map(|(_, group)| of_group(group)).fold(0.0, f64::max);
    // Roundings on the way up may add to it.
    let largest = f64::from(f32::MAX) * 0.99;
    if of_group(still) + most <= largest && shared.iter().all(|own| own.energy <= largest) {
        return Ok(());
    }
    let groups = || std::iter::once(still).chain(frames.iter().map(|(_, group)| group));
    let flat = groups().flat_map(|group| {
        (group.first..)
            .zip(&group.flat)
            .map(|(emitter, b)| (emitters.get(emitter).light, f64::from(b.energy)))
    });
    let placed = groups()
        .flat_map(|group| group.placed.iter().chain(&group.forced))
        .map(|p| (p.light, energy_of(p, shared).max(shared[p.shared as usize].energy)));
    let strongest = flat.chain(placed).max_by(|a, b| a.1.total_cmp(&b.1));
    let light = strongest.map_or(0, |(light, _)| light);
    Err(LightOverflow { path: emitters.lights()[light as usize].path.clone() })
}

fn summaries(
    scene: &Scene,
    emitters: &Emitters,
    looks: &[LightLook],
    shared: &[SharedBounds],
    still: &Group,
    frames: &[(i32, Group)],
) -> Vec<LightSummary> {
    let placed_of = |group: &Group, row: u32| {
        let all = [&group.placed, &group.forced];
        all.into_iter().find_map(|list| {
            let found = list.binary_search_by_key(&row, |placed| placed.light).ok()?;
            Some(list[found])
        })
    };
    let summary = |(row, light): (usize, &LightEntry)| {
        let groups: Vec<&Group> = match light.changes() {
            true => frames.iter().map(|(_, group)| group).collect(),
            false => vec![still],
        };
        let mut hasher = blake3::Hasher::new();
        if scene.origin != DVec3::ZERO {
            hasher.update(bytemuck::bytes_of(&scene.origin));
        }
        let mut energy = None;
        for group in groups {
            let now = match placed_of(group, row as u32) {
                Some(placed) => {
                    hasher.update(&shared[placed.shared as usize].fingerprint);
                    hasher.update(bytemuck::bytes_of(&placed.to_local));
                    hasher.update(&placed.brightness.to_le_bytes());
                    energy_of(&placed, shared)
                }
                None => {
                    let own = &group.flat[(light.first - group.first) as usize..];
                    let own = &own[..light.count as usize];
                    hasher.update(hash_bounds(own).finalize().as_bytes());
                    sum(own)
                }
            };
            energy.get_or_insert(now);
        }
        let bit = |is: bool, bit: u32| if is { bit } else { 0 };
        LightSummary {
            path: light.path.clone(),
            fingerprint: *hasher.finalize().as_bytes(),
            emitter_count: light.count,
            energy: energy.unwrap_or(0.0).min(f64::from(f32::MAX)) as f32,
            class: bit(light.forced, LightRow::FORCED)
                + bit(light.changes(), LightRow::CHANGES)
                + bit(light.in_own_space || light.forced, LightRow::PLACED),
            look: looks[row],
        }
    };
    emitters.lights().par_iter().enumerate().map(summary).collect()
}

/// Over every number of some bounds.
fn hash_bounds(bounds: &[LightBounds]) -> blake3::Hasher {
    let mut hasher = blake3::Hasher::new();
    let mut bytes = Vec::with_capacity(size_of_val(bounds));
    for LightBounds { aabb, cone, energy, range_m } in bounds {
        for vector in [aabb.min, aabb.max, cone.axis] {
            bytes.extend_from_slice(bytemuck::bytes_of(&vector));
        }
        let numbers = [cone.theta_o, cone.theta_e, *energy, *range_m];
        bytes.extend_from_slice(bytemuck::bytes_of(&numbers));
        bytes.push(cone.two_sided.into());
    }
    hasher.update(&(bounds.len() as u64).to_le_bytes());
    hasher.update(&bytes);
    hasher
}

fn whole(lights: &[LightSummary], frames: &[(i32, Group)]) -> [u8; 32] {
    let mut bytes = ALGORITHM_VERSION.to_le_bytes().to_vec();
    for light in lights {
        bytes.extend_from_slice(&(light.path.len() as u64).to_le_bytes());
        bytes.extend_from_slice(light.path.as_bytes());
        bytes.extend_from_slice(&light.class.to_le_bytes());
        bytes.extend_from_slice(&light.fingerprint);
    }
    for (frame, _) in frames {
        bytes.extend_from_slice(&frame.to_le_bytes());
    }
    *blake3::Hasher::new().update_rayon(&bytes).finalize().as_bytes()
}
