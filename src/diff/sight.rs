//! The cameras of two versions.

use super::side::Side;
use crate::pipeline::{ASPECT, View, ViewError, carry_camera, look};

/// Chooses a camera for each version that is a scene. If the view names a camera, each version uses its
/// own camera of that name; by default each uses its first. If the view gives a place, or if neither
/// scene has a camera, one camera is chosen for the version after (for the one before, if the version
/// after is a tree) and both use it. Returns a note on where that camera is, if the user did not say.
///
/// # Errors
/// If there is no such camera, or the view contradicts itself.
pub fn look_at_both(
    before: &mut Side,
    after: &mut Side,
    view: &View,
) -> Result<Option<String>, ViewError> {
    if view.is_shared() {
        (before.camera, after.camera) = (None, None);
    }
    if view.camera.is_some() {
        for side in [&mut *before, &mut *after] {
            if let Some(scene) = side.scene_mut() {
                side.camera = Some(look(scene, view, ASPECT)?.camera);
            }
        }
    }
    let mut note = None;
    if before.camera.is_none() && after.camera.is_none() {
        let leader = if after.scene().is_some() { &mut *after } else { &mut *before };
        if let Some(scene) = leader.scene_mut() {
            let found = look(scene, view, ASPECT)?;
            (leader.camera, note) = (Some(found.camera), found.note);
        }
    }
    // A version that has none yet is seen as the other is.
    follow(before, after);
    follow(after, before);
    Ok(note)
}

/// Chooses the camera of a version that nothing else is looked at beside, as a renderer would: a tree has none.
/// Returns a note on where it is, if the user did not say.
///
/// # Errors
/// If there is no such camera, or the view contradicts itself.
pub fn look_at(version: &mut Side, view: &View) -> Result<Option<String>, ViewError> {
    let Some(scene) = version.scene_mut() else { return Ok(None) };
    let found = look(scene, view, ASPECT)?;
    version.camera = Some(found.camera);
    Ok(found.note)
}

/// Gives a scene without a camera the camera of another scene.
fn follow(side: &mut Side, other: &Side) {
    let (Some(there), Some(camera)) = (other.scene(), other.camera()) else { return };
    if side.camera.is_none()
        && let Some(scene) = side.scene_mut()
    {
        side.camera = Some(carry_camera(there, camera, scene));
    }
}
