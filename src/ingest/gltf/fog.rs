//! Homogeneous fog: `extras.usdFog` of a node or of the scene.

use super::Output;
use super::document::{UsdFog, label, reals};
use crate::ingest::error::Fault;
use crate::math::color::Rgb;
use crate::scene::{Category, FogBox, Medium};
use glam::Vec3;
use gltf::json::Extras;
use gltf::json::Scene as Row;

/// The fog that the file's scene is in.
pub(super) fn of_scene(output: &mut Output, number: usize, row: &Row) -> Result<(), Fault> {
    let object = label("scene", number, row.name.as_deref());
    let Some(fog) = UsdFog::of(&row.extras, &object)? else { return Ok(()) };
    if fog.min.is_some() || fog.max.is_some() {
        return Err(Fault::new(object, "extras.usdFog: a scene has no space for min and max")
            .remedy("give the box to a node"));
    }
    add(output, medium(&fog, None, &object)?, &object);
    Ok(())
}

/// The fog at a node.
pub(super) fn of_node(
    output: &mut Output,
    extras: &Extras,
    node: u32,
    object: &str,
) -> Result<(), Fault> {
    let Some(fog) = UsdFog::of(extras, object)? else { return Ok(()) };
    let region = region(&fog, node, object)?;
    add(output, medium(&fog, region, object)?, object);
    Ok(())
}

/// A scene has one medium. What neither scatters nor absorbs is none.
fn add(output: &mut Output, medium: Medium, object: &str) {
    if medium.scattering + medium.absorption == Rgb::ZERO {
        return;
    }
    match output.scene.medium {
        None => output.scene.medium = Some(medium),
        Some(_) => output.notes.add(
            Category::Other,
            object,
            "only the first fog of a scene is read; left out",
        ),
    }
}

fn medium(fog: &UsdFog, region: Option<FogBox>, object: &str) -> Result<Medium, Fault> {
    let fault = |problem: &str| Err(Fault::new(object, format!("extras.usdFog: {problem}")));
    let extinction = Rgb::from(reals(fog.extinction.rgb()));
    let albedo = fog.albedo.map_or(Rgb::ONE, |albedo| reals(albedo).into());
    let anisotropy = fog.anisotropy.f32();
    if extinction.min_element() < 0.0 {
        return fault("extinction is negative");
    }
    if albedo.min_element() < 0.0 || albedo.max_element() > 1.0 {
        return fault("albedo is not in [0, 1]");
    }
    if anisotropy.abs() >= 1.0 {
        return fault("anisotropy is not in (-1, 1)");
    }
    Ok(Medium {
        scattering: extinction * albedo,
        absorption: extinction * (Rgb::ONE - albedo),
        anisotropy,
        region,
    })
}

fn region(fog: &UsdFog, node: u32, object: &str) -> Result<Option<FogBox>, Fault> {
    let fault = |problem| Err(Fault::new(object, format!("extras.usdFog: {problem}")));
    match (fog.min, fog.max) {
        (None, None) => Ok(None),
        (Some(min), Some(max)) => {
            let (min, max) = (Vec3::from(reals(min)), Vec3::from(reals(max)));
            match min.cmplt(max).all() {
                true => Ok(Some(FogBox { node, min, max })),
                false => fault("min is not below max"),
            }
        }
        _ => fault("has one of min and max without the other"),
    }
}
