//! Mesh primitives, compiled to triangle meshes when the first node uses them.

use super::accessors::Accessor;
use super::document::{label, morph_targets};
use super::materials::{Materials, uv_sets};
use super::{Output, Source};
use crate::ingest::error::Fault;
use crate::ingest::normals;
use crate::scene::Mesh;
use glam::{Vec2, Vec3, Vec4};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{Index, Mesh as Row};
use std::rc::Rc;

/// A texture set's number is its place in a list; honest files have two or three.
const MOST_UV_SETS: u32 = 16;

/// The meshes that were compiled, by their number in the file: one row a primitive, `None` for one
/// without triangles.
pub(super) struct Meshes {
    compiled: Vec<Option<Rc<[Option<u32>]>>>,
    materials: Materials,
}

/// Vertices of a primitive that its triangles use.
struct Vertices {
    /// Their numbers in the file, ascending; `None` is all of them.
    used: Option<Vec<u32>>,
    count: usize,
}

impl Meshes {
    pub(super) fn new(source: &Source) -> Meshes {
        let compiled = vec![None; source.document.meshes.len()];
        Meshes { compiled, materials: Materials::new(source) }
    }

    /// The scene's meshes for a mesh of the file.
    pub(super) fn primitives(
        &mut self,
        source: &Source,
        output: &mut Output,
        number: Index<Row>,
    ) -> Result<Rc<[Option<u32>]>, Fault> {
        if let Some(known) = &self.compiled[number.value()] {
            return Ok(known.clone());
        }
        let row = &source.document.meshes[number.value()];
        let object = label("mesh", number.value(), row.name.as_deref());
        let mut compiled = Vec::with_capacity(row.primitives.len());
        for (i, primitive) in row.primitives.iter().enumerate() {
            let object = match row.primitives.len() {
                1 => object.clone(),
                _ => format!("{object}, primitive {i}"),
            };
            let mesh = self.compile(source, output, primitive, &object)?;
            compiled.push(mesh.map(|mesh| {
                let name = row.name.clone().unwrap_or(object);
                output.scene.meshes.push(Mesh { name, ..mesh });
                output.scene.meshes.len() as u32 - 1
            }));
        }
        let compiled: Rc<[Option<u32>]> = compiled.into();
        self.compiled[number.value()] = Some(compiled.clone());
        Ok(compiled)
    }

    /// The scene's number of the material that all primitives of a mesh share, if they do.
    pub(super) fn only_material(
        &mut self,
        source: &Source,
        output: &mut Output,
        number: Index<Row>,
    ) -> Result<Option<u32>, Fault> {
        let primitives = &source.document.meshes[number.value()].primitives;
        match primitives[0].material {
            Some(material) if primitives.iter().all(|p| p.material == Some(material)) => {
                self.materials.index(source, output, material).map(Some)
            }
            _ => Ok(None),
        }
    }

    fn compile(
        &mut self,
        source: &Source,
        output: &mut Output,
        primitive: &Primitive,
        object: &str,
    ) -> Result<Option<Mesh>, Fault> {
        let attribute = |semantic: Semantic| {
            let index = primitive.attributes.get(&Checked::Valid(semantic))?;
            Some(&source.accessors[index.value()])
        };
        let Some(positions) = attribute(Semantic::Positions) else {
            output.notes.add(object, "has no positions; not drawn");
            return Ok(None);
        };
        let Checked::Valid(mode @ (Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)) =
            primitive.mode
        else {
            output.notes.add(object, "is made of points or lines; not drawn");
            return Ok(None);
        };
        if morph_targets(primitive) > 0 {
            output.notes.add(object, "morph targets are not read; drawn in its rest shape");
        }
        if attribute(Semantic::Joints(0)).is_some() {
            output.notes.add(object, "skins are not read; drawn in its rest pose");
        }
        let extensions = primitive.extensions.as_ref();
        if extensions.is_some_and(|e| e.others.contains_key("KHR_materials_variants")) {
            output.notes.add(object, "material variants are not read; drawn with the default");
        }
        let indices = primitive.indices.map(|index| &source.accessors[index.value()]);
        let corners = indices.map_or(positions.count, |indices| indices.count);
        let triangle_bytes = 12 * corners as u64;
        output.budget.take(triangle_bytes, || object.to_string())?;
        if mode == Mode::Triangles && !corners.is_multiple_of(3) {
            output.notes.add(object, "its last triangle lacks corners; not drawn");
        }
        let corner = |i: usize| indices.map_or(i as u32, |indices| indices.index(i));
        let mut triangles = triangles(mode, corners, corner);
        if triangles.is_empty() {
            output.notes.add(object, "has no triangles; not drawn");
            return Ok(None);
        }
        let vertices = Vertices::of(&mut triangles, positions.count);

        let material = primitive.material;
        let material = material.map(|m| self.materials.index(source, output, m)).transpose()?;
        let look = material.map(|m| output.scene.materials[m as usize].clone()).unwrap_or_default();
        let wants_tangents = look.normal_texture.is_some();
        let mut sets: Vec<u32> = uv_sets(&look).collect();
        sets.sort_unstable();
        sets.dedup();
        // Position, normal, tangent, colour and the texture sets: what a vertex takes at most.
        let vertex_bytes = 12 + 12 + 16 + 16 + 8 * sets.len() as u64;
        output.budget.take(vertex_bytes * vertices.count as u64, || object.to_string())?;

        let mut mesh = Mesh {
            positions: vertices.read(positions, 0.0, Vec3::from_array),
            triangles,
            material,
            ..Mesh::default()
        };
        if let Some(accessor) = attribute(Semantic::Normals) {
            mesh.normals = vertices.read(accessor, 0.0, Vec3::from_array);
            normals::make_unit(&mut mesh);
        }
        if let Some(accessor) = attribute(Semantic::Tangents).filter(|_| wants_tangents) {
            mesh.tangents = vertices.read(accessor, 1.0, unit_tangent);
            // A mesh with tangents of no length has none that mean anything.
            if mesh.tangents.iter().any(|tangent| !tangent.is_finite()) {
                output
                    .notes
                    .add(object, "has tangents without a direction; derived from its texture set");
                mesh.tangents.clear();
            }
        }
        if let Some(accessor) = attribute(Semantic::Colors(0)) {
            mesh.colors =
                vertices.read(accessor, 1.0, |c| Vec4::from(c).clamp(Vec4::ZERO, Vec4::ONE));
        }
        for set in sets {
            match attribute(Semantic::TexCoords(set)).filter(|_| set < MOST_UV_SETS) {
                Some(accessor) => {
                    mesh.uv_sets.resize_with(mesh.uv_sets.len().max(set as usize + 1), Vec::new);
                    mesh.uv_sets[set as usize] = vertices.read(accessor, 0.0, Vec2::from_array);
                }
                None => output.notes.add(object, format!("has no TEXCOORD_{set} for its textures")),
            }
        }
        Ok(Some(mesh))
    }
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

    fn read<const N: usize, T>(
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

/// Not finite if it has no length.
fn unit_tangent(tangent: [f32; 4]) -> Vec4 {
    let tangent = Vec4::from(tangent);
    let handedness = if tangent.w < 0.0 { -1.0 } else { 1.0 };
    tangent.truncate().try_normalize().unwrap_or(Vec3::NAN).extend(handedness)
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
