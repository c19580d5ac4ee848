//! The knob of splitting: how readily clusters are split, at each kind of point of a path.
//!
//! More lights at a point mean less noise from picking, and more to pay. How many pay depends on what else
//! is noisy and what else costs: pixels with edges, indirect light, textures. With the variance `V1` of
//! picking one light, the variance `V0` of everything else, the cost `C1` of one more light and the cost
//! `C0` of the rest of a path, variance times cost is least with about `sqrt(V1 C0 / (V0 C1))` lights
//! (Rath et al. 2022, "EARS: Efficiency-Aware Russian Roulette and Splitting"). Light that reaches the
//! eye after many bounces is a small part of a pixel, so few lights pay there.
//!
//! | module | question |
//! |---|---|
//! | [`pilot()`] | which knobs are best for this shot? |
//! | `sketch` | how noisy will the frame be, and where will its samples go? |
//! | `trial` | what would other knobs do at a point of a path? |
//! | `choice` | which of them are best together? |
//! | `prices` | what does tracing cost, in a unit that no clock decides? |

mod choice;
mod pilot;
mod prices;
mod sketch;
mod trial;

pub use pilot::{pilot, pilot_pays};
pub use sketch::Aim;
pub(super) use trial::Trial;

use serde::{Deserialize, Serialize};
use std::fmt;

/// How readily clusters are split.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Split {
    /// As readily as pays: by a [`pilot()`], or without one by knobs that are good for most scenes.
    #[default]
    Auto,
    /// By one knob in `[0, 1]`: 0 samples one light at a point, 1 every one.
    Fixed(f32),
    /// By one knob for each kind of point.
    ByBounce(Knobs),
}

impl From<f32> for Split {
    fn from(knob: f32) -> Split {
        Split::Fixed(knob)
    }
}

/// As it is written on a command line: `auto`, or a knob; several are joined by `/`.
impl fmt::Display for Split {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Split::Auto => f.write_str("auto"),
            Split::Fixed(knob) => write!(f, "{knob}"),
            Split::ByBounce(Knobs { by_bounce: [a, b, c] }) => write!(f, "{a}/{b}/{c}"),
        }
    }
}

impl Split {
    /// The knobs at all kinds of points.
    pub fn knobs(&self) -> Knobs {
        match *self {
            Split::Auto => Knobs::default(),
            Split::Fixed(knob) => Knobs { by_bounce: [knob; Knobs::KINDS] },
            Split::ByBounce(knobs) => knobs,
        }
    }
}

/// Knobs of splitting, each in `[0, 1]`, by the kind of point that lights are picked for. A stretch of a
/// ray in fog is of the kind of the point where the ray ends.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Knobs {
    /// At the first hit of a path, at its second, at all later ones.
    pub by_bounce: [f32; Knobs::KINDS],
}

impl Default for Knobs {
    fn default() -> Self {
        Knobs { by_bounce: [0.35, 0.15, 0.05] }
    }
}

impl Knobs {
    /// Kinds of points.
    pub const KINDS: usize = 3;

    /// The kind of a point that a path reaches after some bounces.
    pub fn kind(bounce: u32) -> usize {
        (bounce as usize).min(Knobs::KINDS - 1)
    }

    /// The knob at a point that a path reaches after some bounces.
    pub fn at(&self, bounce: u32) -> f32 {
        self.by_bounce[Knobs::kind(bounce)]
    }
}
