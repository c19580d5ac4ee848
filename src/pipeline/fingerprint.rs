//! What of a scene its trees depend on, in 32 bytes: all that stands still once, and what changes frame by
//! frame. Who renders one frame looks at that frame and at what stands still, and at nothing else.

use super::survey::{Group, PlacedLight, SharedBounds, class_of};
use crate::bounds::LightBounds;
use crate::emitter::{Emitters, LightEntry};
use crate::light_tree::ALGORITHM_VERSION;
use blake3::Hasher;
use glam::DVec3;
use rayon::prelude::*;

/// What is hashed by one task.
const TOGETHER: usize = 1 << 12;
/// Bytes laid out at a time.
const MOST_BYTES: usize = 1 << 22;
/// Bytes of bounds: fourteen numbers and a side.
const BOUNDS: usize = 57;

/// Over the shot, by that of what stands still and those of its frames.
pub(super) fn of_shot(still: &[u8; 32], frames: impl Iterator<Item = (i32, [u8; 32])>) -> [u8; 32] {
    let mut hasher = Hasher::new();
    hasher.update(still);
    for (frame, fingerprint) in frames {
        hasher.update(&frame.to_le_bytes());
        hasher.update(&fingerprint);
    }
    *hasher.finalize().as_bytes()
}

/// Over all that does not change: the list of lights, the bounds of those that stand still, and the
/// algorithm that builds over them.
pub(super) fn of_still(
    origin: DVec3,
    emitters: &Emitters,
    still: &Group,
    shared: &[SharedBounds],
) -> [u8; 32] {
    let of_lights = |lights: &[LightEntry]| {
        let mut bytes = Vec::new();
        for light in lights {
            bytes.extend_from_slice(&(light.path.len() as u64).to_le_bytes());
            bytes.extend_from_slice(light.path.as_bytes());
            bytes.extend_from_slice(&class_of(light).to_le_bytes());
            bytes.extend_from_slice(&light.count.to_le_bytes());
        }
        *blake3::hash(&bytes).as_bytes()
    };
    let lists = emitters.lights().par_chunks(TOGETHER).map(of_lights);
    let lists: Vec<[u8; 32]> = lists.collect();
    let mut hasher = Hasher::new();
    hasher.update(&ALGORITHM_VERSION.to_le_bytes());
    hasher.update(bytemuck::bytes_of(&origin));
    hasher.update(&(emitters.lights().len() as u64).to_le_bytes());
    hasher.update(lists.as_flattened());
    hasher.update(&of_group(still, shared));
    if !emitters.link_sets().is_empty() {
        let links: Vec<u32> = emitters.lights().iter().map(|light| light.link).collect();
        hasher.update(bytemuck::cast_slice(&links));
    }
    *hasher.finalize().as_bytes()
}

/// Over lights that are sampled together.
pub(super) fn of_group(group: &Group, shared: &[SharedBounds]) -> [u8; 32] {
    let mut hasher = Hasher::new();
    hasher.update(&group.first.to_le_bytes());
    hasher.update(&of_bounds(&group.flat));
    for list in [&group.placed, &group.forced] {
        hasher.update(&(list.len() as u64).to_le_bytes());
        for placed in list {
            hasher.update(&placed.first_emitter.to_le_bytes());
            hash_placed(placed, shared, &mut hasher);
        }
    }
    *hasher.finalize().as_bytes()
}

/// Over a light with a tree of its own, and where it is.
pub(super) fn hash_placed(placed: &PlacedLight, shared: &[SharedBounds], hasher: &mut Hasher) {
    hasher.update(&shared[placed.shared as usize].fingerprint);
    hasher.update(bytemuck::bytes_of(&placed.to_local));
    hasher.update(&placed.brightness.to_le_bytes());
}

/// Over every number of some bounds.
pub(super) fn of_bounds(bounds: &[LightBounds]) -> [u8; 32] {
    let mut hasher = Hasher::new();
    hasher.update(&(bounds.len() as u64).to_le_bytes());
    // Most lights are one emitter.
    if let [one] = bounds {
        hasher.update(&bytes_of(one));
    } else {
        for part in bounds.chunks(MOST_BYTES / BOUNDS) {
            let bytes: Vec<[u8; BOUNDS]> =
                part.par_iter().with_min_len(TOGETHER).map(bytes_of).collect();
            hasher.update_rayon(bytes.as_flattened());
        }
    }
    *hasher.finalize().as_bytes()
}

fn bytes_of(bounds: &LightBounds) -> [u8; BOUNDS] {
    let LightBounds { aabb, cone, energy, share, range_m } = bounds;
    let mut bytes = [0; BOUNDS];
    let numbers: [[f32; 3]; 4] = [
        aabb.min.to_array(),
        aabb.max.to_array(),
        cone.axis.to_array(),
        [cone.theta_o, cone.theta_e, *energy],
    ];
    bytes[..48].copy_from_slice(bytemuck::cast_slice(&numbers));
    bytes[48..52].copy_from_slice(&range_m.to_le_bytes());
    bytes[52..56].copy_from_slice(&share.to_le_bytes());
    bytes[56] = cone.two_sided.into();
    bytes
}
