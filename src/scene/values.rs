//! The strength of lights: a constant, or keys where it varies.

use super::{Keys, Pose, Scene};
use crate::math::color::Rgb;

impl Scene {
    /// The strength of a light in a pose, in its own unit: candela, nits or lux.
    #[inline]
    pub fn rgb_of_light(&self, light: u32, pose: &Pose) -> Rgb {
        pose.light_rgb(light).unwrap_or_else(|| self.lights[light as usize].kind.rgb())
    }

    /// The emission of an instance's mesh in a pose, nits, before its texture. A mesh without a
    /// material emits nothing.
    #[inline]
    pub fn rgb_of_instance(&self, instance: u32, pose: &Pose) -> Rgb {
        match self.material_of(self.instances[instance as usize].mesh) {
            Some(material) => pose.instance_rgb(instance).unwrap_or(material.emission_nits),
            None => Rgb::ZERO,
        }
    }

    /// The largest that each component of [`rgb_of_light`](Self::rgb_of_light) ever is: a light that
    /// is dark in one frame may shine in another.
    pub fn peak_rgb_of_light(&self, light: u32) -> Rgb {
        let light = &self.lights[light as usize];
        light.values.as_deref().map_or_else(|| light.kind.rgb(), Keys::peak)
    }

    /// The largest that each component of [`rgb_of_instance`](Self::rgb_of_instance) ever is.
    pub fn peak_rgb_of_instance(&self, instance: u32) -> Rgb {
        let instance = &self.instances[instance as usize];
        match self.material_of(instance.mesh) {
            Some(material) => instance.values.as_deref().map_or(material.emission_nits, Keys::peak),
            None => Rgb::ZERO,
        }
    }
}
