//! Cameras.
//!
//! No camera is a reason to refuse a scene: most of what a scene is used for needs none. A number
//! that makes no sense is mended and noted, and a camera that shows nothing is left out and noted.

use super::document::{Node, UsdCamera, reals};
use super::{Output, Source};
use crate::ingest::notes::Notes;
use crate::scene::{Camera, Category, Projection, Shutter};
use gltf::json::{Camera as Row, Index};
use std::f32::consts::PI;

/// The field of view that is taken where the file's is none, degrees.
const DEFAULT_YFOV_DEG: f32 = 45.0;

const CAMERAS: Category = Category::Cameras;

/// Adds the camera of a node.
pub(super) fn compile(
    source: &Source,
    output: &mut Output,
    camera: Index<Row>,
    row: &Node,
    node: u32,
    object: &str,
) {
    let document = source.document;
    let notes = &mut output.notes;
    let Some(lens) = document.get(camera) else {
        notes.add(CAMERAS, object, "its camera is not in the file; left out");
        return;
    };
    let is_sound = |aspect: &f32| *aspect > 0.0 && aspect.is_finite();
    let mut compiled = if let Some(lens) = &lens.perspective {
        let aspect = lens.aspect_ratio.filter(is_sound);
        if aspect != lens.aspect_ratio {
            notes.add(CAMERAS, object, "its camera's aspect ratio is not positive; left out");
        }
        Camera { aspect, ..Camera::perspective(node, field_of_view(lens.yfov, object, notes)) }
    } else if let Some(seen) = document.beside.magnifications.get(camera.value()).copied().flatten()
    {
        // glTF advises against a negative magnification, which would mirror the picture.
        let (xmag, ymag) = (seen.xmag.f32().abs(), seen.ymag.f32().abs());
        let height_m = 2.0 * ymag;
        if !(is_sound(&height_m) && xmag > 0.0) {
            notes.add(
                CAMERAS,
                object,
                "its orthographic camera sees no width or no height; left out",
            );
            return;
        }
        let aspect = Some(xmag / ymag).filter(is_sound);
        Camera { aspect, ..Camera::orthographic(node, height_m) }
    } else {
        notes.add(CAMERAS, object, "its camera has no projection; left out");
        return;
    };
    match UsdCamera::of(&row.extras, object) {
        Ok(Some(usd)) => apply(&usd, &mut compiled, object, notes),
        Ok(None) => {}
        Err(fault) => {
            notes.add(
                CAMERAS,
                object,
                format!("extras.usdCamera is not read: {}", fault.into_problem()),
            );
        }
    }
    output.scene.cameras.push(compiled);
}

/// A full vertical field of view in (0, pi), radians.
fn field_of_view(yfov: f32, object: &str, notes: &mut Notes) -> f32 {
    // The largest whose half has a tangent that is still positive.
    let widest = PI - 1e-6;
    if yfov > 0.0 && yfov < widest {
        return yfov;
    }
    let problem = format!(
        "its camera's vertical field of view, {yfov} radians, is not between 0 and pi; \
         {DEFAULT_YFOV_DEG} degrees are taken"
    );
    notes.add(CAMERAS, object, problem);
    DEFAULT_YFOV_DEG.to_radians()
}

/// What USD says of a camera and glTF does not.
fn apply(usd: &UsdCamera, camera: &mut Camera, object: &str, notes: &mut Notes) {
    let (f_stop, focal_length) = (usd.f_stop.f32(), usd.focal_length_m.f32());
    let focus_distance = usd.focus_distance_m.f32();
    camera.film_offset = reals(usd.film_offset);
    // A lens that is focused nowhere blurs everything: USD means a pinhole.
    if f_stop > 0.0 && matches!(camera.projection, Projection::Orthographic { .. }) {
        notes.add(
            CAMERAS,
            object,
            "its camera is orthographic and has no lens; its f-stop is left out",
        );
    } else if f_stop > 0.0 && focus_distance > 0.0 {
        let radius = focal_length / (2.0 * f_stop);
        if radius >= 0.0 && radius.is_finite() {
            camera.lens_radius_m = radius;
            camera.focus_distance_m = focus_distance;
        } else {
            notes.add(
                CAMERAS,
                object,
                "its camera's lens has no possible radius; taken for a pinhole",
            );
        }
    } else if f_stop < 0.0 || focus_distance < 0.0 {
        notes.add(CAMERAS, object, "its camera's f-stop or focus is negative; taken for a pinhole");
    }
    if let Some(scale) = usd.exposure_scale.map(|scale| scale.f32()) {
        if scale >= 0.0 {
            camera.exposure_scale = scale;
        } else {
            notes.add(CAMERAS, object, "its camera's exposure scale is negative; left out");
        }
    }
    if let Some([near, far]) = usd.clipping_range_m.map(reals) {
        if far > near.max(0.0) {
            camera.clip_m = [near.max(0.0), far];
        } else {
            notes.add(
                CAMERAS,
                object,
                "its camera's clipping planes leave nothing between them; left out",
            );
        }
    }
    if let Some([open, close]) = usd.shutter.map(reals) {
        camera.shutter = Shutter::new(open.into(), close.into());
        if camera.shutter.is_none() {
            notes.add(CAMERAS, object, "its camera's shutter is never open; taken for an instant");
        }
    }
}
