//! A camera's lens: sharp in the plane of focus, and blurred by the right disk elsewhere.

use crate::stage::{Stage, at, direct, glow};
use candelabra::render::RenderSettings;
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

const RADIUS: f64 = 0.1;
const FOCUS: f64 = 2.0;
const COLUMNS: u32 = 64;
/// Slope of the rays at the picture's edge.
const EDGE: f64 = 0.1;

/// The columns of a picture of a card that shines right of the middle, so far before the camera.
fn columns(distance: f64) -> Vec<f64> {
    let mut stage = Stage::default();
    stage.quad([10.0; 2], glow(Vec3::ONE), at(DVec3::new(5.0, 0.0, -distance)));
    let camera = stage.look(DVec3::ZERO, -DVec3::Z, 2.0 * EDGE.atan() as f32);
    (camera.lens_radius_m, camera.focus_distance_m) = (RADIUS as f32, FOCUS as f32);
    let buffers = stage.render(&RenderSettings { depth: 0, ..direct(COLUMNS, 64) });
    let beauty: Vec<Vec3> = buffers.beauty().collect();
    let column = |x: u32| {
        let rows = (0..COLUMNS).map(|y| beauty[(y * COLUMNS + x) as usize].x);
        rows.map(f64::from).sum::<f64>() / f64::from(COLUMNS)
    };
    (0..COLUMNS).map(column).collect()
}

/// The share of a unit disk left of `x`.
fn share_of_disk(x: f64) -> f64 {
    let x = x.clamp(-1.0, 1.0);
    0.5 + (x * (1.0 - x * x).sqrt() + x.asin()) / PI
}

#[test]
fn an_edge_in_focus_is_sharp() {
    for (x, value) in columns(FOCUS).into_iter().enumerate() {
        assert_eq!(value, if x < COLUMNS as usize / 2 { 0.0 } else { 1.0 }, "column {x}");
    }
}

#[test]
fn an_edge_out_of_focus_is_blurred_by_the_lens() {
    for distance in [3.0, 1.25] {
        // A ray of slope s from x on the lens is at s d + x (1 - d / focus) in the card's plane.
        let reach = RADIUS * (distance / FOCUS - 1.0f64).abs();
        for (x, value) in columns(distance).into_iter().enumerate() {
            let lit = |part: u32| {
                let column = x as f64 + (f64::from(part) + 0.5) / 16.0;
                let slope = EDGE * (2.0 * column / f64::from(COLUMNS) - 1.0);
                share_of_disk(slope * distance / reach)
            };
            let expected = (0..16).map(lit).sum::<f64>() / 16.0;
            assert!(
                (value - expected).abs() < 0.01,
                "{distance} m, column {x}: {value} {expected}"
            );
        }
    }
}
