//! Suns and domes, which no tree holds.

use super::card::Kind;
use super::light::{Light, Profile, Row};
use super::profile::{add_texture, short, with_filters};
use super::scene_side::kind;
use crate::emitter::infinite_lights;
use crate::light_tree::{LightLook, LightRow};
use crate::scene::{Keys, LightKind, Pose, Posing, Response, Scene};
use glam::Vec3;
use std::collections::HashMap;

/// A light at infinity that shines in some frame.
pub(super) struct Infinite {
    /// Its row in [`Scene::lights`].
    pub light: u32,
    fingerprint: [u8; 32],
    class: u32,
    kind: Kind,
    color: [u16; 3],
    illuminance_lux: f32,
    profile: Profile,
}

/// The infinite lights of a scene, as they are in `pose`. Their fingerprints cover all of `frames`.
pub(super) fn find(scene: &Scene, pose: &Pose, frames: &[i32]) -> Vec<Infinite> {
    let shining = infinite_lights(scene, pose);
    let illuminance: HashMap<usize, f64> =
        shining.iter().map(|light| (light.light, light.importance(Vec3::ZERO))).collect();
    let ways = ways(scene, frames);
    let lights = scene.lights.iter().enumerate().filter(|&(row, light)| {
        light.kind.is_infinite() && scene.peak_rgb_of_light(row as u32).max_element() > 0.0
    });
    let found = lights.map(|(row, light)| {
        let rgb = scene.rgb_of_light(row as u32, pose);
        let way = ways.get(&light.node);
        let (moves, varies) = (way.is_some(), light.values.as_deref().is_some_and(Keys::varies));
        let profile = profile(scene, &light.kind);
        let filters = scene.light_filters.of_light(row as u32);
        let pattern = with_filters(profile.pattern, scene, pose, filters);
        let response = scene.light_responses.of_light(row as u32);
        let profile = Profile { pattern, response, ..profile };
        let mut hasher = blake3::Hasher::new();
        hasher.update(&profile.pattern.to_le_bytes());
        hasher.update(&profile.half_angle_rad.unwrap_or(0.0).to_le_bytes());
        let Response { diffuse, specular } = response;
        hasher.update(bytemuck::bytes_of(&[diffuse, specular]));
        hasher.update(bytemuck::bytes_of(&rgb));
        hasher.update(bytemuck::bytes_of(&pose.world(light.node).matrix3.to_cols_array()));
        if let Some(keys) = light.values.as_deref().filter(|keys| keys.varies()) {
            // Frame by frame: which second a frame is says nothing of the light.
            for &frame in frames {
                let time_s = scene.timeline.seconds_at(frame.into());
                let rgb = keys.at(time_s, scene.timeline).as_vec3();
                hasher.update(bytemuck::bytes_of(&rgb));
            }
        }
        hasher.update(way.map_or(&[], |way| way.as_slice()));
        let bit = |is: bool, bit: u32| if is { bit } else { 0 };
        Infinite {
            light: row as u32,
            fingerprint: *hasher.finalize().as_bytes(),
            class: bit(light.forced, LightRow::FORCED) + bit(moves || varies, LightRow::CHANGES),
            kind: kind(&light.kind),
            color: LightLook::new(0, rgb).color,
            illuminance_lux: illuminance.get(&row).copied().unwrap_or(0.0) as f32,
            profile,
        }
    });
    found.collect()
}

/// A hash of the orientations over all frames, for each moving node with an infinite light. The scene
/// is posed once a frame for all of them.
fn ways(scene: &Scene, frames: &[i32]) -> HashMap<u32, [u8; 32]> {
    let moving = scene.moving_nodes();
    let infinite = scene.lights.iter().filter(|light| light.kind.is_infinite());
    let nodes = infinite.map(|light| light.node).filter(|&node| moving[node as usize]);
    let mut ways: HashMap<u32, blake3::Hasher> =
        nodes.map(|node| (node, blake3::Hasher::new())).collect();
    let mut posing = Posing::new(scene);
    for &frame in if ways.is_empty() { &[] } else { frames } {
        let pose = posing.at_frame(f64::from(frame));
        for (&node, way) in &mut ways {
            way.update(bytemuck::bytes_of(&pose.world(node).matrix3.to_cols_array()));
        }
    }
    ways.into_iter().map(|(node, way)| (node, *way.finalize().as_bytes())).collect()
}

/// The picture of a dome, the size of a sun.
fn profile(scene: &Scene, kind: &LightKind) -> Profile {
    match *kind {
        LightKind::Dome { texture: Some(texture), .. } => {
            let mut hasher = blake3::Hasher::new();
            add_texture(&mut hasher, &scene.textures[texture as usize]);
            Profile { pattern: short(&hasher), ..Profile::default() }
        }
        LightKind::Distant { angle_rad, .. } => {
            Profile { half_angle_rad: Some(0.5 * angle_rad), ..Profile::default() }
        }
        _ => Profile::default(),
    }
}

impl Infinite {
    /// The light in the form in which it is matched. `row` is its index among the infinite lights.
    pub fn as_light<'a>(&self, scene: &'a Scene, row: u32) -> Light<'a> {
        Light {
            path: scene.light_path(self.light as usize),
            row: Row::Infinite(row),
            fingerprint: self.fingerprint,
            class: self.class,
            kind: Some(self.kind),
            color: self.color,
            energy: self.illuminance_lux,
            emitters: 0,
            link: 0,
            profile: self.profile,
        }
    }
}
