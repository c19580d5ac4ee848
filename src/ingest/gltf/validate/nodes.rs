//! Transforms that can be composed; cameras and lights that make sense.

use crate::ingest::error::Fault;
use crate::ingest::gltf::document::{Camera, Document, Light, Node, label};
use std::f64::consts::{FRAC_PI_2, PI};

/// How far the length of a rotation's quaternion may be from one.
const QUATERNION_TOLERANCE: f64 = 0.01;

pub(super) fn check(document: &Document) -> Result<(), Fault> {
    for (i, node) in document.nodes.iter().enumerate() {
        check_node(node, document)
            .map_err(|problem| Fault::new(label("node", i, node.name.as_deref()), problem))?;
    }
    for (i, camera) in document.cameras.iter().enumerate() {
        check_camera(camera)
            .map_err(|problem| Fault::new(label("camera", i, camera.name.as_deref()), problem))?;
    }
    for (i, light) in document.lights.iter().enumerate() {
        check_light(light)
            .map_err(|problem| Fault::new(label("light", i, light.name.as_deref()), problem))?;
    }
    Ok(())
}

fn check_node(node: &Node, document: &Document) -> Result<(), &'static str> {
    if let Some(matrix) = node.matrix {
        if node.translation.is_some() || node.rotation.is_some() || node.scale.is_some() {
            return Err("has both a matrix and translation, rotation or scale");
        }
        let last_row = [matrix[3], matrix[7], matrix[11], matrix[15]].map(|value| value.f64());
        if last_row != [0.0, 0.0, 0.0, 1.0] {
            return Err("its matrix is not affine");
        }
    }
    if let Some(rotation) = node.rotation {
        let length = rotation.iter().map(|part| part.f64() * part.f64()).sum::<f64>().sqrt();
        if (length - 1.0).abs() > QUATERNION_TOLERANCE {
            return Err("its rotation is not a unit quaternion");
        }
    }
    let Some(mesh) = node.mesh else {
        return match (node.skin, &node.weights) {
            (None, None) => Ok(()),
            _ => Err("has a skin or weights, but no mesh"),
        };
    };
    let primitives = &document.meshes[mesh as usize].primitives;
    if node.skin.is_some() && !primitives.iter().any(|p| p.attributes.contains_key("JOINTS_0")) {
        return Err("has a skin, but its mesh has no joints");
    }
    let targets = primitives.first().map_or(0, |primitive| primitive.targets.len());
    match &node.weights {
        Some(weights) if weights.len() != targets => {
            Err("has another number of weights than its mesh has morph targets")
        }
        _ => Ok(()),
    }
}

fn check_camera(camera: &Camera) -> Result<(), String> {
    match (camera.kind.as_str(), &camera.perspective) {
        ("perspective", Some(lens)) => {
            let yfov = lens.yfov.f64();
            if !(yfov > 0.0 && yfov < PI) {
                return Err(format!("its field of view, {yfov} radians, is not in (0, pi)"));
            }
            match lens.aspect_ratio {
                Some(aspect) if aspect.f64() <= 0.0 => {
                    Err("its aspect ratio is not positive".into())
                }
                _ => Ok(()),
            }
        }
        ("orthographic", _) => Ok(()),
        ("perspective", None) => Err("has no perspective".into()),
        (kind, _) => Err(format!("has unknown type {kind:?}")),
    }
}

fn check_light(light: &Light) -> Result<(), String> {
    if light.intensity.f64() < 0.0 || light.color.iter().any(|part| part.f64() < 0.0) {
        return Err("has a negative colour or intensity".into());
    }
    if light.range.is_some_and(|range| range.f64() <= 0.0) {
        return Err("its range is not positive".into());
    }
    match (light.kind.as_str(), &light.spot) {
        ("point" | "directional", _) => Ok(()),
        ("spot", Some(spot)) => {
            let (inner, outer) = (spot.inner_cone_angle.f64(), spot.outer_cone_angle.f64());
            // A right angle written in single precision is a little more than one.
            match 0.0 <= inner && inner < outer && outer <= FRAC_PI_2 + 1e-6 {
                true => Ok(()),
                false => Err(format!("its cone angles {inner} and {outer} are not 0..pi/2")),
            }
        }
        ("spot", None) => Err("is a spot without cone angles".into()),
        (kind, _) => Err(format!("has unknown type {kind:?}")),
    }
}
