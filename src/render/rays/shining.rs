//! Whether a ray may meet light at all.
//!
//! The last reflected ray of a path is there to find a light and nothing else, and most find none. A look at boxes
//! around all that ever shines tells that of most of them, at a fraction of the cost of finding out what they do hit.
//! Boxes know nothing of what hides them, so a ray that may meet light is to be traced.

use super::blas::can_be_hit;
use super::wide_bvh::{BoxRay, LEAF_SIZE, WideBvh};
use crate::bounds::Aabb;
use glam::Vec3;

/// With more triangles than this, a box stands for a run of them: more would cost memory and save little.
const MANY: usize = 1 << 16;

/// Boxes around what shines at any time.
#[derive(Debug, Default)]
pub struct Shining {
    tree: WideBvh,
}

impl Shining {
    /// Around some boxes, which are finite.
    pub fn around(boxes: &[Aabb]) -> Shining {
        Shining { tree: WideBvh::build(boxes, LEAF_SIZE as u32).0 }
    }

    /// Around the triangles of some meshes: one box for each, or for a run of them if there are very many.
    pub fn around_meshes(meshes: &[&[[Vec3; 3]]]) -> Shining {
        let all: usize = meshes.iter().map(|mesh| mesh.len()).sum();
        let run = all.div_ceil(MANY).max(1);
        let around = |triangles: &[[Vec3; 3]]| {
            let met = triangles.iter().filter(|triangle| can_be_hit(triangle));
            met.map(|triangle| Aabb::around(*triangle)).reduce(|a, b| a.union(&b))
        };
        let runs = meshes.iter().flat_map(|mesh| mesh.chunks(run));
        Shining::around(&runs.filter_map(around).collect::<Vec<_>>())
    }

    /// Whether a ray may meet any of it; if not, it surely meets none.
    pub fn may_be_met(&self, ray: &BoxRay) -> bool {
        let mut is_met = false;
        self.tree.walk::<false>(ray, f32::INFINITY, |_| {
            is_met = true;
            -1.0
        });
        is_met
    }
}
