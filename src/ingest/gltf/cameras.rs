//! Cameras.

use super::document::{UsdCamera, reals};
use super::{Output, Source};
use crate::ingest::error::Fault;
use crate::scene::{Camera, Category};
use gltf::json::{Camera as Row, Index, Node};
use std::f32::consts::PI;

/// Adds the camera of a node.
pub(super) fn compile(
    source: &Source,
    output: &mut Output,
    camera: Index<Row>,
    row: &Node,
    node: u32,
    object: &str,
) -> Result<(), Fault> {
    let mut note = |text| output.notes.add(Category::Cameras, object, text);
    let Some(camera) = source.document.get(camera) else {
        note("its camera is not in the file; left out");
        return Ok(());
    };
    let Some(lens) = &camera.perspective else {
        note("orthographic cameras are not read; left out");
        return Ok(());
    };
    if !(lens.yfov > 0.0 && lens.yfov < PI) {
        note("the field of view of its camera is not between 0 and pi radians; left out");
        return Ok(());
    }
    let aspect = lens.aspect_ratio.filter(|&aspect| aspect > 0.0 && aspect.is_finite());
    if aspect != lens.aspect_ratio {
        note("the aspect ratio of its camera is not positive; it has none");
    }
    let mut compiled = Camera {
        node,
        yfov_rad: lens.yfov,
        aspect,
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
