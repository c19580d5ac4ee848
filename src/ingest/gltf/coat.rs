//! `KHR_materials_clearcoat`. A coat without normals of its own has those of the mesh, as the extension says, whatever
//! normal map is below it.

use super::document::Real;
use super::textures::Textures;
use super::{Output, Source};
use crate::ingest::image::Coding;
use crate::scene::{Category, Coat};
use gltf::json::texture::Info;
use serde::Deserialize;
use serde_json::Value;

/// The extension's name.
pub(super) const NAME: &str = "KHR_materials_clearcoat";

/// What the extension says.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Row {
    #[serde(default)]
    clearcoat_factor: Real,
    clearcoat_texture: Option<Info>,
    #[serde(default)]
    clearcoat_roughness_factor: Real,
    clearcoat_roughness_texture: Option<Info>,
    clearcoat_normal_texture: Option<Value>,
}

/// What a normal map has beside its texture.
#[derive(Deserialize)]
struct Scaled {
    scale: Option<Real>,
}

/// The coat that the extension tells; `None` if it has no strength or cannot be read.
pub(super) fn compile(
    textures: &mut Textures,
    source: &Source,
    output: &mut Output,
    extension: &Value,
    object: &str,
) -> Option<Coat> {
    let note = |output: &mut Output, text: String| {
        output.notes.add(Category::Materials, object, text);
    };
    let row = match Row::deserialize(extension) {
        Ok(row) => row,
        Err(error) => {
            note(output, format!("its {NAME} cannot be read: {error}; left out"));
            return None;
        }
    };
    let normals = row.clearcoat_normal_texture.as_ref().map(|told| {
        let scale = Scaled::deserialize(told)?.scale.map_or(1.0, |scale| scale.f32());
        Ok::<_, serde_json::Error>((Info::deserialize(told)?, scale))
    });
    let normals = match normals.transpose() {
        Ok(normals) => normals,
        Err(error) => {
            note(
                output,
                format!("its {NAME} has a normal map that cannot be read: {error}; left out"),
            );
            None
        }
    };
    let [factor, roughness] = [row.clearcoat_factor, row.clearcoat_roughness_factor].map(|told| {
        let within = told.f32().clamp(0.0, 1.0);
        if within != told.f32() {
            note(output, format!("its {NAME} has factors out of their range; brought into it"));
        }
        within
    });
    if factor == 0.0 {
        return None;
    }
    let mut texture = |info: Option<Info>, instead: &str| {
        let found = textures.texture_use(source, output, &info?, Coding::Linear);
        found.map_err(|problem| note(output, format!("{problem}; {instead}"))).ok()
    };
    let as_factor = "its coat is as its factor says";
    let factor_texture = texture(row.clearcoat_texture, as_factor);
    let roughness_texture = texture(row.clearcoat_roughness_texture, as_factor);
    let (map, scale) = match normals {
        Some((map, scale)) => (Some(map), scale),
        None => (None, 1.0),
    };
    let normal_texture = texture(map, "its coat is drawn without a normal map");
    let normal_scale = if scale.is_finite() { scale } else { 1.0 };
    Some(Coat {
        factor,
        factor_texture,
        roughness,
        roughness_texture,
        normal_texture,
        normal_scale,
    })
}
