//! The ray kernel: what a ray hits, and whether anything stands between two points.
//!
//! Two levels. [`RayScene`] is prepared once for a shot: one world-space set of triangles for all
//! that stands still, one local-space set for each mesh that moves or is shared by so many
//! instances that copies would cost memory, and a small tree over the placed meshes and the sphere lights
//! that stand still. [`Tracer`] is one time of it: another such tree over those that move, built for a [`Pose`], with
//! a set for each mesh that deforms.
//!
//! What callers may rely on:
//!
//! - Every hit lies at a distance in the open interval `(0, tmax)`, is found
//!   watertight (Woop 2013) and is measured in double precision. There is no scene epsilon.
//!   Coordinates from 1e-9 to 1e9 metres are tested; beyond 1e12 they are filtered.
//! - A ray that starts at [`Anchor::origin_toward`] does not meet the surface it left.
//! - Triangles are two-sided; the normal is the front's, which counts the corners
//!   counter-clockwise, and clockwise under a mirroring transform (glTF 2.0, 3.7.4).
//! - Sphere lights are surfaces that a ray hits from outside and from inside.
//! - Which prims a ray meets depends on who [sent](Sender) it, by their
//!   [`Visibility`](crate::scene::Visibility).
//! - Glass that light passes straight, a *pane*, ends no ray. Rays between two points are tinted by it.
//! - Surfaces in one place are told apart by rules that know nothing of the order of the prims;
//!   see [`Tracer::look`] and the page of `sight`.
//! - Preparing takes `O(n log n)` time for every input.
//!
//! Not here: shading (`surface`), and what happens at a cut-out, which the caller decides through
//! the `accept` function; it is asked only about meshes whose material has a coverage.

mod anchor;
mod binary_bvh;
mod blas;
mod cover;
mod lanes;
mod meeting;
mod placing;
mod prim;
mod shining;
mod sight;
mod sphere;
#[cfg(test)]
mod tests;
mod tracer;
mod triangles;
mod wide_bvh;

pub use anchor::Anchor;
pub use meeting::{Hit, HitSurface};
pub use prim::Sender;
pub use sight::{Passed, Seen, SeenLight, SeenPane};
pub use tracer::{Caster, Tracer, Transmitted};

use crate::scene::{Instance, LightKind, Mesh, Pose, Scene};
use blas::{Blas, TriangleId};
use glam::{DAffine3, DMat3, Vec3};
use placing::{Placing, Rows};
use rayon::prelude::*;
use shining::Shining;
use std::collections::HashMap;

/// A mesh whose copies would add more triangles than this keeps one set for all its instances...
const COPIED_TRIANGLES: usize = 1 << 16;
/// ...unless it has no more triangles than this, when a copy is cheaper than a reference.
const TINY_MESH: usize = 32;

/// The geometry of a shot. See the [module page](self).
#[derive(Debug)]
pub struct RayScene {
    /// Everything that stands still and is not shared, in world space.
    fixed: Blas,
    /// What of that may shine.
    shining: Shining,
    /// Sets in local space.
    shared: Vec<Blas>,
    /// What of the instances of shared sets and of the sphere lights stands still.
    standing: Placing,
    /// And what of them moves.
    moving: Rows,
    /// By instance: its place in the order of paths.
    ranks: Vec<u32>,
}

impl RayScene {
    /// Prepares what does not change in a shot. `pose` may be that of any of its frames.
    pub fn new(scene: &Scene, pose: &Pose) -> RayScene {
        let is_kept = kept_in_own_space(scene);
        let moves = scene.moving_nodes();
        let (mut standing, mut moving) = (Rows::default(), Rows::default());
        let (mut sets, mut flat) = (HashMap::new(), Vec::new());
        let mut meshes = Vec::new();
        for (number, instance) in scene.instances.iter().enumerate() {
            let number = number as u32;
            if is_kept[number as usize] {
                let set = *sets.entry(instance.mesh).or_insert_with(|| {
                    meshes.push(instance.mesh);
                    meshes.len() as u32 - 1
                });
                let rows = if moves[instance.node as usize] { &mut moving } else { &mut standing };
                rows.instances.push((number, set));
            } else if scene.deforms(number) {
                moving.deforming.entry(instance.mesh).or_default().push(number);
            } else {
                flat.push(number);
            }
        }
        for (row, light) in (0..).zip(&scene.lights) {
            if matches!(light.kind, LightKind::Sphere { .. }) {
                let rows = if moves[light.node as usize] { &mut moving } else { &mut standing };
                rows.spheres.push(row);
            }
        }
        let parts: Vec<_> = flat.par_iter().map(|&i| in_world(scene, pose, i)).collect();
        let shining = flat.iter().zip(&parts).filter(|(row, _)| may_shine(scene, **row));
        let shining = shining.map(|(_, (triangles, _))| triangles.as_slice()).collect::<Vec<_>>();
        let shining = Shining::around_meshes(&shining);
        let triangles = parts.iter().flat_map(|part| &part.0).copied().collect::<Vec<_>>();
        let ids = parts.iter().flat_map(|part| &part.1).copied().collect::<Vec<_>>();
        drop(parts);
        let own = |&mesh: &u32| in_own_space(scene, pose, mesh);
        let shared: Vec<Blas> = meshes.par_iter().map(own).collect();
        RayScene {
            fixed: Blas::build(&triangles, &ids),
            shining,
            standing: Placing::new(scene, pose, &shared, &standing),
            shared,
            moving,
            ranks: ranks(&scene.instances),
        }
    }

    /// One frame: only what moves is placed anew. `scene` must be the one this was made of.
    pub fn for_pose(&self, scene: &Scene, pose: &Pose) -> Tracer<'_> {
        Tracer::new(self, scene, pose, None)
    }

    /// Several poses, in their order; there is one at least.
    pub fn for_poses(&self, scene: &Scene, poses: &[Pose]) -> Vec<Tracer<'_>> {
        let first = self.for_pose(scene, &poses[0]);
        let others = poses[1..].par_iter();
        let others = others.map(|pose| Tracer::new(self, scene, pose, Some(&first)));
        let others: Vec<Tracer> = others.collect();
        std::iter::once(first).chain(others).collect()
    }
}

/// For each instance, whether rays search its mesh in the mesh's own space: because it moves, or because
/// copies of it would take much memory.
pub fn kept_in_own_space(scene: &Scene) -> Vec<bool> {
    let moving = scene.moving_nodes();
    let mut uses = vec![0_usize; scene.meshes.len()];
    for instance in &scene.instances {
        uses[instance.mesh as usize] += 1;
    }
    let is_kept = |(row, instance): (u32, &Instance)| {
        let size = scene.meshes[instance.mesh as usize].triangles.len();
        let copied = (uses[instance.mesh as usize] - 1) * size;
        // What deforms has no shape of its own that could be searched at all times.
        !scene.deforms(row)
            && (moving[instance.node as usize] || (size > TINY_MESH && copied > COPIED_TRIANGLES))
    };
    (0..).zip(&scene.instances).map(is_kept).collect()
}

/// Whether an instance shines at any time.
fn may_shine(scene: &Scene, instance: u32) -> bool {
    scene.peak_rgb_of_instance(instance).max_element() > 0.0
}

/// The place of each instance in the order of paths.
fn ranks(instances: &[Instance]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..instances.len() as u32).collect();
    order.par_sort_by_key(|&row| &*instances[row as usize].path);
    let mut ranks = vec![0; instances.len()];
    for (rank, row) in (0..).zip(order) {
        ranks[row as usize] = rank;
    }
    ranks
}

/// The triangles of a mesh with some positions, transformed in double precision and rounded once.
fn in_space(
    mesh: &Mesh,
    positions: &[Vec3],
    instance: u32,
    transform: DAffine3,
) -> (Vec<[Vec3; 3]>, Vec<TriangleId>) {
    let transformed = |&p: &Vec3| transform.transform_point3(p.as_dvec3()).as_vec3();
    let points: Vec<Vec3> = positions.iter().map(transformed).collect();
    let corners = |triangle: &[u32; 3]| triangle.map(|corner| points[corner as usize]);
    let triangles = mesh.triangles.iter().map(corners).collect();
    let ids = (0..mesh.triangles.len() as u32).map(|triangle| TriangleId { instance, triangle });
    (triangles, ids.collect())
}

/// The set of a mesh in its own space.
fn in_own_space(scene: &Scene, pose: &Pose, mesh: u32) -> Blas {
    let positions = pose.positions(scene, mesh);
    let mesh = &scene.meshes[mesh as usize];
    let (triangles, ids) = in_space(mesh, positions, 0, DAffine3::IDENTITY);
    Blas::build(&triangles, &ids)
}

/// The triangles of an instance in world space.
fn in_world(scene: &Scene, pose: &Pose, instance: u32) -> (Vec<[Vec3; 3]>, Vec<TriangleId>) {
    let placed = &scene.instances[instance as usize];
    let mesh = &scene.meshes[placed.mesh as usize];
    in_space(mesh, pose.positions(scene, placed.mesh), instance, world_of(pose, placed.node))
}

/// Local to world of a node.
fn world_of(pose: &Pose, node: u32) -> DAffine3 {
    let world = pose.world(node);
    let columns = [world.matrix3.x_axis, world.matrix3.y_axis, world.matrix3.z_axis]
        .map(|column| Vec3::from(column).as_dvec3());
    let matrix3 = DMat3::from_cols(columns[0], columns[1], columns[2]);
    DAffine3 { matrix3, translation: Vec3::from(world.translation).as_dvec3() }
}
