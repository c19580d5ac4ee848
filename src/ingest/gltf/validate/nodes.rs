//! Transforms that can be composed; cameras and lights that make sense.

use crate::ingest::error::Fault;
use crate::ingest::gltf::document::{Document, label, morph_targets};
use gltf::json::Camera;
use gltf::json::camera::Type as CameraType;
use gltf::json::extensions::scene::khr_lights_punctual::{Light, Type as LightType};
use gltf::json::mesh::Semantic;
use gltf::json::validation::Checked;
use std::f32::consts::FRAC_PI_2;
use std::f64::consts::PI;

const JOINTS: Checked<Semantic> = Checked::Valid(Semantic::Joints(0));

/// How far the length of a rotation's quaternion may be from one.
const QUATERNION_TOLERANCE: f64 = 0.01;

pub(super) fn check(document: &Document) -> Result<(), Fault> {
    for (i, node) in document.nodes.iter().enumerate() {
        check_node(i, document)
            .map_err(|problem| Fault::new(label("node", i, node.name.as_deref()), problem))?;
    }
    for (i, camera) in document.cameras.iter().enumerate() {
        check_camera(camera)
            .map_err(|problem| Fault::new(label("camera", i, camera.name.as_deref()), problem))?;
    }
    for (i, light) in document.lights().iter().enumerate() {
        check_light(light)
            .map_err(|problem| Fault::new(label("light", i, light.name.as_deref()), problem))?;
    }
    Ok(())
}

fn check_node(number: usize, document: &Document) -> Result<(), &'static str> {
    let (node, place) = (&document.nodes[number], &document.beside.transforms[number]);
    if let Some(matrix) = place.matrix {
        if place.translation.is_some() || place.rotation.is_some() || place.scale.is_some() {
            return Err("has both a matrix and translation, rotation or scale");
        }
        let last_row = [matrix[3], matrix[7], matrix[11], matrix[15]].map(|value| value.f64());
        if last_row != [0.0, 0.0, 0.0, 1.0] {
            return Err("its matrix is not affine");
        }
    }
    if let Some(rotation) = place.rotation {
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
    let primitives = &document.meshes[mesh.value()].primitives;
    if node.skin.is_some() && !primitives.iter().any(|p| p.attributes.contains_key(&JOINTS)) {
        return Err("has a skin, but its mesh has no joints");
    }
    let targets = primitives.first().map_or(0, morph_targets);
    match &node.weights {
        Some(weights) if weights.len() != targets => {
            Err("has another number of weights than its mesh has morph targets")
        }
        _ => Ok(()),
    }
}

fn check_camera(camera: &Camera) -> Result<(), String> {
    if camera.type_ != Checked::Valid(CameraType::Perspective) {
        return Ok(());
    }
    let lens = camera.perspective.as_ref().ok_or("has no perspective")?;
    let yfov = f64::from(lens.yfov);
    if !(yfov > 0.0 && yfov < PI) {
        return Err(format!("its field of view, {yfov} radians, is not in (0, pi)"));
    }
    match lens.aspect_ratio {
        Some(aspect) if !(aspect > 0.0 && aspect.is_finite()) => {
            Err("its aspect ratio is not positive".into())
        }
        _ => Ok(()),
    }
}

fn check_light(light: &Light) -> Result<(), String> {
    let brightness = |value: &f32| *value >= 0.0 && value.is_finite();
    if !light.color.iter().chain([&light.intensity]).all(brightness) {
        return Err("has a negative or infinite colour or intensity".into());
    }
    if light.range.is_some_and(|range| !(range > 0.0 && range.is_finite())) {
        return Err("its range is not positive".into());
    }
    match (&light.type_, &light.spot) {
        (Checked::Valid(LightType::Spot), Some(spot)) => {
            let (inner, outer) = (spot.inner_cone_angle, spot.outer_cone_angle);
            match 0.0 <= inner && inner < outer && outer <= FRAC_PI_2 + 1e-6 {
                true => Ok(()),
                false => Err(format!("its cone angles {inner} and {outer} are not 0..pi/2")),
            }
        }
        (Checked::Valid(LightType::Spot), None) => Err("is a spot without cone angles".into()),
        _ => Ok(()),
    }
}
