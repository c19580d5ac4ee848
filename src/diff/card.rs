//! One light, described: what a reader wants to know of it before and after.

use serde::Serialize;

/// What kind of light it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// A mesh whose material emits.
    Mesh,
    /// A point that shines to all sides.
    Point,
    /// A point that aims.
    Spot,
    /// A sphere sampled as a sphere.
    Sphere,
    /// Parallel or nearly parallel light from infinity.
    Sun,
    /// Light from all around.
    Dome,
}

/// One light of one version. Of a light that changes with time: as it is in the first frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LightCard {
    /// Prim path.
    pub path: String,
    /// What it is; `None` if its tree file is too old to say.
    pub kind: Option<Kind>,
    /// How many emitters it has; 0 if it is dark or at infinity.
    pub emitters: u32,
    /// Peak radiant intensity, summed over its emitters, candela; of a sun or a dome the illuminance
    /// of a surface that faces it, lux.
    pub energy: f32,
    /// Its hue: linear Rec. 709, the largest component 1. `None` if it is dark, or if its tree file is
    /// too old to say.
    pub color: Option<[f32; 3]>,
    /// Where it is; `None` at infinity.
    pub place: Option<Place>,
    /// Where it aims, unit, world space; `None` if to all sides. Of a sun, where its light goes.
    pub axis: Option<[f32; 3]>,
    /// How far off the axis light leaves it, degrees; 180 to all sides. Of a sun, half its angular
    /// diameter.
    pub half_angle_deg: f32,
    /// Beyond this distance it gives no light, metres; `None` is physical.
    pub range_m: Option<f32>,
    /// Whether it is left out of all estimates and sampled at every point.
    pub forced: bool,
    /// Whether it moves, deforms or varies in strength with time.
    pub changes: bool,
}

/// Where a light is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Place {
    /// Middle of the box around it, world space, metres.
    pub center_m: [f32; 3],
    /// Edges of that box, metres.
    pub size_m: [f32; 3],
}

impl Kind {
    /// Whether lights of this kind are at infinity and in no tree.
    pub fn is_infinite(self) -> bool {
        matches!(self, Kind::Sun | Kind::Dome)
    }

    /// The word for it.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Mesh => "mesh",
            Kind::Point => "point",
            Kind::Spot => "spot",
            Kind::Sphere => "sphere",
            Kind::Sun => "sun",
            Kind::Dome => "dome",
        }
    }
}

impl LightCard {
    /// Whether it is at infinity, its energy an illuminance.
    pub fn is_infinite(&self) -> bool {
        self.kind.is_some_and(Kind::is_infinite)
    }
}
