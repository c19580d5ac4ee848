//! Walks: the vertices of paths, without light.

use super::camera::CameraRay;
use super::path::Integrator;
use super::rays::{Passed, Sender};
use super::vertex::Vertex;
use crate::math::random::Sampler;
use glam::Vec2;

impl Integrator<'_> {
    /// Pixel `number` of `of` that are spread over the picture, by a lattice of rank 1: its column and row.
    pub fn spread_pixel(&self, number: u32, of: u32) -> (u32, u32) {
        let (width, height) = (self.settings.width, self.settings.height);
        let x = (number as f32 + 0.5) / of as f32 * width as f32;
        let y = (f64::from(number) * 0.618_033_988_749_895).fract() as f32 * height as f32;
        ((x as u32).min(width - 1), (y as u32).min(height - 1))
    }

    /// The vertex that a path from the eye reaches after `bounces` bounces, or its last one if it ends
    /// earlier. `None` if it hits nothing that reflects.
    pub fn probe(&self, x: u32, y: u32, seed: u32, bounces: u32) -> Option<Vertex> {
        let mut last = None;
        self.for_each_vertex((x, y), seed, bounces + 1, |vertex| last = Some(*vertex));
        last
    }

    /// Calls `visit` with the first vertices of a path through a pixel, at most so many.
    pub fn for_each_vertex(
        &self,
        (x, y): (u32, u32),
        seed: u32,
        most: u32,
        mut visit: impl FnMut(&Vertex),
    ) {
        let mut sampler = Sampler::new(seed, 0);
        let [px, py, lx, ly] = sampler.next_4d();
        let CameraRay { mut origin, mut direction, mut reach_m } =
            self.camera.ray(x, y, Vec2::new(px, py), Vec2::new(lx, ly));
        let accept = self.cutouts(seed);
        let mut passed = Passed::default();
        for bounce in 0..most {
            let sender = if bounce == 0 { Sender::Camera } else { Sender::Surface };
            let ray = (origin, direction, reach_m);
            let hit = self.tracer.look(sender, ray, &accept, &mut passed).hit;
            reach_m = f32::INFINITY;
            let vertex = if passed.panes.is_empty() {
                hit.and_then(|hit| self.vertex(&hit, -direction))
            } else {
                self.tint_panes(&mut passed, direction);
                let [u, ..] = sampler.next_4d();
                self.through_panes((origin, direction), (None, f32::INFINITY), &passed, hit, u)
                    .vertex
            };
            let Some(vertex) = vertex else { break };
            let [lobe, bu, bv, _] = sampler.next_4d();
            let next = vertex.reflection.sample(lobe, Vec2::new(bu, bv));
            let next = next.filter(|next| vertex.lets_through(next.wi));
            visit(&vertex);
            let Some(next) = next else { break };
            origin = vertex.anchor.origin_toward(next.wi);
            direction = next.wi;
        }
    }
}
