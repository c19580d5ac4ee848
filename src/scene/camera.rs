//! Cameras.

/// A perspective camera that looks along its node's -Z with +Y up (glTF's convention, and USD's).
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// The node it stands at.
    pub node: u32,
    /// Full vertical field of view, radians.
    pub yfov_rad: f32,
    /// Width over height that the file asks for, if it does. A render of another aspect keeps
    /// the vertical field of view.
    pub aspect: Option<f32>,
    /// Radius of the lens in metres; 0 is a pinhole.
    pub lens_radius_m: f32,
    /// Distance from the camera to the plane in focus, metres. Used only with a lens.
    pub focus_distance_m: f32,
    /// Offset of the film's centre as a fraction of its width and height.
    pub film_offset: [f32; 2],
}
