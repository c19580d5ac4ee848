//! Vertex attributes, indices and instance attributes have types that their meaning allows.

use super::data::Facts;
use crate::ingest::error::Fault;
use crate::ingest::gltf::accessors::{Accessor, Component, Shape};
use crate::ingest::gltf::document::{Document, Instancing, Primitive, label};

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
        let targets = |primitive: &Primitive| primitive.targets.len();
        if mesh.weights.as_ref().is_some_and(|w| w.len() != targets(&mesh.primitives[0])) {
            return Err(fault("has another number of weights than morph targets".into()));
        }
    }
    for (i, node) in document.nodes.iter().enumerate() {
        if let Some(instancing) = &node.extensions.instancing {
            check_instancing(instancing, accessors)
                .map_err(|problem| Fault::new(label("node", i, node.name.as_deref()), problem))?;
        }
    }
    Ok(())
}

fn check_primitive(
    primitive: &Primitive,
    accessors: &[Accessor],
    facts: &[Facts],
    quantized: bool,
) -> Result<(), String> {
    if primitive.mode > 6 {
        return Err(format!("has unknown primitive mode {}", primitive.mode));
    }
    let mut vertices = None;
    for (semantic, &index) in &primitive.attributes {
        let accessor = &accessors[index as usize];
        if !attribute_allows(semantic, accessor, quantized) {
            let (component, shape) = (accessor.component, accessor.shape);
            return Err(format!("its {semantic} cannot be {component:?} x {}", shape.components()));
        }
        if *vertices.get_or_insert(accessor.count) != accessor.count {
            return Err("its attributes have different numbers of vertices".into());
        }
    }
    let vertices = vertices.unwrap_or(0);
    for (semantic, &index) in primitive.targets.iter().flatten() {
        if accessors[index as usize].count != vertices {
            return Err(format!("its morph target {semantic} has another number of vertices"));
        }
    }
    let Some(index) = primitive.indices else { return Ok(()) };
    let indices = &accessors[index as usize];
    let integers = indices.component.is_unsigned() && !indices.normalized;
    if !integers || indices.shape != Shape::SCALAR || indices.is_interleaved() {
        return Err("its indices are not a packed array of unsigned integers".into());
    }
    let largest = facts[index as usize].largest;
    if largest >= vertices as f64 && primitive.attributes.contains_key("POSITION") {
        return Err(format!("has an index {largest}, but only {vertices} vertices"));
    }
    Ok(())
}

/// Core glTF's table of attributes (3.7.2.1), and `KHR_mesh_quantization`'s.
fn attribute_allows(semantic: &str, accessor: &Accessor, quantized: bool) -> bool {
    let (component, normalized, shape) = (accessor.component, accessor.normalized, accessor.shape);
    let float = component == Component::F32;
    let small = !float && component != Component::U32;
    let unsigned_norm = small && component.is_unsigned() && normalized;
    let signed_norm = small && !component.is_unsigned() && normalized;
    let set =
        |prefix: &str| semantic.strip_prefix(prefix).is_some_and(|n| n.parse::<u32>().is_ok());
    match semantic {
        "POSITION" => shape == Shape::VEC3 && (float || quantized && small),
        "NORMAL" => shape == Shape::VEC3 && (float || quantized && signed_norm),
        "TANGENT" => shape == Shape::VEC4 && (float || quantized && signed_norm),
        _ if set("TEXCOORD_") => {
            shape == Shape::VEC2 && (float || unsigned_norm || quantized && small)
        }
        _ if set("COLOR_") => {
            (shape == Shape::VEC3 || shape == Shape::VEC4) && (float || unsigned_norm)
        }
        // Skins are not read, custom attributes neither.
        _ => true,
    }
}

/// `EXT_mesh_gpu_instancing`: TRANSLATION, ROTATION, SCALE, of one length.
fn check_instancing(instancing: &Instancing, accessors: &[Accessor]) -> Result<(), String> {
    let mut instances = None;
    for (semantic, &index) in &instancing.attributes {
        let accessor = &accessors[index as usize];
        let float = accessor.component == Component::F32;
        let signed_norm = accessor.normalized && !accessor.component.is_unsigned();
        let allowed = match semantic.as_str() {
            "TRANSLATION" | "SCALE" => float && accessor.shape == Shape::VEC3,
            "ROTATION" => (float || signed_norm) && accessor.shape == Shape::VEC4,
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
