//! Vertex attributes, indices and instance attributes have types that their meaning allows.

use super::data::Facts;
use crate::ingest::error::Fault;
use crate::ingest::gltf::accessors::Accessor;
use crate::ingest::gltf::document::{Document, Instancing, label, morph_targets};
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::validation::Checked;

pub(super) fn check(
    document: &Document,
    accessors: &[Accessor],
    facts: &[Facts],
) -> Result<(), Fault> {
    let quantized = document.extensions_used.iter().any(|e| e == "KHR_mesh_quantization");
    for (i, mesh) in document.meshes.iter().enumerate() {
        let fault = |problem| Fault::new(label("mesh", i, mesh.name.as_deref()), problem);
        if mesh.primitives.is_empty() {
            return Err(fault("has no primitives".into()));
        }
        for primitive in &mesh.primitives {
            check_primitive(primitive, accessors, facts, quantized).map_err(fault)?;
        }
        if mesh.weights.as_ref().is_some_and(|w| w.len() != morph_targets(&mesh.primitives[0])) {
            return Err(fault("has another number of weights than morph targets".into()));
        }
    }
    for (&i, instancing) in &document.beside.instances {
        let object = || label("node", i, document.nodes[i].name.as_deref());
        check_instancing(instancing, accessors).map_err(|problem| Fault::new(object(), problem))?;
    }
    Ok(())
}

fn check_primitive(
    primitive: &Primitive,
    accessors: &[Accessor],
    facts: &[Facts],
    quantized: bool,
) -> Result<(), String> {
    let mut vertices = None;
    for (semantic, &index) in &primitive.attributes {
        let accessor = &accessors[index.value()];
        if !attribute_allows(semantic, accessor, quantized) {
            let (component, components) = (accessor.component, accessor.shape.multiplicity());
            let semantic = semantic.to_string();
            return Err(format!("its {semantic} cannot be {component:?} x {components}"));
        }
        if *vertices.get_or_insert(accessor.count) != accessor.count {
            return Err("its attributes have different numbers of vertices".into());
        }
    }
    let Some(index) = primitive.indices else { return Ok(()) };
    let indices = &accessors[index.value()];
    let integers = indices.is_unsigned() && !indices.normalized;
    if !integers || indices.shape != Type::Scalar || indices.is_interleaved() {
        return Err("its indices are not a packed array of unsigned integers".into());
    }
    let vertices = vertices.unwrap_or(0);
    let largest = facts[index.value()].largest;
    if largest >= vertices as f64
        && primitive.attributes.contains_key(&Checked::Valid(Semantic::Positions))
    {
        return Err(format!("has an index {largest}, but only {vertices} vertices"));
    }
    Ok(())
}

/// Core glTF's table of attributes (3.7.2.1), and `KHR_mesh_quantization`'s.
fn attribute_allows(semantic: &Checked<Semantic>, accessor: &Accessor, quantized: bool) -> bool {
    let (component, normalized, shape) = (accessor.component, accessor.normalized, accessor.shape);
    let float = component == ComponentType::F32;
    let small = !float && component != ComponentType::U32;
    let unsigned_norm = small && accessor.is_unsigned() && normalized;
    let signed_norm = small && !accessor.is_unsigned() && normalized;
    let Checked::Valid(semantic) = semantic else { return false };
    match semantic {
        Semantic::Positions => shape == Type::Vec3 && (float || quantized && small),
        Semantic::Normals => shape == Type::Vec3 && (float || quantized && signed_norm),
        Semantic::Tangents => shape == Type::Vec4 && (float || quantized && signed_norm),
        Semantic::TexCoords(_) => {
            shape == Type::Vec2 && (float || unsigned_norm || quantized && small)
        }
        Semantic::Colors(_) => {
            (shape == Type::Vec3 || shape == Type::Vec4) && (float || unsigned_norm)
        }
        // Skins are not read, the application's own attributes neither.
        Semantic::Joints(_) | Semantic::Weights(_) | Semantic::Extras(_) => true,
    }
}

/// `EXT_mesh_gpu_instancing`: TRANSLATION, ROTATION, SCALE, of one length.
fn check_instancing(instancing: &Instancing, accessors: &[Accessor]) -> Result<(), String> {
    let mut instances = None;
    for (semantic, &index) in &instancing.attributes {
        let accessor = &accessors[index.value()];
        let float = accessor.component == ComponentType::F32;
        let signed_norm = accessor.normalized && !accessor.is_unsigned();
        let allowed = match semantic.as_str() {
            "TRANSLATION" | "SCALE" => float && accessor.shape == Type::Vec3,
            "ROTATION" => (float || signed_norm) && accessor.shape == Type::Vec4,
            _ => true,
        };
        if !allowed {
            return Err(format!("its instances' {semantic} has a type that it cannot have"));
        }
        if *instances.get_or_insert(accessor.count) != accessor.count {
            return Err("its instances' attributes have different lengths".into());
        }
    }
    match instances {
        Some(_) => Ok(()),
        None => Err("has instances without attributes".into()),
    }
}
