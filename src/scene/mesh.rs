//! Triangles, and where they stand.

use super::{Deformation, Keys, Shaping, Visibility};
use crate::math::color::Rgb;
use glam::{Vec2, Vec3, Vec4};
use std::sync::Arc;

/// Triangles with one material, in local space. All attribute arrays that are not empty have as
/// many entries as `positions`; every index is in range; every number is finite.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Its name in the file, for messages.
    pub name: String,
    /// Local-space positions, metres.
    pub positions: Vec<Vec3>,
    /// Unit normals, or empty: flat shading.
    pub normals: Vec<Vec3>,
    /// Unit tangents with the handedness in `w`, or empty: derived from the first texture set.
    pub tangents: Vec<Vec4>,
    /// Texture sets, by number; a set may be empty.
    pub uv_sets: Vec<Vec<Vec2>>,
    /// Linear vertex colours that multiply the base colour (alpha: the opacity), or empty.
    pub colors: Vec<Vec4>,
    /// Corners of each triangle, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Index into [`Scene::materials`](super::Scene::materials).
    pub material: Option<u32>,
    /// How it changes its shape over time, if it does. Positions, normals and tangents above are those of the shot's
    /// first frame; [`Pose::shape`](super::Pose::shape) knows all others.
    pub deformation: Option<Arc<Deformation>>,
}

/// A mesh put at a node: a prim that a ray can hit.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    /// The prim's path; unique in the scene.
    pub path: Arc<str>,
    /// The node it stands at.
    pub node: u32,
    /// Index into [`Scene::meshes`](super::Scene::meshes).
    pub mesh: u32,
    /// Where the mesh's light varies with time: nits that take the place of the material's, which
    /// the material's emission texture multiplies. Never below zero; linear or stepped, not a
    /// spline.
    pub values: Option<Box<Keys<Rgb>>>,
    /// Profile of the mesh's emission about the node's -Z, if it has one.
    pub shaping: Option<Shaping>,
    /// Take the mesh's light out of the importance heuristic and sample it at every point.
    pub forced: bool,
    /// Which rays meet it.
    pub visibility: Visibility,
}
