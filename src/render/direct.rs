//! Next-event estimation: light from the lights that are picked for a point of a surface.

use super::path::{Integrator, PathScratch, TraceStats};
use super::picker::{LightPick, PickScratch, Wanted};
use super::rays::{Anchor, Caster, Hit, Transmitted};
use super::vertex::{Inside, Vertex};
use crate::emitter::{EmitterPlace, Lit, Source};
use crate::light_tree::{Picked, Splitting};
use crate::math::built_in;
use crate::math::color::{Rgb, luminance};
use crate::math::random::hash;
use crate::scene::{LightResponses, Response};
use glam::{Vec2, Vec3};

/// Light that may arrive at a point, if nothing is in its way.
pub struct Incoming {
    /// Unit, from the point.
    pub direction: Vec3,
    /// Radiance in nits; if `pdf` is `None`, the irradiance of a facing surface in lux.
    pub radiance: Rgb,
    /// Density over solid angle, 1/sr; `None` for a direction or point that no ray can hit.
    pub pdf: Option<f32>,
    /// The point of the light; `None` for an infinite light.
    pub from: Option<Anchor>,
    /// Whether a reflected ray in this direction would hit the light, too.
    pub is_seen: bool,
    /// The link set that casts shadows from the light; `None` is everything.
    pub shadow_set: Option<u32>,
}

/// What light reflected rays may find by themselves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FoundByReflection {
    /// None.
    Nothing,
    /// That of surfaces.
    Surfaces,
    /// That of lights at infinity, too.
    Everything,
}

/// What gives the light that was picked, a row of the scene.
enum Owner {
    Instance(u32),
    Light(u32),
}

impl Integrator<'_> {
    /// Whether a reflected ray may find light, hidden or not.
    pub(super) fn may_find_light(&self, origin: Vec3, direction: Vec3) -> bool {
        match self.found_by_reflection {
            FoundByReflection::Nothing => false,
            FoundByReflection::Surfaces => self.tracer.may_meet_light(origin, direction),
            FoundByReflection::Everything => true,
        }
    }

    /// The share of a light's light from a source that its filters let through to what is lit.
    #[inline]
    pub(super) fn filtered(&self, light: Picked, at: Lit, source: Source) -> Rgb {
        let Some(filters) = self.filters.filter(|_| built_in::FILTERS) else { return Rgb::ONE };
        match self.owner(light) {
            Owner::Instance(row) => filters.of_instance(row, at, source),
            Owner::Light(row) => filters.of_light(row, at, source),
        }
    }

    #[inline]
    fn owner(&self, light: Picked) -> Owner {
        match light {
            Picked::Emitter(emitter) => match self.emitters.emitters.place_of(emitter) {
                EmitterPlace::Triangle { instance, .. } => Owner::Instance(instance),
                EmitterPlace::Light(row) => Owner::Light(row),
            },
            Picked::Beside(row) => Owner::Light(self.infinite[row as usize].light as u32),
        }
    }

    /// The multipliers of all lights, if any has some.
    #[inline]
    pub(super) fn multipliers(&self) -> Option<&LightResponses> {
        self.responses.filter(|_| built_in::MULTIPLIERS)
    }

    /// The multipliers of a light, unless no light has any.
    #[inline]
    fn response(&self, light: Picked) -> Option<Response> {
        let responses = self.multipliers()?;
        Some(match self.owner(light) {
            Owner::Instance(row) => responses.of_instance(row),
            Owner::Light(row) => responses.of_light(row),
        })
    }

    /// What a vertex reflects of a light in some direction, `f |cos|` times the light's multipliers, and the density with
    /// which its reflected rays go there, 1/sr.
    #[inline]
    pub fn reflects(&self, vertex: &Vertex, light: Picked, direction: Vec3) -> (Rgb, f32) {
        let (whole, pdf) = vertex.reflection.eval(direction);
        match self.response(light) {
            None | Some(Response::PLAIN) => (whole, pdf),
            Some(response) => (response.of(whole, vertex.reflection.diffuse_part(direction)), pdf),
        }
    }

    /// What multiplies the light that a reflected ray finds, given the diffuse share of what was reflected.
    #[inline]
    pub(super) fn reflected_share(&self, light: Picked, diffuse_share: Rgb) -> Rgb {
        let response = self.response(light);
        response.map_or(Rgb::ONE, |response| response.of(Rgb::ONE, diffuse_share))
    }

    /// What a vertex reflects of the lights that are picked for it. `u_pick` picks the lights, `u` samples
    /// points on them, and `salt` is a hash of the pixel and the bounce. `throughput` is the share of the
    /// reflected light that gets to the eye: the result is without it.
    pub(super) fn direct(
        &self,
        vertex: &Vertex,
        wanted: &Wanted,
        numbers: (f32, Vec2, u32),
        accept: &impl Fn(u32, u32, Vec2) -> bool,
        (bounce, throughput): (u32, Rgb),
        scratch: &mut PathScratch,
    ) -> Rgb {
        let mut sum = Rgb::ZERO;
        let PathScratch { picks, stats, by_group, blocked, trial, .. } = scratch;
        let how = self.picker.splitting(bounce);
        let room = (&mut *picks, stats);
        self.gather(vertex, (wanted, how), numbers, accept, room, |light, whole, arriving| {
            if arriving == Rgb::ZERO {
                *blocked += f64::from(luminance(throughput * whole)).powi(2);
                return;
            }
            self.count_in_group(light, throughput * whole * arriving, by_group);
            sum += whole * arriving;
        });
        if let Some(trial) = trial {
            trial.at(bounce, throughput, |how, ([pick, u, v, _], salt), stats| {
                let (numbers, room) = ((pick, Vec2::new(u, v), salt), (&mut *picks, stats));
                let mut sum = Rgb::ZERO;
                self.gather(vertex, (wanted, how), numbers, accept, room, |_, whole, arriving| {
                    sum += whole * arriving;
                });
                sum
            });
        }
        sum
    }

    /// Picks lights for a vertex and calls `visit` with each, what the vertex reflects of it if nothing
    /// blocks it, and the share that arrives.
    fn gather(
        &self,
        vertex: &Vertex,
        (wanted, how): (&Wanted, &Splitting),
        (u_pick, u, salt): (f32, Vec2, u32),
        accept: &impl Fn(u32, u32, Vec2) -> bool,
        (picks, stats): (&mut PickScratch, &mut TraceStats),
        mut visit: impl FnMut(Picked, Rgb, Rgb),
    ) {
        let several = self.picker.takes_several(how);
        let weighed = picks.weighed();
        self.picker.pick(wanted, how, (u_pick, salt), picks, |pick| {
            stats.light_picks += 1;
            stats.groups += u64::from(pick.weighed);
            let u = if several { another(u, salt, pick.light) } else { u };
            let incoming = self.incoming(pick.light, vertex.lit(), vertex.receiver.normal, u);
            let Some(incoming) = incoming else { return };
            let reflected = self.reflected(vertex, &pick, &incoming);
            if reflected == Rgb::ZERO {
                return;
            }
            stats.rays += 1;
            stats.shadow_rays += 1;
            visit(pick.light, reflected, self.arriving(vertex, &incoming, accept));
        });
        stats.groups += picks.weighed() - weighed;
    }

    /// What a vertex reflects of some light if nothing blocks it, divided by the probability and pdf of
    /// the light sample, and weighted against hitting the light by a reflected ray.
    fn reflected(&self, vertex: &Vertex, pick: &LightPick, incoming: &Incoming) -> Rgb {
        if !vertex.lets_through(incoming.direction) {
            return Rgb::ZERO;
        }
        let (reflected, bsdf_pdf) = self.reflects(vertex, pick.light, incoming.direction);
        let probability = pick.probability as f32;
        match incoming.pdf {
            None => reflected * incoming.radiance / probability,
            Some(pdf) => {
                let expected = pick.expected as f32 * pdf;
                let weight = match self.settings.mis && incoming.is_seen {
                    true => power_heuristic(expected, bsdf_pdf),
                    false => 1.0,
                };
                reflected * incoming.radiance * (weight / (probability * pdf))
            }
        }
    }

    /// Samples a picked light as seen from what is lit. Infinite lights are sampled on the side of the normal
    /// only, or all around if it is zero.
    pub fn incoming(&self, light: Picked, at: Lit, normal: Vec3, u: Vec2) -> Option<Incoming> {
        let links = self.links.filter(|_| built_in::LINKS);
        let shadow_set = links.and_then(|links| links.shadow_set(light));
        // Light that passes what a reflected ray would hit is found by sampling alone.
        let by_reflection = shadow_set.is_none();
        let emitter = match light {
            Picked::Emitter(emitter) => emitter,
            Picked::Beside(row) => {
                let of_row = &self.infinite[row as usize];
                let s = of_row.sample(normal, u)?;
                let (direction, pdf) = (s.direction, s.pdf);
                let passes = self.filtered(light, at, Source::Direction(direction));
                if passes == Rgb::ZERO {
                    return None;
                }
                let radiance = s.radiance * passes;
                let is_seen = of_row.visibility.reflections && by_reflection;
                return Some(Incoming {
                    direction,
                    radiance,
                    pdf,
                    from: None,
                    is_seen,
                    shadow_set,
                });
            }
        };
        let s = self.emitters.sample(emitter, at.point, u)?;
        let passes = self.filtered(light, at, Source::Point(s.point));
        if passes == Rgb::ZERO {
            return None;
        }
        let coverage = s.on_mesh.map_or(1.0, |place| {
            self.surfaces.coverage(place.instance, place.triangle, place.barycentric)
        });
        let from = if s.normal == Vec3::ZERO {
            Anchor::free(s.point)
        } else {
            Anchor::computed(s.point, s.normal, s.magnitude_m)
        };
        Some(Incoming {
            direction: s.direction,
            radiance: s.radiance * passes * coverage,
            pdf: s.pdf,
            from: Some(from),
            is_seen: s.is_seen && by_reflection,
            shadow_set,
        })
    }

    /// The share of the light that reaches a point: zero if anything blocks it, else the transmittance of
    /// the fog or glass and of the panes on the way.
    pub fn arriving(
        &self,
        vertex: &Vertex,
        incoming: &Incoming,
        accept: &impl Fn(u32, u32, Vec2) -> bool,
    ) -> Rgb {
        let is_beyond = vertex.is_beyond(incoming.direction);
        let inside = if is_beyond { vertex.beyond } else { vertex.here };
        self.arriving_within(inside, &vertex.anchor, incoming, accept)
    }

    /// The same at a point that is inside of something.
    pub(super) fn arriving_within(
        &self,
        inside: Inside,
        at: &Anchor,
        incoming: &Incoming,
        accept: &impl Fn(u32, u32, Vec2) -> bool,
    ) -> Rgb {
        let direction = incoming.direction;
        let length = match &incoming.from {
            Some(light) => (light.position - at.position).length(),
            None => f32::INFINITY,
        };
        let Transmitted { share, leaves_at } = match self.links.zip(incoming.shadow_set) {
            None => self.transmitted(at, incoming, accept, &|_| true),
            Some((links, set)) => {
                self.transmitted(at, incoming, accept, &|caster| links.casts(set, caster))
            }
        };
        if share == Rgb::ZERO {
            return Rgb::ZERO;
        }
        // Between two points it is a fraction of the way.
        let leaves_at = if length.is_finite() { leaves_at * length } else { leaves_at };
        share * self.through((inside, leaves_at), at.position, direction, length)
    }

    /// What of light gets from a light to a point past the prims that `casts` names.
    fn transmitted(
        &self,
        at: &Anchor,
        incoming: &Incoming,
        accept: &impl Fn(u32, u32, Vec2) -> bool,
        casts: &impl Fn(Caster) -> bool,
    ) -> Transmitted {
        let direction = incoming.direction;
        let tint = |pane: &Hit| self.surfaces.tint(pane, direction);
        match &incoming.from {
            Some(light) => self.tracer.transmitted_between(at, light, accept, casts, &tint),
            None => {
                let ray = (at.origin_toward(direction), direction, f32::INFINITY);
                self.tracer.transmitted(ray, accept, casts, &tint)
            }
        }
    }
}

/// Random numbers for one of several lights: `u` shifted, modulo 1, by a hash of `salt` and the light.
/// All samples with one salt are shifted alike, so they stay stratified for each light.
pub(super) fn another(u: Vec2, salt: u32, light: Picked) -> Vec2 {
    let code = match light {
        Picked::Emitter(emitter) => emitter,
        Picked::Beside(row) => !row,
    };
    let word = hash(salt ^ 0x5bd1_e995, code);
    let turn = |bits: u32| (bits & 0xffff) as f32 / 65536.0;
    let turned = u + Vec2::new(turn(word), turn(word >> 16));
    (turned - turned.floor()).min(Vec2::splat(BELOW_ONE))
}

/// The largest number below 1.
pub(super) const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

/// Veach's power heuristic with exponent 2, safe where squares would overflow.
pub fn power_heuristic(own: f32, other: f32) -> f32 {
    if own > 0.0 {
        let ratio = other / own;
        1.0 / (1.0 + ratio * ratio)
    } else {
        0.0
    }
}
