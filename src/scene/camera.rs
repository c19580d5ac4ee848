//! Cameras.

use super::{LensKeys, Shutter};
use std::sync::Arc;

/// A camera that looks along its node's -Z with +Y up (glTF's convention, and USD's).
///
/// Where [`over_time`](Camera::over_time) says otherwise, [`Scene::camera_at`](super::Scene::camera_at) tells what it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// The node it stands at.
    pub node: u32,
    /// How points of the scene come to the film.
    pub projection: Projection,
    /// Width over height that the file asks for, if it does. A render of another aspect keeps
    /// the height.
    pub aspect: Option<f32>,
    /// Radius of the lens in metres; 0 is a pinhole. Used only in perspective.
    pub lens_radius_m: f32,
    /// Distance from the camera to the plane in focus, metres. Used only with a lens.
    pub focus_distance_m: f32,
    /// Offset of the film's centre as a fraction of its width and height.
    pub film_offset: [f32; 2],
    /// Factor on the picture's radiance: what shutter, aperture and film speed make of it.
    pub exposure_scale: f32,
    /// Surfaces nearer or farther than these two distances are not seen by the camera itself; they
    /// still cast shadows and are seen in reflections. Metres along the view axis, ascending; the
    /// second may be infinite.
    pub clip_m: [f32; 2],
    /// When its shutter is open; `None` for an instant.
    pub shutter: Option<Shutter>,
    /// How its lens varies, if it does.
    pub over_time: Option<Arc<LensKeys>>,
    /// Whether the file hides it: it is looked through if it is named, or if there is no other.
    pub is_hidden: bool,
}

/// How points of the scene come to the film.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Through one point.
    Perspective {
        /// Full vertical field of view, radians, in (0, pi).
        yfov_rad: f32,
    },
    /// Along parallel lines.
    Orthographic {
        /// Full height of what is seen, metres.
        height_m: f32,
    },
}

impl Camera {
    /// A pinhole camera at a node, with a full vertical field of view in (0, pi) radians.
    pub fn perspective(node: u32, yfov_rad: f32) -> Camera {
        Camera {
            node,
            projection: Projection::Perspective { yfov_rad },
            aspect: None,
            lens_radius_m: 0.0,
            focus_distance_m: 1.0,
            film_offset: [0.0; 2],
            exposure_scale: 1.0,
            clip_m: [0.0, f32::INFINITY],
            shutter: None,
            over_time: None,
            is_hidden: false,
        }
    }

    /// A camera at a node that projects along parallel lines and sees so many metres from bottom to top.
    pub fn orthographic(node: u32, height_m: f32) -> Camera {
        Camera {
            projection: Projection::Orthographic { height_m },
            ..Camera::perspective(node, 1.0)
        }
    }
}
