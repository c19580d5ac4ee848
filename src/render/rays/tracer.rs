//! One frame of the ray kernel.

use super::blas::search_limit;
use super::meeting::{Meeting, On};
use super::placing::{Item, Placing};
use super::prim::{Prim, Sender};
use super::sight::{Passed, Seen, Sight, is_one_meeting};
use super::triangles::{Ray, barycentric};
use super::wide_bvh::BoxRay;
use super::{Anchor, Hit, RayScene};
use crate::math::built_in;
use crate::math::color::Rgb;
use crate::scene::{Pose, Scene};
use glam::{DVec3, Vec2, Vec3};
use std::sync::Arc;

/// The geometry at one time. Made by [`RayScene::for_pose`]; shared by all threads.
#[derive(Debug)]
pub struct Tracer<'a> {
    scene: &'a RayScene,
    /// What moves.
    moving: Placing,
    prims: Arc<Prims>,
}

/// What rays must know of all prims.
#[derive(Debug, PartialEq)]
struct Prims {
    /// By instance.
    instances: Vec<Prim>,
    /// By light; only those of spheres are looked at.
    lights: Vec<Prim>,
}

/// A prim that may cast a shadow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Caster {
    /// A row of [`Scene::instances`].
    Instance(u32),
    /// A row of [`Scene::lights`]: a sphere.
    Sphere(u32),
}

impl<'a> Tracer<'a> {
    /// `alike` is another tracer of the same scene, if there is one: what is the same is shared with it.
    pub(super) fn new(
        prepared: &'a RayScene,
        scene: &Scene,
        pose: &Pose,
        alike: Option<&Tracer>,
    ) -> Tracer<'a> {
        let ranks = &prepared.ranks;
        let instance = |row: u32| Prim::instance(scene, pose, row, ranks[row as usize]);
        let of_instances = scene.instances.len() as u32;
        let light = |row: u32| Prim::sphere(scene, pose, row, of_instances + row);
        let prims = Prims {
            instances: (0..of_instances).map(instance).collect(),
            lights: (0..scene.lights.len() as u32).map(light).collect(),
        };
        let prims = match alike.filter(|other| *other.prims == prims) {
            Some(other) => other.prims.clone(),
            None => Arc::new(prims),
        };
        let moving = Placing::new(scene, pose, &prepared.shared, &prepared.moving);
        Tracer { scene: prepared, moving, prims }
    }

    /// What a ray sees at distances in `(0, tmax)`, in lengths of `direction`; the lights and panes among it go
    /// to `passed`. `accept` takes an instance, a triangle and the barycentric weights of its second
    /// and third corner, and says whether a hit on a cut-out counts. A ray that is not finite sees
    /// nothing.
    pub fn look(
        &self,
        sender: Sender,
        (origin, direction, tmax): (Vec3, Vec3, f32),
        accept: &impl Fn(u32, u32, Vec2) -> bool,
        passed: &mut Passed,
    ) -> Seen {
        let Some(ray) = usable(origin.as_dvec3(), direction.as_dvec3()) else {
            *passed = Passed::default();
            return Seen { hit: None, in_shade: false };
        };
        let mut sight = Sight::new(&ray, sender, f64::from(tmax), passed);
        self.visit::<true>(&ray, f64::from(tmax), |meeting| {
            let prim = self.prim(meeting);
            sight.meet(meeting, prim, || counts(meeting, prim, &ray, accept));
            sight.limit()
        });
        sight.finish()
    }

    /// Whether a ray may meet a prim that shines, hidden or not. If not, [`look`](Self::look) finds no light.
    pub fn may_meet_light(&self, origin: Vec3, direction: Vec3) -> bool {
        let ray = BoxRay::new(origin, direction);
        let parts = [&self.scene.shining, &self.scene.standing.shining, &self.moving.shining];
        parts.into_iter().any(|part| part.may_be_met(&ray))
    }

    /// Whether anything that casts shadows, panes too, stands at a distance in `(0, tmax)`, in lengths of
    /// `direction`. `accept` as for [`look`](Self::look). A ray that is not finite counts as blocked.
    pub fn occluded(
        &self,
        origin: Vec3,
        direction: Vec3,
        tmax: f32,
        accept: &impl Fn(u32, u32, Vec2) -> bool,
    ) -> bool {
        let ray = (origin, direction, tmax);
        self.transmitted(ray, accept, &|_| true, &|_| Rgb::ZERO) == Rgb::ZERO
    }

    /// The share of light that passes the distances in `(0, tmax)`, in lengths of `direction`: the product of the
    /// panes' tints, or none if anything else that `casts` names casts a shadow. A ray that is not finite is blocked.
    pub fn transmitted(
        &self,
        (origin, direction, tmax): (Vec3, Vec3, f32),
        accept: &impl Fn(u32, u32, Vec2) -> bool,
        casts: &impl Fn(Caster) -> bool,
        tint: &impl Fn(&Hit) -> Rgb,
    ) -> Rgb {
        match usable(origin.as_dvec3(), direction.as_dvec3()) {
            Some(ray) => self.share(&ray, f64::from(tmax), accept, casts, tint),
            None => Rgb::ZERO,
        }
    }

    /// Whether anything that casts shadows, panes too, stands between two points, neither of whose surfaces
    /// counts.
    pub fn occluded_between(
        &self,
        from: &Anchor,
        to: &Anchor,
        accept: &impl Fn(u32, u32, Vec2) -> bool,
    ) -> bool {
        self.transmitted_between(from, to, accept, &|_| true, &|_| Rgb::ZERO) == Rgb::ZERO
    }

    /// The share of light that passes [so](Self::transmitted) between two points, neither of whose surfaces counts.
    /// The exact way to ask whether a light sample is visible: no distance has to be shortened by hand.
    pub fn transmitted_between(
        &self,
        from: &Anchor,
        to: &Anchor,
        accept: &impl Fn(u32, u32, Vec2) -> bool,
        casts: &impl Fn(Caster) -> bool,
        tint: &impl Fn(&Hit) -> Rgb,
    ) -> Rgb {
        let direction = to.position - from.position;
        let start = from.origin_toward(direction).as_dvec3();
        let end = to.origin_toward(-direction).as_dvec3();
        match usable(start, end - start) {
            Some(ray) => self.share(&ray, 1.0, accept, casts, tint),
            None => Rgb::ZERO,
        }
    }

    fn share(
        &self,
        ray: &Ray,
        tmax: f64,
        accept: &impl Fn(u32, u32, Vec2) -> bool,
        casts: &impl Fn(Caster) -> bool,
        tint: &impl Fn(&Hit) -> Rgb,
    ) -> Rgb {
        let (mut share, mut last) = (Rgb::ONE, None);
        self.visit::<false>(ray, tmax, |meeting| {
            let prim = self.prim(meeting);
            let caster = match &meeting.on {
                On::Triangle { id, .. } => Caster::Instance(id.instance),
                On::Sphere(sphere) => Caster::Sphere(sphere.light),
            };
            if prim.casts_shadow() && casts(caster) && counts(meeting, prim, ray, accept) {
                share = match caster {
                    Caster::Instance(row) if built_in::TRANSMISSION && prim.is_pane => {
                        let before = last.replace((row, meeting.t));
                        match before {
                            Some(before) if is_one_meeting(ray, before, (row, meeting.t)) => share,
                            _ => share * tint(&meeting.hit(ray, prim)),
                        }
                    }
                    _ => Rgb::ZERO,
                };
            }
            if share == Rgb::ZERO { -1.0 } else { tmax }
        });
        share
    }

    /// Calls `met` with everything that a ray meets at a distance in `(0, tmax)`, near things roughly
    /// first if `ORDERED`. It returns the new `tmax`; a negative one ends the search.
    fn visit<'b, const ORDERED: bool>(
        &'b self,
        ray: &Ray,
        mut tmax: f64,
        mut met: impl FnMut(&Meeting<'b>) -> f64,
    ) {
        self.scene.fixed.visit::<ORDERED>(ray, tmax, |hit| {
            tmax = met(&Meeting::with_triangle(hit, None));
            tmax
        });
        if tmax < 0.0 {
            return;
        }
        let box_ray = BoxRay::new(ray.origin.as_vec3(), ray.direction.as_vec3());
        for placing in [&self.scene.standing, &self.moving] {
            placing.tree.walk::<ORDERED>(&box_ray, search_limit(tmax), |item| {
                match &placing.items[item as usize] {
                    Item::Sphere(sphere) => {
                        if let Some(t) = sphere.distance(ray, tmax) {
                            tmax = met(&Meeting { t, on: On::Sphere(sphere) });
                        }
                    }
                    Item::Mesh { .. } if !built_in::INSTANCES => {}
                    Item::Mesh { instance, set, space } => {
                        let set = &self.scene.shared[*set as usize];
                        set.visit::<ORDERED>(&space.localize(ray), tmax, |hit| {
                            tmax = met(&Meeting::with_triangle(&hit.of(*instance), Some(space)));
                            tmax
                        });
                    }
                    Item::Flattened { set } => set.visit::<ORDERED>(ray, tmax, |hit| {
                        tmax = met(&Meeting::with_triangle(hit, None));
                        tmax
                    }),
                }
                search_limit(tmax)
            });
            if tmax < 0.0 {
                return;
            }
        }
    }

    #[inline]
    fn prim(&self, meeting: &Meeting) -> &Prim {
        match &meeting.on {
            On::Triangle { id, .. } => &self.prims.instances[id.instance as usize],
            On::Sphere(sphere) => &self.prims.lights[sphere.light as usize],
        }
    }
}

/// Whether a meeting counts: always, unless its mesh is a cut-out.
#[inline]
fn counts(
    meeting: &Meeting,
    prim: &Prim,
    ray: &Ray,
    accept: &impl Fn(u32, u32, Vec2) -> bool,
) -> bool {
    match meeting.on {
        On::Triangle { id, corners, space } if prim.is_cutout => {
            let weights = match space {
                Some(space) => barycentric(&space.localize(ray), corners),
                None => barycentric(ray, corners),
            };
            accept(id.instance, id.triangle, weights)
        }
        _ => true,
    }
}

/// A ray that can be traced, or nothing.
#[inline]
fn usable(origin: DVec3, direction: DVec3) -> Option<Ray> {
    let sound = origin.is_finite() && direction.is_finite() && direction.as_vec3() != Vec3::ZERO;
    sound.then_some(Ray { origin, direction })
}
