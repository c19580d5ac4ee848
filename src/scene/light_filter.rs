//! Light filters: what multiplies the light that some lights give to a point.
//!
//! A filter stands at a node, whose matrix takes its own space to the world's. It is asked about a point that is lit and about
//! the place on the light from which it is lit. The eye sees lights as they are; what surfaces and fog get of them, and what
//! reflected rays find of them, is filtered. A filter may be for some geometry alone ([`Linking::of_filter`]).
//!
//! [`Linking::of_filter`]: super::Linking::of_filter

use crate::math::color::Rgb;
use glam::Vec3;
use std::collections::BTreeMap;

/// A light filter at a node.
#[derive(Clone, Debug, PartialEq)]
pub struct LightFilter {
    /// The node that it stands at.
    pub node: u32,
    /// What it does.
    pub kind: FilterKind,
}

/// The kinds of light filter.
#[derive(Clone, Debug, PartialEq)]
pub enum FilterKind {
    /// Filters by where the lit point is.
    Rod(Rod),
    /// Filters light that passes a shape on the straight way from the light to the lit point.
    Blocker {
        /// The shape, in the filter's own space.
        shape: BlockerShape,
        /// The share that passes.
        through: Rgb,
    },
    /// Filters all of the light alike.
    Multiplier(Rgb),
    /// Filters by the distance from the light to the lit point, metres: dark below the first number of `near`, whole
    /// from its second one on; whole up to the first of `far`, dark from its second. In between it is a smoothstep.
    Decay {
        /// Where light fades in.
        near_m: Option<[f32; 2]>,
        /// Where it fades out.
        far_m: Option<[f32; 2]>,
    },
}

/// A box with rounded edges, and a soft shell around it.
#[derive(Clone, Debug, PartialEq)]
pub struct Rod {
    /// The smallest corner of the box before it is rounded, in the filter's own space.
    pub min: Vec3,
    /// The largest one.
    pub max: Vec3,
    /// What is nearer to the box than this is inside, local units.
    pub radius: f32,
    /// Thickness of the shell, local units.
    pub edge: f32,
    /// Across the shell: pairs of the share of its thickness and of how much it is like outside, which ascend from (0, 0) to
    /// (1, 1). Linear in between.
    pub ramp: Vec<[f32; 2]>,
    /// The share of the light inside.
    pub inside: Rgb,
    /// The share outside.
    pub outside: Rgb,
}

/// A shape of size 1 about the origin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BlockerShape {
    /// A cube of edges 1.
    Box,
    /// A ball of diameter 1.
    Sphere,
    /// A square of edges 1 across Z.
    Plane,
}

/// Which lights have which filters.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightFilters {
    filters: Vec<LightFilter>,
    sets: Vec<Box<[u32]>>,
    lights: BTreeMap<u32, u32>,
    instances: BTreeMap<u32, u32>,
}

impl LightFilters {
    /// `sets` are rows of `filters`; `lights` and `instances` name a set for each row of the scene's that has one.
    pub fn new(
        filters: Vec<LightFilter>,
        sets: Vec<Box<[u32]>>,
        lights: BTreeMap<u32, u32>,
        instances: BTreeMap<u32, u32>,
    ) -> LightFilters {
        LightFilters { filters, sets, lights, instances }
    }

    /// Whether no light has any.
    pub fn is_empty(&self) -> bool {
        self.lights.is_empty() && self.instances.is_empty()
    }

    /// All of them.
    pub fn all(&self) -> &[LightFilter] {
        &self.filters
    }

    /// The rows of those of a light.
    pub fn of_light(&self, light: u32) -> &[u32] {
        self.lights.get(&light).map_or(&[], |&set| &self.sets[set as usize])
    }

    /// The rows of those of an instance's light.
    pub fn of_instance(&self, instance: u32) -> &[u32] {
        self.instances.get(&instance).map_or(&[], |&set| &self.sets[set as usize])
    }

    /// The rows of lights that have some.
    pub fn filtered_lights(&self) -> impl Iterator<Item = u32> + '_ {
        self.lights.keys().copied()
    }

    /// The rows of instances that have some.
    pub fn filtered_instances(&self) -> impl Iterator<Item = u32> + '_ {
        self.instances.keys().copied()
    }
}
