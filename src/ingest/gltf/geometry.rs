//! Mesh primitives, compiled to triangle meshes when the first node uses them.

use super::accessors::Accessor;
use super::attributes::Attributes;
use super::document::label;
use super::glass;
use super::materials::{Materials, uv_sets};
use super::posing::{Arrays, Hung, Pose, Posed, Poses};
use super::{Output, Source};
use crate::ingest::error::Fault;
use crate::math::color::Rgb;
use crate::scene::{Category, Keys, Mesh};
use glam::{Vec2, Vec3, Vec4};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{Index, Mesh as Row};
use std::collections::{BTreeMap, HashMap};
use std::rc::Rc;
use std::sync::Arc;

/// A texture set's number is its place in a list; honest files have two or three.
const MOST_UV_SETS: u32 = 16;

/// The meshes that were compiled, by their number in the file and how they are posed: one row a primitive, `None`
/// for one without triangles.
pub(super) struct Meshes {
    compiled: HashMap<(usize, Pose), Rc<[Option<Compiled>]>>,
    materials: Materials,
    /// Thin glass in the place of solid glass, by materials of the scene.
    thin: HashMap<u32, u32>,
}

/// A primitive in the scene.
#[derive(Clone, Copy)]
pub(super) struct Compiled {
    /// The scene's number of the mesh.
    pub mesh: u32,
    /// Where it hangs; else at its node.
    pub hung: Option<Hung>,
}

/// Vertices of a primitive that its triangles use.
pub(super) struct Vertices {
    /// Their numbers in the file, ascending; `None` is all of them.
    used: Option<Vec<u32>>,
    count: usize,
}

impl Meshes {
    /// Given the emission over time of materials of the file.
    pub(super) fn new(source: &Source, glows: BTreeMap<usize, Keys<Rgb>>) -> Meshes {
        let materials = Materials::new(source, glows);
        Meshes { compiled: HashMap::new(), materials, thin: HashMap::new() }
    }

    /// The emission over time of a primitive of a mesh that was compiled, if it is animated.
    pub(super) fn glow(&self, primitive: &Primitive) -> Option<&Keys<Rgb>> {
        self.materials.glow(primitive.material?)
    }

    /// The scene's meshes for a mesh of the file in a pose.
    pub(super) fn primitives(
        &mut self,
        source: &Source,
        output: &mut Output,
        number: Index<Row>,
        (poses, pose): (&Poses, &Pose),
    ) -> Result<Rc<[Option<Compiled>]>, Fault> {
        let key = (number.value(), pose.clone());
        if let Some(known) = self.compiled.get(&key) {
            return Ok(known.clone());
        }
        let row = &source.document.meshes[number.value()];
        let object = label("mesh", number.value(), row.name.as_deref());
        let first = output.scene.meshes.len();
        let mut compiled = Vec::with_capacity(row.primitives.len());
        for (i, primitive) in row.primitives.iter().enumerate() {
            let object = match row.primitives.len() {
                1 => object.clone(),
                _ => format!("{object}, primitive {i}"),
            };
            let mesh = self.compile(source, output, primitive, (poses, pose), &object)?;
            compiled.push(mesh.map(|(mesh, hung)| {
                let name = row.name.clone().unwrap_or(object);
                output.scene.meshes.push(Mesh { name, ..mesh });
                Compiled { mesh: output.scene.meshes.len() as u32 - 1, hung }
            }));
        }
        let all = first..output.scene.meshes.len();
        glass::thin_if_open(output, &mut self.thin, all, &object);
        let bytes = pose.byte_length() + (row.primitives.len() * size_of::<Compiled>()) as u64;
        output.budget.take(bytes, || object)?;
        let compiled: Rc<[Option<Compiled>]> = compiled.into();
        self.compiled.insert(key, compiled.clone());
        Ok(compiled)
    }

    /// The scene's number of the material that all primitives of a mesh share, if they do.
    pub(super) fn only_material(
        &mut self,
        source: &Source,
        output: &mut Output,
        number: Index<Row>,
    ) -> Option<u32> {
        let row = &source.document.meshes[number.value()];
        let object = label("mesh", number.value(), row.name.as_deref());
        let material = row.primitives.first()?.material?;
        let is_shared = row.primitives.iter().all(|p| p.material == Some(material));
        is_shared.then(|| self.materials.index(source, output, material, &object))?
    }

    /// What notes about a mesh are about: its light, if any of it may emit.
    pub(super) fn category(&self, source: &Source, number: Index<Row>) -> Category {
        let primitives = &source.document.meshes[number.value()].primitives;
        let may_emit =
            primitives.iter().any(|p| category(source, &self.materials, p) == Category::Lights);
        if may_emit { Category::Lights } else { Category::Geometry }
    }

    fn compile(
        &mut self,
        source: &Source,
        output: &mut Output,
        primitive: &Primitive,
        (poses, pose): (&Poses, &Pose),
        object: &str,
    ) -> Result<Option<(Mesh, Option<Hung>)>, Fault> {
        let category = category(source, &self.materials, primitive);
        let Checked::Valid(mode @ (Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)) =
            primitive.mode
        else {
            output.notes.add(category, object, "is not made of triangles; not drawn");
            return Ok(None);
        };
        let attributes = Attributes { source, primitive };
        let arrays = || -> Result<_, String> {
            let positions = attributes.get(Semantic::Positions)?.ok_or("has no positions")?;
            Ok((positions, attributes.indices()?))
        };
        let (positions, indices) = match arrays() {
            Ok(arrays) => arrays,
            Err(problem) => {
                output.notes.add(category, object, format!("{problem}; not drawn"));
                return Ok(None);
            }
        };
        let extensions = primitive.extensions.as_ref();
        if extensions.is_some_and(|e| e.others.contains_key("KHR_materials_variants")) {
            let text = "material variants are not read; drawn with the default";
            output.notes.add(Category::Materials, object, text);
        }
        let corners = indices.map_or(positions.count, |indices| indices.count);
        // Strips and fans have a triangle for every corner, lists for every third.
        let most = if mode == Mode::Triangles { corners / 3 } else { corners };
        output.budget.take(12 * most as u64, || object.to_string())?;
        if mode == Mode::Triangles && !corners.is_multiple_of(3) {
            output.notes.add(category, object, "its last triangle lacks corners; not drawn");
        }
        let corner = |i: usize| indices.map_or(i as u32, |indices| indices.index(i));
        let mut triangles = triangles(mode, corners, corner);
        let all = triangles.len();
        let is_good = |&corner: &u32| {
            let place: Option<[f32; 3]> = ((corner as usize) < positions.count)
                .then(|| positions.vector(corner as usize, 0.0));
            place.is_some_and(|place| Vec3::from_array(place).is_finite())
        };
        triangles.retain(|triangle| triangle.iter().all(is_good));
        if triangles.len() < all {
            let text = "has triangles whose corners are not there or not finite; they are left out";
            output.notes.add(category, object, text);
        }
        if triangles.is_empty() {
            output.notes.add(category, object, "has no triangles; not drawn");
            return Ok(None);
        }
        let vertices = Vertices::of(&mut triangles, positions.count);

        let material = primitive.material;
        let material = material.and_then(|m| self.materials.index(source, output, m, object));
        let look = material.map(|m| output.scene.materials[m as usize].clone()).unwrap_or_default();
        let wants_tangents = look.has_normal_map();
        let mut sets: Vec<u32> = uv_sets(&look).collect();
        sets.sort_unstable();
        sets.dedup();
        // Position, normal, tangent, colour and the texture sets: what a vertex takes at most.
        let vertex_bytes = 12 + 12 + 16 + 16 + 8 * sets.len() as u64;
        output.budget.take(vertex_bytes * vertices.count as u64, || object.to_string())?;

        // Of vertices that no triangle uses some may not be finite.
        let finite = |place: [f32; 3]| match Vec3::from_array(place) {
            place if place.is_finite() => place,
            _ => Vec3::ZERO,
        };
        let mut mesh = Mesh {
            positions: vertices.read(positions, 0.0, finite),
            triangles,
            material,
            ..Mesh::default()
        };
        if !attributes.bounds_hold(&mesh.positions) {
            let text =
                "its positions are outside the min and max that they declare, which are not used";
            output.notes.add(Category::Geometry, object, text);
        }
        let attribute = |semantic: Semantic, output: &mut Output| {
            let found = attributes.beside(semantic, positions.count);
            found.unwrap_or_else(|problem| {
                output.notes.add(Category::Geometry, object, format!("{problem}; left out"));
                None
            })
        };
        if let Some(accessor) = attribute(Semantic::Normals, output) {
            mesh.normals = vertices.read(accessor, 0.0, finite);
        }
        if wants_tangents && let Some(accessor) = attribute(Semantic::Tangents, output) {
            mesh.tangents = vertices.read(accessor, 1.0, Vec4::from_array);
        }
        let arrays =
            Arrays { attributes: &attributes, vertices: &vertices, positions: positions.count };
        let posed = poses.apply(source, output, (pose, &arrays), &mut mesh, object)?;
        let Posed { hung, mut deformation } = posed;
        mesh.make_unit();
        // A mesh with tangents of no length has none that mean anything.
        if mesh.tangents.iter().any(|tangent| tangent.truncate() == Vec3::ZERO) {
            let text = "has tangents without a direction; derived from its texture set";
            output.notes.add(Category::Geometry, object, text);
            mesh.tangents.clear();
            deformation.iter_mut().for_each(|how| how.rest.tangents.clear());
        }
        mesh.deformation = deformation.map(Arc::new);
        if let Some(accessor) = attribute(Semantic::Colors(0), output) {
            mesh.colors = vertices.read(accessor, 1.0, |color| {
                let color = Vec4::from(color).clamp(Vec4::ZERO, Vec4::ONE);
                if color.is_nan() { Vec4::ONE } else { color }
            });
        }
        for set in sets {
            let accessor = match set {
                0..MOST_UV_SETS => attribute(Semantic::TexCoords(set), output),
                _ => None,
            };
            let set = (set as usize).min(MOST_UV_SETS as usize - 1);
            mesh.uv_sets.resize_with(mesh.uv_sets.len().max(set + 1), Vec::new);
            mesh.uv_sets[set] = match accessor {
                Some(accessor) => vertices.read(accessor, 0.0, |uv| {
                    let uv = Vec2::from_array(uv);
                    if uv.is_finite() { uv } else { Vec2::ZERO }
                }),
                None => {
                    let text = format!(
                        "has no TEXCOORD_{set} for its textures; it has the colour of their corner (0, 0)"
                    );
                    output.notes.add(category, object, text);
                    vec![Vec2::ZERO; vertices.count]
                }
            };
        }
        Ok(Some((mesh, hung)))
    }
}

/// What notes about a primitive are about: its light, if it may emit.
fn category(source: &Source, materials: &Materials, primitive: &Primitive) -> Category {
    let may_emit =
        |number| source.document.get(number).is_none_or(|row| materials.may_emit(row, number));
    if primitive.material.is_some_and(may_emit) { Category::Lights } else { Category::Geometry }
}

/// Triangles of a list, strip or fan, wound the same way (glTF 2.0, 3.7.2.1).
fn triangles(mode: Mode, corners: usize, corner: impl Fn(usize) -> u32) -> Vec<[u32; 3]> {
    let count = if mode == Mode::Triangles { corners / 3 } else { corners.saturating_sub(2) };
    let triangle = |i: usize| match mode {
        Mode::Triangles => [3 * i, 3 * i + 1, 3 * i + 2],
        Mode::TriangleStrip => [i, i + 1 + i % 2, i + 2 - i % 2],
        _ => [i + 1, i + 2, 0],
    };
    (0..count).map(|i| triangle(i).map(&corner)).collect()
}

impl Vertices {
    /// Primitives often share one long list of vertices and use a few of it each; then these are
    /// renumbered to those in use.
    fn of(triangles: &mut [[u32; 3]], available: usize) -> Vertices {
        if available <= 3 * triangles.len() {
            return Vertices { used: None, count: available };
        }
        let mut used: Vec<u32> = triangles.as_flattened().to_vec();
        used.sort_unstable();
        used.dedup();
        for corner in triangles.as_flattened_mut() {
            // Every corner is in the list that was made of them.
            *corner = used.binary_search(corner).unwrap_or(0) as u32;
        }
        Vertices { count: used.len(), used: Some(used) }
    }

    /// An array of the primitive, of these vertices.
    pub(super) fn read<const N: usize, T>(
        &self,
        accessor: &Accessor,
        missing: f32,
        make: impl Fn([f32; N]) -> T,
    ) -> Vec<T> {
        let vertex = |i: usize| make(accessor.vector(i, missing));
        match &self.used {
            Some(used) => used.iter().map(|&i| vertex(i as usize)).collect(),
            None => (0..self.count).map(vertex).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_keep_their_winding() {
        let corner = |i: usize| i as u32;
        assert_eq!(triangles(Mode::Triangles, 7, corner), [[0, 1, 2], [3, 4, 5]]);
        assert_eq!(triangles(Mode::TriangleStrip, 5, corner), [[0, 1, 2], [1, 3, 2], [2, 3, 4]]);
        assert_eq!(triangles(Mode::TriangleFan, 5, corner), [[1, 2, 0], [2, 3, 0], [3, 4, 0]]);
        assert!(triangles(Mode::TriangleStrip, 1, corner).is_empty());
    }

    #[test]
    fn vertices_that_no_triangle_uses_are_dropped() {
        let mut triangles = [[7, 9, 8], [9, 7, 1]];
        let vertices = Vertices::of(&mut triangles, 1000);
        assert_eq!(vertices.used.unwrap(), [1, 7, 8, 9]);
        assert_eq!(triangles, [[1, 3, 2], [3, 1, 0]]);
        assert!(Vertices::of(&mut triangles, 6).used.is_none());
    }
}
