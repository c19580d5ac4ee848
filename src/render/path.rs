//! The integrator: paths from the eye, with next-event estimation at every point.
//!
//! Light is found in two ways: by [picking](super::direct) lights, and by reflected rays that hit one. The
//! power heuristic weighs the two against each other (Veach 1997, section 9.2.2). The expected number of
//! picks of a light is part of the density on both sides: when a ray hits an emitter, the tree is asked
//! how often it would have been picked from the point before. In [fog](super::fog), every stretch of a
//! path also gathers the light scattered along it.

use super::camera::{CameraRay, CameraRays};
use super::direct::{FoundByReflection, power_heuristic};
use super::fog::Fog;
use super::knob::Trial;
use super::light_groups::LightGroups;
use super::links::FrameLinks;
use super::panes::Drawn;
use super::picker::{LightPicker, PickScratch, Site, Wanted};
use super::rays::{Hit, HitSurface, Passed, Seen, Sender, Tracer};
use super::settings::RenderSettings;
use super::surface::Surfaces;
use super::vertex::{Inside, Vertex};
use crate::emitter::{EmitterHit, InfiniteLight, Lit, PosedEmitters, PosedFilters, Source};
use crate::light_tree::learned::Cells;
use crate::light_tree::{Cell, Picked, Receiver, Splitting};
use crate::math::built_in;
use crate::math::color::Rgb;
use crate::math::random::{Sampler, hash};
use crate::scene::{LightResponses, Visibility};
use glam::{Vec2, Vec3};

/// Bounces before Russian roulette may end a path.
const SURE_BOUNCES: u32 = 3;
/// Tells the random number that chooses a cell from others.
const CELL: u32 = 0x6365_6c6c;

/// One frame, ready to be traced.
pub struct Integrator<'a> {
    /// Knobs.
    pub settings: &'a RenderSettings,
    /// What rays hit.
    pub tracer: &'a Tracer<'a>,
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
    /// Where what is known to be hidden is known, if it is.
    pub cells: Option<Cells<'a>>,
    /// Which lights light what, if not all light everything.
    pub links: Option<FrameLinks<'a>>,
    /// What lights are filtered by, if any are.
    pub filters: Option<&'a PosedFilters<'a>>,
    /// How much of which lights surfaces reflect, if not all of all.
    pub responses: Option<&'a LightResponses>,
    /// What fills the space, if anything does.
    pub fog: Option<Fog>,
    /// Which light group each light is in, if that is asked for.
    pub groups: Option<&'a LightGroups>,
    /// What light reflected rays may find by themselves. The last one of a path is traced only if it may find some.
    pub found_by_reflection: FoundByReflection,
}

/// What one path saw. Its light by group is in [`PathScratch::by_group`].
#[derive(Clone, Copy, Debug, Default)]
pub struct PathSample {
    /// Radiance towards the eye, nits.
    pub radiance: Rgb,
    /// That by how often it was scattered: never, once, more often.
    pub by_scatterings: [Rgb; 3],
    /// The eye's ray, unit, world space.
    pub direction: Vec3,
    /// What the eye's ray hit.
    pub hit: Option<Hit>,
    /// Distance along the view axis to the first hit, metres.
    pub depth_m: f32,
    /// World-space shading normal of the first hit.
    pub normal: Vec3,
    /// Share of white light that the first hit reflects.
    pub albedo: Rgb,
}

impl PathSample {
    fn add(&mut self, scatterings: u32, light: Rgb) {
        self.radiance += light;
        self.by_scatterings[scatterings.min(2) as usize] += light;
    }
}

/// What tracing cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TraceStats {
    /// Rays of all kinds.
    pub rays: u64,
    /// Lights picked.
    pub light_picks: u64,
    /// Those of the rays that asked whether a picked light is visible.
    pub shadow_rays: u64,
    /// Groups of the tree weighed to pick them.
    pub groups: u64,
}

impl TraceStats {
    /// Both together.
    pub fn plus(self, other: TraceStats) -> TraceStats {
        TraceStats {
            rays: self.rays + other.rays,
            light_picks: self.light_picks + other.light_picks,
            shadow_rays: self.shadow_rays + other.shadow_rays,
            groups: self.groups + other.groups,
        }
    }
}

/// The point that a reflected ray left, for the weight of a light that it hits.
struct Origin {
    wanted: Wanted,
    how: Splitting,
    lit: Lit,
    normal: Vec3,
    bsdf_pdf: f32,
    /// How much of what it reflects its diffuse lobe does, if anybody asks.
    diffuse_share: Rgb,
}

/// A thread's buffers, reused from path to path.
#[derive(Debug, Default)]
pub struct PathScratch {
    pub(super) picks: PickScratch,
    passed: Passed,
    /// Light of the last path towards the eye by light group, nits; empty unless that is asked for.
    pub by_group: Vec<Rgb>,
    /// Sum of the squared luminance of what the last path would have got from lights that were picked
    /// and found to be blocked.
    pub blocked: f64,
    /// What it cost so far.
    pub stats: TraceStats,
    /// Other knobs to try at each point, for a pilot.
    pub(super) trial: Option<Box<Trial>>,
}

impl Integrator<'_> {
    /// Traces one path through a pixel. `seed` is a hash of the pixel and the frame, `index` the number of
    /// the sample.
    pub fn trace(
        &self,
        x: u32,
        y: u32,
        seed: u32,
        index: u32,
        scratch: &mut PathScratch,
    ) -> PathSample {
        let mut sampler = Sampler::new(seed, index);
        let [px, py, lx, ly] = sampler.next_4d();
        let CameraRay { mut origin, mut direction, mut reach_m } =
            self.camera.ray(x, y, Vec2::new(px, py), Vec2::new(lx, ly));
        let accept = self.cutouts(hash(seed, index));
        let mut seen = PathSample { direction, ..Default::default() };
        scratch.blocked = 0.0;
        scratch.by_group.clear();
        scratch.by_group.resize(self.groups.map_or(0, |groups| groups.names().len()), Rgb::ZERO);
        let mut throughput = Rgb::ONE;
        let mut before: Option<Origin> = None;
        let mut inside: Inside = None;
        // How many times as high radiance is here as where the path began.
        let mut concentration = 1.0;
        for bounce in 0..=self.settings.depth {
            scratch.stats.rays += 1;
            let sender = if bounce == 0 { Sender::Camera } else { Sender::Surface };
            let mut passed = std::mem::take(&mut scratch.passed);
            let ray = (origin, direction, reach_m);
            let Seen { hit, in_shade, leaves_at } =
                self.tracer.look(sender, ray, &accept, &mut passed);
            reach_m = f32::INFINITY;
            if built_in::TRANSMISSION
                && bounce == 0
                && let Some(hit) = &hit
            {
                inside = self.sides(hit, -direction)[0];
            }
            let filled = (inside, leaves_at);
            let meets_panes = built_in::TRANSMISSION && !passed.panes.is_empty();
            if meets_panes {
                self.tint_panes(&mut passed, direction);
            }
            if built_in::FOG
                && let Some(fog) = &self.fog
                && inside.is_none()
            {
                let length = hit.as_ref().map_or(f32::INFINITY, |hit| hit.t);
                if bounce < self.settings.depth {
                    let (numbers, salt) = (sampler.next_4d(), hash(seed, !bounce));
                    let stretch = (origin, direction, length);
                    let numbers = (numbers, salt);
                    let at = (bounce, throughput);
                    let light =
                        self.scattered((fog, &passed), stretch, numbers, &accept, at, scratch);
                    seen.add(bounce + 1, throughput * light);
                }
            }
            for light in &passed.lights {
                let arriving = throughput * self.through(filled, origin, direction, light.hit.t);
                let arriving = arriving * passed.tint_of(light);
                seen.add(bounce, self.emitted(&light.hit, direction, &before, arriving, scratch));
            }
            if hit.is_none() && !in_shade {
                let arriving = self.through(filled, origin, direction, f32::INFINITY);
                let arriving = throughput * arriving * passed.tint_of_sky();
                let light = self.emitted_at_infinity(direction, &before, arriving, scratch);
                seen.add(bounce, arriving * light);
            }
            let first = passed.met().next().map_or(hit, |pane| Some(pane.hit));
            let drawn = match (meets_panes, hit) {
                (false, None) => Drawn::default(),
                (false, Some(hit)) => self.at_end((origin, direction), filled, &hit),
                (true, _) => {
                    let [u, ..] = sampler.next_4d();
                    self.through_panes((origin, direction), filled, &passed, hit, u)
                }
            };
            scratch.passed = passed;
            if let Some(hit) = first.filter(|_| bounce == 0) {
                // Of a pane, not of what is seen through it; but the albedo is of both.
                let own = if meets_panes { self.vertex(&hit, -direction) } else { drawn.vertex };
                seen.hit = Some(hit);
                seen.depth_m = self.camera.depth_m(hit.anchor.position);
                seen.normal = own.map_or(hit.anchor.normal, |v| v.reflection.normal());
                seen.albedo = match meets_panes {
                    true => drawn.albedo,
                    false => own.map_or(Rgb::ZERO, |v| v.reflection.whole_albedo()),
                };
            }
            throughput *= drawn.weight;
            let Some(vertex) = drawn.vertex.filter(|_| bounce < self.settings.depth) else { break };

            let wanted = self.wanted(&vertex, &mut sampler, hash(seed, bounce));
            let [pick, lu, lv, roulette] = sampler.next_4d();
            let numbers = (pick, Vec2::new(lu, lv), hash(seed, bounce));
            let at = (bounce, throughput);
            let direct = self.direct(&vertex, &wanted, numbers, &accept, at, scratch);
            seen.add(bounce + 1, throughput * direct);
            let is_last = bounce + 1 == self.settings.depth;
            if is_last && self.found_by_reflection == FoundByReflection::Nothing {
                break;
            }

            let [lobe, bu, bv, _] = sampler.next_4d();
            let Some(next) = vertex.reflection.sample(lobe, Vec2::new(bu, bv)) else { break };
            if !vertex.lets_through(next.wi) {
                break;
            }
            throughput *= next.weight;
            if vertex.is_beyond(next.wi) {
                concentration *= vertex.reflection.concentration();
            }
            if bounce >= SURE_BOUNCES {
                // Of the power, not of the radiance: what enters glass gets back its `eta^2` where it leaves.
                let survival = (throughput * concentration).max_element().min(0.95);
                if roulette >= survival {
                    break;
                }
                throughput /= survival;
            }
            let (lit, normal) = (vertex.lit(), vertex.receiver.normal);
            let how = *self.picker.splitting(bounce);
            let share = |_: &LightResponses| vertex.reflection.diffuse_share(next.wi);
            let diffuse_share = self.multipliers().map_or(Rgb::ZERO, share);
            let bsdf_pdf = next.pdf;
            before = Some(Origin { wanted, how, lit, normal, bsdf_pdf, diffuse_share });
            origin = vertex.anchor.origin_toward(next.wi);
            direction = next.wi;
            inside = if vertex.is_beyond(next.wi) { vertex.beyond } else { vertex.here };
            if is_last && !self.may_find_light(origin, direction) {
                break;
            }
        }
        seen
    }

    /// Decides at random which hits on cut-outs count; the probability is the coverage.
    pub fn cutouts(&self, seed: u32) -> impl Fn(u32, u32, Vec2) -> bool + '_ {
        move |instance: u32, triangle: u32, barycentric: Vec2| {
            let bits = hash(barycentric.x.to_bits(), barycentric.y.to_bits());
            let random = hash(hash(seed, bits), hash(instance, triangle)) >> 8;
            self.surfaces.coverage(instance, triangle, barycentric) > random as f32 / 16_777_216.0
        }
    }

    /// What lights are picked for at a vertex.
    fn wanted(&self, vertex: &Vertex, sampler: &mut Sampler, salt: u32) -> Wanted {
        let wanted = match self.picker.looks() {
            true => vertex.wanted(self.picker.asks_for_direction().then_some(sampler)),
            false => vertex.wanted_at(Site::At(vertex.receiver)),
        };
        Wanted { cell: self.cell(vertex, salt), ..wanted }
    }

    /// The cell of a vertex. `salt` is a hash of the pixel and the bounce: all samples of a pixel are
    /// in one cell as long as they are in one place, and stay stratified.
    pub fn cell(&self, vertex: &Vertex, salt: u32) -> Cell {
        let Some(cells) = self.cells else { return Cell::NONE };
        let Receiver { point, normal } = vertex.receiver;
        cells.find(point, normal, (hash(salt, CELL) >> 8) as f32 / 16_777_216.0)
    }

    /// The share of light that fog or glass lets through along a stretch of a ray. It leaves the glass at some length
    /// at the latest.
    pub(super) fn through(
        &self,
        (inside, leaves_at): (Inside, f32),
        origin: Vec3,
        direction: Vec3,
        length: f32,
    ) -> Rgb {
        if let Some(absorption) = inside.filter(|_| built_in::TRANSMISSION) {
            let within = (absorption * -length.min(leaves_at).min(f32::MAX)).exp();
            return match leaves_at < length {
                true => {
                    let (left, rest) = (origin + direction * leaves_at, length - leaves_at);
                    within * self.through((None, f32::INFINITY), left, direction, rest)
                }
                false => within,
            };
        }
        let through = |fog: &Fog| fog.transmittance(origin, direction, length);
        self.fog.as_ref().filter(|_| built_in::FOG).map_or(Rgb::ONE, through)
    }

    /// The part of a light's contribution that goes to its group.
    #[inline]
    pub(super) fn count_in_group(&self, light: Picked, contribution: Rgb, by_group: &mut [Rgb]) {
        if let Some(groups) = self.groups {
            let group = match light {
                Picked::Emitter(emitter) => groups.of_emitter(self.emitters.emitters, emitter),
                Picked::Beside(row) => groups.of_infinite(&self.infinite[row as usize]),
            };
            by_group[group] += contribution;
        }
    }

    /// Light emitted at a ray's hit towards the eye, weighted against picking that light. `throughput`
    /// is the share of it that gets there.
    fn emitted(
        &self,
        hit: &Hit,
        direction: Vec3,
        before: &Option<Origin>,
        throughput: Rgb,
        scratch: &mut PathScratch,
    ) -> Rgb {
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
        let light = Picked::Emitter(emitter);
        if !self.is_found(before, light) {
            return Rgb::ZERO;
        }
        let weight = before.as_ref().map_or(1.0, |before| {
            let pdf = || self.emitters.pdf(&at, before.lit.point);
            self.weight_of_hit(before, light, scratch, pdf)
        });
        let filtered = before.as_ref().map_or(Rgb::ONE, |before| {
            self.filtered(light, before.lit, Source::Point(at.point))
                * self.reflected_share(light, before.diffuse_share)
        });
        let arriving = throughput * (radiance * filtered * weight);
        self.count_in_group(light, arriving, &mut scratch.by_group);
        arriving
    }

    /// Light of the infinite lights along a ray, weighted likewise; before `throughput`.
    fn emitted_at_infinity(
        &self,
        direction: Vec3,
        before: &Option<Origin>,
        throughput: Rgb,
        scratch: &mut PathScratch,
    ) -> Rgb {
        let mut sum = Rgb::ZERO;
        for (row, light) in self.infinite.iter().enumerate().filter(|_| built_in::DOMES) {
            let Visibility { camera, reflections, .. } = light.visibility;
            let meets = if before.is_none() { camera } else { reflections };
            let radiance = if meets { light.radiance(direction) } else { Rgb::ZERO };
            if radiance == Rgb::ZERO {
                continue;
            }
            let picked = Picked::Beside(row as u32);
            if !self.is_found(before, picked) {
                continue;
            }
            let weight = before.as_ref().map_or(1.0, |before| {
                self.weight_of_hit(before, picked, scratch, || light.pdf(before.normal, direction))
            });
            let filtered = before.as_ref().map_or(Rgb::ONE, |before| {
                self.filtered(picked, before.lit, Source::Direction(direction))
                    * self.reflected_share(picked, before.diffuse_share)
            });
            let light = radiance * filtered * weight;
            self.count_in_group(picked, throughput * light, &mut scratch.by_group);
            sum += light;
        }
        sum
    }

    /// Whether a ray finds a light that it meets: the eye's always, a reflected one if the light lights what the ray
    /// left, and its shadows are those of everything.
    fn is_found(&self, before: &Option<Origin>, light: Picked) -> bool {
        let links = self.links.as_ref().zip(before.as_ref());
        let Some((links, before)) = links.filter(|_| built_in::LINKS) else { return true };
        links.reflections_find(before.wanted.class, light)
    }

    /// The weight of a reflected ray that hit a light, against picking and sampling that light.
    fn weight_of_hit(
        &self,
        before: &Origin,
        light: Picked,
        scratch: &mut PathScratch,
        pdf: impl FnOnce() -> f32,
    ) -> f32 {
        if !self.settings.mis {
            return 0.0;
        }
        let Origin { wanted, how, bsdf_pdf, .. } = before;
        let expected = self.picker.expected(wanted, how, light, &mut scratch.picks) as f32;
        power_heuristic(*bsdf_pdf, expected * pdf())
    }
}
