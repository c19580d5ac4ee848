//! Material parameters in their ranges.

use crate::ingest::error::Fault;
use crate::ingest::gltf::document::{Document, label};
use gltf::json::Material;
use gltf::json::texture::Info;

pub(super) fn check(document: &Document) -> Result<(), Fault> {
    for (i, material) in document.materials.iter().enumerate() {
        check_material(material, document.texture_uses(i)).map_err(|problem| {
            Fault::new(label("material", i, material.name.as_deref()), problem)
        })?;
    }
    Ok(())
}

fn check_material<'a>(
    material: &Material,
    mut textures: impl Iterator<Item = &'a Info>,
) -> Result<(), &'static str> {
    let unit = |values: &[f32]| values.iter().all(|value| (0.0..=1.0).contains(value));
    let positive = |values: &[f32]| values.iter().all(|&value| value >= 0.0 && value.is_finite());
    let pbr = &material.pbr_metallic_roughness;
    if !unit(&pbr.base_color_factor.0) || !unit(&[pbr.metallic_factor.0, pbr.roughness_factor.0]) {
        return Err("its base colour, metallic or roughness factor is outside [0, 1]");
    }
    // More than one is brighter than glTF allows, but no less clear.
    let cutoff = material.alpha_cutoff.map_or(0.0, |cutoff| cutoff.0);
    if !positive(&material.emissive_factor.0) || !positive(&[cutoff]) {
        return Err("its emissive factor or alpha cutoff is negative or infinite");
    }
    if material.normal_texture.as_ref().is_some_and(|normal| !normal.scale.is_finite())
        || !textures.all(is_transform_finite)
    {
        return Err("the scale or transform of one of its textures is infinite");
    }
    let Some(extensions) = &material.extensions else { return Ok(()) };
    if extensions.emissive_strength.as_ref().is_some_and(|e| !positive(&[e.emissive_strength.0])) {
        return Err("its emissive strength is negative or infinite");
    }
    // Zero asks for an infinitely strong reflection, by the extension's own words.
    let ior = extensions.ior.as_ref().map_or(0.0, |ior| ior.ior.0);
    if ior != 0.0 && !(ior >= 1.0 && ior.is_finite()) {
        return Err("its index of refraction is below 1 or infinite");
    }
    if let Some(specular) = &extensions.specular
        && !(unit(&[specular.specular_factor.0]) && positive(&specular.specular_color_factor.0))
    {
        return Err("its specular factors are out of range");
    }
    if let Some(glossy) = &extensions.pbr_specular_glossiness
        && !(unit(&glossy.diffuse_factor.0)
            && unit(&glossy.specular_factor.0)
            && unit(&[glossy.glossiness_factor.0]))
    {
        return Err("its specular-glossiness factors are outside [0, 1]");
    }
    Ok(())
}

fn is_transform_finite(info: &Info) -> bool {
    let transform = info.extensions.as_ref().and_then(|e| e.texture_transform.as_ref());
    transform.is_none_or(|transform| {
        let numbers = [transform.offset.0, transform.scale.0, [transform.rotation.0, 0.0]];
        numbers.as_flattened().iter().all(|number| number.is_finite())
    })
}
