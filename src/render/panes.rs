//! Panes: thin, smooth glass that light passes straight.
//!
//! A pane is no vertex for the light that passes it: rays see through it, and rays between two points go on, both
//! times the product of the [tints](super::bsdf::SurfaceSample::tint) on the way. So lights behind a window are
//! picked, found and weighted as if it were not there. Only where a path goes on is drawn at random: reflected by
//! one of the panes that a ray meets, or from where it ends. The chances follow from what each would reflect of
//! white light, and the path's throughput is divided by that of the place that is drawn.
//!
//! One search of the ray finds all panes before its end, however many, so nothing has to be bounded.

use super::direct::BELOW_ONE;
use super::path::Integrator;
use super::rays::{Hit, Passed};
use super::vertex::{Inside, Vertex};
use crate::math::color::Rgb;
use glam::Vec3;

/// Where a path goes on.
#[derive(Default)]
pub(super) struct Drawn {
    /// From there; `None` if nothing reflects.
    pub vertex: Option<Vertex>,
    /// The share of the light from there that gets to the ray's origin, over the probability.
    pub weight: Rgb,
    /// The share of white light that all that the ray meets reflects, each seen through what is before it. Only if
    /// the ray passes panes.
    pub albedo: Rgb,
}

impl Integrator<'_> {
    /// Tints the panes that a ray passes.
    pub(super) fn tint_panes(&self, passed: &mut Passed, direction: Vec3) {
        for pane in &mut passed.panes {
            pane.tint = self.surfaces.tint(&pane.hit, direction);
        }
    }

    /// Where the path of a ray that passes no panes goes on.
    pub(super) fn at_end(
        &self,
        (origin, direction): (Vec3, Vec3),
        filled: (Inside, f32),
        end: &Hit,
    ) -> Drawn {
        let vertex = self.vertex_within(filled, end, -direction);
        let weight = self.through(filled, origin, direction, end.t);
        Drawn { vertex, weight, albedo: Rgb::ZERO }
    }

    /// Draws where the path of a ray that passes panes goes on: at one of them or at its end. `u` is a random number
    /// in `[0, 1)`.
    pub(super) fn through_panes(
        &self,
        (origin, direction): (Vec3, Vec3),
        filled: (Inside, f32),
        passed: &Passed,
        end: Option<Hit>,
        mut u: f32,
    ) -> Drawn {
        let mut drawn = Drawn::default();
        let (mut share, mut sum, mut chosen) = (Rgb::ONE, 0.0, 0.0);
        let panes = passed.met().map(|pane| (pane.hit, pane.tint));
        for (hit, tint) in panes.chain(end.map(|hit| (hit, Rgb::ZERO))) {
            if let Some(vertex) = self.vertex_within(filled, &hit, -direction) {
                let reflected = share * vertex.reflection.whole_albedo();
                drawn.albedo += reflected;
                let arriving = share * self.through(filled, origin, direction, hit.t);
                let chance = (arriving * vertex.reflection.whole_albedo()).max_element();
                sum += chance;
                // A reservoir: each takes the place of those before it with its share of all so far.
                let own = if chance > 0.0 { chance / sum } else { 0.0 };
                if u < own {
                    u = (u / own).min(BELOW_ONE);
                    chosen = chance;
                    (drawn.vertex, drawn.weight) = (Some(vertex), arriving);
                } else {
                    u = ((u - own) / (1.0 - own)).min(BELOW_ONE);
                }
            }
            share *= tint;
        }
        drawn.weight *= if chosen > 0.0 { sum / chosen } else { 0.0 };
        drawn
    }
}
