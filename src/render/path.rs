//! The integrator: paths from the eye, with next-event estimation at every point.
//!
//! Light is found in two ways, by picking a light and by reflecting a ray into it, which the power
//! heuristic weighs against each other (Veach 1997, section 9.2.2). The probability of the pick is
//! part of the density on both sides: when a ray hits an emitter, the tree is asked how likely it
//! would have been picked from the point before.

use super::bsdf::Bsdf;
use super::camera::{CameraRay, CameraRays};
use super::picker::{LightPicker, Target};
use super::rays::{Anchor, Hit, HitSurface, Tracer};
use super::settings::RenderSettings;
use super::surface::Surfaces;
use crate::emitter::{EmitterHit, InfiniteLight, PosedEmitters};
use crate::light_tree::Receiver;
use crate::math::color::Rgb;
use crate::math::random::{Sampler, hash};
use glam::{Vec2, Vec3};

/// Bounces after which a path may be ended by chance.
const SURE_BOUNCES: u32 = 3;

/// One frame, ready to be traced.
pub struct Integrator<'a> {
    /// Knobs.
    pub settings: &'a RenderSettings,
    /// What rays hit.
    pub tracer: Tracer<'a>,
    /// What is there.
    pub surfaces: Surfaces<'a>,
    /// What shines.
    pub emitters: PosedEmitters<'a>,
    /// What shines from infinity.
    pub infinite: &'a [InfiniteLight<'a>],
    /// Which light to sample.
    pub picker: LightPicker<'a>,
    /// Rays through pixels.
    pub camera: CameraRays,
}

/// What one path saw.
#[derive(Clone, Copy, Debug, Default)]
pub struct PathSample {
    /// Radiance towards the eye, nits.
    pub radiance: Rgb,
    /// Whether the eye's ray hit anything.
    pub covered: bool,
    /// Distance along the view axis to the first hit, metres.
    pub depth_m: f32,
    /// World-space shading normal of the first hit.
    pub normal: Vec3,
    /// Share of white light that the first hit reflects.
    pub albedo: Rgb,
}

/// What tracing cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TraceStats {
    /// Rays of all kinds.
    pub rays: u64,
    /// Lights picked.
    pub light_picks: u64,
}

impl TraceStats {
    /// Both together.
    pub fn plus(self, other: TraceStats) -> TraceStats {
        TraceStats {
            rays: self.rays + other.rays,
            light_picks: self.light_picks + other.light_picks,
        }
    }
}

/// The point a reflected ray came from, for the weight of what it hits.
struct Origin {
    receiver: Receiver,
    bsdf_pdf: f32,
}

/// Light that may arrive at a vertex, if nothing is in its way.
struct Incoming {
    /// Unit, from the vertex.
    direction: Vec3,
    /// Nits; lux of a facing surface if `pdf` is `None`.
    radiance: Rgb,
    /// Density over solid angle, 1/sr; `None` for a direction or point that no ray can hit.
    pdf: Option<f32>,
    /// Where it comes from; `None` from infinity.
    from: Option<Anchor>,
}

/// A point on the way, about to be lit.
struct Vertex {
    anchor: Anchor,
    bsdf: Bsdf,
    wo: Vec3,
    receiver: Receiver,
}

impl Integrator<'_> {
    /// Traces one path through a pixel. `seed` stands for the pixel in its frame.
    pub fn trace(
        &self,
        x: u32,
        y: u32,
        seed: u32,
        index: u32,
        stats: &mut TraceStats,
    ) -> PathSample {
        let mut sampler = Sampler::new(seed, index);
        let [px, py, lx, ly] = sampler.next_4d();
        let CameraRay { mut origin, mut direction } =
            self.camera.ray(x, y, Vec2::new(px, py), Vec2::new(lx, ly));
        let cutout_seed = hash(seed, index);
        let accept = |instance: u32, triangle: u32, barycentric: Vec2| {
            let bits = hash(barycentric.x.to_bits(), barycentric.y.to_bits());
            let random = hash(hash(cutout_seed, bits), hash(instance, triangle)) >> 8;
            self.surfaces.coverage(instance, triangle, barycentric) > random as f32 / 16_777_216.0
        };
        let mut seen = PathSample::default();
        let mut throughput = Rgb::ONE;
        let mut before: Option<Origin> = None;
        for bounce in 0..=self.settings.depth {
            stats.rays += 1;
            let hit = self.tracer.closest(origin, direction, f32::INFINITY, &accept);
            let Some(hit) = hit else {
                seen.radiance += throughput * self.emitted_at_infinity(direction, &before);
                break;
            };
            seen.radiance += throughput * self.emitted(&hit, direction, &before);
            let wo = -direction;
            let vertex = self.vertex(&hit, wo);
            if bounce == 0 {
                seen.covered = true;
                seen.depth_m = self.camera.depth_m(hit.anchor.position);
                seen.normal = vertex.as_ref().map_or(hit.anchor.normal, |v| v.receiver.normal);
                seen.albedo = vertex.as_ref().map_or(Rgb::ZERO, |v| {
                    let (specular, diffuse) = v.bsdf.albedo(wo);
                    specular + diffuse
                });
            }
            let Some(vertex) = vertex.filter(|_| bounce < self.settings.depth) else { break };

            let [pick, lu, lv, roulette] = sampler.next_4d();
            let direct = self.direct(&vertex, pick, Vec2::new(lu, lv), &accept, stats);
            seen.radiance += throughput * direct;

            let [lobe, bu, bv, _] = sampler.next_4d();
            let Some(next) = vertex.bsdf.sample(wo, lobe, Vec2::new(bu, bv)) else { break };
            if !vertex.lets_through(next.wi) {
                break;
            }
            throughput *= next.weight;
            if bounce >= SURE_BOUNCES {
                let survival = throughput.max_element().min(0.95);
                if roulette >= survival {
                    break;
                }
                throughput /= survival;
            }
            before = Some(Origin { receiver: vertex.receiver, bsdf_pdf: next.pdf });
            origin = vertex.anchor.origin_toward(next.wi);
            direction = next.wi;
        }
        seen
    }

    /// The point that a hit is; `None` on a sphere light, which reflects nothing.
    fn vertex(&self, hit: &Hit, wo: Vec3) -> Option<Vertex> {
        let HitSurface::Triangle { instance, triangle, barycentric } = hit.surface else {
            return None;
        };
        let surface = self.surfaces.at(instance, triangle, barycentric, hit.anchor, wo);
        let receiver = Receiver { point: hit.anchor.position, normal: surface.frame.normal };
        Some(Vertex { anchor: hit.anchor, bsdf: surface.bsdf(), wo, receiver })
    }

    /// Light from one picked light.
    fn direct(
        &self,
        vertex: &Vertex,
        u_pick: f32,
        u: Vec2,
        accept: &impl Fn(u32, u32, Vec2) -> bool,
        stats: &mut TraceStats,
    ) -> Rgb {
        stats.light_picks += 1;
        let Some(pick) = self.picker.pick(&vertex.receiver, u_pick) else { return Rgb::ZERO };
        let sample = match pick.target {
            Target::Emitter(emitter) => self.sample_emitter(emitter, vertex, u),
            Target::Infinite(row) => {
                let found = self.infinite[row as usize].sample(vertex.receiver.normal, u);
                found.map(|s| Incoming {
                    direction: s.direction,
                    radiance: s.radiance,
                    pdf: s.pdf,
                    from: None,
                })
            }
        };
        let Some(Incoming { direction, radiance, pdf, from }) = sample else { return Rgb::ZERO };
        if !vertex.lets_through(direction) {
            return Rgb::ZERO;
        }
        let (reflected, bsdf_pdf) = vertex.bsdf.eval(vertex.wo, direction);
        if reflected == Rgb::ZERO {
            return Rgb::ZERO;
        }
        stats.rays += 1;
        let blocked = match from {
            Some(light) => self.tracer.occluded_between(&vertex.anchor, &light, accept),
            None => {
                let origin = vertex.anchor.origin_toward(direction);
                self.tracer.occluded(origin, direction, f32::INFINITY, accept)
            }
        };
        if blocked {
            return Rgb::ZERO;
        }
        let chance = pick.probability as f32;
        match pdf {
            None => reflected * radiance / chance,
            Some(pdf) => {
                let density = chance * pdf;
                let weight =
                    if self.settings.mis { power_heuristic(density, bsdf_pdf) } else { 1.0 };
                reflected * radiance * (weight / density)
            }
        }
    }

    /// Light from a point of an emitter.
    fn sample_emitter(&self, emitter: u32, vertex: &Vertex, u: Vec2) -> Option<Incoming> {
        let s = self.emitters.sample(emitter, vertex.receiver.point, u)?;
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
            radiance: s.radiance * coverage,
            pdf: s.pdf,
            from: Some(from),
        })
    }

    /// Light that a ray finds where it ends, weighed against having picked it.
    fn emitted(&self, hit: &Hit, direction: Vec3, before: &Option<Origin>) -> Rgb {
        let emitter = match hit.surface {
            HitSurface::Triangle { instance, triangle, .. } => {
                self.emitters.emitters.of_triangle(instance, triangle)
            }
            HitSurface::Sphere { light } => self.emitters.emitters.of_light(light),
        };
        let Some(emitter) = emitter else { return Rgb::ZERO };
        let barycentric = match hit.surface {
            HitSurface::Triangle { barycentric, .. } => barycentric,
            HitSurface::Sphere { .. } => {
                // From inside, a sphere is dark.
                if hit.anchor.normal.dot(direction) >= 0.0 {
                    return Rgb::ZERO;
                }
                Vec2::ZERO
            }
        };
        let at = EmitterHit { emitter, barycentric, point: hit.anchor.position };
        let radiance = self.emitters.radiance(&at, direction);
        if radiance == Rgb::ZERO {
            return Rgb::ZERO;
        }
        let Some(before) = before else { return radiance };
        radiance
            * self.weight_of_hit(before, Target::Emitter(emitter), || {
                self.emitters.pdf(&at, before.receiver.point)
            })
    }

    /// Light from infinity along a ray, weighed likewise.
    fn emitted_at_infinity(&self, direction: Vec3, before: &Option<Origin>) -> Rgb {
        let mut sum = Rgb::ZERO;
        for (row, light) in self.infinite.iter().enumerate() {
            let radiance = light.radiance(direction);
            if radiance == Rgb::ZERO {
                continue;
            }
            let weight = before.as_ref().map_or(1.0, |before| {
                self.weight_of_hit(before, Target::Infinite(row as u32), || {
                    light.pdf(before.receiver.normal, direction)
                })
            });
            sum += radiance * weight;
        }
        sum
    }

    /// The weight of a reflected ray that hit a light, against picking and sampling that light.
    fn weight_of_hit(&self, before: &Origin, target: Target, pdf: impl FnOnce() -> f32) -> f32 {
        if !self.settings.mis {
            return 0.0;
        }
        let chance = self.picker.probability(&before.receiver, target) as f32;
        power_heuristic(before.bsdf_pdf, chance * pdf())
    }
}

impl Vertex {
    /// Whether the surface itself, not only its shading normal, lets light pass between `wo` and a
    /// direction without going through it.
    fn lets_through(&self, wi: Vec3) -> bool {
        self.anchor.normal.dot(wi) * self.anchor.normal.dot(self.wo) > 0.0
    }
}

/// Veach's power heuristic with exponent 2, safe where squares would overflow.
fn power_heuristic(own: f32, other: f32) -> f32 {
    if own > 0.0 {
        let ratio = other / own;
        1.0 / (1.0 + ratio * ratio)
    } else {
        0.0
    }
}
