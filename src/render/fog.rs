//! Homogeneous fog with single scattering.
//!
//! Lights are picked for each stretch of a path as a whole (seed, "Extending to volume render"). For each
//! picked light one point of the stretch is sampled equi-angularly (Kulla and Fajardo 2012, "Importance
//! Sampling Techniques for Path Tracing in Participating Media", section 4), which cancels the pole of
//! `1/d^2`. Only the part of the stretch that the light can reach is sampled; for a narrow beam that part
//! is short. At that point the light is sampled as at any other. The angle to an infinite light does not
//! change along the stretch, so its points are sampled by transmittance. Multiple scattering is left out.
//!
//! Fog without a box fills the box around everything in the scene: suns and domes could not shine through
//! endless fog.
//!
//! Distances along a ray are in double precision, and a point is rounded to single precision only once.
//! A beam a millimetre wide is therefore hit from kilometres away.

use super::direct::another;
use super::path::{Integrator, PathScratch, TraceStats};
use super::picker::{PickScratch, Site, Wanted};
use super::rays::{Anchor, Passed};
use crate::emitter::Lit;
use crate::light_tree::{Cell, Picked, ReceiverClass, Segment, Splitting};
use crate::math::color::{Rgb, luminance};
use crate::scene::{Camera, Medium, Pose, Scene};
use glam::{DAffine3, DVec3, Vec2, Vec3};
use std::f32::consts::PI;

/// Fog in one pose.
#[derive(Clone, Debug)]
pub struct Fog {
    /// Scattering coefficient, 1/m.
    scattering: Rgb,
    /// Extinction coefficient, scattering plus absorption, 1/m.
    extinction: Rgb,
    anisotropy: f32,
    /// World space to the space of its box.
    to_box: DAffine3,
    min: DVec3,
    max: DVec3,
}

/// A part of a ray. World space, metres.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    origin: DVec3,
    direction: DVec3,
    length: f64,
}

impl Stretch {
    fn at(&self, t: f64) -> DVec3 {
        self.origin + t * self.direction
    }

    fn part(&self, (from, to): (f64, f64)) -> Stretch {
        Stretch { origin: self.at(from), length: to - from, ..*self }
    }
}

impl Fog {
    /// The fog of a scene, if it has any.
    pub fn new(scene: &Scene, pose: &Pose, camera: &Camera) -> Option<Fog> {
        let Medium { scattering, absorption, anisotropy, region } = scene.medium.as_ref()?.clone();
        let (to_box, min, max) = match region {
            Some(region) => {
                let world = pose.world(region.node);
                let translation = Vec3::from(world.translation).as_dvec3();
                let to_world = DAffine3 { matrix3: world.matrix3.as_dmat3(), translation };
                (to_world.inverse(), region.min, region.max)
            }
            None => {
                let (min, max) = around_everything(scene, pose, camera);
                (DAffine3::IDENTITY, min, max)
            }
        };
        let (min, max) = (min.as_dvec3(), max.as_dvec3());
        let extinction = scattering + absorption;
        let is_there = to_box.is_finite() && extinction.max_element() > 0.0;
        is_there.then_some(Fog { scattering, extinction, anisotropy, to_box, min, max })
    }

    /// The interval of a stretch that is inside the fog's box, metres from its start.
    fn inside(&self, stretch: &Stretch) -> Option<(f64, f64)> {
        let o = self.to_box.transform_point3(stretch.origin);
        let d = self.to_box.transform_vector3(stretch.direction);
        let (mut from, mut to) = (0.0, stretch.length);
        for axis in 0..3 {
            // Parallel to a face both quotients are infinite or NaN; the origin alone decides.
            if d[axis] == 0.0 {
                if o[axis] < self.min[axis] || o[axis] > self.max[axis] {
                    return None;
                }
                continue;
            }
            let [a, b] = [self.min, self.max].map(|side| (side[axis] - o[axis]) / d[axis]);
            from = a.min(b).max(from);
            to = a.max(b).min(to);
        }
        (from < to).then_some((from, to))
    }

    /// The transmittance of a stretch of a ray.
    pub fn transmittance(&self, origin: Vec3, direction: Vec3, length: f32) -> Rgb {
        match self.inside(&stretch(origin, direction, length)) {
            Some((from, to)) => self.through(to - from),
            None => Rgb::ONE,
        }
    }

    fn through(&self, metres: f64) -> Rgb {
        (self.extinction.as_dvec3() * -metres).exp().as_vec3()
    }

    /// Henyey and Greenstein's phase function, 1/sr. Light arrives from `toward_light` and leaves along
    /// `-ray`; both are unit.
    fn phase(&self, toward_light: Vec3, ray: Vec3) -> f32 {
        let g = self.anisotropy;
        // 1 + g^2 - 2 g cos, written with the chord between the directions: at the peak of a narrow
        // lobe the plain sum would be nothing but rounding error.
        let peak = if g < 0.0 { toward_light + ray } else { toward_light - ray };
        let base = (1.0 - g.abs()).powi(2) + g.abs() * peak.length_squared();
        (1.0 - g.abs()) * (1.0 + g.abs()) / (4.0 * PI * base * base.sqrt())
    }
}

fn stretch(origin: Vec3, direction: Vec3, length: f32) -> Stretch {
    let (origin, direction) = (origin.as_dvec3(), direction.as_dvec3());
    Stretch { origin, direction, length: length.into() }
}

/// A sampled point of a stretch.
struct Drawn {
    /// Metres from the start.
    t: f64,
    /// 1/m.
    pdf: f64,
}

/// Equi-angular sampling: a point of a stretch, uniform in the angle under which `seen_from` sees it.
fn by_angle(stretch: &Stretch, seen_from: DVec3, u: f64) -> Option<Drawn> {
    let to_point = seen_from - stretch.origin;
    let nearest = to_point.dot(stretch.direction);
    let off = (to_point - nearest * stretch.direction).length();
    // On the line itself the angle does not change along it: keep a little off.
    let off = off.max(1e-5 * stretch.length).max(f64::MIN_POSITIVE);
    // Along the line from the nearest point to the start and to the end. Neither the angle between them
    // nor `t` is a difference of large numbers, which from far away would be only rounding error.
    let (begin, end) = (-nearest, stretch.length - nearest);
    let angle = (stretch.length * off).atan2(off * off + begin * end);
    let (sin, cos) = (u * angle).sin_cos();
    let reach2 = off * off + begin * begin;
    let t = (sin * reach2 / (off * cos - begin * sin)).clamp(0.0, stretch.length);
    let pdf = off / (angle * (off * off + (begin + t).powi(2)));
    (pdf.is_finite() && pdf > 0.0).then_some(Drawn { t, pdf })
}

/// A point of a stretch with density proportional to transmittance.
fn by_transmittance(length: f64, extinction: f64, u: f64) -> Drawn {
    let lost = -(-extinction * length).exp_m1();
    let t = (-(-u * lost).ln_1p() / extinction).min(length);
    Drawn { t, pdf: extinction * (-extinction * t).exp() / lost }
}

impl Integrator<'_> {
    /// Samples the part of a stretch that an emitter can illuminate, equi-angularly about its middle.
    fn by_angle_of(&self, emitter: u32, stretch: &Stretch, u: f64) -> Option<Drawn> {
        let Stretch { origin, direction, length } = *stretch;
        let (from, to) = self.emitters.lit_part(emitter, origin, direction, length)?;
        let middle = self.emitters.middle(emitter).as_dvec3();
        let drawn = by_angle(&stretch.part((from, to)), middle, u)?;
        Some(Drawn { t: from + drawn.t, ..drawn })
    }

    /// Light that the fog along a stretch of a ray scatters, once, towards the ray's origin, through the panes that the
    /// ray passes. `throughput` is the share of it that gets to the eye: the result is without it.
    pub(super) fn scattered(
        &self,
        (fog, passed): (&Fog, &Passed),
        (origin, direction, length): (Vec3, Vec3, f32),
        numbers: ([f32; 4], u32),
        accept: &impl Fn(u32, u32, Vec2) -> bool,
        (bounce, throughput): (u32, Rgb),
        scratch: &mut PathScratch,
    ) -> Rgb {
        let whole = stretch(origin, direction, length);
        let Some(part) = fog.inside(&whole) else { return Rgb::ZERO };
        let stretch = whole.part(part);
        let extinction = f64::from(luminance(fog.extinction).max(f32::MIN_POSITIVE));
        let lost = -(-extinction * stretch.length).exp_m1();
        let (origin, length) = (stretch.origin.as_vec3(), stretch.length as f32);
        let segment = Segment { origin, direction, length };
        let site = Site::Along(segment, (lost / extinction) as f32);
        let unlinked = (None, ReceiverClass::ALL);
        let (membership, class) = self.links.map_or(unlinked, |links| links.of_fog());
        let wanted = Wanted { site, cell: Cell::NONE, class };
        let mut sum = Rgb::ZERO;
        let PathScratch { picks, stats, by_group, blocked, trial, .. } = scratch;
        let how = self.picker.splitting(bounce);
        let through = |t: f64| passed.tint((part.0 + t) as f32);
        let part = (fog, membership, &stretch, &through);
        self.gather_along(
            part,
            (&wanted, how),
            numbers,
            accept,
            (picks, stats),
            |light, whole, arriving| {
                if arriving == Rgb::ZERO {
                    *blocked += f64::from(luminance(throughput * whole)).powi(2);
                    return;
                }
                self.count_in_group(light, throughput * whole * arriving, by_group);
                sum += whole * arriving;
            },
        );
        if let Some(trial) = trial {
            trial.at(bounce, throughput, |how, numbers, stats| {
                let (wanted, room) = ((&wanted, how), (&mut *picks, stats));
                let mut sum = Rgb::ZERO;
                self.gather_along(part, wanted, numbers, accept, room, |_, whole, arriving| {
                    sum += whole * arriving;
                });
                sum
            });
        }
        sum
    }

    /// Picks lights for a stretch inside the fog and calls `visit` with each, what is scattered of
    /// it if nothing blocks it, and the share that arrives. `through` is what panes let through from a point of it.
    fn gather_along(
        &self,
        (fog, membership, stretch, through): (&Fog, Option<u32>, &Stretch, &impl Fn(f64) -> Rgb),
        (wanted, how): (&Wanted, &Splitting),
        ([u_pick, u_place, lu, lv], salt): ([f32; 4], u32),
        accept: &impl Fn(u32, u32, Vec2) -> bool,
        (picks, stats): (&mut PickScratch, &mut TraceStats),
        mut visit: impl FnMut(Picked, Rgb, Rgb),
    ) {
        let direction = stretch.direction.as_vec3();
        let extinction = f64::from(luminance(fog.extinction).max(f32::MIN_POSITIVE));
        let weighed = picks.weighed();
        self.picker.pick(wanted, how, (u_pick, salt), picks, |pick| {
            stats.light_picks += 1;
            stats.groups += u64::from(pick.weighed);
            let place = f64::from(another(Vec2::new(u_place, 0.0), salt, pick.light).x);
            let drawn = match pick.light {
                Picked::Emitter(emitter) => self.by_angle_of(emitter, stretch, place),
                Picked::Beside(_) => Some(by_transmittance(stretch.length, extinction, place)),
            };
            let Some(Drawn { t, pdf }) = drawn else { return };
            let point = stretch.at(t).as_vec3();
            let u = another(Vec2::new(lu, lv), !salt, pick.light);
            let lit = Lit { point, membership };
            let Some(incoming) = self.incoming(pick.light, lit, Vec3::ZERO, u) else { return };
            stats.rays += 1;
            stats.shadow_rays += 1;
            let arriving = self.arriving_within(None, &Anchor::free(point), &incoming, accept);
            let turned = f64::from(fog.phase(incoming.direction, direction));
            let density = pick.probability * pdf * f64::from(incoming.pdf.unwrap_or(1.0));
            let weight = (turned / density) as f32;
            let whole = fog.scattering * fog.through(t) * incoming.radiance * weight * through(t);
            visit(pick.light, whole, arriving);
        });
        stats.groups += picks.weighed() - weighed;
    }
}

/// The box around all meshes, all finite lights, and the camera.
fn around_everything(scene: &Scene, pose: &Pose, camera: &Camera) -> (Vec3, Vec3) {
    let mut boxes = vec![None; scene.meshes.len()];
    let (mut min, mut max) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let mut add = |p: Vec3| (min, max) = (min.min(p), max.max(p));
    for instance in &scene.instances {
        let (low, high) = *boxes[instance.mesh as usize].get_or_insert_with(|| {
            let positions = pose.positions(scene, instance.mesh);
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn fog(scattering: f32, anisotropy: f32, to_box: DAffine3) -> Fog {
        let scattering = Rgb::splat(scattering);
        let (min, max) = (DVec3::ZERO, DVec3::ONE);
        Fog { scattering, extinction: scattering, anisotropy, to_box, min, max }
    }

    proptest! {
        /// Of lobes as narrow as 32 bits can say, forwards and backwards.
        #[test]
        fn the_phase_function_scatters_all_light(sharp in -7.0..0.0, backward in any::<bool>()) {
            let g = 1.0 - 10f64.powf(sharp) as f32;
            let fog = fog(1.0, if backward { -g } else { g }, DAffine3::IDENTITY);
            // Steps that grow with the angle off the peak, from far inside the lobe.
            let (n, least) = (4000, 1e-9f64);
            let ratio = (std::f64::consts::PI / least).powf(1.0 / f64::from(n));
            let sum: f64 = (0..n).map(|i| least * ratio.powf(f64::from(i) + 0.5)).map(|theta| {
                let (sin, cos) = theta.sin_cos();
                let side = if backward { -1.0 } else { 1.0 };
                let toward = Vec3::new(sin as f32, 0.0, (side * cos) as f32);
                let width = theta * (ratio.sqrt() - 1.0 / ratio.sqrt());
                f64::from(fog.phase(toward, Vec3::Z)) * sin * width * std::f64::consts::TAU
            }).sum();
            prop_assert!((sum - 1.0).abs() < 1e-3, "{sum} for {g}");
        }

        /// A box of any size, seen from any distance.
        #[test]
        fn a_far_box_keeps_its_thickness(away in -9.0..9.0, size in -9.0..9.0, depth in -3.0..1.0) {
            let (size, away) = (10f64.powf(size), 10f64.powf(away));
            let extinction = (10f64.powf(depth) / size) as f32;
            let fog = fog(extinction, 0.0, DAffine3::from_scale(DVec3::splat(1.0 / size)));
            let origin = Vec3::new((0.5 * size) as f32, (0.5 * size) as f32, -away as f32);
            let through = fog.transmittance(origin, Vec3::Z, f32::INFINITY).x;
            let expected = (-f64::from(extinction) * size).exp();
            prop_assert!((f64::from(through) - expected).abs() < 1e-6 + 1e-15 * away / size);
        }

        /// The pdf is that of the sampled points, and they cover the whole stretch.
        #[test]
        fn places_have_the_density_they_tell(
            length in -9.0..9.0, off in -9.0..9.0, along in -9.0..9.0, depth in -9.0..3.0,
            is_behind in any::<bool>()
        ) {
            let [length, off, along] = [length, off, along].map(|e| 10f64.powf(e));
            let along = if is_behind { -along } else { along };
            let stretch = Stretch { origin: DVec3::ZERO, direction: DVec3::X, length };
            let by_angle = |u| by_angle(&stretch, DVec3::new(along, off, 0.0), u);
            let by_loss = |u| Some(by_transmittance(length, 10f64.powf(depth) / length, u));
            let draws: [&dyn Fn(f64) -> Option<Drawn>; 2] = [&by_angle, &by_loss];
            for draw in draws {
                for i in 0..64 {
                    let u = (f64::from(i) + 0.5) / 64.0;
                    let [before, here, after] = [u - 1e-5, u, u + 1e-5].map(|u| draw(u).unwrap());
                    let rate = (after.t - before.t) / 2e-5;
                    let noise = 1e-15 * length / 1e-5 / rate;
                    let product = here.pdf * rate;
                    prop_assert!((product - 1.0).abs() < 1e-3 + noise, "{product} at {u}");
                    prop_assert!((0.0..=length).contains(&here.t));
                }
                prop_assert!(draw(0.0).unwrap().t <= 1e-12 * length);
                // In fog that no light gets through, the far end is never sampled.
                prop_assert!(draw(1.0).unwrap().t >= (1.0 - 1e-9) * length || depth > 0.5);
            }
        }
    }
}
