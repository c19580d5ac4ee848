//! What every light gives to a point.

use crate::light_tree::Picked;
use crate::math::color::luminance;
use crate::render::direct::power_heuristic;
use crate::render::path::Integrator;
use crate::render::vertex::Vertex;
use glam::Vec2;
use std::collections::HashMap;

/// The contribution of an emitter is averaged over a square lattice with this many points along a side.
const POINTS_ALONG: u32 = 3;

/// Contributions to one point, by light.
pub struct Contributions {
    of_emitter: Vec<Contribution>,
    beside: Vec<Contribution>,
}

/// The contribution of one light.
#[derive(Clone, Copy, Debug, Default)]
struct Contribution {
    /// Luminance that the point reflects of it.
    luminance: f32,
    /// The BSDF's pdf over the pdf of a sample on the light; 0 if the light has no pdf.
    by_reflection: f32,
}

impl Contributions {
    /// What a vertex reflects of each light that is not forced, averaged over the points of a lattice on
    /// each. With `visibility`, one shadow ray goes to the first lattice point that the vertex receives
    /// light from, and its transmittance scales the contribution.
    pub fn at(integrator: &Integrator, vertex: &Vertex, visibility: bool) -> Contributions {
        let emitters = integrator.picker.tree().unforced_count();
        let of = |light| contribution(integrator, vertex, light, visibility, POINTS_ALONG);
        Contributions {
            of_emitter: (0..emitters).map(|emitter| of(Picked::Emitter(emitter))).collect(),
            beside: (0..integrator.infinite.len() as u32)
                .map(|row| match integrator.infinite[row as usize].forced {
                    true => Contribution::default(),
                    false => of(Picked::Beside(row)),
                })
                .collect(),
        }
    }

    /// The contribution of one light, times the weight of picking it against finding it by reflection
    /// (power heuristic). `expected` is the expected number of picks of the light.
    pub fn of(&self, light: Picked, expected: f64) -> f64 {
        let Contribution { luminance, by_reflection } = self.row(light);
        f64::from(luminance) * f64::from(power_heuristic(expected as f32, by_reflection))
    }

    /// The luminance that the point reflects of a light.
    pub fn luminance(&self, light: Picked) -> f64 {
        f64::from(self.row(light).luminance)
    }

    /// How many lights at infinity there are.
    pub fn beside_count(&self) -> usize {
        self.beside.len()
    }

    fn row(&self, light: Picked) -> Contribution {
        match light {
            Picked::Emitter(emitter) => self.of_emitter[emitter as usize],
            Picked::Beside(row) => self.beside[row as usize],
        }
    }

    /// The sum of all contributions, without weights.
    pub fn sum(&self) -> f64 {
        let all = self.of_emitter.iter().chain(&self.beside);
        all.map(|light| f64::from(light.luminance)).sum()
    }

    /// `sum of f^2 / p - F^2`: the variance of one sample, given the probability of each light.
    pub fn variance_of_one(&self, probability: impl Fn(Picked) -> f64) -> f64 {
        let emitters = (0..self.of_emitter.len() as u32).map(Picked::Emitter);
        let all = emitters.chain((0..self.beside.len() as u32).map(Picked::Beside));
        let (mut mean, mut second) = (0.0, 0.0);
        for light in all {
            let probability = probability(light);
            let own = if probability > 0.0 { self.of(light, probability) } else { 0.0 };
            if own > 0.0 {
                mean += own;
                second += own * own / probability;
            }
        }
        (second - mean * mean).max(0.0)
    }
}

/// Luminance that a vertex reflects of a light, from the middles of a square lattice over it.
pub fn reflected(
    integrator: &Integrator,
    vertex: &Vertex,
    light: Picked,
    visibility: bool,
    points_along: u32,
) -> f32 {
    contribution(integrator, vertex, light, visibility, points_along).luminance
}

fn contribution(
    integrator: &Integrator,
    vertex: &Vertex,
    light: Picked,
    visibility: bool,
    points_along: u32,
) -> Contribution {
    if integrator.links.is_some_and(|links| !links.lights(vertex.class, light)) {
        return Contribution::default();
    }
    let at = |u: Vec2| {
        let found = integrator.incoming(light, vertex.lit(), vertex.receiver.normal, u)?;
        if !vertex.lets_through(found.direction) {
            return None;
        }
        let (reflected, bsdf_pdf) = integrator.reflects(vertex, light, found.direction);
        let pdf = found.pdf.unwrap_or(1.0);
        let value = Contribution {
            luminance: luminance(reflected * found.radiance) / pdf,
            by_reflection: match found.pdf {
                Some(_) if found.shadow_set.is_none() => bsdf_pdf / pdf,
                _ => 0.0,
            },
        };
        Some((value, found))
    };
    let step = |i: u32| (i as f32 + 0.5) / points_along as f32;
    let points = points_along * points_along;
    let (mut sum, mut middle) = (Contribution::default(), None);
    for i in 0..points {
        let u = Vec2::new(step(i % points_along), step(i / points_along));
        let Some((value, found)) = at(u) else { continue };
        if found.pdf.is_none() {
            (sum, middle) = (value, Some(found));
            break;
        }
        sum.luminance += value.luminance / points as f32;
        sum.by_reflection += value.by_reflection / points as f32;
        middle = middle.or(Some(found));
    }
    if visibility && sum.luminance > 0.0 {
        let accept = integrator.cutouts(0);
        let arriving = middle.map(|found| integrator.arriving(vertex, &found, &accept));
        sum.luminance *= arriving.map_or(0.0, luminance);
    }
    sum
}

/// The probability of each light if picks are proportional to these importances.
pub fn shares(importances: Vec<(Picked, f64)>) -> HashMap<Picked, f64> {
    let total: f64 = importances.iter().map(|(_, importance)| importance).sum();
    importances.into_iter().map(|(light, importance)| (light, importance / total)).collect()
}
