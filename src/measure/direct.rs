//! Direct light in a coarse picture, without noise.
//!
//! At one point of each pixel all lights are enumerated, as for the [probes](super::at_probes). The
//! same pixel of two versions of a scene has the same ray, so what differs between their pictures is
//! what changed.

use super::contributions::reflected;
use crate::light_tree::{NoSuchFrame, Picked};
use crate::render::RenderDelegate;
use crate::render::path::{Integrator, Vertex};
use rayon::prelude::*;

/// Points of a dome, or of a sun, along a square lattice over it. Of an emitter the middle will do.
const POINTS_AT_INFINITY: u32 = 8;

/// What the first surface behind each pixel of a delegate's picture reflects of all lights, as
/// luminance in nits, row after row; `None` where no surface is that reflects. What stands in a light's
/// way counts only with `visibility`, by a ray to the middle of each emitter.
///
/// # Errors
/// If the tree lacks the frame.
pub fn direct_light<D: AsRef<[u8]> + Sync>(
    delegate: &RenderDelegate<D>,
    frame: i32,
    visibility: bool,
) -> Result<Vec<Option<f32>>, NoSuchFrame> {
    delegate.at_frame(frame, |integrator| {
        let (width, height) = (integrator.settings.width, integrator.settings.height);
        let pixel = |i: u32| {
            let vertex = integrator.probe(i % width, i / width, 0, 0)?;
            Some(of_all(integrator, &vertex, visibility))
        };
        (0..width * height).into_par_iter().map(pixel).collect()
    })
}

fn of_all(integrator: &Integrator, vertex: &Vertex, visibility: bool) -> f32 {
    let of = |light, points| f64::from(reflected(integrator, vertex, light, visibility, points));
    let emitters = 0..integrator.emitters.emitters.len() as u32;
    let near: f64 = emitters.map(|emitter| of(Picked::Emitter(emitter), 1)).sum();
    let rows = 0..integrator.infinite.len() as u32;
    let infinite: f64 = rows.map(|row| of(Picked::Beside(row), POINTS_AT_INFINITY)).sum();
    (near + infinite) as f32
}
