//! Lights that a user wants sampled at every point.

use crate::scene::Scene;

/// No light has the path that was to be forced.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "there is no light at or below '{path}' to be forced; `candelabra inspect` lists the heaviest lights by their paths"
)]
pub struct NoLightThere {
    /// The path asked for.
    pub path: String,
}

/// Takes all lights at some prim paths, and below them, out of the heuristic: they are left out of
/// the tree's estimates and sampled at every point (the seed's remedy for strong but occluded lights
/// and for those whose decay is not physical). What the scene itself forces stays forced.
///
/// # Errors
/// A path at which there is no light.
pub fn force_lights(scene: &mut Scene, paths: &[String]) -> Result<(), NoLightThere> {
    for path in paths {
        let is_there = |own: &str| {
            let below = own.strip_prefix(path.trim_end_matches('/'));
            !path.is_empty()
                && below.is_some_and(|rest| rest.is_empty() || rest.starts_with(['/', '[']))
        };
        let mut found = false;
        for row in 0..scene.instances.len() {
            let emits = scene.peak_rgb_of_instance(row as u32).max_element() > 0.0;
            if emits && is_there(&scene.instances[row].path) {
                (scene.instances[row].forced, found) = (true, true);
            }
        }
        for row in 0..scene.lights.len() {
            if is_there(scene.light_path(row)) {
                (scene.lights[row].forced, found) = (true, true);
            }
        }
        if !found {
            return Err(NoLightThere { path: path.clone() });
        }
    }
    Ok(())
}
