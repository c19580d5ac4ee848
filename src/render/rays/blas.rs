//! A set of triangles that a ray can search: the lower level of the kernel.

use super::triangles::{Block, Ray, ShearedRay, plane_distance};
use super::wide_bvh::{BoxRay, LEAF_SIZE, NONE, WideBvh};
use crate::bounds::Aabb;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Coordinates beyond this, in metres, are filtered: products of three of them must stay finite.
pub const LARGEST_COORDINATE: f32 = 1e12;

/// A triangle's name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TriangleId {
    /// Index into [`Scene::instances`](crate::scene::Scene::instances).
    pub instance: u32,
    /// Index into the mesh's triangles.
    pub triangle: u32,
}

/// Triangles in one space, blocks in the order of the tree's leaves.
#[derive(Debug, Default)]
pub struct Blas {
    tree: WideBvh,
    blocks: Vec<Block>,
    ids: Vec<[TriangleId; LEAF_SIZE]>,
    bounds: Option<Aabb>,
}

/// Where a ray meets a triangle of a [`Blas`], in its space.
#[derive(Clone, Copy, Debug)]
pub struct BlasHit {
    /// In lengths of the ray's direction.
    pub t: f64,
    /// Which triangle.
    pub id: TriangleId,
    /// Its corners.
    pub corners: [DVec3; 3],
}

impl BlasHit {
    /// The same on an instance of the set.
    pub fn of(&self, instance: u32) -> BlasHit {
        BlasHit { id: TriangleId { instance, ..self.id }, ..*self }
    }
}

impl Blas {
    /// Builds over triangles. Those with a coordinate that is not finite or beyond 1e12, and those
    /// without area, are left out: no ray meets them.
    pub fn build(triangles: &[[Vec3; 3]], ids: &[TriangleId]) -> Blas {
        let kept: Vec<u32> = (0..triangles.len() as u32)
            .into_par_iter()
            .filter(|&i| can_be_hit(&triangles[i as usize]))
            .collect();
        let boxes: Vec<Aabb> =
            kept.par_iter().map(|&i| Aabb::around(triangles[i as usize])).collect();
        let (tree, leaves) = WideBvh::build(&boxes, LEAF_SIZE as u32);
        let filled = leaves.par_iter().map(|leaf| {
            let (mut block, mut names) = (Block::EMPTY, [TriangleId::default(); LEAF_SIZE]);
            for (lane, &entry) in leaf.iter().enumerate().filter(|&(_, &entry)| entry != NONE) {
                let triangle = kept[entry as usize] as usize;
                block.set(lane, triangles[triangle]);
                names[lane] = ids[triangle];
            }
            (block, names)
        });
        let (blocks, ids) = filled.unzip();
        let bounds = boxes.iter().copied().reduce(|a, b| a.union(&b));
        Blas { tree, blocks, ids, bounds }
    }

    /// Around all triangles; `None` if there are none.
    pub fn bounds(&self) -> Option<Aabb> {
        self.bounds
    }

    /// Calls `met` with the triangles that the ray meets at a distance in `(0, tmax)`, near ones
    /// roughly first if `ORDERED`. It returns the new `tmax`; a negative one ends the search.
    #[inline]
    pub fn visit<const ORDERED: bool>(
        &self,
        ray: &Ray,
        tmax: f64,
        met: impl FnMut(&BlasHit) -> f64,
    ) {
        let d = ray.direction.abs();
        if d.x >= d.y && d.x >= d.z {
            self.visit_along::<ORDERED, 0>(ray, tmax, met)
        } else if d.y >= d.z {
            self.visit_along::<ORDERED, 1>(ray, tmax, met)
        } else {
            self.visit_along::<ORDERED, 2>(ray, tmax, met)
        }
    }

    fn visit_along<const ORDERED: bool, const KZ: usize>(
        &self,
        ray: &Ray,
        mut tmax: f64,
        mut met: impl FnMut(&BlasHit) -> f64,
    ) {
        let (origin, direction) = (ray.origin.as_vec3(), ray.direction.as_vec3());
        let box_ray = BoxRay::new(origin, direction);
        let sheared = ShearedRay::<KZ>::new(origin, direction);
        let mut bound = search_limit(tmax);
        self.tree.walk::<ORDERED>(&box_ray, bound, |leaf| {
            let block = &self.blocks[leaf as usize];
            let mut lanes = block.candidates(&sheared, bound);
            while lanes != 0 {
                let lane = lanes.trailing_zeros() as usize % LEAF_SIZE;
                lanes &= lanes - 1;
                let corners = block.get(lane);
                let Some(t) = plane_distance(ray, corners) else { continue };
                if !(t > 0.0 && t < tmax) {
                    continue;
                }
                tmax = met(&BlasHit { t, id: self.ids[leaf as usize][lane], corners });
                if tmax < 0.0 {
                    return -1.0;
                }
                bound = search_limit(tmax);
            }
            bound
        });
    }
}

/// A single-precision bound that what lies before `t` is searched with: larger than `t` by more
/// than the search rounds, since what it finds is measured again.
pub fn search_limit(t: f64) -> f32 {
    t as f32 * 1.000_002
}

/// Whether any ray can meet a triangle.
pub fn can_be_hit(&[a, b, c]: &[Vec3; 3]) -> bool {
    let small = |p: Vec3| p.abs().cmple(Vec3::splat(LARGEST_COORDINATE)).all();
    small(a) && small(b) && small(c) && {
        let (a, b, c) = (a.as_dvec3(), b.as_dvec3(), c.as_dvec3());
        (b - a).cross(c - a) != DVec3::ZERO
    }
}
