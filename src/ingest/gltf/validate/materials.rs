//! Material parameters in their ranges.

use crate::ingest::error::Fault;
use crate::ingest::gltf::document::{Document, Material, Real, label};

pub(super) fn check(document: &Document) -> Result<(), Fault> {
    for (i, material) in document.materials.iter().enumerate() {
        check_material(material).map_err(|problem| {
            Fault::new(label("material", i, material.name.as_deref()), problem)
        })?;
    }
    Ok(())
}

fn check_material(material: &Material) -> Result<(), &'static str> {
    let unit = |values: &[Real]| values.iter().all(|value| (0.0..=1.0).contains(&value.f64()));
    let positive = |values: &[Real]| values.iter().all(|value| value.f64() >= 0.0);
    let pbr = &material.pbr_metallic_roughness;
    if !unit(&pbr.base_color_factor) || !unit(&[pbr.metallic_factor, pbr.roughness_factor]) {
        return Err("its base colour, metallic or roughness factor is outside [0, 1]");
    }
    // More than one is brighter than glTF allows, but no less clear.
    if !positive(&material.emissive_factor) || !positive(&[material.alpha_cutoff]) {
        return Err("its emissive factor or alpha cutoff is negative");
    }
    let extensions = &material.extensions;
    if extensions.emissive_strength.as_ref().is_some_and(|e| e.emissive_strength.f64() < 0.0) {
        return Err("its emissive strength is negative");
    }
    // Zero asks for an infinitely strong reflection, by the extension's own words.
    if extensions.ior.as_ref().is_some_and(|e| e.ior.f64() != 0.0 && e.ior.f64() < 1.0) {
        return Err("its index of refraction is below 1");
    }
    if let Some(specular) = &extensions.specular
        && !(unit(&[specular.specular_factor]) && positive(&specular.specular_color_factor))
    {
        return Err("its specular factors are out of range");
    }
    if let Some(glossy) = &extensions.specular_glossiness
        && !(unit(&glossy.diffuse_factor)
            && unit(&glossy.specular_factor)
            && unit(&[glossy.glossiness_factor]))
    {
        return Err("its specular-glossiness factors are outside [0, 1]");
    }
    Ok(())
}
