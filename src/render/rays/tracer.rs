//! One frame of the ray kernel.

use super::blas::{Blas, LARGEST_COORDINATE, search_limit};
use super::meeting::{Meeting, On, Space};
use super::prim::{Prim, Sender};
use super::shining::Shining;
use super::sight::{Seen, SeenLight, Sight};
use super::sphere::Sphere;
use super::triangles::{Ray, barycentric};
use super::wide_bvh::{BoxRay, NONE, WideBvh};
use super::{Anchor, RayScene, in_world, may_shine, world_of};
use crate::bounds::Aabb;
use crate::math::built_in;
use crate::scene::{LightKind, Pose, Scene};
use glam::{DAffine3, DVec3, Vec2, Vec3};

/// The geometry at one time. Made by [`RayScene::for_pose`]; shared by all threads.
#[derive(Debug)]
pub struct Tracer<'a> {
    scene: &'a RayScene,
    tree: WideBvh,
    /// Boxes of those that may shine.
    shining: Shining,
    /// What the leaves of the tree are.
    items: Vec<Item<'a>>,
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

#[derive(Debug)]
enum Item<'a> {
    Sphere(Sphere),
    Mesh {
        instance: u32,
        set: &'a Blas,
        space: Space,
    },
    /// A mesh that its transform makes flat: it has no local space to search in.
    Flattened {
        set: Box<Blas>,
    },
}

impl<'a> Tracer<'a> {
    pub(super) fn new(prepared: &'a RayScene, scene: &Scene, pose: &Pose) -> Tracer<'a> {
        let (mut boxes, mut unordered) = (Vec::new(), Vec::new());
        let mut shining = Vec::new();
        for placed in &prepared.placed {
            let node = scene.instances[placed.instance as usize].node;
            let to_world = world_of(pose, node);
            let to_local = to_world.inverse();
            let set = &prepared.shared[placed.set as usize];
            let (item, bounds) = if to_local.is_finite() {
                let bounds = set.bounds().map(|bounds| transform_box(&bounds, &to_world));
                let space = Space { to_world, to_local };
                (Item::Mesh { instance: placed.instance, set, space }, bounds)
            } else {
                let (triangles, ids) = in_world(scene, pose, placed.instance);
                let set = Box::new(Blas::build(&triangles, &ids));
                let bounds = set.bounds();
                (Item::Flattened { set }, bounds)
            };
            if let Some(bounds) = bounds.filter(is_sound) {
                shining.extend(may_shine(scene, placed.instance).then_some(bounds));
                boxes.push(bounds);
                unordered.push(item);
            }
        }
        for sphere in spheres(scene, pose) {
            let radius = DVec3::splat(sphere.radius_m);
            let bounds = outward(sphere.center - radius, sphere.center + radius);
            if is_sound(&bounds) {
                let may_shine = scene.peak_rgb_of_light(sphere.light).max_element() > 0.0;
                shining.extend(may_shine.then_some(bounds));
                boxes.push(bounds);
                unordered.push(Item::Sphere(sphere));
            }
        }
        let (tree, leaves) = WideBvh::build(&boxes, 1);
        let mut unordered: Vec<_> = unordered.into_iter().map(Some).collect();
        let order = leaves.iter().map(|leaf| leaf[0]).filter(|&item| item != NONE);
        let items = order.filter_map(|item| unordered[item as usize].take()).collect();
        let ranks = &prepared.ranks;
        let instance = |row: u32| Prim::instance(scene, pose, row, ranks[row as usize]);
        let of_instances = scene.instances.len() as u32;
        let light = |row: u32| Prim::sphere(scene, pose, row, of_instances + row);
        let instances = (0..of_instances).map(instance).collect();
        let lights = (0..scene.lights.len() as u32).map(light).collect();
        let shining = Shining::around(&shining);
        Tracer { scene: prepared, tree, shining, items, instances, lights }
    }

    /// What a ray sees at distances in `(0, tmax)`, in lengths of `direction`; the lights among it go
    /// to `lights`. `accept` takes an instance, a triangle and the barycentric weights of its second
    /// and third corner, and says whether a hit on a cut-out counts. A ray that is not finite sees
    /// nothing.
    pub fn look(
        &self,
        sender: Sender,
        (origin, direction, tmax): (Vec3, Vec3, f32),
        accept: &impl Fn(u32, u32, Vec2) -> bool,
        lights: &mut Vec<SeenLight>,
    ) -> Seen {
        let Some(ray) = usable(origin.as_dvec3(), direction.as_dvec3()) else {
            lights.clear();
            return Seen { hit: None, in_shade: false };
        };
        let mut sight = Sight::new(&ray, sender, f64::from(tmax), lights);
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
        self.shining.may_be_met(&ray) || self.scene.shining.may_be_met(&ray)
    }

    /// Whether anything that casts shadows stands at a distance in `(0, tmax)`, in lengths of
    /// `direction`. `accept` as for [`look`](Self::look). A ray that is not finite counts as blocked.
    pub fn occluded(
        &self,
        origin: Vec3,
        direction: Vec3,
        tmax: f32,
        accept: &impl Fn(u32, u32, Vec2) -> bool,
    ) -> bool {
        self.occluded_by(origin, direction, tmax, accept, &|_| true)
    }

    /// The same, of the prims alone that `casts` names.
    pub fn occluded_by(
        &self,
        origin: Vec3,
        direction: Vec3,
        tmax: f32,
        accept: &impl Fn(u32, u32, Vec2) -> bool,
        casts: &impl Fn(Caster) -> bool,
    ) -> bool {
        match usable(origin.as_dvec3(), direction.as_dvec3()) {
            Some(ray) => self.blocks(&ray, f64::from(tmax), accept, casts),
            None => true,
        }
    }

    /// Whether anything that casts shadows stands between two points, neither of whose surfaces
    /// counts. The exact way to ask whether a light sample is visible: no distance has to be shortened
    /// by hand.
    pub fn occluded_between(
        &self,
        from: &Anchor,
        to: &Anchor,
        accept: &impl Fn(u32, u32, Vec2) -> bool,
    ) -> bool {
        self.occluded_between_by(from, to, accept, &|_| true)
    }

    /// The same, of the prims alone that `casts` names.
    pub fn occluded_between_by(
        &self,
        from: &Anchor,
        to: &Anchor,
        accept: &impl Fn(u32, u32, Vec2) -> bool,
        casts: &impl Fn(Caster) -> bool,
    ) -> bool {
        let direction = to.position - from.position;
        let start = from.origin_toward(direction).as_dvec3();
        let end = to.origin_toward(-direction).as_dvec3();
        match usable(start, end - start) {
            Some(ray) => self.blocks(&ray, 1.0, accept, casts),
            None => true,
        }
    }

    fn blocks(
        &self,
        ray: &Ray,
        tmax: f64,
        accept: &impl Fn(u32, u32, Vec2) -> bool,
        casts: &impl Fn(Caster) -> bool,
    ) -> bool {
        let mut blocked = false;
        self.visit::<false>(ray, tmax, |meeting| {
            let prim = self.prim(meeting);
            let caster = match &meeting.on {
                On::Triangle { id, .. } => Caster::Instance(id.instance),
                On::Sphere(sphere) => Caster::Sphere(sphere.light),
            };
            blocked = prim.casts_shadow() && casts(caster) && counts(meeting, prim, ray, accept);
            if blocked { -1.0 } else { tmax }
        });
        blocked
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
        self.tree.walk::<ORDERED>(&box_ray, search_limit(tmax), |item| {
            match &self.items[item as usize] {
                Item::Sphere(sphere) => {
                    if let Some(t) = sphere.distance(ray, tmax) {
                        tmax = met(&Meeting { t, on: On::Sphere(sphere) });
                    }
                }
                Item::Mesh { .. } if !built_in::INSTANCES => {}
                Item::Mesh { instance, set, space } => {
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
    }

    #[inline]
    fn prim(&self, meeting: &Meeting) -> &Prim {
        match &meeting.on {
            On::Triangle { id, .. } => &self.instances[id.instance as usize],
            On::Sphere(sphere) => &self.lights[sphere.light as usize],
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

/// The sphere lights that have a surface.
fn spheres(scene: &Scene, pose: &Pose) -> impl Iterator<Item = Sphere> {
    scene.lights.iter().enumerate().filter_map(|(number, light)| {
        let LightKind::Sphere { radius, .. } = light.kind else { return None };
        let world = world_of(pose, light.node);
        let radius_m = f64::from(pose.world_radius(light.node, radius));
        let center = world.translation;
        (radius_m > 0.0).then_some(Sphere { light: number as u32, center, radius_m })
    })
}

/// A box around a transformed box.
fn transform_box(bounds: &Aabb, to_world: &DAffine3) -> Aabb {
    let corner = |i: usize| {
        let side = |axis: usize| if i >> axis & 1 == 0 { bounds.min } else { bounds.max };
        let pick = |axis: usize| f64::from(side(axis)[axis]);
        to_world.transform_point3(DVec3::new(pick(0), pick(1), pick(2)))
    };
    let all = (1..8).map(corner);
    let (low, high) = all.fold((corner(0), corner(0)), |(l, h), p| (l.min(p), h.max(p)));
    outward(low, high)
}

/// Whether a box is small enough to build a tree over.
fn is_sound(bounds: &Aabb) -> bool {
    let small = |p: Vec3| p.abs().cmple(Vec3::splat(LARGEST_COORDINATE)).all();
    small(bounds.min) && small(bounds.max)
}

/// Rounded so that nothing is lost; a local ray, rounded in its own space, still finds it.
fn outward(low: DVec3, high: DVec3) -> Aabb {
    let margin = (high - low).max_element() * f64::from(f32::EPSILON);
    let low = (low - margin).as_vec3().to_array().map(f32::next_down);
    let high = (high + margin).as_vec3().to_array().map(f32::next_up);
    Aabb { min: low.into(), max: high.into() }
}
