//! `KHR_materials_clearcoat`. The coat has the normals of what is below; where the extension gives it others, a note
//! says so.

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
    clearcoat_normal_texture: Option<Info>,
}

/// The coat that the extension of a material with a normal map, or none, tells; `None` if it has no strength or
/// cannot be read.
pub(super) fn compile(
    textures: &mut Textures,
    source: &Source,
    output: &mut Output,
    (extension, normal_map): (&Value, Option<&Info>),
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
    let mut texture = |info: Option<Info>| {
        let found = textures.texture_use(source, output, &info?, Coding::Linear);
        found
            .map_err(|problem| note(output, format!("{problem}; its coat is as its factor says")))
            .ok()
    };
    let factor_texture = texture(row.clearcoat_texture);
    let roughness_texture = texture(row.clearcoat_roughness_texture);
    let of_coat = row.clearcoat_normal_texture.map(|info| info.index);
    if of_coat != normal_map.map(|info| info.index) {
        note(output, "its coat has other normals than what is below; drawn with the same".into());
    }
    Some(Coat { factor, factor_texture, roughness, roughness_texture })
}
