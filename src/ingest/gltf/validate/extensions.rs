//! The version of the format, and the extensions that a file cannot be read without.

use crate::ingest::error::Fault;
use crate::ingest::gltf::document::Document;

/// Extensions that may be required: read in full, or where the scene is still true without them.
const READ: [&str; 21] = [
    "EXT_mesh_gpu_instancing",
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
    "KHR_texture_transform",
    "KHR_xmp_json_ld",
];

pub(super) fn check(document: &Document) -> Result<(), Fault> {
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
                .remedy("export without it; compressed meshes and textures must be unpacked"));
        }
    }
    Ok(())
}
