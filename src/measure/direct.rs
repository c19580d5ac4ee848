//! Direct light in a coarse picture, without noise.
//!
//! All lights are enumerated at one point of each pixel, as for the [probes](super::at_probes). A pixel
//! has the same ray in two versions of a scene, so their pictures differ only by what changed.

use super::contributions::reflected;
use crate::light_tree::{LightTree, NoSuchFrame, Picked};
use crate::render::RenderDelegate;
use crate::render::path::Integrator;
use crate::render::vertex::Vertex;
use rayon::prelude::*;

/// Points along a side of the square lattice over a dome or a sun. An emitter has one, its middle.
const POINTS_AT_INFINITY: u32 = 8;

/// The luminance, in nits, that the first surface behind each pixel of a delegate's picture reflects of
/// all lights, row after row. `None` where there is no surface that reflects. With `visibility`, there
/// are shadows: one ray goes to the middle of each emitter, and one to a point of each infinite light.
///
/// # Errors
/// If the tree lacks the frame.
pub fn direct_light(
    delegate: &RenderDelegate,
    tree: &LightTree<impl AsRef<[u8]>>,
    frame: i32,
    visibility: bool,
) -> Result<Vec<Option<f32>>, NoSuchFrame> {
    delegate.at_frame(tree, frame, |integrator| {
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
