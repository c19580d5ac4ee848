//! What a tree depends on: the bounds of all emitters in all frames, and their fingerprints.

use crate::bounds::LightBounds;
use crate::emitter::{Emitters, LightOverflow, PosedEmitters};
use crate::light_tree::{ALGORITHM_VERSION, LightSummary};
use crate::scene::Scene;
use rayon::prelude::*;

/// Everything that the trees of a shot are built over.
pub struct Survey {
    /// Bounds of the emitters that stand still.
    pub fixed: Vec<LightBounds>,
    /// For each frame, the bounds of the emitters that move; empty if none does.
    pub moving: Vec<(i32, Vec<LightBounds>)>,
    /// What the file says of each light.
    pub lights: Vec<LightSummary>,
    /// Of all of the above, and of the algorithm that builds over it.
    pub fingerprint: [u8; 32],
}

/// Surveys a scene for some frames (ascending). If no light moves the frames do not matter.
///
/// # Errors
/// A light that is too far away or too strong for `f32`.
pub fn survey(scene: &Scene, emitters: &Emitters, frames: &[i32]) -> Result<Survey, LightOverflow> {
    let at = |frame: i32| scene.pose_at(scene.timeline.seconds_at(f64::from(frame)));
    let still = scene.pose_at(0.0);
    let fixed = PosedEmitters { scene, emitters, pose: &still }.bounds(false)?;
    let any_moves = emitters.static_count() < emitters.len();
    let moving = if any_moves { frames } else { &[] }
        .iter()
        .map(|&frame| {
            let pose = at(frame);
            Ok((frame, PosedEmitters { scene, emitters, pose: &pose }.bounds(true)?))
        })
        .collect::<Result<Vec<_>, LightOverflow>>()?;
    check_total(emitters, &fixed, &moving)?;
    let lights = summaries(emitters, &fixed, &moving);
    let fingerprint = whole(&lights, &moving);
    Ok(Survey { fixed, moving, lights, fingerprint })
}

/// Clusters hold the sum of their energies: that of a whole frame must be a number too.
fn check_total(
    emitters: &Emitters,
    fixed: &[LightBounds],
    moving: &[(i32, Vec<LightBounds>)],
) -> Result<(), LightOverflow> {
    let sum = |bounds: &[LightBounds]| bounds.iter().map(|b| f64::from(b.energy)).sum::<f64>();
    let most = moving.iter().map(|(_, bounds)| sum(bounds)).fold(0.0, f64::max);
    // Roundings on the way up may add to it.
    if sum(fixed) + most <= f64::from(f32::MAX) * 0.99 {
        return Ok(());
    }
    let numbered = |first: u32, bounds: &[LightBounds]| {
        (first..).zip(bounds.iter().map(|b| b.energy)).collect::<Vec<_>>()
    };
    let mut all = numbered(0, fixed);
    all.extend(moving.iter().flat_map(|(_, bounds)| numbered(fixed.len() as u32, bounds)));
    let strongest = all.into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
    let emitter = strongest.map_or(0, |(emitter, _)| emitter);
    Err(LightOverflow { path: emitters.light_of(emitter).path.clone() })
}

fn summaries(
    emitters: &Emitters,
    fixed: &[LightBounds],
    moving: &[(i32, Vec<LightBounds>)],
) -> Vec<LightSummary> {
    let split = emitters.static_count();
    let summary = |light: &crate::emitter::LightEntry| {
        let (first, count) = (light.first as usize, light.count as usize);
        let runs: Vec<&[LightBounds]> = if light.moves {
            moving.iter().map(|(_, bounds)| &bounds[first - split..][..count]).collect()
        } else {
            vec![&fixed[first..][..count]]
        };
        let energy = |bounds: &LightBounds| f64::from(bounds.energy);
        LightSummary {
            path: light.path.clone(),
            fingerprint: fingerprint_of(&runs),
            emitter_count: light.count,
            energy: runs.first().map_or(0.0, |run| run.iter().map(energy).sum::<f64>() as f32),
            moves: light.moves,
        }
    };
    emitters.lights().par_iter().map(summary).collect()
}

/// Over every number of the bounds, frame after frame.
fn fingerprint_of(runs: &[&[LightBounds]]) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    let mut bytes = Vec::new();
    for run in runs {
        bytes.clear();
        for LightBounds { aabb, cone, energy } in *run {
            for vector in [aabb.min, aabb.max, cone.axis] {
                bytes.extend_from_slice(bytemuck::bytes_of(&vector));
            }
            bytes.extend_from_slice(bytemuck::bytes_of(&[cone.theta_o, cone.theta_e, *energy]));
            bytes.push(cone.two_sided.into());
        }
        hasher.update(&(run.len() as u64).to_le_bytes());
        hasher.update(&bytes);
    }
    *hasher.finalize().as_bytes()
}

fn whole(lights: &[LightSummary], moving: &[(i32, Vec<LightBounds>)]) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&ALGORITHM_VERSION.to_le_bytes());
    for light in lights {
        hasher.update(&(light.path.len() as u64).to_le_bytes());
        hasher.update(light.path.as_bytes());
        hasher.update(&[light.moves.into()]);
        hasher.update(&light.fingerprint);
    }
    for (frame, _) in moving {
        hasher.update(&frame.to_le_bytes());
    }
    *hasher.finalize().as_bytes()
}
