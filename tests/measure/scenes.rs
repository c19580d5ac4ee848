//! The talk's scenes in small: as many lights as a test can enumerate, in the same arrangements.

use crate::stage::{Stage, aimed, at, facing, glow, lambert};
use candelabra::scene::{LightKind, Mesh, Shaping};
use glam::{DVec3, Vec3};

/// A floor with balls on it, seen from the side and above.
fn floor() -> Stage {
    let mut stage = Stage::default();
    stage.quad([24.0; 2], lambert(Vec3::splat(0.5)), facing(DVec3::ZERO, DVec3::Y));
    for i in 0..9 {
        let place = DVec3::new(f64::from(i % 3 - 1) * 2.5, 0.3, f64::from(i / 3 - 1) * 2.5);
        stage.ball(0.3, 4, lambert(Vec3::splat(0.4)), at(place));
    }
    stage.look((0.0, 4.6, 9.0), (0.0, 0.0, 0.75), 0.7);
    stage
}

/// Place `share` along a spiral that winds inwards and upwards, three turns.
fn spiral(share: f64) -> DVec3 {
    let radius = (5.4_f64.powi(2) + (0.25 - 5.4_f64.powi(2)) * share).sqrt();
    let inwards = (5.4 - radius) / 4.9;
    let turn = 6.0 * std::f64::consts::PI * inwards;
    DVec3::new(radius * turn.cos(), 0.4 + 1.2 * inwards.powi(5), radius * turn.sin())
}

/// Point lights in a spiral.
pub fn spiral_points(count: u32) -> Stage {
    let mut stage = floor();
    for i in 0..count {
        let share = (f64::from(i) + 0.5) / f64::from(count);
        let intensity_cd = Vec3::new(1.0, 0.4, 0.2).lerp(Vec3::new(0.3, 0.6, 1.0), share as f32);
        stage.light(LightKind::Point { intensity_cd }, at(spiral(share)));
    }
    stage
}

/// A ribbon along the spiral that shines from one side.
pub fn spiral_mesh(segments: u32) -> Stage {
    let mut stage = floor();
    let corner = |i: u32, side: f64| {
        let place = spiral(f64::from(i) / f64::from(segments));
        (place + DVec3::Y * (0.1 + 0.12 * side)).as_vec3()
    };
    let positions = (0..=segments).flat_map(|i| [corner(i, -1.0), corner(i, 1.0)]).collect();
    let strip = |i: u32| [[2 * i, 2 * i + 1, 2 * i + 3], [2 * i, 2 * i + 3, 2 * i + 2]];
    let triangles = (0..segments).flat_map(strip).collect();
    let ribbon = Mesh { positions, triangles, ..Default::default() };
    stage.mesh(ribbon, glow(Vec3::new(4.0, 3.0, 2.0)), at(DVec3::ZERO));
    stage
}

/// Lamps of several kinds over the floor, behind walls that hide most of them from most places.
pub fn lamps(count: u32) -> Stage {
    let mut stage = floor();
    for i in -2..=2 {
        let place = DVec3::new(f64::from(i) * 2.5 + 1.2, 1.0, 0.0);
        stage.quad([4.0, 2.0], lambert(Vec3::splat(0.6)), facing(place, place + DVec3::X));
    }
    for i in 0..count {
        // Spread evenly, by a lattice of rank 1.
        let along = f64::from(i) / f64::from(count) * 12.0 - 6.0;
        let across = (f64::from(i) * 0.618_034).fract() * 12.0 - 6.0;
        let place = DVec3::new(along, 0.5 + f64::from(i % 5) * 0.4, across);
        let strength = 0.5 + (i % 7) as f32;
        match i % 4 {
            0 => {
                let shape = glow(Vec3::splat(8.0 * strength));
                stage.quad([0.4, 0.2], shape, facing(place, place - DVec3::Y));
            }
            1 => {
                let radiance_nits = Vec3::splat(20.0 * strength);
                let kind = LightKind::Sphere { radiance_nits, radius: 0.05, shaping: None };
                stage.light(kind, at(place));
            }
            2 => {
                let shaping = Shaping::Khr { inner_rad: 0.3, outer_rad: 0.7 };
                let kind = LightKind::Spot { intensity_cd: Vec3::splat(strength), shaping };
                stage.light(kind, aimed(place, place + DVec3::new(0.3, -1.0, 0.2)));
            }
            _ => {
                let kind = LightKind::Point { intensity_cd: Vec3::splat(0.3 * strength) };
                stage.light(kind, at(place));
            }
        }
    }
    stage
}
