//! What a ray must know of a prim that it meets.

use super::super::surface::is_pane;
use crate::math::built_in;
use crate::math::directions::mirrors;
use crate::scene::{AlphaMode, Material, Pose, Scene, Visibility};

/// Who sent a ray, which decides what it meets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sender {
    /// The camera.
    Camera,
    /// A surface that reflects.
    Surface,
}

/// What a prim is to a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    /// The ray ends on it, or passes it if it is a pane.
    Surface,
    /// The ray takes up its light and goes on.
    Light,
    /// The ray goes on, but a ray to a light would not.
    Shade,
    /// It is not there.
    Nothing,
}

/// A prim at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Prim {
    /// Its place in the order of paths: what decides where two surfaces are one.
    pub rank: u32,
    /// A hit on it must be asked about.
    pub is_cutout: bool,
    /// Rays pass it, tinted.
    pub is_pane: bool,
    /// Solid glass.
    is_solid: bool,
    /// Its transform mirrors.
    pub mirrors: bool,
    visibility: Visibility,
    /// It gives light now.
    shines: bool,
    /// And it does so from either side.
    two_sided: bool,
}

impl Prim {
    /// A row of [`Scene::instances`].
    pub fn instance(scene: &Scene, pose: &Pose, row: u32, rank: u32) -> Prim {
        let instance = &scene.instances[row as usize];
        let material = scene.material_of(instance.mesh);
        Prim {
            rank,
            is_cutout: material.is_some_and(|m| m.alpha_mode != AlphaMode::Opaque),
            is_pane: built_in::TRANSMISSION && material.is_some_and(is_pane),
            is_solid: built_in::TRANSMISSION && material.is_some_and(Material::is_solid_glass),
            mirrors: mirrors(&pose.world(instance.node)),
            visibility: instance.visibility,
            shines: scene.rgb_of_instance(row, pose).max_element() > 0.0,
            two_sided: material.is_some_and(|m| m.double_sided),
        }
    }

    /// A row of [`Scene::lights`]: a sphere, which shines outwards.
    pub fn sphere(scene: &Scene, pose: &Pose, row: u32, rank: u32) -> Prim {
        Prim {
            rank,
            is_cutout: false,
            is_pane: false,
            is_solid: false,
            mirrors: false,
            visibility: scene.lights[row as usize].visibility,
            shines: scene.rgb_of_light(row, pose).max_element() > 0.0,
            two_sided: false,
        }
    }

    /// Whether every ray ends on it, and finds no light.
    #[inline]
    pub fn is_plain(&self) -> bool {
        !self.shines && !self.is_pane && self.visibility == Visibility::ALL
    }

    /// Whether a ray that meets it, at its front or its back, meets light.
    pub fn shines_toward(&self, front: bool) -> bool {
        self.shines && (front || self.two_sided)
    }

    /// Whether it stops rays from a surface to a light.
    pub fn casts_shadow(&self) -> bool {
        self.visibility.shadows
    }

    /// Whether a ray that passes it without meeting it leaves solid glass.
    #[inline]
    pub fn is_left(&self, is_met: bool, front: impl FnOnce() -> bool) -> bool {
        built_in::TRANSMISSION && self.is_solid && !is_met && !front()
    }

    /// What it is to a ray that meets its front or its back. A prim that casts no shadow is nothing
    /// but its light: it is there for who looks at the side that shines, while it shines.
    pub fn role(&self, sender: Sender, front: bool) -> Role {
        let Visibility { camera, reflections, shadows } = self.visibility;
        let shines = self.shines_toward(front);
        match sender {
            Sender::Camera if camera && (shadows || shines) => Role::Surface,
            Sender::Surface if reflections && shadows => Role::Surface,
            Sender::Surface if reflections && shines => Role::Light,
            Sender::Surface if shadows => Role::Shade,
            _ => Role::Nothing,
        }
    }
}
