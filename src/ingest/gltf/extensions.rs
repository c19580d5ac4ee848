//! The version of the format, and the extensions that a file cannot be read without.

use super::document::Document;
use crate::ingest::error::Fault;
use crate::ingest::notes::Notes;
use crate::scene::Category;

/// Extensions that may be required: read in full, or where the scene is still true without them.
const READ: [&str; 25] = [
    "EXT_mesh_gpu_instancing",
    "EXT_texture_avif",
    "EXT_texture_webp",
    "KHR_animation_pointer",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    "KHR_texture_basisu",
    "KHR_texture_transform",
    "KHR_xmp_json_ld",
    "MSFT_texture_dds",
];

/// Extensions that light a whole scene and are not read.
const LIGHTS: [&str; 3] = ["EXT_lights_area", "EXT_lights_ies", "EXT_lights_image_based"];

/// Refuses other versions and required extensions; notes what changes a picture and is told nowhere else.
pub(super) fn check(document: &Document, notes: &mut Notes) -> Result<(), Fault> {
    let asset = &document.asset;
    let version = asset.min_version.as_ref().unwrap_or(&asset.version);
    let supported = match asset.min_version {
        Some(_) => version == "2.0",
        None => version.starts_with("2."),
    };
    if !supported {
        return Err(Fault::new("asset", format!("glTF version {version:?} is not supported"))
            .remedy("export glTF 2.0"));
    }
    for required in &document.extensions_required {
        if !READ.contains(&required.as_str()) {
            return Err(Fault::new("extensionsRequired", format!("{required} is not supported"))
                .remedy("export without it; compressed meshes must be unpacked"));
        }
    }
    for extension in &document.extensions_used {
        if LIGHTS.contains(&extension.as_str()) {
            notes.add(Category::Lights, "file", format!("{extension} is not read"));
        }
    }
    Ok(())
}
