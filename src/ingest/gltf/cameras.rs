//! Cameras.

use super::document::{UsdCamera, reals};
use super::{Output, Source};
use crate::ingest::error::Fault;
use crate::scene::Camera;
use gltf::json::{Camera as Row, Index, Node};

/// Adds the camera of a node.
pub(super) fn compile(
    source: &Source,
    output: &mut Output,
    camera: Index<Row>,
    row: &Node,
    node: u32,
    object: &str,
) -> Result<(), Fault> {
    let Some(lens) = &source.document.cameras[camera.value()].perspective else {
        output.notes.add(object, "orthographic cameras are not read; left out");
        return Ok(());
    };
    let mut compiled = Camera {
        node,
        yfov_rad: lens.yfov,
        aspect: lens.aspect_ratio,
        lens_radius_m: 0.0,
        focus_distance_m: 0.0,
        film_offset: [0.0; 2],
    };
    if let Some(usd) = UsdCamera::of(&row.extras, object)? {
        let (f_stop, focal_length) = (usd.f_stop.f32(), usd.focal_length_m.f32());
        let focus_distance = usd.focus_distance_m.f32();
        if f_stop < 0.0 || focal_length < 0.0 || focus_distance < 0.0 {
            return Err(Fault::new(object, "extras.usdCamera: a lens number is negative"));
        }
        compiled.film_offset = reals(usd.film_offset);
        // A lens that is focused nowhere blurs everything: USD means a pinhole.
        if f_stop > 0.0 && focus_distance > 0.0 {
            compiled.lens_radius_m = focal_length / (2.0 * f_stop);
            compiled.focus_distance_m = focus_distance;
        }
        if !compiled.lens_radius_m.is_finite() {
            return Err(Fault::new(object, "extras.usdCamera: its lens is infinitely wide"));
        }
    }
    output.scene.cameras.push(compiled);
    Ok(())
}
