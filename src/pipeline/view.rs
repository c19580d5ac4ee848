//! The view of a scene that a user means.
//!
//! Both programs take the same options, [`View`], and [`look`] finds the camera that they mean: one of
//! the scene, one of another file, or one placed by the options. A scene without a camera gets one that
//! has the whole scene in view. A camera needs a node, so for one that is not the scene's own nodes are
//! added to the scene. These carry no lights, and a tree of the scene stays fresh.

use super::fit::{self, Fitted};
use super::{carry_camera, load_scene, option};
use crate::ingest::IngestError;
use crate::scene::{Camera, Node, Scene, Trs};
use clap::Args;
use glam::{DAffine3, DMat3, DVec3};
use std::path::{Path, PathBuf};

/// Width over height of a picture, where neither the user nor the camera says.
pub const ASPECT: f32 = 16.0 / 9.0;

/// Where the path of a camera's file ends.
const FILES: [&str; 7] = [".gltf", ".glb", ".obj", ".usda", ".usdc", ".usdz", ".usd"];

/// What to look at a scene through.
#[derive(Args, Clone, Debug, Default, PartialEq)]
pub struct View {
    /// Camera to look through: a prim path or number in the scene; FILE for the default camera of another
    /// glTF file; or FILE:CAMERA. If not given, the scene's camera called main_cam, or its first one that is not
    /// hidden, or --fit if it has none
    #[arg(long)]
    pub camera: Option<String>,
    /// Put the whole scene in view, even if it has a camera
    #[arg(long, conflicts_with = "camera", group = "placed")]
    pub fit: bool,
    /// Look from a point, in metres, +Y up
    #[arg(long, value_name = "X,Y,Z", value_parser = option::point, allow_hyphen_values = true,
        conflicts_with = "camera", group = "placed")]
    pub look_from: Option<DVec3>,
    /// Look at a point; if not given, the middle of the scene
    #[arg(long, value_name = "X,Y,Z", value_parser = option::point, allow_hyphen_values = true,
        requires = "look_from")]
    pub look_at: Option<DVec3>,
    /// Direction that is up in the picture; if not given, 0,1,0
    #[arg(long, value_name = "X,Y,Z", value_parser = option::point, allow_hyphen_values = true,
        requires = "look_from")]
    pub up: Option<DVec3>,
    /// Full vertical field of view in degrees, with --look-from or --fit; if not given, 40
    #[arg(long, value_name = "DEGREES", value_parser = option::field_of_view, requires = "placed")]
    pub fov: Option<f32>,
}

/// A camera to look through.
#[derive(Clone, Debug, PartialEq)]
pub struct Look {
    /// The camera, at a node of the scene.
    pub camera: Camera,
    /// What the user is told of it: where it stands, if the user did not say; what of it is left out.
    pub note: Option<String>,
}

/// Why there is no camera to look through.
#[derive(Debug, thiserror::Error)]
pub enum ViewError {
    /// The file that a camera was to be taken from has none.
    #[error("{}: the scene has no camera; name another file, or leave out --camera", scene.display())]
    NoCamera {
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
    /// The file that a camera was to be taken from cannot be read.
    #[error(transparent)]
    File(#[from] IngestError),
    /// There is no direction from one point to itself.
    #[error("--look-from and --look-at are the same point; move one of them")]
    NoDirection,
    /// Up would be towards or away from the viewer.
    #[error("--up points along the view, or nowhere; choose another direction")]
    NoUp,
}

impl ViewError {
    /// Whether the options contradict themselves, whatever is in the scene.
    pub fn is_usage(&self) -> bool {
        matches!(self, ViewError::NoDirection | ViewError::NoUp)
    }
}

impl View {
    /// Whether no option is given, so that the scenes decide.
    pub fn is_default(&self) -> bool {
        *self == View::default()
    }

    /// Whether two versions of a scene are to be seen from the same place, and not by a camera of each.
    pub fn is_shared(&self) -> bool {
        self.fit || self.look_from.is_some()
    }
}

/// The camera that a user means, for a picture of some aspect. Nodes for it may be added to the scene.
///
/// # Errors
/// If there is no such camera, or the options contradict themselves.
pub fn look(scene: &mut Scene, view: &View, aspect: f32) -> Result<Look, ViewError> {
    let own = |camera: Camera| Ok(Look { camera, note: None });
    if let Some(from) = view.look_from {
        let at = view.look_at.unwrap_or_else(|| fit::middle(scene));
        let yfov_rad = view.fov.unwrap_or(fit::YFOV_DEG as f32).to_radians();
        return own(stand(scene, from, at, view.up, yfov_rad)?);
    }
    if let Some(wanted) = &view.camera {
        if let Some(camera) = by_path(scene, wanted) {
            return own(camera.clone());
        }
        if let Some((file, wanted)) = file_of(wanted) {
            let other = load_scene(file)?;
            let wanted = find(&other, wanted)?;
            let camera = carry_camera(&other, wanted, scene);
            let note = (camera.shutter != wanted.shutter).then(|| {
                format!(
                    "{}: its camera's shutter is left out: lights of {} change, and none of its cameras has that \
                     shutter",
                    other.source.display(),
                    scene.source.display()
                )
            });
            // What the picture depends on, and what it must not replace.
            scene.files.extend(other.files);
            return Ok(Look { camera, note });
        }
        return own(find(scene, Some(wanted))?.clone());
    }
    match scene.default_camera() {
        Some(camera) if !view.fit => own(camera.clone()),
        _ => {
            let yfov_rad = view.fov.map(|degrees| f64::from(degrees).to_radians());
            let fitted = fit::fit(scene, aspect.into(), yfov_rad);
            let why = if view.fit { "--fit is" } else { "it has no camera; the view is" };
            let note = format!("{}: {why} {fitted}", scene.source.display());
            let Fitted { from, at, yfov_rad } = fitted;
            let camera = stand(scene, from, at, None, yfov_rad as f32)?;
            Ok(Look { camera, note: Some(note) })
        }
    }
}

fn by_path<'a>(scene: &'a Scene, wanted: &str) -> Option<&'a Camera> {
    scene.cameras.iter().find(|camera| &*scene.nodes[camera.node as usize].path == wanted)
}

/// The camera of some path or number; the default one if none is named.
fn find<'a>(scene: &'a Scene, wanted: Option<&str>) -> Result<&'a Camera, ViewError> {
    let source = || scene.source.clone();
    let default = scene.default_camera().ok_or_else(|| ViewError::NoCamera { scene: source() })?;
    let Some(wanted) = wanted else { return Ok(default) };
    let by_number = || wanted.parse().ok().and_then(|number: usize| scene.cameras.get(number));
    by_path(scene, wanted).or_else(by_number).ok_or_else(|| ViewError::OfThatName {
        scene: source(),
        wanted: wanted.into(),
        others: scene
            .cameras
            .iter()
            .map(|c| scene.nodes[c.node as usize].path.to_string())
            .collect(),
    })
}

/// The file and the camera in it that `FILE` or `FILE:CAMERA` names.
fn file_of(text: &str) -> Option<(&Path, Option<&str>)> {
    let lower = text.to_ascii_lowercase();
    let ends = FILES
        .iter()
        .flat_map(|extension| lower.match_indices(extension).map(|(at, _)| at + extension.len()));
    let camera = |end: usize| match &text[end..] {
        "" => Some(None),
        rest => rest.strip_prefix(':').map(Some),
    };
    ends.filter_map(|end| Some((Path::new(&text[..end]), camera(end)?))).next()
}

/// Adds a node that stands at a point and looks at another. If `up` is not given, +Y is up. For a view
/// straight down it is -Z, as on a map, and for one straight up +Z.
fn stand(
    scene: &mut Scene,
    from: DVec3,
    at: DVec3,
    up: Option<DVec3>,
    yfov_rad: f32,
) -> Result<Camera, ViewError> {
    let back = (from - at).try_normalize().ok_or(ViewError::NoDirection)?;
    let across = |up: DVec3| {
        let right = up.normalize_or_zero().cross(back);
        (right.length() > 1e-9).then(|| right.normalize())
    };
    let right = match up {
        Some(up) => across(up).ok_or(ViewError::NoUp)?,
        None => across(DVec3::Y).or_else(|| across(-DVec3::Z * back.y)).ok_or(ViewError::NoUp)?,
    };
    let matrix3 = DMat3::from_cols(right, back.cross(right), back);
    let place = Trs::Matrix(DAffine3 { matrix3, translation: from });
    scene.nodes.push(Node::fixed("/(view)", None, place));
    Ok(Camera::perspective(scene.nodes.len() as u32 - 1, yfov_rad))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_told_from_a_path() {
        let found = |text| file_of(text).map(|(file, camera)| (file.to_str().unwrap(), camera));
        assert_eq!(found("cam.glb"), Some(("cam.glb", None)));
        assert_eq!(found("/a.b/Cam.GLTF"), Some(("/a.b/Cam.GLTF", None)));
        assert_eq!(found("cam.glb:/eye/left"), Some(("cam.glb", Some("/eye/left"))));
        assert_eq!(found("c:\\cam.glb:1"), Some(("c:\\cam.glb", Some("1"))));
        assert_eq!(found("v1.glb.d/cam.gltf:0"), Some(("v1.glb.d/cam.gltf", Some("0"))));
        assert_eq!(found("shot.usda"), Some(("shot.usda", None)));
        assert_eq!(found("/World/cam"), None);
        assert_eq!((found("2"), found("glb"), found("a.glbx")), (None, None, None));
    }

    #[test]
    fn a_view_stands_where_it_is_told_to() {
        let mut scene = Scene::default();
        for (from, at, up, right, upward) in [
            ([0.0, 0.0, 5.0], [0.0; 3], None, DVec3::X, DVec3::Y),
            ([5.0, 0.0, 0.0], [0.0; 3], None, -DVec3::Z, DVec3::Y),
            ([0.0, 5.0, 0.0], [0.0; 3], None, DVec3::X, -DVec3::Z),
            ([0.0, -5.0, 0.0], [0.0; 3], None, DVec3::X, DVec3::Z),
            ([0.0, 0.0, 5.0], [0.0; 3], Some(DVec3::X * 3.0), -DVec3::Y, DVec3::X),
            ([1e9, 0.0, 1e-9], [1e9, 0.0, 0.0], None, DVec3::X, DVec3::Y),
        ] {
            let camera = stand(&mut scene, from.into(), at.into(), up, 0.5).unwrap();
            let Trs::Matrix(place) = scene.nodes[camera.node as usize].local else { panic!() };
            assert!(place.matrix3.x_axis.distance(right) < 1e-12, "{place}");
            assert!(place.matrix3.y_axis.distance(upward) < 1e-12, "{place}");
            assert_eq!(place.translation, DVec3::from(from));
        }
        let here = DVec3::ONE;
        let error = stand(&mut scene, here, here, None, 0.5).unwrap_err();
        assert!(matches!(error, ViewError::NoDirection) && error.is_usage());
        for up in [DVec3::Z, -DVec3::Z, DVec3::ZERO] {
            let error = stand(&mut scene, DVec3::Z, DVec3::ZERO, Some(up), 0.5).unwrap_err();
            assert!(matches!(error, ViewError::NoUp) && error.is_usage(), "{up}");
        }
    }
}
