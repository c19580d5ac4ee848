//! What is put into the world by a pose: meshes that are searched in their own space, and sphere lights.
//!
//! What stands still is placed once for a shot, what moves once for each pose.

use super::blas::{Blas, LARGEST_COORDINATE};
use super::meeting::Space;
use super::shining::Shining;
use super::sphere::Sphere;
use super::wide_bvh::{NONE, WideBvh};
use super::{in_own_space, in_world, may_shine, world_of};
use crate::bounds::Aabb;
use crate::scene::{LightKind, Pose, Scene};
use glam::{DAffine3, DVec3, Vec3};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// What is to be placed.
#[derive(Debug, Default)]
pub(super) struct Rows {
    /// Instances, and the set of triangles that each refers to.
    pub instances: Vec<(u32, u32)>,
    /// Of each mesh that changes its shape, its instances.
    pub deforming: BTreeMap<u32, Vec<u32>>,
    /// Rows of [`Scene::lights`]: spheres.
    pub spheres: Vec<u32>,
}

/// What has been placed.
#[derive(Debug, Default)]
pub(super) struct Placing {
    pub tree: WideBvh,
    /// Boxes of those that may shine.
    pub shining: Shining,
    /// What the leaves of the tree are.
    pub items: Vec<Item>,
    /// Sets in local space, of meshes that deform and have several instances.
    pub shaped: Vec<Blas>,
}

/// A set in local space.
#[derive(Clone, Copy, Debug)]
pub(super) enum Set {
    /// A row of those that are shared by all poses.
    Shared(u32),
    /// A row of [`Placing::shaped`].
    Shaped(u32),
}

#[derive(Debug)]
pub(super) enum Item {
    Sphere(Sphere),
    Mesh {
        instance: u32,
        set: Set,
        space: Space,
    },
    /// A mesh in world space: one that deforms, or one that its transform makes flat, which has no local space to
    /// search in.
    InWorld {
        set: Box<Blas>,
    },
}

impl Placing {
    /// Places some rows.
    pub fn new(scene: &Scene, pose: &Pose, sets: &[Blas], rows: &Rows) -> Placing {
        let (mut boxes, mut unordered) = (Vec::new(), Vec::new());
        let mut shining = Vec::new();
        let in_world = |instance: u32| {
            let (triangles, ids) = in_world(scene, pose, instance);
            let set = Box::new(Blas::build(&triangles, &ids));
            let bounds = set.bounds();
            (Item::InWorld { set }, bounds)
        };
        // A lone instance is searched in world space, as what stands still is: that spares its rays a transform.
        let (alone, crowds): (Vec<_>, Vec<_>) =
            rows.deforming.iter().partition(|(_, instances)| instances.len() == 1);
        let alone: Vec<_> =
            alone.par_iter().map(|(_, rows)| (rows[0], in_world(rows[0]))).collect();
        let shaped = crowds.par_iter().map(|(mesh, _)| in_own_space(scene, pose, **mesh));
        let shaped: Vec<Blas> = shaped.collect();
        let of_crowd = |(row, (_, instances)): (u32, &(&u32, &Vec<u32>))| {
            instances.iter().map(move |&instance| (instance, Set::Shaped(row))).collect::<Vec<_>>()
        };
        let crowds = (0..).zip(&crowds).flat_map(of_crowd);
        let shared = rows.instances.iter().map(|&(instance, set)| (instance, Set::Shared(set)));
        let placed = shared.chain(crowds).map(|(instance, set)| {
            let to_world = world_of(pose, scene.instances[instance as usize].node);
            let to_local = to_world.inverse();
            // A ray in a space beyond all bounds would have no direction.
            let is_sound = to_local.matrix3.to_cols_array().iter().all(|part| part.abs() < 1e30);
            let (item, bounds) = if to_local.is_finite() && is_sound {
                let bounds = match set {
                    Set::Shared(set) => sets[set as usize].bounds(),
                    Set::Shaped(set) => shaped[set as usize].bounds(),
                };
                let bounds = bounds.map(|bounds| transform_box(&bounds, &to_world));
                (Item::Mesh { instance, set, space: Space { to_world, to_local } }, bounds)
            } else {
                in_world(instance)
            };
            (instance, (item, bounds))
        });
        for (instance, (item, bounds)) in placed.chain(alone) {
            if let Some(bounds) = bounds.filter(is_sound) {
                shining.extend(may_shine(scene, instance).then_some(bounds));
                boxes.push(bounds);
                unordered.push(item);
            }
        }
        for sphere in rows.spheres.iter().filter_map(|&row| sphere(scene, pose, row)) {
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
        Placing { tree, shining: Shining::around(&shining), items, shaped }
    }
}

/// A sphere light, if it has a surface.
fn sphere(scene: &Scene, pose: &Pose, row: u32) -> Option<Sphere> {
    let light = &scene.lights[row as usize];
    let LightKind::Sphere { radius, .. } = light.kind else { return None };
    let radius_m = f64::from(pose.world_radius(light.node, radius));
    let center = world_of(pose, light.node).translation;
    (radius_m > 0.0).then_some(Sphere { light: row, center, radius_m })
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
