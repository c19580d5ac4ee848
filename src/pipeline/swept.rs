//! The bounds of emitters over the time that a shutter is open.

use crate::bounds::LightBounds;
use rayon::prelude::*;

/// What rounding may lose of a cone while it grows, radians.
const LOST_RAD: f32 = 1e-5;

/// Bounds that contain emitters at several times, one emitter after the other.
pub(super) struct Swept {
    bounds: Vec<LightBounds>,
    /// Energies, summed over the times.
    energies: Vec<f64>,
}

impl Swept {
    /// At one time.
    pub fn new(bounds: Vec<LightBounds>) -> Swept {
        let energies = bounds.iter().map(|own| own.energy.into()).collect();
        Swept { bounds, energies }
    }

    /// And at another; the emitters are the same.
    pub fn add(&mut self, at: &[LightBounds]) {
        let own = self.bounds.par_iter_mut().zip(&mut self.energies);
        own.zip(at).for_each(|((own, energy), at)| {
            *energy += f64::from(at.energy);
            if (own.aabb, own.cone) != (at.aabb, at.cone) {
                let LightBounds { aabb, cone, .. } = *own;
                own.aabb = aabb.union(&at.aabb);
                own.cone = cone.union(&at.cone);
            }
        });
    }

    /// The bounds over so many times, with the mean energies.
    pub fn over(mut self, times: usize) -> Vec<LightBounds> {
        for (own, energy) in self.bounds.iter_mut().zip(self.energies) {
            own.energy = (energy / times as f64) as f32;
            if own.cone.theta_o > 0.0 {
                own.cone.theta_o = (own.cone.theta_o + LOST_RAD).min(std::f32::consts::PI);
            }
        }
        self.bounds
    }
}
