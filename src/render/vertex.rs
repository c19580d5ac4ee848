//! Vertices: the points of a path where light is reflected, or bent by glass.

use super::bsdf::Reflection;
use super::path::Integrator;
use super::picker::{Site, Wanted};
use super::rays::{Anchor, Hit, HitSurface};
use crate::emitter::Lit;
use crate::light_tree::{Cell, Glossy, Lobes, Receiver, ReceiverClass};
use crate::math::built_in;
use crate::math::color::Rgb;
use crate::math::random::Sampler;
use glam::{Vec2, Vec3};

/// What a stretch of a path goes through: solid glass of some absorption, 1/m, or what fills the space.
pub type Inside = Option<Rgb>;

/// A point on the way, about to be lit.
#[derive(Clone, Copy)]
pub struct Vertex {
    /// Where it is.
    pub anchor: Anchor,
    /// How it reflects.
    pub reflection: Reflection,
    /// Towards the point before it, unit, world space.
    pub wo: Vec3,
    /// What the tree is asked for. It has no normal where light from either side is wanted.
    pub receiver: Receiver,
    /// What is on this side.
    pub here: Inside,
    /// What is on the other.
    pub beyond: Inside,
    /// The link sets that its surface is in; `None` is every set.
    pub membership: Option<u32>,
    /// Which lights light it.
    pub class: ReceiverClass,
}

impl Integrator<'_> {
    /// The vertex at a hit; `None` on a sphere light, which reflects nothing.
    pub(super) fn vertex(&self, hit: &Hit, wo: Vec3) -> Option<Vertex> {
        let HitSurface::Triangle { instance, triangle, barycentric } = hit.surface else {
            return None;
        };
        let surface = self.surfaces.at(instance, triangle, barycentric, hit.anchor, wo);
        let reflection = surface.bsdf().toward(wo);
        let normal = if reflection.transmits() {
            Vec3::ZERO
        } else if reflection.has_two_horizons() {
            // All that is reflected is above the triangle too.
            if surface.front { hit.anchor.normal } else { -hit.anchor.normal }
        } else {
            surface.frame.normal
        };
        let receiver = Receiver { point: hit.anchor.position, normal };
        let links = self.links.filter(|_| built_in::LINKS);
        let unlinked = (None, ReceiverClass::ALL);
        let (membership, class) = links.map_or(unlinked, |links| links.of_instance(instance));
        let [here, beyond] = self.sides(hit, wo);
        let anchor = hit.anchor;
        Some(Vertex { anchor, reflection, wo, receiver, here, beyond, membership, class })
    }

    /// What is on the side of `wo` of a surface, and what on the other. Only solid glass knows.
    pub(super) fn sides(&self, hit: &Hit, wo: Vec3) -> [Inside; 2] {
        let HitSurface::Triangle { instance, .. } = hit.surface else { return [None; 2] };
        let volume = self.surfaces.volume(instance);
        if hit.anchor.normal.dot(wo) >= 0.0 { [None, volume] } else { [volume, None] }
    }

    /// The vertex at a hit of a path that came through something, which it left at some length at the latest.
    pub(super) fn vertex_within(
        &self,
        (inside, leaves_at): (Inside, f32),
        hit: &Hit,
        wo: Vec3,
    ) -> Option<Vertex> {
        let vertex = self.vertex(hit, wo)?;
        let inside = inside.filter(|_| hit.t <= leaves_at);
        // A wall without thickness has the same on both sides.
        let beyond = if vertex.here == vertex.beyond { inside } else { vertex.beyond };
        Some(Vertex { here: inside, beyond, ..vertex })
    }
}

impl Vertex {
    /// What light falls on.
    pub fn lit(&self) -> Lit {
        Lit { point: self.receiver.point, membership: self.membership }
    }

    /// What lights are picked for here. The BSDF is part of it only if it has a specular lobe. With a
    /// sampler, a direction is sampled from the BSDF.
    pub fn wanted(&self, sampler: Option<&mut Sampler>) -> Wanted {
        let receiver = self.receiver;
        let is_glossy =
            |lobes: &Lobes| built_in::GLOSSY && lobes.at_normal + lobes.toward_grazing > 0.0;
        // Where light passes, lights on both sides are wanted: a site without a horizon.
        let lobes = self.reflection.lobes().filter(|_| !self.reflection.transmits());
        let Some((lobes, about)) = lobes.filter(|(lobes, _)| is_glossy(lobes)) else {
            return self.wanted_at(Site::At(receiver));
        };
        // Independent of the direction in which the path continues: that one may hit a light, whose
        // weight must not depend on the direction.
        let drawn = sampler.and_then(|sampler| {
            let [lobe, u, v, _] = sampler.next_4d();
            self.reflection.sample(lobe, Vec2::new(u, v))
        });
        let toward = drawn.map_or(receiver.normal, |sample| sample.wi);
        let glossy = Glossy { receiver, about, to_eye: self.wo, lobes, toward };
        self.wanted_at(Site::Glossy(glossy))
    }

    pub(super) fn wanted_at(&self, site: Site) -> Wanted {
        Wanted { site, cell: Cell::NONE, class: self.class }
    }

    /// Whether `wi` is on the same side as `wo` of the geometric surface, and not only of the shading
    /// normal; where light passes, whether it is on the same side of both.
    pub fn lets_through(&self, wi: Vec3) -> bool {
        let is_same_side = self.anchor.normal.dot(wi) * self.anchor.normal.dot(self.wo) > 0.0;
        if self.reflection.transmits() {
            return is_same_side == self.reflection.is_above(wi);
        }
        is_same_side
    }

    /// Whether a ray that leaves towards `wi` goes through the surface.
    pub fn is_beyond(&self, wi: Vec3) -> bool {
        self.reflection.transmits() && !self.reflection.is_above(wi)
    }
}
