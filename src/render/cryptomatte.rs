//! Cryptomatte: ids and coverages of the prims that a pixel sees.
//!
//! After the Cryptomatte specification, version 1.2.0 (Friedman and Jones, Psyop, 2015 to 2018). A prim's
//! id is the MurmurHash3 of its path. Pairs of id and coverage, the largest coverage first, fill the
//! channels of a few layers. The manifest tells the paths; here it has those that the picture shows.

use super::buffers::RenderBuffers;
use super::layers::Aov;
use super::rays::HitSurface;
use crate::scene::Scene;
use std::collections::{BTreeMap, HashSet};

/// Name of the matte, which its layers' names begin with.
pub const NAME: &str = "CryptoObject";
/// Layers; each has two pairs.
pub const LEVELS: usize = 3;
const PAIRS: usize = 2 * LEVELS;

/// The ids of a scene's prims.
pub struct ObjectIds {
    /// By row of [`Scene::instances`].
    instances: Vec<u32>,
    /// By row of [`Scene::lights`]: those that are spheres can be seen.
    lights: Vec<u32>,
}

impl ObjectIds {
    /// Hashes all paths.
    pub fn new(scene: &Scene) -> ObjectIds {
        let instances = scene.instances.iter().map(|instance| id_of(&instance.path)).collect();
        let lights = (0..scene.lights.len()).map(|row| id_of(scene.light_path(row))).collect();
        ObjectIds { instances, lights }
    }

    /// The id of what a ray has hit.
    pub fn of(&self, surface: &HitSurface) -> u32 {
        match *surface {
            HitSurface::Triangle { instance, .. } => self.instances[instance as usize],
            HitSurface::Sphere { light } => self.lights[light as usize],
        }
    }

    /// The manifest of a finished picture: `{"path": "id", ...}`, ids as eight hexadecimal digits.
    pub fn manifest(&self, scene: &Scene, buffers: &RenderBuffers) -> String {
        let mut seen: HashSet<u32> = HashSet::new();
        let mut channel = 0;
        for layer in buffers.layers() {
            if layer.aov == Aov::Cryptomatte {
                seen.extend(buffers.plane(channel).map(f32::to_bits));
                seen.extend(buffers.plane(channel + 2).map(f32::to_bits));
            }
            channel += layer.channels.len();
        }
        let instances = scene.instances.iter().map(|instance| &*instance.path);
        let lights = (0..scene.lights.len()).map(|row| scene.light_path(row));
        let ids = self.instances.iter().chain(&self.lights);
        let names: BTreeMap<&str, String> = instances
            .chain(lights)
            .zip(ids)
            .filter(|(_, id)| seen.contains(id))
            .map(|(path, id)| (path, format!("{id:08x}")))
            .collect();
        serde_json::to_string(&names).unwrap_or_default()
    }
}

/// How often each prim was seen through a pixel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Coverage(Vec<(u32, u32)>);

impl Coverage {
    /// From ids and counts, in the order in which they were first seen.
    pub fn of_pairs(pairs: Vec<(u32, u32)>) -> Coverage {
        Coverage(pairs)
    }

    /// Ids and counts, in the order in which they were first seen.
    pub fn pairs(&self) -> &[(u32, u32)] {
        &self.0
    }

    /// Counts a sample.
    pub fn add(&mut self, id: u32) {
        match self.0.iter_mut().find(|(own, _)| *own == id) {
            Some((_, count)) => *count += 1,
            None => self.0.push((id, 1)),
        }
    }

    /// The pairs of the largest coverages, of `samples` in all: id, coverage, id, coverage, ...
    pub fn ranked(&self, samples: u32) -> [f32; 2 * PAIRS] {
        let mut sorted = self.0.clone();
        sorted.sort_unstable_by_key(|&(id, count)| (std::cmp::Reverse(count), id));
        let mut values = [0.0; 2 * PAIRS];
        for (pair, (id, count)) in values.chunks_mut(2).zip(&sorted) {
            pair[0] = f32::from_bits(*id);
            pair[1] = (f64::from(*count) / f64::from(samples.max(1))) as f32;
        }
        values
    }
}

/// The attributes that a file needs beside the channels: names and values.
pub fn attributes(manifest: &str) -> [(String, String); 4] {
    let key = format!("{:08x}", murmur3(NAME.as_bytes()));
    [
        ("conversion", "uint32_to_float32"),
        ("hash", "MurmurHash3_32"),
        ("manifest", manifest),
        ("name", NAME),
    ]
    .map(|(name, value)| (format!("cryptomatte/{}/{name}", &key[..7]), value.to_string()))
}

/// The id of a name: its hash, made a normal float as the specification says.
fn id_of(name: &str) -> u32 {
    let hash = murmur3(name.as_bytes());
    let exponent = hash >> 23 & 255;
    if exponent == 0 || exponent == 255 { hash ^ 1 << 23 } else { hash }
}

/// MurmurHash3_x86_32 with seed 0 (Appleby, public domain).
fn murmur3(bytes: &[u8]) -> u32 {
    let mix = |word: u32| word.wrapping_mul(0xcc9e_2d51).rotate_left(15).wrapping_mul(0x1b87_3593);
    let mut hash = 0u32;
    let mut words = bytes.chunks_exact(4);
    for word in &mut words {
        hash ^= mix(u32::from_le_bytes([word[0], word[1], word[2], word[3]]));
        hash = hash.rotate_left(13).wrapping_mul(5).wrapping_add(0xe654_6b64);
    }
    let rest = words.remainder().iter().rev().fold(0, |rest, byte| rest << 8 | u32::from(*byte));
    hash ^= mix(rest) ^ bytes.len() as u32;
    hash = (hash ^ hash >> 16).wrapping_mul(0x85eb_ca6b);
    hash = (hash ^ hash >> 13).wrapping_mul(0xc2b2_ae35);
    hash ^ hash >> 16
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Test vectors of MurmurHash3_x86_32, and the specification's own example.
    #[test]
    fn hashes_are_those_of_the_specification() {
        assert_eq!(murmur3(b""), 0);
        assert_eq!(murmur3(b"test"), 0xba6b_d213);
        assert_eq!(murmur3(b"Hello, world!"), 0xc036_3e43);
        assert_eq!(murmur3(b"The quick brown fox jumps over the lazy dog"), 0x2e4f_f723);
        assert_eq!(id_of("hello"), 0x248b_fa47);
    }

    #[test]
    fn every_id_is_a_normal_float() {
        for i in 0..100_000 {
            assert!(f32::from_bits(id_of(&format!("/World/lamp_{i}"))).is_normal());
        }
    }

    #[test]
    fn larger_coverages_come_first_and_ties_are_settled() {
        let mut coverage = Coverage::default();
        [7, 9, 7, 8, 8, 5].iter().for_each(|&id| coverage.add(id));
        let values = coverage.ranked(8);
        let ids: Vec<u32> = values.iter().step_by(2).map(|id| id.to_bits()).collect();
        assert_eq!(ids, [7, 8, 5, 9, 0, 0]);
        assert_eq!(values[1..].iter().step_by(2).sum::<f32>(), 0.75);
    }
}
