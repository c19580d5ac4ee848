//! One light that differs, and in what.

use super::card::{Kind, LightCard};
use serde::Serialize;

/// What happened to a light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verb {
    /// The version before does not have it.
    Added,
    /// The version after does not have it.
    Removed,
    /// It is not what it was.
    Dirtied,
    /// The same light under another path; perhaps carried along by a prim above it.
    Renamed,
}

/// One light that differs. There is a card for each version that has it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Change {
    /// What happened to it.
    pub verb: Verb,
    /// How much it matters, `[0, 1]`: the share of all energy that it gained or lost, or the share of
    /// all picks that it gained or lost in the mean over the probes, whichever is larger.
    pub share: f64,
    /// The light before.
    pub before: Option<LightCard>,
    /// The light after.
    pub after: Option<LightCard>,
    /// What differs; empty if it was added, removed, or renamed and nothing else.
    pub differences: Vec<Difference>,
}

/// One thing in which a light differs, and by how much. At most one of each sort.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "aspect", rename_all = "snake_case")]
pub enum Difference {
    /// Where it is. A tree file does not tell everything, such as a turn of a light that shines to all
    /// sides; what it does not tell counts as unchanged.
    Transform {
        /// How far its middle moved, metres.
        moved_m: f32,
        /// By what angle it turned, degrees.
        turned_deg: f32,
        /// By how much it grew; 1 if not.
        scaled: f32,
    },
    /// What it is made of. Where both numbers are the same, its shape differs in its own space.
    Topology {
        /// Emitters before.
        before: u32,
        /// Emitters after.
        after: u32,
    },
    /// How strong it is, in the unit of [`LightCard::energy`].
    Energy {
        /// Before.
        before: f32,
        /// After.
        after: f32,
        /// `log2` of the ratio: 1 is twice as strong; `None` if either is dark.
        stops: Option<f32>,
    },
    /// Its hue; see [`LightCard::color`].
    Color {
        /// Before.
        before: Option<[f32; 3]>,
        /// After.
        after: Option<[f32; 3]>,
    },
    /// How far off its axis light leaves it.
    Cone {
        /// Half angle before, degrees.
        before_deg: f32,
        /// Half angle after, degrees.
        after_deg: f32,
    },
    /// What kind of light it is.
    Kind {
        /// Before.
        before: Option<Kind>,
        /// After.
        after: Option<Kind>,
    },
    /// Whether it is sampled at every point.
    Forced {
        /// Before.
        before: bool,
        /// After.
        after: bool,
    },
    /// How much of it surfaces reflect: the multipliers of what diffuse lobes do, and others.
    Response {
        /// Diffuse and specular before.
        before: [f32; 2],
        /// And after.
        after: [f32; 2],
    },
    /// Which prims it lights.
    LightLink {
        /// Those of two scenes; `None` where a tree file tells only that it lights others.
        prims: Option<Relinked>,
    },
    /// Which prims cast shadows from it.
    ShadowLink {
        /// Those of two scenes.
        prims: Option<Relinked>,
    },
    /// For which prims its filters filter.
    FilterLink {
        /// The filters of two scenes that do so otherwise.
        filters: Vec<RelinkedFilter>,
    },
    /// How far it reaches.
    Range {
        /// Metres before; `None` is physical.
        before_m: Option<f32>,
        /// Metres after; `None` is physical.
        after_m: Option<f32>,
    },
    /// What it does in time, beyond what differs in the first frame.
    OverTime {
        /// Whether it changes before.
        before: bool,
        /// Whether it changes after.
        after: bool,
        /// How far apart the versions come, where it changes in both of two scenes.
        apart: Option<Apart>,
    },
    /// How its emission is distributed: its texture, its profile within the cone, the shares of its
    /// emitters. It stands for all that the other differences do not tell.
    Pattern,
}

/// Prims of both scenes that are in a link set of one and not of the other.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Relinked {
    /// How many are in it now and were not.
    pub gained: usize,
    /// The paths of the first few of them.
    pub gained_named: Vec<String>,
    /// How many were in it and are not now.
    pub lost: usize,
    /// The paths of the first few of them.
    pub lost_named: Vec<String>,
}

/// A light filter that filters for other prims than before.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct RelinkedFilter {
    /// Its path.
    pub path: String,
    /// The prims that it filters for, or no longer.
    pub prims: Relinked,
}

/// How far apart two versions of a light come in the course of time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Apart {
    /// In how many frames they differ.
    pub frames: u32,
    /// In how many their shapes differ in their own space, if either deforms.
    pub reshaped: u32,
    /// How far their places are apart at most, metres.
    pub most_moved_m: f32,
    /// How far their strengths are apart at most, stops; infinite where one is dark.
    pub most_stops: f32,
}

impl Change {
    /// The path by which it is known: after, if it is there then.
    pub fn path(&self) -> &str {
        let card = self.after.as_ref().or(self.before.as_ref());
        card.map_or("", |card| &card.path)
    }
}

impl Difference {
    /// The word for it, as in the JSON.
    pub fn aspect(&self) -> &'static str {
        match self {
            Difference::Transform { .. } => "transform",
            Difference::Topology { .. } => "topology",
            Difference::Energy { .. } => "energy",
            Difference::Color { .. } => "color",
            Difference::Cone { .. } => "cone",
            Difference::Kind { .. } => "kind",
            Difference::Forced { .. } => "forced",
            Difference::Response { .. } => "response",
            Difference::LightLink { .. } => "light_link",
            Difference::ShadowLink { .. } => "shadow_link",
            Difference::FilterLink { .. } => "filter_link",
            Difference::Range { .. } => "range",
            Difference::OverTime { .. } => "over_time",
            Difference::Pattern => "pattern",
        }
    }
}
