//! One frame of the ray kernel.

use super::blas::{Blas, BlasHit, LARGEST_COORDINATE, TriangleId, search_limit};
use super::sphere::Sphere;
use super::triangles::{Ray, barycentric};
use super::wide_bvh::{BoxRay, NONE, WideBvh};
use super::{Anchor, RayScene, in_world, world_of};
use crate::scene::{LightKind, Pose, Scene};
use glam::{DAffine3, DVec3, Vec2, Vec3, Vec3A};
use obvhs::aabb::Aabb;

/// Relative error of a distance found in double precision, with room for what a scene may do to it.
const NOISE: f64 = 1.0 / (1_u64 << 48) as f64;

/// What a ray hits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance in lengths of the ray's direction.
    pub t: f32,
    /// Position and geometric normal (of the front), from which further rays can start.
    pub anchor: Anchor,
    /// On what.
    pub surface: HitSurface,
}

/// On what a ray ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HitSurface {
    /// A triangle of a mesh.
    Triangle {
        /// Index into [`Scene::instances`].
        instance: u32,
        /// Index into the mesh's triangles.
        triangle: u32,
        /// Weights of the second and third corner.
        barycentric: Vec2,
    },
    /// A sphere light.
    Sphere {
        /// Index into [`Scene::lights`].
        light: u32,
    },
}

/// The geometry at one time. Made by [`RayScene::for_pose`]; shared by all threads.
#[derive(Debug)]
pub struct Tracer<'a> {
    scene: &'a RayScene,
    tree: WideBvh,
    /// What the leaves of the tree are.
    items: Vec<Item<'a>>,
    /// By instance: its transform mirrors.
    mirrored: Vec<bool>,
}

#[derive(Debug)]
enum Item<'a> {
    Sphere(Sphere),
    Mesh {
        instance: u32,
        set: &'a Blas,
        to_world: DAffine3,
        to_local: DAffine3,
    },
    /// A mesh that its transform makes flat: it has no local space to search in.
    Flattened {
        set: Box<Blas>,
    },
}

/// The nearest hit so far.
struct Nearest {
    hit: BlasHit,
    /// Local to world of the hit's space.
    to_world: Option<DAffine3>,
}

enum Found {
    Triangle(Nearest),
    Sphere(f64, Sphere),
}

impl<'a> Tracer<'a> {
    pub(super) fn new(prepared: &'a RayScene, scene: &Scene, pose: &Pose) -> Tracer<'a> {
        let (mut boxes, mut unordered) = (Vec::new(), Vec::new());
        for placed in &prepared.placed {
            let node = scene.instances[placed.instance as usize].node;
            let to_world = world_of(pose, node);
            let inverse = to_world.inverse();
            let set = &prepared.shared[placed.set as usize];
            let (item, bounds) = if inverse.is_finite() {
                let bounds = set.bounds().map(|bounds| transform_box(bounds, &to_world));
                let instance = placed.instance;
                (Item::Mesh { instance, set, to_world, to_local: inverse }, bounds)
            } else {
                let (triangles, ids) = in_world(scene, pose, placed.instance);
                let set = Box::new(Blas::build(&triangles, &ids));
                let bounds = set.bounds().map(|(low, high)| Aabb::new(low.into(), high.into()));
                (Item::Flattened { set }, bounds)
            };
            if let Some(bounds) = bounds.filter(is_sound) {
                boxes.push(bounds);
                unordered.push(item);
            }
        }
        for sphere in spheres(scene, pose) {
            let radius = DVec3::splat(sphere.radius_m);
            let bounds = outward(sphere.center - radius, sphere.center + radius);
            if is_sound(&bounds) {
                boxes.push(bounds);
                unordered.push(Item::Sphere(sphere));
            }
        }
        let (tree, leaves) = WideBvh::build(&boxes, 1);
        let mut unordered: Vec<_> = unordered.into_iter().map(Some).collect();
        let order = leaves.iter().map(|leaf| leaf[0]).filter(|&item| item != NONE);
        let items = order.filter_map(|item| unordered[item as usize].take()).collect();
        let is_mirrored = |node| pose.world(node).matrix3.determinant() < 0.0;
        let mirrored = scene.instances.iter().map(|instance| is_mirrored(instance.node)).collect();
        Tracer { scene: prepared, tree, items, mirrored }
    }

    /// The nearest hit at a distance in `(0, tmax)`, in lengths of `direction`. `accept` takes an
    /// instance, a triangle and the barycentric weights of its second and third corner, and says
    /// whether a hit on a cut-out counts. `None` also for a ray that is not finite.
    pub fn closest(
        &self,
        origin: Vec3,
        direction: Vec3,
        tmax: f32,
        accept: &impl Fn(u32, u32, Vec2) -> bool,
    ) -> Option<Hit> {
        let ray = usable(origin.as_dvec3(), direction.as_dvec3())?;
        let mut best = f64::from(tmax);
        let mut found = None;
        if let Some(hit) =
            self.scene.fixed.closest(&ray, best, |hit| self.counts(hit, &ray, accept))
        {
            best = hit.t;
            found = Some(Found::Triangle(Nearest { hit, to_world: None }));
        }
        let box_ray = BoxRay::new(origin, direction);
        self.tree.walk::<true>(&box_ray, search_limit(best), |item| {
            let nearer = match &self.items[item as usize] {
                Item::Sphere(sphere) => {
                    sphere.distance(&ray, best).map(|t| (t, Found::Sphere(t, *sphere)))
                }
                Item::Mesh { instance, set, to_world, to_local } => {
                    let local = into_local(&ray, to_local);
                    let named = |hit: &BlasHit| name(hit, *instance);
                    let accept = |hit: &BlasHit| self.counts(&named(hit), &local, accept);
                    set.closest(&local, best, accept).map(|hit| {
                        let to_world = Some(*to_world);
                        (hit.t, Found::Triangle(Nearest { hit: named(&hit), to_world }))
                    })
                }
                Item::Flattened { set } => set
                    .closest(&ray, best, |hit| self.counts(hit, &ray, accept))
                    .map(|hit| (hit.t, Found::Triangle(Nearest { hit, to_world: None }))),
            };
            if let Some((t, nearer)) = nearer {
                best = t;
                found = Some(nearer);
            }
            search_limit(best)
        });
        found.map(|found| match found {
            Found::Triangle(nearest) => self.triangle_hit(&ray, nearest),
            Found::Sphere(t, sphere) => sphere_hit(&ray, t, &sphere),
        })
    }

    /// Whether anything stands at a distance in `(0, tmax)`, in lengths of `direction`. `accept`
    /// as for [`closest`](Self::closest). A ray that is not finite counts as blocked.
    pub fn occluded(
        &self,
        origin: Vec3,
        direction: Vec3,
        tmax: f32,
        accept: &impl Fn(u32, u32, Vec2) -> bool,
    ) -> bool {
        match usable(origin.as_dvec3(), direction.as_dvec3()) {
            Some(ray) => self.blocks(&ray, f64::from(tmax), accept),
            None => true,
        }
    }

    /// Whether anything stands between two points, neither of whose surfaces counts. The exact way
    /// to ask whether a light sample is visible: no distance has to be shortened by hand.
    pub fn occluded_between(
        &self,
        from: &Anchor,
        to: &Anchor,
        accept: &impl Fn(u32, u32, Vec2) -> bool,
    ) -> bool {
        let direction = to.position - from.position;
        let start = from.origin_toward(direction).as_dvec3();
        let end = to.origin_toward(-direction).as_dvec3();
        match usable(start, end - start) {
            Some(ray) => self.blocks(&ray, 1.0, accept),
            None => true,
        }
    }

    fn blocks(&self, ray: &Ray, tmax: f64, accept: &impl Fn(u32, u32, Vec2) -> bool) -> bool {
        if self.scene.fixed.occluded(ray, tmax, |hit| self.counts(hit, ray, accept)) {
            return true;
        }
        let mut blocked = false;
        let bound = search_limit(tmax);
        let box_ray = BoxRay::new(ray.origin.as_vec3(), ray.direction.as_vec3());
        self.tree.walk::<false>(&box_ray, bound, |item| {
            blocked = match &self.items[item as usize] {
                Item::Sphere(sphere) => sphere.distance(ray, tmax).is_some(),
                Item::Mesh { instance, set, to_local, .. } => {
                    let local = into_local(ray, to_local);
                    let accept = |hit: &BlasHit| self.counts(&name(hit, *instance), &local, accept);
                    set.occluded(&local, tmax, accept)
                }
                Item::Flattened { set } => {
                    set.occluded(ray, tmax, |hit| self.counts(hit, ray, accept))
                }
            };
            if blocked { -1.0 } else { bound }
        });
        blocked
    }

    /// Whether a hit counts: always, unless its mesh is a cut-out.
    #[inline]
    fn counts(&self, hit: &BlasHit, ray: &Ray, accept: &impl Fn(u32, u32, Vec2) -> bool) -> bool {
        !self.scene.cutout[hit.id.instance as usize]
            || accept(hit.id.instance, hit.id.triangle, barycentric(ray, hit.corners))
    }

    fn triangle_hit(&self, ray: &Ray, Nearest { hit, to_world }: Nearest) -> Hit {
        let corners = match to_world {
            Some(to_world) => hit.corners.map(|corner| to_world.transform_point3(corner)),
            None => hit.corners,
        };
        let TriangleId { instance, triangle } = hit.id;
        let [a, b, c] = corners;
        let across = (b - a).cross(c - a).normalize_or_zero().as_vec3();
        let normal = if self.mirrored[instance as usize] { -across } else { across };
        let position = ray.origin + hit.t * ray.direction;
        let size = ray.origin.abs().max(a.abs()).max(b.abs()).max(c.abs()).max_element();
        let barycentric = barycentric(ray, corners);
        Hit {
            t: hit.t as f32,
            anchor: Anchor::rounded(position, normal, NOISE * size),
            surface: HitSurface::Triangle { instance, triangle, barycentric },
        }
    }
}

fn name(hit: &BlasHit, instance: u32) -> BlasHit {
    BlasHit { id: TriangleId { instance, ..hit.id }, ..*hit }
}

fn sphere_hit(ray: &Ray, t: f64, sphere: &Sphere) -> Hit {
    let met = ray.origin + t * ray.direction;
    let outward = (met - sphere.center).normalize_or_zero();
    let position = sphere.center + outward * sphere.radius_m;
    let size = sphere.center.abs().max_element() + sphere.radius_m + ray.origin.abs().max_element();
    Hit {
        t: t as f32,
        anchor: Anchor::rounded(position, outward.as_vec3(), NOISE * size),
        surface: HitSurface::Sphere { light: sphere.light },
    }
}

/// A ray that can be traced, or nothing.
#[inline]
fn usable(origin: DVec3, direction: DVec3) -> Option<Ray> {
    let sound = origin.is_finite() && direction.is_finite() && direction.as_vec3() != Vec3::ZERO;
    sound.then_some(Ray { origin, direction })
}

#[inline]
fn into_local(ray: &Ray, to_local: &DAffine3) -> Ray {
    Ray {
        origin: to_local.transform_point3(ray.origin),
        direction: to_local.transform_vector3(ray.direction),
    }
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
fn transform_box((low, high): (Vec3, Vec3), to_world: &DAffine3) -> Aabb {
    let corner = |i: usize| {
        let pick = |axis: usize| f64::from(if i >> axis & 1 == 0 { low[axis] } else { high[axis] });
        to_world.transform_point3(DVec3::new(pick(0), pick(1), pick(2)))
    };
    let all = (1..8).map(corner);
    let (low, high) = all.fold((corner(0), corner(0)), |(l, h), p| (l.min(p), h.max(p)));
    outward(low, high)
}

/// Whether a box is small enough to build a tree over.
fn is_sound(bounds: &Aabb) -> bool {
    let small = |p: Vec3A| p.abs().cmple(Vec3A::splat(LARGEST_COORDINATE)).all();
    small(bounds.min) && small(bounds.max)
}

/// Rounded so that nothing is lost; a local ray, rounded in its own space, still finds it.
fn outward(low: DVec3, high: DVec3) -> Aabb {
    let margin = (high - low).max_element() * f64::from(f32::EPSILON);
    let low = (low - margin).as_vec3().to_array().map(f32::next_down);
    let high = (high + margin).as_vec3().to_array().map(f32::next_up);
    Aabb::new(low.into(), high.into())
}
