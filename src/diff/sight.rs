//! What two versions are looked at through.

use super::side::Side;
use crate::pipeline::{ASPECT, View, ViewError, carry_camera, look};

/// Chooses a camera for each version that is a scene. A camera that the view names, or the first of a
/// scene, is that of each version. A place that the view tells, or one that was found for scenes without
/// a camera, is the same for both: that for the version after, if it is a scene. Returns a note on where
/// it is, if the user did not say.
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

/// Gives a scene without a camera that of another.
fn follow(side: &mut Side, other: &Side) {
    let (Some(there), Some(camera)) = (other.scene(), other.camera()) else { return };
    if side.camera.is_none()
        && let Some(scene) = side.scene_mut()
    {
        side.camera = Some(carry_camera(there, camera, scene));
    }
}
