//! Wavefront OBJ with its MTL: every object and material change is one mesh at a node of its own.
//!
//! OBJ says nothing of units, of up or of the side that an emissive surface shines from: metres, +Y
//! and the front are taken. Polygons are cut into fans, so concave ones should be triangulated by
//! whoever writes the file. References in OBJ files are often stale, so that absent materials and
//! textures are noted rather than refused.

mod materials;
mod text;

use super::budget::Budget;
use super::error::Fault;
use super::normals;
use super::notes::Notes;
use super::paths::{PrimPaths, component};
use super::uri::Folder;
use crate::scene::{Instance, Mesh, Node, Scene, Trs, Visibility};
use glam::{Vec2, Vec3, Vec4};
use materials::Materials;
use std::cell::RefCell;
use std::collections::HashMap;
use std::path::Path;

/// Reads a file.
pub(super) fn load(path: &Path) -> Result<Scene, Fault> {
    let bytes = super::read_file(path)?;
    let folder = Folder::of(path)?;
    let mut text = text::decode(&bytes).map_err(|problem| {
        Fault::new("file", problem).remedy("save it as UTF-8 text, or fetch or export it again")
    })?;
    let notes = RefCell::new(Notes::default());
    if text::check(&text)?.polylines {
        notes.borrow_mut().add("file", "lines are not drawn");
        text = text::without_polylines(&text).into();
    }
    // One vertex per combination of position, normal and texture coordinate; fans.
    let options = tobj::GPU_LOAD_OPTIONS;
    let library = |file: &Path| Ok(read_library(&folder, file, &mut notes.borrow_mut()));
    let (models, rows) = tobj::load_obj_buf(&mut text.as_bytes(), &options, library)
        .map_err(|error| Fault::new("text", format!("cannot be parsed: {error}")))?;
    let rows = rows.map_err(|error| Fault::new("materials", error))?;
    let mut notes = notes.into_inner();

    let mut scene = Scene::default();
    let mut paths = PrimPaths::default();
    let mut materials =
        Materials { folder: &folder, budget: Budget::for_pictures(), textures: HashMap::new() };
    let mut compiled: Vec<Option<u32>> = vec![None; rows.len()];
    for (i, model) in models.into_iter().enumerate() {
        let object = format!("object {i} {:?}", model.name);
        let Some(mut mesh) = compile(model.mesh, &object, &mut notes)? else { continue };
        if let Some(number) = mesh.material.filter(|&number| (number as usize) < rows.len()) {
            let number = number as usize;
            if compiled[number].is_none() {
                let material = materials.compile(&rows[number], &mut scene, &mut notes)?;
                scene.materials.push(material);
                compiled[number] = Some(scene.materials.len() as u32 - 1);
            }
            mesh.material = compiled[number];
        } else {
            mesh.material = None;
        }
        let path = paths.claim(format!("/{}", component(&model.name, || format!("object_{i}"))));
        mesh.name = model.name;
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
    scene.notes = notes.into_lines();
    scene.files = folder.into_files(path);
    Ok(scene)
}

type Library = (Vec<tobj::Material>, HashMap<String, usize>);

/// Reads a material library; an absent or broken one is noted.
fn read_library(folder: &Folder, file: &Path, notes: &mut Notes) -> Library {
    let object = format!("material library {:?}", file.display().to_string());
    let read = || -> Result<Library, String> {
        let name = file.to_str().ok_or("its name is not UTF-8")?;
        let file = folder.resolve(name, &object).map_err(Fault::into_problem)?;
        let bytes = folder.read(&file, &object).map_err(Fault::into_problem)?;
        let text = text::with_whole_colors(&text::decode(&bytes)?)?;
        tobj::load_mtl_buf(&mut text.as_bytes()).map_err(|error| error.to_string())
    };
    read().unwrap_or_else(|problem| {
        notes.add(&*object, format!("{problem}; surfaces are drawn with the default material"));
        Library::default()
    })
}

/// Keeps a mesh's promises: counts agree, indices are in range, numbers are finite.
fn compile(mesh: tobj::Mesh, object: &str, notes: &mut Notes) -> Result<Option<Mesh>, Fault> {
    let mut positions: Vec<Vec3> = mesh.positions.chunks_exact(3).map(Vec3::from_slice).collect();
    let mut triangles: Vec<[u32; 3]> =
        mesh.indices.chunks_exact(3).map(|corners| [corners[0], corners[1], corners[2]]).collect();
    if triangles.as_flattened().iter().any(|&corner| corner as usize >= positions.len()) {
        return Err(Fault::new(object, "has an index out of range"));
    }
    if positions.iter().any(|position| !position.is_finite()) {
        let finite = |corner: &u32| positions[*corner as usize].is_finite();
        triangles.retain(|triangle| triangle.iter().all(finite));
        positions.iter_mut().filter(|p| !p.is_finite()).for_each(|p| *p = Vec3::ZERO);
        notes.add(object, "has vertices that are not finite; their faces are left out");
    }
    if triangles.is_empty() {
        return Ok(None);
    }
    let finite = |vector: Vec3| if vector.is_finite() { vector } else { Vec3::ZERO };
    let normals = mesh.normals.chunks_exact(3).map(|n| finite(Vec3::from_slice(n))).collect();
    // OBJ's v points up, the scene's down.
    let uv = |uv: &[f32]| finite(Vec3::new(uv[0], 1.0 - uv[1], 0.0)).truncate();
    let uvs: Vec<Vec2> = mesh.texcoords.chunks_exact(2).map(uv).collect();
    let color = |c: &[f32]| finite(Vec3::from_slice(c)).clamp(Vec3::ZERO, Vec3::ONE).extend(1.0);
    let colors: Vec<Vec4> = mesh.vertex_color.chunks_exact(3).map(color).collect();
    let mut compiled = Mesh {
        positions,
        normals,
        colors,
        triangles,
        material: mesh.material_id.and_then(|number| u32::try_from(number).ok()),
        ..Mesh::default()
    };
    // Attributes that only some vertices have mean nothing.
    let count = compiled.positions.len();
    if compiled.normals.len() != count {
        compiled.normals.clear();
    }
    if compiled.colors.len() != count {
        compiled.colors.clear();
    }
    if uvs.len() == count {
        compiled.uv_sets.push(uvs);
    }
    normals::make_unit(&mut compiled);
    Ok(Some(compiled))
}
