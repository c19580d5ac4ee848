//! How much of a light surfaces reflect: two controls of lighting departments that have no counterpart in physics.
//!
//! What the diffuse lobe of a surface reflects of a light is multiplied by one number, what its other lobes do by another.
//! Who sees the light itself, directly or through panes, sees it as it is, and fog is lit by it as it is. That is what
//! UsdLux says of its `inputs:diffuse` and `inputs:specular`: multipliers of the effect "on the diffuse response of
//! materials", "on the specular response of materials".

use super::Scene;
use crate::math::color::Rgb;
use std::collections::BTreeMap;

/// A light that no surface reflects still lights fog, so it must be picked now and then.
const LEAST_EFFECT: f32 = 1.0 / 16.0;

/// The multipliers of a light, at least 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Response {
    /// Of what diffuse lobes reflect.
    pub diffuse: f32,
    /// Of what other lobes reflect or let pass: specular ones, coats, glass.
    pub specular: f32,
}

impl Default for Response {
    fn default() -> Response {
        Response::PLAIN
    }
}

impl Response {
    /// That of a light which is reflected as it is.
    pub const PLAIN: Response = Response { diffuse: 1.0, specular: 1.0 };

    /// How many times the light counts where lights are picked: as often as it is multiplied at most, but not less than
    /// [`LEAST_EFFECT`]. It is the same with and without fog, which a render may put in after the tree was published.
    #[inline]
    fn effect(self) -> f32 {
        self.diffuse.max(self.specular).max(LEAST_EFFECT)
    }

    /// What is reflected of a light, given what would be without multipliers, and the diffuse part of that.
    #[inline]
    pub fn of(self, whole: Rgb, diffuse: Rgb) -> Rgb {
        // No less than zero: the part, rounded, is no more than the whole.
        whole * self.specular + diffuse * (self.diffuse - self.specular)
    }
}

/// The lights that have multipliers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightResponses {
    lights: BTreeMap<u32, Response>,
    instances: BTreeMap<u32, Response>,
}

impl LightResponses {
    /// By rows of the scene's lights and instances, those that are not plain.
    pub fn new(
        lights: BTreeMap<u32, Response>,
        instances: BTreeMap<u32, Response>,
    ) -> LightResponses {
        LightResponses { lights, instances }
    }

    /// Whether no light has any.
    pub fn is_empty(&self) -> bool {
        self.lights.is_empty() && self.instances.is_empty()
    }

    /// Those of a light.
    pub fn of_light(&self, light: u32) -> Response {
        self.lights.get(&light).copied().unwrap_or(Response::PLAIN)
    }

    /// Those of an instance's light.
    pub fn of_instance(&self, instance: u32) -> Response {
        self.instances.get(&instance).copied().unwrap_or(Response::PLAIN)
    }

    /// The rows of lights that have some.
    pub fn lights(&self) -> impl Iterator<Item = u32> + '_ {
        self.lights.keys().copied()
    }

    /// The rows of instances that have some.
    pub fn instances(&self) -> impl Iterator<Item = u32> + '_ {
        self.instances.keys().copied()
    }
}

impl Scene {
    /// How many times a light counts where lights are picked.
    #[inline]
    pub fn effect_of_light(&self, light: u32) -> f32 {
        match self.light_responses.is_empty() {
            true => 1.0,
            false => self.light_responses.of_light(light).effect(),
        }
    }

    /// The same of an instance's light.
    #[inline]
    pub fn effect_of_instance(&self, instance: u32) -> f32 {
        match self.light_responses.is_empty() {
            true => 1.0,
            false => self.light_responses.of_instance(instance).effect(),
        }
    }
}
