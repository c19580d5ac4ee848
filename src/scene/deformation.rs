//! Meshes that change their shape over time: morph targets and skins.
//!
//! Source: glTF 2.0, 3.7.2.2 (morph targets) and 3.7.3.3 (skins). A vertex is moved by the morph targets first, then
//! by the joints: by the mean, by its weights, of what each joint's transform makes of the inverse bind matrix.
//! Normals follow by the cofactors of the matrix, which are its inverse transpose but for a factor, and exist where a
//! joint has scale 0.
//!
//! A [`Pose`](super::Pose) says how far each mesh is bent at its time, which is little and quickly found. A
//! [shape](super::Pose::shape) is made when somebody first asks for it. Which triangles there are never changes, nor on
//! which side their fronts are.

use super::{Keys, Mesh, Node, Scene, Timeline};
use glam::{DAffine3, DMat3, DVec3, Vec3, Vec4};
use std::sync::{Arc, OnceLock};

/// Coordinates in the world stay below this many metres, so that squares of distances are finite.
pub const FARTHEST_M: f32 = 1e18;

/// How a mesh changes its shape over time.
#[derive(Clone, Debug)]
pub struct Deformation {
    /// The mesh before anything moves it, in the space of its skin.
    pub rest: Shape,
    /// What may be added to it.
    pub targets: Vec<Target>,
    /// How much of each target is added, for three targets each.
    pub weights: Arc<[Keys<Vec3>]>,
    /// What moves it then.
    pub skin: Option<Skin>,
}

/// What of a mesh changes with its shape. Normals and tangents may be empty, as in the mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shape {
    /// Positions, metres.
    pub positions: Vec<Vec3>,
    /// Unit normals; at rest of any length.
    pub normals: Vec<Vec3>,
    /// Unit tangents with the handedness in `w`; at rest of any length.
    pub tangents: Vec<Vec4>,
}

/// Displacements of all vertices. Arrays that are empty displace nothing.
#[derive(Clone, Debug, Default)]
pub struct Target {
    /// Metres.
    pub positions: Vec<Vec3>,
    /// Of the normals.
    pub normals: Vec<Vec3>,
    /// Of the tangents.
    pub tangents: Vec<Vec3>,
}

/// What moves each vertex.
#[derive(Clone, Debug)]
pub struct Skin {
    /// Where the joints are; meshes may share it.
    pub skeleton: Arc<Skeleton>,
    /// For each vertex the end of its influences.
    pub ends: Vec<u32>,
    /// Joints by number with weights, whose sum is one but for rounding, vertex by vertex.
    pub influences: Vec<(u32, f64)>,
}

/// Joints below the node that a mesh hangs at.
#[derive(Clone, Debug)]
pub struct Skeleton {
    /// The joints and what is above them, each after its parent, whose number in this list comes first; one without a
    /// parent stands in the mesh's space. What the nodes themselves say of parents and paths has no meaning.
    pub nodes: Vec<(Option<u32>, Arc<Node>)>,
    /// By number: the joint's node, and the inverse bind matrix. A joint that moves nothing has no node.
    pub joints: Vec<Option<(u32, DAffine3)>>,
}

/// How far a mesh is bent at one time.
#[derive(Clone, Debug, PartialEq)]
struct Bend {
    /// By morph target.
    weights: Vec<f32>,
    /// By joint: from the vertices at rest to the mesh's space.
    joints: Arc<[DAffine3]>,
}

impl Deformation {
    /// Whether the shape changes with time.
    pub fn varies(&self) -> bool {
        let moves =
            |skin: &Skin| skin.skeleton.nodes.iter().any(|(_, node)| !node.channels.is_empty());
        self.weights.iter().any(Keys::varies) || self.skin.as_ref().is_some_and(moves)
    }

    /// Whether it is proved that a triangle has no area at any time: two of its corners are never apart.
    pub fn is_always_flat(&self, [a, b, c]: [u32; 3]) -> bool {
        self.are_together(a, b) || self.are_together(b, c) || self.are_together(c, a)
    }

    /// Whether two vertices are one at rest, and moved alike.
    fn are_together(&self, a: u32, b: u32) -> bool {
        let (a, b) = (a as usize, b as usize);
        let are_alike = |places: &[Vec3]| places.get(a) == places.get(b);
        are_alike(&self.rest.positions)
            && self.targets.iter().all(|target| are_alike(&target.positions))
            && self.skin.as_ref().is_none_or(|skin| skin.influences(a) == skin.influences(b))
    }

    /// How far the mesh is bent at a time, seconds on the clock of a timeline, where its joints are known.
    fn bend(&self, time_s: f64, timeline: Timeline, joints: Arc<[DAffine3]>) -> Bend {
        let threes = self.weights.iter().map(|keys| keys.at(time_s, timeline).as_vec3());
        let mut weights: Vec<f32> = threes.flat_map(|three| three.to_array()).collect();
        weights.truncate(self.targets.len());
        Bend { weights, joints }
    }

    /// The shape of the bent mesh, whose triangles are given. A vertex that would be [too far](FARTHEST_M) stays
    /// where it was.
    fn shape(&self, bend: &Bend, triangles: &[[u32; 3]]) -> Shape {
        let mut shape = self.rest.clone();
        for (target, &weight) in self.targets.iter().zip(&bend.weights) {
            if weight != 0.0 {
                target.add_to(&mut shape, weight);
            }
        }
        for (place, rest) in shape.positions.iter_mut().zip(&self.rest.positions) {
            if !is_near(place.as_dvec3()) {
                *place = *rest;
            }
        }
        if let Some(skin) = &self.skin {
            skin.bend(&mut shape, &bend.joints);
        }
        shape.make_unit(triangles);
        shape
    }
}

impl Target {
    /// Adds a multiple of the displacements.
    pub fn add_to(&self, shape: &mut Shape, weight: f32) {
        let moves = shape.positions.iter_mut().zip(&self.positions);
        moves.for_each(|(place, &by)| *place += weight * by);
        let turns = shape.normals.iter_mut().zip(&self.normals);
        turns.for_each(|(normal, &by)| *normal += weight * by);
        let turns = shape.tangents.iter_mut().zip(&self.tangents);
        turns.for_each(|(tangent, &by)| *tangent += (weight * by).extend(0.0));
    }
}

impl Skeleton {
    /// By joint: from the vertices at rest to the mesh's space at a time.
    pub fn at(&self, time_s: f64, timeline: Timeline) -> Vec<DAffine3> {
        let mut places: Vec<DAffine3> = Vec::with_capacity(self.nodes.len());
        for (parent, node) in &self.nodes {
            let above = parent.map_or(DAffine3::IDENTITY, |parent| places[parent as usize]);
            places.push(above * node.to_parent(time_s, timeline));
        }
        let joint = |joint: &Option<(u32, DAffine3)>| {
            joint.map_or(DAffine3::ZERO, |(node, inverse)| places[node as usize] * inverse)
        };
        self.joints.iter().map(joint).collect()
    }
}

impl Skin {
    /// Moves all vertices by the joints, but for those that would be too far. Whether none was.
    pub fn bend(&self, shape: &mut Shape, joints: &[DAffine3]) -> bool {
        let mut all_are_near = true;
        for vertex in 0..self.ends.len() {
            let Some(matrix) = self.matrix(vertex, joints) else { continue };
            let place = matrix.transform_point3(shape.positions[vertex].as_dvec3());
            if is_near(place) {
                shape.positions[vertex] = place.as_vec3();
                shape.turn(vertex, matrix.matrix3);
            } else {
                all_are_near = false;
            }
        }
        all_are_near
    }

    /// The joints that move a vertex, with their weights.
    fn influences(&self, vertex: usize) -> &[(u32, f64)] {
        let start = vertex.checked_sub(1).map_or(0, |before| self.ends[before]) as usize;
        &self.influences[start..self.ends[vertex] as usize]
    }

    /// What moves a vertex: the mean of the matrices of its joints. `None` if nothing does.
    pub fn matrix(&self, vertex: usize, joints: &[DAffine3]) -> Option<DAffine3> {
        let influences = self.influences(vertex);
        let mut mean = DAffine3::ZERO;
        for &(joint, weight) in influences {
            mean.matrix3 += joints[joint as usize].matrix3 * weight;
            mean.translation += joints[joint as usize].translation * weight;
        }
        (!influences.is_empty()).then_some(mean)
    }
}

/// Whether a place can be calculated with.
pub fn is_near(place: DVec3) -> bool {
    place.is_finite() && place.abs().max_element() < f64::from(FARTHEST_M)
}

impl Shape {
    /// Takes the shape out of a mesh.
    pub fn take(mesh: &mut Mesh) -> Shape {
        Shape {
            positions: std::mem::take(&mut mesh.positions),
            normals: std::mem::take(&mut mesh.normals),
            tangents: std::mem::take(&mut mesh.tangents),
        }
    }

    /// Puts it into a mesh.
    pub fn put(self, mesh: &mut Mesh) {
        (mesh.positions, mesh.normals, mesh.tangents) =
            (self.positions, self.normals, self.tangents);
    }

    /// Turns the normal and the tangent of a vertex.
    fn turn(&mut self, vertex: usize, matrix: DMat3) {
        let [x, y, z] = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
        let sign = if matrix.determinant() < 0.0 { -1.0 } else { 1.0 };
        if let Some(normal) = self.normals.get_mut(vertex) {
            let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
            let turned = cofactors * normal.as_dvec3() * sign;
            // Scaled, for 32 bits may not hold the cofactors of a small matrix.
            *normal = (turned / turned.abs().max_element()).as_vec3();
        }
        if let Some(tangent) = self.tangents.get_mut(vertex) {
            let turned = matrix * tangent.truncate().as_dvec3();
            *tangent = turned.as_vec3().extend(tangent.w * sign as f32);
        }
    }

    /// Makes normals and tangents unit vectors. A normal without a direction is replaced by the mean of the triangles
    /// around it; a tangent without one is left at zero.
    pub fn make_unit(&mut self, triangles: &[[u32; 3]]) {
        for tangent in &mut self.tangents {
            let handedness = if tangent.w < 0.0 { -1.0 } else { 1.0 };
            *tangent = tangent.truncate().normalize_or_zero().extend(handedness);
        }
        let mut lost = false;
        for normal in &mut self.normals {
            // Scaled first, so that squares neither overflow nor vanish.
            let scaled = *normal / normal.abs().max_element();
            *normal = scaled.normalize_or_zero();
            lost |= *normal == Vec3::ZERO;
        }
        if !lost {
            return;
        }
        let mut sums = vec![Vec3::ZERO; self.positions.len()];
        for triangle in triangles {
            let [a, b, c] = triangle.map(|corner| self.positions[corner as usize]);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            triangle.iter().for_each(|&corner| sums[corner as usize] += normal);
        }
        for (normal, sum) in self.normals.iter_mut().zip(sums) {
            if *normal == Vec3::ZERO {
                *normal = sum.try_normalize().unwrap_or(Vec3::Y);
            }
        }
    }
}

/// The shapes of all meshes that deform, at one time.
#[derive(Clone, Debug, Default)]
pub(super) struct Shapes {
    /// How far each is bent; empty if none deforms.
    bends: Vec<Bend>,
    /// By mesh: which of these is its own.
    rows: Arc<[Option<u32>]>,
    /// Made when somebody first asks for them; copies share them.
    made: Arc<[OnceLock<Shape>]>,
}

impl Shapes {
    /// At a time, seconds on the scene's clock.
    pub fn at(scene: &Scene, time_s: f64) -> Shapes {
        let is_bent = |mesh: &Mesh| mesh.deformation.is_some();
        if !scene.meshes.iter().any(is_bent) {
            return Shapes::default();
        }
        let mut numbers = 0..;
        let rows = scene.meshes.iter().map(|mesh| is_bent(mesh).then(|| numbers.next()).flatten());
        let rows: Arc<[Option<u32>]> = rows.collect();
        let bends = bends(scene, time_s);
        let made = bends.iter().map(|_| OnceLock::new()).collect();
        Shapes { bends, rows, made }
    }

    /// Moves them to another time.
    pub fn set_time(&mut self, scene: &Scene, time_s: f64) {
        if !self.bends.is_empty() {
            self.bends = bends(scene, time_s);
            self.made = self.bends.iter().map(|_| OnceLock::new()).collect();
        }
    }

    /// Whether all are bent alike.
    pub fn are_alike(&self, other: &Shapes) -> bool {
        self.bends == other.bends
    }

    /// The shape of a mesh, if it deforms.
    #[inline]
    pub fn of(&self, scene: &Scene, mesh: u32) -> Option<&Shape> {
        if self.bends.is_empty() {
            return None;
        }
        let row = self.rows[mesh as usize]? as usize;
        let mesh = &scene.meshes[mesh as usize];
        let deformation = mesh.deformation.as_ref()?;
        // Not in parallel: a thread of a pool that waits in here could take up work that asks for the same shape.
        Some(self.made[row].get_or_init(|| deformation.shape(&self.bends[row], &mesh.triangles)))
    }
}

/// How far the meshes of a scene that deform are bent at a time, in the order of the meshes. Joints are found once for
/// all meshes that share them.
fn bends(scene: &Scene, time_s: f64) -> Vec<Bend> {
    let mut found: Vec<(*const Skeleton, Arc<[DAffine3]>)> = Vec::new();
    let mut joints = |skin: &Skin| {
        let skeleton = Arc::as_ptr(&skin.skeleton);
        let known = found.iter().rev().find(|(other, _)| std::ptr::eq(*other, skeleton));
        known.map(|(_, joints)| joints.clone()).unwrap_or_else(|| {
            let joints: Arc<[DAffine3]> = skin.skeleton.at(time_s, scene.timeline).into();
            found.push((skeleton, joints.clone()));
            joints
        })
    };
    let deformations = scene.meshes.iter().filter_map(|mesh| mesh.deformation.as_ref());
    let bend = |deformation: &Arc<Deformation>| {
        let joints = deformation.skin.as_ref().map_or_else(|| Arc::from([]), &mut joints);
        deformation.bend(time_s, scene.timeline, joints)
    };
    deformations.map(bend).collect()
}

impl Mesh {
    /// Makes normals and tangents [unit vectors](Shape::make_unit).
    pub fn make_unit(&mut self) {
        let mut shape = Shape::take(self);
        shape.make_unit(&self.triangles);
        shape.put(self);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_and_tangents_become_unit_vectors() {
        let mut shape = Shape {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
            normals: vec![Vec3::ZERO, Vec3::splat(1e30), Vec3::splat(-1e-40), Vec3::ZERO],
            tangents: [1.0, -3.0, 0.0, f32::NAN].map(|x| Vec4::new(2.0 * x, 0.0, 0.0, x)).into(),
        };
        shape.make_unit(&[[0, 1, 2]]);
        assert_eq!(shape.normals[0], Vec3::Z, "the triangle's");
        assert_eq!(shape.normals[3], Vec3::Y, "no triangle's");
        assert!(shape.normals.iter().all(|normal| normal.is_normalized()));
        let [x, zero] = [Vec4::new(1.0, 0.0, 0.0, 1.0), Vec4::new(0.0, 0.0, 0.0, 1.0)];
        assert_eq!(shape.tangents, [x, Vec4::new(-1.0, 0.0, 0.0, -1.0), zero, zero]);
    }

    #[test]
    fn what_would_go_too_far_stays() {
        let rest = Shape { positions: vec![Vec3::X, Vec3::Y], ..Shape::default() };
        let positions = vec![Vec3::splat(1e19), Vec3::Z];
        let targets = vec![Target { positions, ..Target::default() }];
        let weights = |value| {
            [Keys {
                times_s: vec![0.0],
                values: vec![Vec3::splat(value)],
                interpolation: Default::default(),
            }]
        };
        let shape = |value| {
            let (rest, targets) = (rest.clone(), targets.clone());
            let weights = weights(value).into();
            let bent = Deformation { rest, targets, weights, skin: None };
            let bend = bent.bend(0.0, Timeline::default(), Arc::from([]));
            bent.shape(&bend, &[]).positions
        };
        assert_eq!(shape(1.0), [Vec3::X, Vec3::Y + Vec3::Z]);
        assert_eq!(shape(f32::INFINITY), [Vec3::X, Vec3::Y]);
        // A multiple of little may be near.
        assert!(shape(1e-3)[0].x > 1e15);
    }
}
