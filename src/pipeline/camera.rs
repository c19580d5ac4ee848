//! Finding the camera that a user means.

use crate::scene::{Camera, Scene};
use std::path::PathBuf;

/// Why there is no camera to look through.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoCamera {
    /// The scene has none.
    #[error("{}: the scene has no camera; add one to it", scene.display())]
    InScene {
        /// The scene's file.
        scene: PathBuf,
    },
    /// It has others.
    #[error("{}: no camera '{wanted}'; it has {}", scene.display(), others.join(", "))]
    OfThatName {
        /// The scene's file.
        scene: PathBuf,
        /// What was asked for.
        wanted: String,
        /// The paths of those that it has.
        others: Vec<String>,
    },
}

/// The camera with some prim path or number; the first if none is named.
///
/// # Errors
/// If there is none.
pub fn find_camera<'a>(scene: &'a Scene, wanted: Option<&str>) -> Result<&'a Camera, NoCamera> {
    let path_of = |camera: &Camera| &scene.nodes[camera.node as usize].path;
    let first = scene.cameras.first();
    let first = first.ok_or_else(|| NoCamera::InScene { scene: scene.source.clone() })?;
    let Some(wanted) = wanted else { return Ok(first) };
    let by_number = || wanted.parse().ok().and_then(|number: usize| scene.cameras.get(number));
    let by_path = scene.cameras.iter().find(|camera| path_of(camera) == wanted);
    by_path.or_else(by_number).ok_or_else(|| NoCamera::OfThatName {
        scene: scene.source.clone(),
        wanted: wanted.into(),
        others: scene.cameras.iter().map(|camera| path_of(camera).clone()).collect(),
    })
}
