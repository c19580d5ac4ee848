//! Lights that are not meshes.

use super::{Keys, Visibility};
use crate::math::color::Rgb;

/// A light at a node. A light that aims does so along the node's local -Z, through its matrix.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// The node it stands at; the node's path is the light's path.
    pub node: u32,
    /// What it is and how strong.
    pub kind: LightKind,
    /// Where it varies with time: what takes the place of the strength in `kind`, in the same unit
    /// (candela, nits or lux). Never below zero; linear or stepped, not a spline.
    pub values: Option<Box<Keys<Rgb>>>,
    /// Beyond this distance in metres it gives no light (glTF `range`); `None` is physical.
    pub range_m: Option<f32>,
    /// Take it out of the importance heuristic and sample it at every point.
    pub forced: bool,
    /// Which rays meet it: a sphere; and at infinity a sun or a dome, which casts no shadow.
    pub visibility: Visibility,
}

/// The kinds of light that are not meshes.
#[derive(Clone, Debug, PartialEq)]
pub enum LightKind {
    /// A point: luminous intensity in candela, the same in every direction.
    Point {
        /// Candela.
        intensity_cd: Rgb,
    },
    /// A point that aims.
    Spot {
        /// Candela on the axis.
        intensity_cd: Rgb,
        /// How intensity falls off the axis.
        shaping: Shaping,
    },
    /// A sphere that is sampled as a sphere. Its radius is in the node's local space, and the node's
    /// transform must scale evenly.
    Sphere {
        /// Luminance of the surface, nits.
        radiance_nits: Rgb,
        /// Radius in local units.
        radius: f32,
        /// Emission profile about -Z, if it has one.
        shaping: Option<Shaping>,
    },
    /// A sun: parallel or nearly parallel light that travels along -Z.
    Distant {
        /// Illuminance on a surface that faces it, lux.
        irradiance_lux: Rgb,
        /// Full angular diameter, radians; 0 is a delta direction.
        angle_rad: f32,
    },
    /// Light from all around: constant, or a latitude-longitude picture.
    ///
    /// The picture is laid out as UsdLux says: in local space +Y is its top row, and direction
    /// `(x, y, z)` is at `u = fract((atan2(z, x) + pi/2) / 2pi)`, `v = acos(y) / pi`. Directions go
    /// through the node's matrix as it is: an uneven scale stretches the picture.
    Dome {
        /// Luminance, or what the texture is multiplied by, nits.
        radiance_nits: Rgb,
        /// Index into [`Scene::textures`](super::Scene::textures).
        texture: Option<u32>,
    },
}

impl LightKind {
    /// Whether it is at infinity and not at its node.
    pub fn is_infinite(&self) -> bool {
        matches!(self, LightKind::Distant { .. } | LightKind::Dome { .. })
    }

    /// Its emission profile, if it has one.
    pub fn shaping(&self) -> Option<Shaping> {
        match *self {
            LightKind::Spot { shaping, .. } => Some(shaping),
            LightKind::Sphere { shaping, .. } => shaping,
            _ => None,
        }
    }

    /// Its strength, in its own unit: candela of a point or a spot, nits of a sphere or a dome, lux
    /// of a sun.
    pub fn rgb(&self) -> Rgb {
        match *self {
            LightKind::Point { intensity_cd } | LightKind::Spot { intensity_cd, .. } => {
                intensity_cd
            }
            LightKind::Sphere { radiance_nits, .. } | LightKind::Dome { radiance_nits, .. } => {
                radiance_nits
            }
            LightKind::Distant { irradiance_lux, .. } => irradiance_lux,
        }
    }
}

/// An emission profile: a factor on radiance or intensity by the angle off the axis (-Z), or by the direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shaping {
    /// `KHR_lights_punctual`: squared linear-in-cosine ramp between the two half angles.
    Khr {
        /// Half angle of full intensity, radians.
        inner_rad: f32,
        /// Half angle beyond which it is dark, radians, at most pi/2.
        outer_rad: f32,
    },
    /// UsdLux ShapingAPI.
    Usd {
        /// Half angle of the cone, radians; beyond it is dark. pi or more is no cone.
        cone_rad: f32,
        /// `[0, 1]`: the smoothstep starts at `cone * (1 - softness)`.
        softness: f32,
        /// Exponent of `|cos|`; 0 is none.
        focus: f32,
        /// The colour that off-axis light is tinted towards where focus dims it; black by default.
        focus_tint: [f32; 3],
        /// The photometric profile that multiplies all this: an index into
        /// [`Scene::profiles`](super::Scene::profiles).
        profile: Option<u32>,
    },
}
