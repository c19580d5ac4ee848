//! Cameras.
//!
//! No camera is a reason to refuse a scene: most of what a scene is used for needs none. A number
//! that makes no sense is mended and noted, and a camera that shows nothing is left out and noted.

use super::document::{Node, UsdCamera, reals};
use super::{Output, Source, lenses};
use crate::ingest::error::Fault;
use crate::ingest::notes::Notes;
use crate::scene::{Camera, Category, LensKeys, Projection, Shutter};
use gltf::json::{Camera as Row, Index};
use std::f32::consts::PI;
use std::sync::Arc;

/// The field of view that is taken where the file's is none, degrees.
const DEFAULT_YFOV_DEG: f32 = 45.0;

const CAMERAS: Category = Category::Cameras;

/// Adds the camera of a node. `animated` is what the file's animations say of it.
pub(super) fn compile(
    source: &Source,
    output: &mut Output,
    (camera, animated): (Index<Row>, Option<&Arc<LensKeys>>),
    row: &Node,
    (node, is_hidden): (u32, bool),
    object: &str,
) -> Result<(), Fault> {
    let document = source.document;
    let notes = &mut output.notes;
    let Some(lens) = document.get(camera) else {
        notes.add(CAMERAS, object, "its camera is not in the file; left out");
        return Ok(());
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
            return Ok(());
        }
        let aspect = Some(xmag / ymag).filter(is_sound);
        Camera { aspect, ..Camera::orthographic(node, height_m) }
    } else {
        notes.add(CAMERAS, object, "its camera has no projection; left out");
        return Ok(());
    };
    compiled.is_hidden = is_hidden;
    animate(&mut compiled, animated);
    match UsdCamera::of(&row.extras, object) {
        Ok(Some(usd)) => {
            apply(&usd, &mut compiled, object, notes);
            lenses::apply(&usd, &mut compiled, object, output)?;
        }
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
    Ok(())
}

/// Gives a camera what animations say of its height.
fn animate(camera: &mut Camera, animated: Option<&Arc<LensKeys>>) {
    let Some(lens) = animated else { return };
    let still = lens.height.as_ref().filter(|keys| !keys.varies()).map(|keys| keys.values[0]);
    match (still, &mut camera.projection) {
        (None, _) => camera.over_time = Some(lens.clone()),
        (Some(height), Projection::Perspective { yfov_rad }) => *yfov_rad = height,
        (Some(height), Projection::Orthographic { height_m }) => *height_m = height,
    }
}

/// A full vertical field of view in (0, pi), radians.
fn field_of_view(yfov: f32, object: &str, notes: &mut Notes) -> f32 {
    if is_field_of_view(yfov) {
        return yfov;
    }
    let problem = format!(
        "its camera's vertical field of view, {yfov} radians, is not between 0 and pi; \
         {DEFAULT_YFOV_DEG} degrees are taken"
    );
    notes.add(CAMERAS, object, problem);
    DEFAULT_YFOV_DEG.to_radians()
}

/// Whether half of it has a tangent that is positive.
pub(super) fn is_field_of_view(yfov: f32) -> bool {
    yfov > 0.0 && yfov < PI - 1e-6
}

/// What USD says of a camera and glTF does not, where it does not vary.
fn apply(usd: &UsdCamera, camera: &mut Camera, object: &str, notes: &mut Notes) {
    let [f_stop, focal_length, focus] =
        reals([usd.f_stop, usd.focal_length_m, usd.focus_distance_m]);
    camera.is_hidden |= usd.hidden;
    camera.film_offset = reals(usd.film_offset);
    if f_stop > 0.0 && matches!(camera.projection, Projection::Orthographic { .. }) {
        notes.add(
            CAMERAS,
            object,
            "its camera is orthographic and has no lens; its f-stop is left out",
        );
    } else {
        match lens_radius(f_stop, focal_length, focus) {
            Ok(Some(radius)) => (camera.lens_radius_m, camera.focus_distance_m) = (radius, focus),
            Ok(None) => {}
            Err(problem) => {
                notes.add(CAMERAS, object, format!("its camera's {problem}; taken for a pinhole"));
            }
        }
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

/// The radius of a lens, metres; `None` is a pinhole. A lens that is focused nowhere blurs everything: USD means a
/// pinhole.
///
/// # Errors
/// What makes no sense.
pub(super) fn lens_radius(
    f_stop: f32,
    focal_length_m: f32,
    focus_distance_m: f32,
) -> Result<Option<f32>, &'static str> {
    if f_stop < 0.0 || focus_distance_m < 0.0 {
        return Err("f-stop or focus is negative");
    }
    if f_stop == 0.0 || focus_distance_m == 0.0 {
        return Ok(None);
    }
    let radius = focal_length_m / (2.0 * f_stop);
    let is_possible = radius >= 0.0 && radius.is_finite();
    is_possible.then_some(Some(radius)).ok_or("lens has no possible radius")
}
