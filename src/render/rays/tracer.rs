//! One frame of the ray kernel.

use super::blas::search_limit;
use super::meeting::{Meeting, On};
use super::placing::{Item, Placing, Set};
use super::prim::{Prim, Sender};
use super::sight::{Passed, Seen, SeenPane, Sight, order_panes};
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

/// What of light gets along a ray.
#[derive(Clone, Copy, Debug)]
pub struct Transmitted {
    /// The product of the panes' tints, or none if anything else casts a shadow.
    pub share: Rgb,
    /// Where the ray passes the back of solid glass that does not block it, in lengths of its direction; infinite if
    /// it does not.
    pub leaves_at: f32,
}

impl Transmitted {
    const NOTHING: Transmitted = Transmitted { share: Rgb::ZERO, leaves_at: f32::INFINITY };
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
            passed.clear();
            return Seen { hit: None, in_shade: false, leaves_at: f32::INFINITY };
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
        self.transmitted(ray, accept, &|_| true, &|_| Rgb::ZERO).share == Rgb::ZERO
    }

    /// What of light passes the distances in `(0, tmax)`, in lengths of `direction`, if what `casts` names casts
    /// shadows. A ray that is not finite is blocked.
    pub fn transmitted(
        &self,
        (origin, direction, tmax): (Vec3, Vec3, f32),
        accept: &impl Fn(u32, u32, Vec2) -> bool,
        casts: &impl Fn(Caster) -> bool,
        tint: &impl Fn(&Hit) -> Rgb,
    ) -> Transmitted {
        match usable(origin.as_dvec3(), direction.as_dvec3()) {
            Some(ray) => self.along(&ray, f64::from(tmax), accept, casts, tint),
            None => Transmitted::NOTHING,
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
        self.transmitted_between(from, to, accept, &|_| true, &|_| Rgb::ZERO).share == Rgb::ZERO
    }

    /// What of light passes [so](Self::transmitted) between two points, neither of whose surfaces counts.
    /// The exact way to ask whether a light sample is visible: no distance has to be shortened by hand.
    pub fn transmitted_between(
        &self,
        from: &Anchor,
        to: &Anchor,
        accept: &impl Fn(u32, u32, Vec2) -> bool,
        casts: &impl Fn(Caster) -> bool,
        tint: &impl Fn(&Hit) -> Rgb,
    ) -> Transmitted {
        let direction = to.position - from.position;
        let start = from.origin_toward(direction).as_dvec3();
        let end = to.origin_toward(-direction).as_dvec3();
        match usable(start, end - start) {
            Some(ray) => self.along(&ray, 1.0, accept, casts, tint),
            None => Transmitted::NOTHING,
        }
    }

    fn along(
        &self,
        ray: &Ray,
        tmax: f64,
        accept: &impl Fn(u32, u32, Vec2) -> bool,
        casts: &impl Fn(Caster) -> bool,
        tint: &impl Fn(&Hit) -> Rgb,
    ) -> Transmitted {
        let (mut is_blocked, mut leaves_at, mut panes) = (false, f64::INFINITY, Vec::new());
        self.visit::<false>(ray, tmax, |meeting| {
            let prim = self.prim(meeting);
            let caster = match &meeting.on {
                On::Triangle { id, .. } => Caster::Instance(id.instance),
                On::Sphere(sphere) => Caster::Sphere(sphere.light),
            };
            let is_met = prim.casts_shadow() && casts(caster) && counts(meeting, prim, ray, accept);
            if is_met {
                let pane = prim.is_pane.then(|| SeenPane::of(meeting, ray, prim, true)).flatten();
                let pane = pane.map(|pane| pane.tinted(tint));
                is_blocked = pane.is_none_or(|pane| pane.tint == Rgb::ZERO);
                panes.extend(pane);
            } else if prim.is_left(false, || meeting.is_front(ray, prim)) {
                leaves_at = leaves_at.min(meeting.t);
            }
            if is_blocked { -1.0 } else { tmax }
        });
        if is_blocked {
            return Transmitted::NOTHING;
        }
        // In the order of the ray, as `look` finds them: the two ways to find light must add up.
        order_panes(ray, &mut panes);
        let share = panes.iter().fold(Rgb::ONE, |share, pane| share * pane.tint);
        Transmitted { share, leaves_at: leaves_at as f32 }
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
        let placings = [&self.scene.standing, &self.moving];
        if placings.iter().all(|placing| placing.items.is_empty()) {
            return;
        }
        let box_ray = BoxRay::new(ray.origin.as_vec3(), ray.direction.as_vec3());
        for placing in placings {
            placing.tree.walk::<ORDERED>(&box_ray, search_limit(tmax), |item| {
                match &placing.items[item as usize] {
                    Item::Sphere(sphere) => {
                        if let Some(t) = sphere.distance(ray, tmax) {
                            tmax = met(&Meeting { t, on: On::Sphere(sphere) });
                        }
                    }
                    Item::Mesh { .. } if !built_in::INSTANCES => {}
                    Item::Mesh { instance, set, space } => {
                        let set = match set {
                            Set::Shared(set) => &self.scene.shared[*set as usize],
                            Set::Shaped(set) => &placing.shaped[*set as usize],
                        };
                        set.visit::<ORDERED>(&space.localize(ray), tmax, |hit| {
                            tmax = met(&Meeting::with_triangle(&hit.of(*instance), Some(space)));
                            tmax
                        });
                    }
                    Item::InWorld { set } => set.visit::<ORDERED>(ray, tmax, |hit| {
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
        On::Triangle { id, triangle, space } if prim.is_cutout => {
            let corners = triangle.corners();
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
