//! Wavefront OBJ with its MTL: every object, and every change of material, is one mesh at a node of its own.
//!
//! OBJ says nothing of units, of up or of the side that an emissive surface shines from: metres, +Y and the
//! front are taken. References in OBJ files are often stale: absent libraries, materials and textures are
//! noted and not refused, and so is a line that cannot be read.
//!
//! | file | what |
//! |---|---|
//! | `text` | bytes to text, text to statements |
//! | `model` | vertices, and faces in groups |
//! | `polygon` | faces to triangles |
//! | `library` | material libraries: parameters as text |
//! | `map` | texture maps and their options |
//! | `materials` | parameters to materials and textures |

mod library;
mod map;
mod materials;
mod model;
mod polygon;
mod text;

use super::budget::Budget;
use super::error::Fault;
use super::notes::Notes;
use super::paths::{PrimPaths, component};
use super::uri::Folder;
use crate::scene::{Category, Instance, Material, Mesh, Node, Scene, Trs, Visibility};
use glam::{Vec2, Vec3};
use library::Library;
use materials::Materials;
use model::{Corner, Group, Model, NONE};
use polygon::{Cut, Cutter};
use std::collections::HashMap;
use std::path::Path;

/// What exporters write for faces without a material.
const NO_MATERIAL: [&str; 3] = ["None", "(null)", "default"];

/// Where a corner without texture coordinates looks its textures up: OBJ's (0, 0).
const NO_UV: Vec2 = Vec2::new(0.0, 1.0);

/// Reads a file.
pub(super) fn load(path: &Path) -> Result<Scene, Fault> {
    let (bytes, read) = super::read_file(path)?;
    let folder = Folder::of(path)?;
    let mut budget = Budget::for_geometry();
    budget.grow(bytes.len() as u64);
    let text = text::decode(&bytes).map_err(|problem| {
        Fault::new("file", problem).remedy("save it as UTF-8 text, or fetch or export it again")
    })?;
    let mut notes = Notes::default();
    let model = Model::parse(&text, &mut notes);
    let library = Library::read(&folder, &model.libraries, &mut notes);

    let mut scene = Scene::default();
    let mut paths = PrimPaths::default();
    let mut materials =
        Materials { folder: &folder, budget: Budget::for_pictures(), textures: HashMap::new() };
    let mut compiled: Vec<Option<u32>> = vec![None; library.rows.len()];
    let mut cutter = Cutter::new();
    for (i, group) in model.groups.iter().enumerate() {
        let object = format!("object {i} {:?}", group.name);
        let path = paths.claim(&format!("/{}", component(&group.name, || format!("object_{i}"))));
        let rows = size_of::<Mesh>() + size_of::<Node>() + size_of::<Instance>() + 4 * path.len();
        budget.take(rows as u64, || object.clone())?;
        let Some(mut mesh) = compile(&model, group, &mut cutter, &object, &mut notes) else {
            continue;
        };
        let name = group.material.as_deref();
        match name.and_then(|name| library.find(name)) {
            Some(row) => {
                let number = *compiled[row].get_or_insert_with(|| {
                    let material = materials.compile(&library.rows[row], &mut scene, &mut notes);
                    scene.materials.push(material);
                    scene.materials.len() as u32 - 1
                });
                mesh.material = Some(number);
                look_up(&mut mesh, &scene.materials[number as usize], &object, &mut notes);
            }
            None => {
                mesh.uv_sets.clear();
                if let Some(name) = name.filter(|name| !NO_MATERIAL.contains(name)) {
                    // Whether it would emit is not known.
                    let text = "is in no material library; its surfaces have the default material, \
                                and do not emit";
                    notes.add(Category::Lights, format!("material {name:?}"), text);
                }
            }
        }
        let node = scene.nodes.len() as u32;
        scene.nodes.push(Node::fixed(path.clone(), None, Trs::default()));
        let mesh_index = scene.meshes.len() as u32;
        scene.meshes.push(mesh);
        let instance = Instance {
            path,
            node,
            mesh: mesh_index,
            values: None,
            shaping: None,
            forced: false,
            visibility: Visibility::ALL,
        };
        scene.instances.push(instance);
    }
    if scene.meshes.is_empty() {
        return Err(Fault::new("file", "holds no faces").remedy("export the faces of the model"));
    }
    scene.notes = notes.into_list();
    scene.files = folder.into_files(read);
    Ok(scene)
}

/// A group as a mesh of vertices that have all their attributes; `None` if nothing of it is left.
fn compile(
    model: &Model,
    group: &Group,
    cutter: &mut Cutter,
    object: &str,
    notes: &mut Notes,
) -> Option<Mesh> {
    let mut numbers: HashMap<Corner, u32> = HashMap::new();
    let mut vertices: Vec<Corner> = Vec::new();
    let mut triangles = Vec::new();
    let (mut from, mut places) = (0, Vec::new());
    for &size in &group.sizes {
        let face = &group.corners[from..from + size as usize];
        from += size as usize;
        places.clear();
        places.extend(face.iter().map(|corner| model.positions[corner.position as usize]));
        if places.iter().any(|place: &Vec3| !place.is_finite()) {
            let text = "has vertices that are not finite; their faces are left out";
            notes.add(Category::Geometry, object, text);
            continue;
        }
        let mut vertex = |corner: u32| {
            let corner = face[corner as usize];
            *numbers.entry(corner).or_insert_with(|| {
                vertices.push(corner);
                vertices.len() as u32 - 1
            })
        };
        let cut = cutter.cut(&places, |triangle| triangles.push(triangle.map(&mut vertex)));
        if cut == Cut::Approximate {
            let text = "has faces that cross themselves; what area they have is not defined";
            notes.add(Category::Geometry, object, text);
        }
    }
    if triangles.is_empty() {
        return None;
    }
    // Normals and colours that only some vertices have mean nothing.
    let has_all = |attribute: fn(&Corner) -> u32| vertices.iter().all(|v| attribute(v) != NONE);
    let finite = |vector: Vec3| if vector.is_finite() { vector } else { Vec3::ZERO };
    let mut mesh = Mesh {
        name: group.name.clone(),
        positions: vertices.iter().map(|v| model.positions[v.position as usize]).collect(),
        triangles,
        ..Mesh::default()
    };
    if has_all(|vertex| vertex.normal) {
        let normal = |v: &Corner| finite(model.normals[v.normal as usize]);
        mesh.normals = vertices.iter().map(normal).collect();
        mesh.make_unit();
    }
    let color = |v: &Corner| model.colors[v.position as usize];
    if !model.colors.is_empty() && vertices.iter().all(|v| color(v).is_finite()) {
        let clamped = |v: &Corner| color(v).clamp(Vec3::ZERO, Vec3::ONE).extend(1.0);
        mesh.colors = vertices.iter().map(clamped).collect();
    }
    // OBJ's v points up, the scene's down.
    let uv = |v: &Corner| match model.uvs.get(v.uv as usize) {
        Some(uv) if uv.is_finite() => Vec2::new(uv.x, 1.0 - uv.y),
        _ => NO_UV,
    };
    if vertices.iter().any(|vertex| vertex.uv != NONE) {
        mesh.uv_sets.push(vertices.iter().map(uv).collect());
    }
    Some(mesh)
}

/// Gives a mesh without texture coordinates, but with textures, one place to look them up. Coordinates
/// that no texture is looked up at are not kept.
fn look_up(mesh: &mut Mesh, material: &Material, object: &str, notes: &mut Notes) {
    let textures = [material.base_color_texture, material.emission_texture];
    if textures.iter().all(Option::is_none) {
        mesh.uv_sets.clear();
        return;
    }
    if !mesh.uv_sets.is_empty() {
        return;
    }
    mesh.uv_sets.push(vec![NO_UV; mesh.positions.len()]);
    let category = match material.emission_texture {
        Some(_) => Category::Lights,
        None => Category::Materials,
    };
    let text =
        "has no texture coordinates for its textures; it has the colour of their corner (0, 0)";
    notes.add(category, object, text);
}
