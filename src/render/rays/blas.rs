//! A set of triangles that a ray can search: the lower level of the kernel.

use super::lanes::{prefetch, scattered};
use super::triangles::{Block, OfBlock, Ray, ShearedRay, plane_distance};
use super::wide_bvh::{AtLeaf, BoxRay, LEAF_SIZE, NONE, WideBvh};
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
    leaves: Vec<Leaf>,
    bounds: Option<Aabb>,
}

/// Three cache lines.
#[derive(Debug)]
#[repr(C, align(64))]
struct Leaf {
    block: Block,
    ids: [TriangleId; LEAF_SIZE],
}

/// Where a ray meets a triangle of a [`Blas`], in its space.
#[derive(Clone, Copy, Debug)]
pub struct BlasHit<'a> {
    /// In lengths of the ray's direction.
    pub t: f64,
    /// Which triangle.
    pub id: TriangleId,
    /// Its corners.
    pub triangle: OfBlock<'a>,
}

impl<'a> BlasHit<'a> {
    /// The same on an instance of the set.
    pub fn of(&self, instance: u32) -> BlasHit<'a> {
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
            let (mut block, mut of_lanes) = (Block::EMPTY, [TriangleId::default(); LEAF_SIZE]);
            for (lane, &entry) in leaf.iter().enumerate().filter(|&(_, &entry)| entry != NONE) {
                let triangle = kept[entry as usize] as usize;
                block.set(lane, triangles[triangle]);
                of_lanes[lane] = ids[triangle];
            }
            Leaf { block, ids: of_lanes }
        });
        let mut leaves = scattered(filled.len());
        filled.collect_into_vec(&mut leaves);
        let bounds = boxes.iter().copied().reduce(|a, b| a.union(&b));
        Blas { tree, leaves, bounds }
    }

    /// Around all triangles; `None` if there are none.
    pub fn bounds(&self) -> Option<Aabb> {
        self.bounds
    }

    /// Calls `met` with the triangles that the ray meets at a distance in `(0, tmax)`, near ones
    /// roughly first if `ORDERED`. It returns the new `tmax`; a negative one ends the search.
    #[inline]
    pub fn visit<'a, const ORDERED: bool>(
        &'a self,
        ray: &Ray,
        tmax: f64,
        met: impl FnMut(&BlasHit<'a>) -> f64,
    ) {
        let (origin, direction) = (ray.origin.as_vec3(), ray.direction.as_vec3());
        let (sheared, bound) = (ShearedRay::new(origin, direction), search_limit(tmax));
        let search = Search { set: self, ray, sheared, tmax, bound, met };
        self.tree.walk::<ORDERED>(&BoxRay::new(origin, direction), bound, search);
    }
}

/// A ray among the triangles of a set.
struct Search<'a, 'r, F> {
    set: &'a Blas,
    ray: &'r Ray,
    sheared: ShearedRay,
    tmax: f64,
    /// What lies before `tmax` is searched with this.
    bound: f32,
    met: F,
}

impl<'a, F: FnMut(&BlasHit<'a>) -> f64> AtLeaf for Search<'a, '_, F> {
    #[inline(always)]
    fn visit(&mut self, leaf: u32) -> f32 {
        let Leaf { block, ids } = &self.set.leaves[leaf as usize];
        let mut lanes = block.candidates(&self.sheared, self.bound);
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize % LEAF_SIZE;
            lanes &= lanes - 1;
            let Some(t) = plane_distance(self.ray, block.get(lane)) else { continue };
            if !(t > 0.0 && t < self.tmax) {
                continue;
            }
            self.tmax =
                (self.met)(&BlasHit { t, id: ids[lane], triangle: OfBlock { block, lane } });
            if self.tmax < 0.0 {
                return -1.0;
            }
            self.bound = search_limit(self.tmax);
        }
        self.bound
    }

    #[inline(always)]
    fn prefetch(&self, leaf: u32) {
        prefetch(&self.set.leaves, leaf);
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
