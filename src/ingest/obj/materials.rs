//! MTL materials: the classic parameters, and the PBR extension's `Ke`, `Pr` and `Pm`.

use crate::ingest::budget::Budget;
use crate::ingest::error::Fault;
use crate::ingest::image::{self, Coding};
use crate::ingest::notes::Notes;
use crate::ingest::uri::Folder;
use crate::math::color::Rgb;
use crate::scene::{AlphaMode, Material, Scene, Texture, TextureUse, Wrap};
use std::collections::HashMap;

/// Compiles materials, and the textures that they use.
pub(super) struct Materials<'a> {
    pub folder: &'a Folder,
    pub budget: Budget,
    /// Textures that were asked for, by file and coding; `None` for those that cannot be read.
    pub textures: HashMap<(String, Coding), Option<u32>>,
}

impl Materials<'_> {
    pub(super) fn compile(
        &mut self,
        row: &tobj::Material,
        scene: &mut Scene,
        notes: &mut Notes,
    ) -> Result<Material, Fault> {
        let object = format!("material {:?}", row.name);
        let color = |value: Option<[f32; 3]>, spare: Rgb| match value.map(Rgb::from) {
            Some(color) if !(color.is_finite() && color.min_element() >= 0.0) => {
                Err(Fault::new(&object, "has a colour that is negative or not finite"))
            }
            color => Ok(color.unwrap_or(spare)),
        };
        let base_color_file = row.diffuse_texture.as_deref();
        let emission_file = parameter(row, "map_Ke");
        let mut base_color = color(row.diffuse, Rgb::ONE)?.min(Rgb::ONE);
        let mut emission = color(row.emissive, Rgb::ZERO)?;
        let gloss = color(row.specular, Rgb::ZERO)?.max_element().min(1.0);
        let number = |key: &str| parameter(row, key).and_then(|value| value.parse::<f32>().ok());
        let unit = |value: f32| if value.is_finite() { value.clamp(0.0, 1.0) } else { 1.0 };
        let opacity = unit(row.dissolve.unwrap_or(1.0));
        // A black factor beside a picture is how exporters say that the picture is all.
        if base_color_file.is_some() && base_color == Rgb::ZERO {
            base_color = Rgb::ONE;
        }
        if emission_file.is_some() && emission == Rgb::ZERO {
            emission = Rgb::ONE;
        }
        let mut texture =
            |file: Option<&str>, coding| self.texture(file, coding, &object, scene, notes);
        let material = Material {
            name: row.name.clone(),
            base_color,
            base_color_texture: texture(base_color_file, Coding::Srgb)?,
            opacity,
            alpha_mode: if opacity < 1.0 { AlphaMode::Blend } else { AlphaMode::Opaque },
            metallic: unit(number("Pm").unwrap_or(0.0)),
            roughness: unit(number("Pr").unwrap_or_else(|| roughness(row.shininess))),
            ior: row.optical_density.filter(|&ior| ior > 1.0 && ior.is_finite()).unwrap_or(1.5),
            specular: gloss,
            emission_nits: emission,
            emission_texture: texture(emission_file, Coding::Srgb)?,
            ..Material::default()
        };
        let unread = [&row.normal_texture, &row.dissolve_texture, &row.specular_texture];
        for file in unread.into_iter().flatten() {
            notes.add(format!("{object}, {file:?}"), "only map_Kd and map_Ke are read");
        }
        Ok(material)
    }

    fn texture(
        &mut self,
        file: Option<&str>,
        coding: Coding,
        object: &str,
        scene: &mut Scene,
        notes: &mut Notes,
    ) -> Result<Option<TextureUse>, Fault> {
        let Some(mut file) = file.map(str::trim).filter(|file| !file.is_empty()) else {
            return Ok(None);
        };
        if file.starts_with('-') {
            notes.add(object, "options of texture maps are not read");
            file = file.rsplit(char::is_whitespace).next().unwrap_or(file);
        }
        let usage = |texture: u32| TextureUse { texture, uv_set: 0, transform: None };
        let key = (file.to_string(), coding);
        if let Some(texture) = self.textures.get(&key) {
            return Ok(texture.map(usage));
        }
        let name = format!("{object}, texture {file:?}");
        let bytes =
            self.folder.resolve(file, &name).and_then(|path| self.folder.read(&path, &name));
        let texture = match bytes {
            Err(fault) => {
                notes.add(object, format!("{}; drawn without", fault.into_problem()));
                None
            }
            Ok(bytes) if !image::is_surface_format(&bytes) => {
                notes.add(name, "is neither PNG nor JPEG; drawn without");
                None
            }
            Ok(bytes) => {
                let picture = image::decode(&bytes, coding, &name, &mut self.budget)?;
                scene.textures.push(Texture {
                    name: file.to_string(),
                    width: picture.width,
                    height: picture.height,
                    pixels: picture.pixels,
                    wrap: [Wrap::Repeat; 2],
                    bilinear: true,
                });
                Some(scene.textures.len() as u32 - 1)
            }
        };
        self.textures.insert(key, texture);
        Ok(texture.map(usage))
    }
}

/// A parameter that `tobj` has no field for.
fn parameter<'a>(row: &'a tobj::Material, key: &str) -> Option<&'a str> {
    let found = row.unknown_param.iter().find(|(name, _)| name.eq_ignore_ascii_case(key));
    found.map(|(_, value)| value.trim())
}

/// The roughness whose GGX lobe is as wide as Blinn and Phong's of that exponent:
/// `alpha^2 = 2 / (n + 2)` (Walter et al. 2007), and roughness is the root of alpha.
fn roughness(shininess: Option<f32>) -> f32 {
    match shininess {
        Some(exponent) if exponent >= 0.0 => (2.0 / (exponent + 2.0)).powf(0.25),
        _ => 1.0,
    }
}
