//! What fills the space between surfaces.

use crate::math::color::Rgb;
use glam::Vec3;

/// Homogeneous fog: it scatters and absorbs alike everywhere inside.
#[derive(Clone, Debug, PartialEq)]
pub struct Medium {
    /// Scattering coefficient, 1/m of world space.
    pub scattering: Rgb,
    /// Absorption coefficient, 1/m of world space.
    pub absorption: Rgb,
    /// Mean cosine `g` of the Henyey-Greenstein phase function, in (-1, 1): above 0 light goes on
    /// forwards.
    pub anisotropy: f32,
    /// Where it is; `None` is everywhere.
    pub region: Option<FogBox>,
}

/// A box in a node's local space. The node may move, scale and shear it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FogBox {
    /// The node it stands at: a row of [`Scene::nodes`](super::Scene::nodes).
    pub node: u32,
    /// The least corner, local units.
    pub min: Vec3,
    /// The greatest corner, greater in every coordinate, local units.
    pub max: Vec3,
}
