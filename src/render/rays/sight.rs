//! What one ray sees: the surface it ends on, and the lights and panes on the way.
//!
//! Lights and surfaces may share a place: a panel flush with a ceiling, two lamps put where one was.
//! A light sample is not hidden by what lies within the rounding of its own position, so a reflected
//! ray must not lose that light to it either, or the two ways to find light would not add up. The
//! rule depends on places alone, never on the order of the prims:
//!
//! - Surfaces are one if they are closer than [`ONE_SURFACE`] allows, along the normal.
//! - Of those that are one with the nearest, every light that shines towards the ray is seen.
//! - The ray ends on the nearest of these lights; without one, on the nearest surface. Of two at
//!   the very same distance, it is the one whose path comes first.
//!
//! Panes are glass that light passes straight (see [`is_pane`](super::super::surface::is_pane)). Every pane before the
//! end counts, by itself, as it does for a ray between two points; one that is one with a light does not cover it.

use super::anchor::Anchor;
use super::meeting::{Hit, Meeting, On};
use super::prim::{Prim, Role, Sender};
use super::triangles::Ray;
use crate::math::color::Rgb;
use glam::DVec3;

/// How far apart two surfaces may be, relative to their coordinates, and still be one. Two copies of
/// one plane, each rounded to 32 bits in its own way, are less than half of this apart.
const ONE_SURFACE: f64 = 16.0 * f32::EPSILON as f64;
/// Nearer to the plane than this cosine, a ray is taken to be at this cosine.
const LEAST_COSINE: f64 = 1.0 / 16.0;

/// A light that a ray sees.
#[derive(Clone, Copy, Debug)]
pub struct SeenLight {
    /// Where.
    pub hit: Hit,
    t: f64,
    /// Between the ray and the normal; at least [`LEAST_COSINE`].
    cosine: f64,
    /// The ray may end on it.
    is_surface: bool,
    /// Panes nearer than this are before it, not one with it.
    covered_to: f64,
}

/// A pane that a ray passes.
#[derive(Clone, Copy, Debug)]
pub struct SeenPane {
    /// Where.
    pub hit: Hit,
    /// The share of light that it lets through along the ray: all, until somebody who knows it says otherwise.
    pub tint: Rgb,
    t: f64,
    /// The ray meets it; if not, it tints only what lights send along the ray.
    is_met: bool,
    /// The ray meets its front.
    is_front: bool,
    /// Of the triangle that is met, in the space of its set.
    corners: [DVec3; 3],
}

impl SeenPane {
    /// `None` if it is no triangle.
    pub(super) fn of(meeting: &Meeting, ray: &Ray, prim: &Prim, is_met: bool) -> Option<SeenPane> {
        let On::Triangle { triangle, .. } = meeting.on else { return None };
        let (hit, is_front) = (meeting.hit(ray, prim), meeting.is_front(ray, prim));
        let corners = triangle.corners();
        Some(SeenPane { hit, tint: Rgb::ONE, t: meeting.t, is_met, is_front, corners })
    }

    /// The same with a tint that depends on where it is.
    pub(super) fn tinted(self, tint: impl Fn(&Hit) -> Rgb) -> SeenPane {
        SeenPane { tint: tint(&self.hit), ..self }
    }

    /// Whether two meetings are one: a ray that goes through an edge or a corner may meet all triangles around it.
    /// What lies close together without a common corner, or is left where the other is entered, are two.
    fn is_one_with(&self, other: &SeenPane) -> bool {
        let instance = |pane: &SeenPane| pane.hit.surface.order().1;
        let shares_corner = || self.corners.iter().any(|corner| other.corners.contains(corner));
        instance(self) == instance(other) && self.is_front == other.is_front && shares_corner()
    }
}

/// Puts panes into the order of the ray, each once. How they were found does not matter.
pub(super) fn order_panes(ray: &Ray, panes: &mut Vec<SeenPane>) {
    panes.sort_unstable_by(|a, b| {
        a.t.total_cmp(&b.t).then_with(|| a.hit.surface.order().cmp(&b.hit.surface.order()))
    });
    let mut kept = 0;
    for at in 0..panes.len() {
        let pane = panes[at];
        let tolerance = tolerance_at(ray, pane.t) / LEAST_COSINE;
        let mut near =
            panes[..kept].iter().rev().take_while(|before| pane.t - before.t <= tolerance);
        if !near.any(|before| pane.is_one_with(before)) {
            panes[kept] = pane;
            kept += 1;
        }
    }
    panes.truncate(kept);
}

/// What a ray passes on its way, near things first. Reused from ray to ray.
#[derive(Debug, Default)]
pub struct Passed {
    /// Lights, also that on which it ends.
    pub lights: Vec<SeenLight>,
    /// Panes.
    pub panes: Vec<SeenPane>,
}

impl Passed {
    /// The panes that the ray meets.
    pub fn met(&self) -> impl Iterator<Item = &SeenPane> {
        self.panes.iter().filter(|pane| pane.is_met)
    }

    /// The share of light that panes let through from a point of the ray.
    pub fn tint(&self, t: f32) -> Rgb {
        let before = self.met().take_while(|pane| pane.hit.t < t);
        before.fold(Rgb::ONE, |share, pane| share * pane.tint)
    }

    /// The same from a light.
    pub fn tint_of(&self, light: &SeenLight) -> Rgb {
        let before = self.panes.iter().take_while(|pane| pane.t < light.covered_to);
        before.fold(Rgb::ONE, |share, pane| share * pane.tint)
    }

    /// The same from infinity.
    pub fn tint_of_sky(&self) -> Rgb {
        self.panes.iter().fold(Rgb::ONE, |share, pane| share * pane.tint)
    }

    pub(super) fn clear(&mut self) {
        self.lights.clear();
        self.panes.clear();
    }
}

/// What a ray saw but for what it passed.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// Where it ended.
    pub hit: Option<Hit>,
    /// What the ray does not meet, but a ray to a light would, stands before the end.
    pub in_shade: bool,
    /// Where the ray passes the back of solid glass that it does not meet, before the end; infinite if it does not.
    pub leaves_at: f32,
}

/// What a ray has seen so far.
pub(super) struct Sight<'a> {
    ray: &'a Ray,
    sender: Sender,
    /// Beyond this nothing is of interest.
    limit: f64,
    nearest: Option<(Meeting<'a>, Prim)>,
    /// The nearest other surface.
    second: f64,
    shade: f64,
    leaves_at: f64,
    passed: &'a mut Passed,
}

/// How far apart along the normal surfaces at a distance may be and still be one, in lengths of the direction.
fn tolerance_at(ray: &Ray, t: f64) -> f64 {
    let place = ray.origin + t * ray.direction;
    ONE_SURFACE * place.abs().max_element() / ray.direction.length() + 4.0 * f64::EPSILON * t
}

/// A hit on one of several surfaces in one place: a ray that leaves one of them must leave all.
fn leaving_all(hit: Hit) -> Hit {
    let apart = ONE_SURFACE as f32 * hit.anchor.position.abs().max_element();
    let error_m = hit.anchor.error_m.max(apart);
    Hit { anchor: Anchor { error_m, ..hit.anchor }, ..hit }
}

impl<'a> Sight<'a> {
    pub fn new(ray: &'a Ray, sender: Sender, tmax: f64, passed: &'a mut Passed) -> Self {
        passed.clear();
        let (second, shade, leaves_at) = (f64::INFINITY, f64::INFINITY, f64::INFINITY);
        Sight { ray, sender, limit: tmax, nearest: None, second, shade, leaves_at, passed }
    }

    /// Beyond this nothing is of interest.
    #[inline]
    pub fn limit(&self) -> f64 {
        self.limit
    }

    /// Takes in what the ray met, if `counts` says that it is there.
    pub fn meet(&mut self, meeting: &Meeting<'a>, prim: &Prim, counts: impl FnOnce() -> bool) {
        let (role, shines) = if prim.is_plain() {
            (Role::Surface, false)
        } else {
            let front = meeting.is_front(self.ray, prim);
            (prim.role(self.sender, front), prim.shines_toward(front))
        };
        let t = meeting.t;
        let is_there = role != Role::Nothing && counts();
        if prim.is_left(role == Role::Surface && is_there, || meeting.is_front(self.ray, prim)) {
            self.leaves_at = self.leaves_at.min(t);
        }
        if !is_there {
            return;
        }
        // Without shadows a prim is nothing but its light, and does not tint.
        let is_pane = prim.is_pane && role != Role::Light;
        if is_pane {
            self.passed.panes.extend(SeenPane::of(meeting, self.ray, prim, role == Role::Surface));
        } else if role == Role::Shade {
            self.shade = self.shade.min(t);
            return;
        }
        let is_surface = role == Role::Surface && !is_pane;
        if shines && role != Role::Shade {
            let cosine = meeting.cosine(self.ray, prim).max(LEAST_COSINE);
            let hit = meeting.hit(self.ray, prim);
            let covered_to = t;
            self.passed.lights.push(SeenLight { hit, t, cosine, is_surface, covered_to });
        }
        if !is_surface {
            return;
        }
        let place = |meeting: &Meeting, prim: &Prim| (prim.rank, meeting.triangle());
        let is_nearer = self.nearest.as_ref().is_none_or(|(other, of)| {
            t < other.t || (t == other.t && place(meeting, prim) < place(other, of))
        });
        if is_nearer {
            self.limit = self.limit.min(t + tolerance_at(self.ray, t) / LEAST_COSINE);
            if let Some((before, _)) = self.nearest.replace((*meeting, *prim)) {
                self.second = self.second.min(before.t);
            }
        } else {
            self.second = self.second.min(t);
        }
    }

    /// What was seen. Leaves the lights that are not hidden, in the order in which they are met.
    pub fn finish(mut self) -> Seen {
        let end = self.nearest.as_ref().map_or(f64::INFINITY, |(nearest, _)| nearest.t);
        let tolerance = if end.is_finite() { tolerance_at(self.ray, end) } else { 0.0 };
        let before = end.min(self.shade);
        self.passed.lights.retain(|light| light.t <= before + tolerance / light.cosine);
        self.passed.lights.sort_unstable_by(|a, b| {
            a.t.total_cmp(&b.t).then_with(|| a.hit.surface.order().cmp(&b.hit.surface.order()))
        });
        let flush = self.settle_panes(end, tolerance);
        let hit = self.nearest.map(|(nearest, prim)| {
            let light = self.passed.lights.iter().find(|light| light.is_surface);
            let hit = light.map_or_else(|| nearest.hit(self.ray, &prim), |light| light.hit);
            if self.second == f64::INFINITY && !flush {
                return hit;
            }
            let cosine = nearest.cosine(self.ray, &prim).max(LEAST_COSINE);
            if self.second > end + tolerance / cosine && !flush {
                return hit;
            }
            leaving_all(hit)
        });
        let leaves_at = if self.leaves_at < end { self.leaves_at as f32 } else { f32::INFINITY };
        Seen { hit, in_shade: self.shade < end, leaves_at }
    }

    /// Sorts out the panes. Whether any is one with the end.
    fn settle_panes(&mut self, end: f64, tolerance: f64) -> bool {
        if self.passed.panes.is_empty() {
            return false;
        }
        let ray = self.ray;
        let beside = |t: f64| tolerance_at(ray, t) / LEAST_COSINE;
        let Passed { lights, panes } = &mut *self.passed;
        panes.retain(|pane| pane.t < end);
        order_panes(ray, panes);
        for at in 1..panes.len() {
            if panes[at].t - panes[at - 1].t <= beside(panes[at].t) {
                panes[at - 1].hit = leaving_all(panes[at - 1].hit);
                panes[at].hit = leaving_all(panes[at].hit);
            }
        }
        for light in lights {
            light.covered_to = light.t - tolerance_at(ray, light.t) / light.cosine;
        }
        let flush = panes.last_mut().filter(|pane| end - pane.t <= tolerance / LEAST_COSINE);
        flush.map(|pane| pane.hit = leaving_all(pane.hit)).is_some()
    }
}
