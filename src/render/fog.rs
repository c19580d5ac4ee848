//! Homogeneous fog, once scattered.
//!
//! Along every stretch of a path lights are picked for the whole stretch (seed, "Extending to volume
//! render"); for each a point of the stretch is drawn by the angle under which the light sees it
//! (Kulla and Fajardo 2012, "Importance Sampling Techniques for Path Tracing in Participating Media",
//! section 4), which cancels the pole of `1/d^2`, and only where the light can shine, which a narrow
//! beam does on a short part; and from there light is taken as from any point. A
//! light at infinity sees nothing under an angle: for it, points are drawn by what the fog lets
//! through. Light that is scattered twice is left out.
//!
//! Fog that has no box fills the one around everything in the scene, so that suns and domes reach it.

use super::direct::another;
use super::path::{Integrator, PathScratch};
use super::picker::Wanted;
use super::rays::Anchor;
use crate::light_tree::{Picked, Segment};
use crate::math::color::{Rgb, luminance};
use crate::scene::{Camera, Medium, Pose, Scene};
use glam::{Affine3A, Vec2, Vec3};
use std::f32::consts::PI;

/// Fog in one pose.
#[derive(Clone, Debug)]
pub struct Fog {
    /// What a metre of it scatters, 1/m.
    scattering: Rgb,
    /// What it scatters and absorbs, 1/m.
    extinction: Rgb,
    anisotropy: f32,
    /// World space to the space of its box.
    to_box: Affine3A,
    min: Vec3,
    max: Vec3,
}

impl Fog {
    /// The fog of a scene, if it has any.
    pub fn new(scene: &Scene, pose: &Pose, camera: &Camera) -> Option<Fog> {
        let Medium { scattering, absorption, anisotropy, region } = scene.medium.as_ref()?.clone();
        let (to_box, min, max) = match region {
            Some(region) => (pose.world(region.node).inverse(), region.min, region.max),
            None => {
                let (min, max) = around_everything(scene, pose, camera);
                (Affine3A::IDENTITY, min, max)
            }
        };
        let extinction = scattering + absorption;
        let is_there = to_box.is_finite() && extinction.max_element() > 0.0;
        is_there.then_some(Fog { scattering, extinction, anisotropy, to_box, min, max })
    }

    /// Where a ray is inside, between 0 and a length, metres.
    fn inside(&self, origin: Vec3, direction: Vec3, length: f32) -> Option<(f32, f32)> {
        let o = self.to_box.transform_point3(origin);
        let d = self.to_box.transform_vector3(direction);
        let (mut from, mut to) = (0f32, length);
        for axis in 0..3 {
            let (a, b) =
                ((self.min[axis] - o[axis]) / d[axis], (self.max[axis] - o[axis]) / d[axis]);
            // In the plane of a face, both are infinite or not numbers: then the side decides.
            if d[axis] == 0.0 {
                if o[axis] < self.min[axis] || o[axis] > self.max[axis] {
                    return None;
                }
                continue;
            }
            from = from.max(a.min(b));
            to = to.min(a.max(b));
        }
        (from < to).then_some((from, to))
    }

    /// The share of light that a stretch lets through.
    pub fn transmittance(&self, origin: Vec3, direction: Vec3, length: f32) -> Rgb {
        match self.inside(origin, direction, length) {
            Some((from, to)) => self.through(to - from),
            None => Rgb::ONE,
        }
    }

    fn through(&self, metres: f32) -> Rgb {
        (-self.extinction * metres).exp()
    }

    /// Henyey and Greenstein's phase function, 1/sr, of the cosine by which light is turned.
    fn phase(&self, cosine: f32) -> f32 {
        let g = self.anisotropy;
        let base = (1.0 + g * g - 2.0 * g * cosine).max(1e-7);
        (1.0 - g * g) / (4.0 * PI * base * base.sqrt())
    }
}

/// A place on a stretch.
struct Drawn {
    /// Metres from its begin.
    t: f32,
    /// 1/m.
    pdf: f32,
}

/// A place by the angle under which a point sees it.
fn by_angle(segment: &Segment, seen_from: Vec3, u: f32) -> Option<Drawn> {
    let to_point = seen_from - segment.origin;
    let nearest = to_point.dot(segment.direction);
    let off = (to_point - nearest * segment.direction).length();
    // On the line itself every angle is the same: keep a little off it.
    let off = off.max(1e-5 * segment.length).max(f32::MIN_POSITIVE);
    // From there to the begin and to the end, along the line. The angle between them is no difference
    // of two large ones, nor is the place: seen from far away, both would be mostly rounding.
    let (begin, end) = (-nearest, segment.length - nearest);
    let angle = (segment.length * off).atan2(off * off + begin * end);
    let (sin, cos) = (u * angle).sin_cos();
    let reach2 = off * off + begin * begin;
    let t = (sin * reach2 / (off * cos - begin * sin)).clamp(0.0, segment.length);
    let pdf = off / (angle * (off * off + (begin + t).powi(2)));
    (pdf.is_finite() && pdf > 0.0).then_some(Drawn { t, pdf })
}

/// A place by what the fog lets through.
fn by_transmittance(length: f32, extinction: f32, u: f32) -> Drawn {
    let lost = -(-extinction * length).exp_m1();
    if lost < 1e-4 {
        return Drawn { t: u * length, pdf: 1.0 / length };
    }
    let t = (-(-u * lost).ln_1p() / extinction).min(length);
    Drawn { t, pdf: extinction * (-extinction * t).exp() / lost }
}

impl Integrator<'_> {
    /// A place where an emitter may shine, by the angle under which it sees it.
    fn by_angle_of(&self, emitter: u32, segment: &Segment, u: f32) -> Option<Drawn> {
        let Segment { origin, direction, length } = *segment;
        let (from, to) = self.emitters.lit_part(emitter, origin, direction, length)?;
        let lit = Segment { origin: origin + from * direction, direction, length: to - from };
        let drawn = by_angle(&lit, self.emitters.middle(emitter), u)?;
        Some(Drawn { t: from + drawn.t, ..drawn })
    }

    /// Light scattered once towards the begin of a stretch of a ray.
    pub(super) fn scattered(
        &self,
        fog: &Fog,
        (origin, direction, length): (Vec3, Vec3, f32),
        ([u_pick, u_place, lu, lv], salt): ([f32; 4], u32),
        accept: &impl Fn(u32, u32, Vec2) -> bool,
        scratch: &mut PathScratch,
    ) -> Rgb {
        let Some((from, to)) = fog.inside(origin, direction, length) else { return Rgb::ZERO };
        let segment = Segment { origin: origin + from * direction, direction, length: to - from };
        let extinction = luminance(fog.extinction).max(f32::MIN_POSITIVE);
        let lost = -(-extinction * segment.length).exp_m1();
        let wanted = Wanted::Along(segment, lost / extinction);
        let mut sum = Rgb::ZERO;
        let PathScratch { picks, stats, .. } = scratch;
        self.picker.pick(&wanted, u_pick, salt, picks, |pick| {
            stats.light_picks += 1;
            let place = another(Vec2::new(u_place, 0.0), salt, pick.light).x;
            let drawn = match pick.light {
                Picked::Emitter(emitter) => self.by_angle_of(emitter, &segment, place),
                Picked::Beside(_) => Some(by_transmittance(segment.length, extinction, place)),
            };
            let Some(Drawn { t, pdf }) = drawn else { return };
            let point = segment.origin + t * direction;
            let u = another(Vec2::new(lu, lv), !salt, pick.light);
            let Some(light) = self.incoming(pick.light, point, Vec3::ZERO, u) else { return };
            stats.rays += 1;
            let arriving = self.arriving(&Anchor::free(point), &light, accept);
            let turned = fog.phase(light.direction.dot(direction));
            let density = pick.probability as f32 * pdf * light.pdf.unwrap_or(1.0);
            sum += fog.scattering * fog.through(t) * arriving * light.radiance * (turned / density);
        });
        sum
    }
}

/// A box around all meshes, all lights that are somewhere, and the camera.
fn around_everything(scene: &Scene, pose: &Pose, camera: &Camera) -> (Vec3, Vec3) {
    let mut boxes = vec![None; scene.meshes.len()];
    let (mut min, mut max) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let mut add = |p: Vec3| (min, max) = (min.min(p), max.max(p));
    for instance in &scene.instances {
        let (low, high) = *boxes[instance.mesh as usize].get_or_insert_with(|| {
            let positions = &scene.meshes[instance.mesh as usize].positions;
            positions.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), &p| {
                (low.min(p), high.max(p))
            })
        });
        let world = pose.world(instance.node);
        for corner in (0..8).filter(|_| low.cmple(high).all()) {
            let pick = |axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
            add(world.transform_point3(Vec3::new(pick(0), pick(1), pick(2))));
        }
    }
    let somewhere = scene.lights.iter().filter(|light| !light.kind.is_infinite());
    for node in somewhere.map(|light| light.node).chain([camera.node]) {
        add(pose.world(node).translation.into());
    }
    (min, max)
}
