//! Floor 1: what bounds an emitter or a cluster of emitters.
//!
//! A [`LightBounds`] is a box, a cone of orientations and an energy: everything the light tree knows
//! of a light. `emitter` makes them, `light_tree` builds over them, and neither knows the other.
//! Nothing here samples, and nothing here knows what kind of light it bounds.
//!
//! Source: Conty Estevez and Kulla, "Importance Sampling of Many Lights with Adaptive Tree
//! Splitting", HPG 2018.

mod aabb;
mod cone;

pub use aabb::Aabb;
pub use cone::Cone;

/// Box, cone and energy of one emitter or of a cluster.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightBounds {
    /// Contains every emitting point, metres.
    pub aabb: Aabb,
    /// Contains every emitting direction.
    pub cone: Cone,
    /// An estimate of what it contributes: the peak radiant intensity of its emitters, summed. One
    /// scale for all kinds (`I` of a point, `L A` of a triangle). Positive.
    pub energy: f32,
    /// What it sends in the mean over all directions, as a share of `energy`: 1 for a point or a sphere, 1/4 for a
    /// face. It tells spheres from faces where normals point everywhere.
    pub share: f32,
    /// Beyond this distance it gives no light (glTF's `range`), metres; infinite if it is physical.
    pub range_m: f32,
}

impl LightBounds {
    /// The bounds of one emitter, whose share is that of its cone.
    pub fn of_emitter(aabb: Aabb, cone: Cone, energy: f32, range_m: f32) -> LightBounds {
        LightBounds { aabb, cone, energy, share: cone.share(), range_m }
    }

    /// The bounds around several.
    ///
    /// # Panics
    /// If there are none.
    pub fn around(parts: &[LightBounds]) -> LightBounds {
        let cones: Vec<Cone> = parts.iter().map(|part| part.cone).collect();
        let energy: f64 = parts.iter().map(|part| f64::from(part.energy)).sum();
        let sent = parts.iter().map(|part| f64::from(part.energy) * f64::from(part.share));
        LightBounds {
            aabb: parts.iter().fold(Aabb::EMPTY, |all, part| all.union(&part.aabb)),
            cone: Cone::around(&cones),
            energy: energy as f32,
            share: (sent.sum::<f64>() / energy) as f32,
            range_m: parts.iter().map(|part| part.range_m).fold(0.0, f32::max),
        }
    }

    /// Whether every number is finite and the energy positive: what the tree may be built over.
    pub fn is_sound(&self) -> bool {
        let numbers = [self.aabb.min, self.aabb.max, self.cone.axis];
        numbers.iter().all(|v| v.is_finite())
            && self.aabb.min.cmple(self.aabb.max).all()
            && self.cone.theta_o.is_finite()
            && self.cone.theta_e.is_finite()
            && self.energy.is_finite()
            && self.energy > 0.0
            && (0.0..=1.0).contains(&self.share)
            && self.range_m > 0.0
    }
}
