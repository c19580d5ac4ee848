//! What one ray sees: the surface it ends on, and the lights on the way.
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

use super::anchor::Anchor;
use super::meeting::{Hit, Meeting};
use super::prim::{Prim, Role, Sender};
use super::triangles::Ray;

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
}

/// What a ray saw but for the lights.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// Where it ended.
    pub hit: Option<Hit>,
    /// What the ray does not meet, but a ray to a light would, stands before the end.
    pub in_shade: bool,
}

/// What a ray has seen so far.
pub(super) struct Sight<'a> {
    ray: &'a Ray,
    sender: Sender,
    tmax: f64,
    nearest: Option<(Meeting<'a>, Prim)>,
    /// The nearest other surface.
    second: f64,
    shade: f64,
    lights: &'a mut Vec<SeenLight>,
}

impl<'a> Sight<'a> {
    pub fn new(ray: &'a Ray, sender: Sender, tmax: f64, lights: &'a mut Vec<SeenLight>) -> Self {
        lights.clear();
        let (second, shade) = (f64::INFINITY, f64::INFINITY);
        Sight { ray, sender, tmax, nearest: None, second, shade, lights }
    }

    /// How far apart along the normal surfaces at a distance may be, in lengths of the direction.
    fn tolerance(&self, t: f64) -> f64 {
        let place = self.ray.origin + t * self.ray.direction;
        ONE_SURFACE * place.abs().max_element() / self.ray.direction.length()
            + 4.0 * f64::EPSILON * t
    }

    /// Beyond this nothing is of interest.
    pub fn limit(&self) -> f64 {
        match &self.nearest {
            Some((Meeting { t, .. }, _)) => (t + self.tolerance(*t) / LEAST_COSINE).min(self.tmax),
            None => self.tmax,
        }
    }

    /// Takes in what the ray met, if `counts` says that it is there.
    pub fn meet(&mut self, meeting: &Meeting<'a>, prim: &Prim, counts: impl FnOnce() -> bool) {
        let (role, shines) = if prim.is_plain() {
            (Role::Surface, false)
        } else {
            let front = meeting.is_front(self.ray, prim);
            (prim.role(self.sender, front), prim.shines_toward(front))
        };
        if role == Role::Nothing || !counts() {
            return;
        }
        let t = meeting.t;
        if role == Role::Shade {
            self.shade = self.shade.min(t);
            return;
        }
        let is_surface = role == Role::Surface;
        if shines {
            let cosine = meeting.cosine(self.ray, prim).max(LEAST_COSINE);
            let hit = meeting.hit(self.ray, prim);
            self.lights.push(SeenLight { hit, t, cosine, is_surface });
        }
        if !is_surface {
            return;
        }
        let place = |meeting: &Meeting, prim: &Prim| (prim.rank, meeting.triangle());
        let is_nearer = self.nearest.as_ref().is_none_or(|(other, of)| {
            t < other.t || (t == other.t && place(meeting, prim) < place(other, of))
        });
        if is_nearer {
            if let Some((before, _)) = self.nearest.replace((*meeting, *prim)) {
                self.second = self.second.min(before.t);
            }
        } else {
            self.second = self.second.min(t);
        }
    }

    /// What was seen. Leaves the lights that are not hidden, in the order in which they are met.
    pub fn finish(self) -> Seen {
        let end = self.nearest.as_ref().map_or(f64::INFINITY, |(nearest, _)| nearest.t);
        let tolerance = if end.is_finite() { self.tolerance(end) } else { 0.0 };
        let before = end.min(self.shade);
        self.lights.retain(|light| light.t <= before + tolerance / light.cosine);
        self.lights.sort_unstable_by(|a, b| {
            a.t.total_cmp(&b.t).then_with(|| a.hit.surface.order().cmp(&b.hit.surface.order()))
        });
        let hit = self.nearest.map(|(nearest, prim)| {
            let light = self.lights.iter().find(|light| light.is_surface);
            let hit = light.map_or_else(|| nearest.hit(self.ray, &prim), |light| light.hit);
            if self.second == f64::INFINITY {
                return hit;
            }
            let cosine = nearest.cosine(self.ray, &prim).max(LEAST_COSINE);
            if self.second > end + tolerance / cosine {
                return hit;
            }
            // A ray that leaves one of the surfaces must leave all of them.
            let apart = ONE_SURFACE as f32 * hit.anchor.position.abs().max_element();
            let error_m = hit.anchor.error_m.max(apart);
            Hit { anchor: Anchor { error_m, ..hit.anchor }, ..hit }
        });
        Seen { hit, in_shade: self.shade < end }
    }
}
