//! `KHR_materials_transmission` and `KHR_materials_volume`.
//!
//! Of a volume's thickness only whether there is one is read: a surface encloses what rays measure. A volume without
//! transmission is nothing, as the extension says.

use super::document::{Real, reals};
use super::textures::Textures;
use super::{Output, Source};
use crate::ingest::image::Coding;
use crate::math::color::Rgb;
use crate::scene::{Category, Mesh, Transmission, Volume};
use gltf::json::texture::Info;
use serde::Deserialize;
use serde_json::{Map, Value};
use std::collections::HashMap;
use std::ops::Range;

/// The extensions' names.
pub(super) const NAMES: [&str; 2] = ["KHR_materials_transmission", "KHR_materials_volume"];

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct TransmissionRow {
    #[serde(default)]
    transmission_factor: Real,
    transmission_texture: Option<Info>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct VolumeRow {
    #[serde(default)]
    thickness_factor: Real,
    attenuation_distance: Option<Real>,
    attenuation_color: Option<[Real; 3]>,
}

/// What the extensions of a material tell; `None` if nothing passes it, or if they cannot be read.
pub(super) fn compile(
    textures: &mut Textures,
    source: &Source,
    output: &mut Output,
    extensions: &Map<String, Value>,
    object: &str,
) -> Option<Transmission> {
    let row: TransmissionRow = read(output, extensions, NAMES[0], object)?;
    let told = row.transmission_factor.f32();
    let factor = told.clamp(0.0, 1.0);
    if factor != told {
        note(
            output,
            object,
            format!("its {} has factors out of their range; brought into it", NAMES[0]),
        );
    }
    if factor == 0.0 {
        return None;
    }
    let factor_texture = row.transmission_texture.and_then(|info| {
        let found = textures.texture_use(source, output, &info, Coding::Linear);
        let instead = "it lets through as its factor says";
        found.map_err(|problem| note(output, object, format!("{problem}; {instead}"))).ok()
    });
    let row: Option<VolumeRow> = read(output, extensions, NAMES[1], object);
    if row.as_ref().is_some_and(|row| row.thickness_factor.f32() < 0.0) {
        note(output, object, format!("its {} has a negative thickness; thin", NAMES[1]));
    }
    let row = row.filter(|row| row.thickness_factor.f32() > 0.0);
    let volume = row.map(|row| Volume { absorption: absorption(output, &row, object) });
    Some(Transmission { factor, factor_texture, volume })
}

fn read<T: for<'a> Deserialize<'a>>(
    output: &mut Output,
    extensions: &Map<String, Value>,
    name: &str,
    object: &str,
) -> Option<T> {
    let read = T::deserialize(extensions.get(name)?);
    read.map_err(|error| {
        note(output, object, format!("its {name} cannot be read: {error}; left out"))
    })
    .ok()
}

fn note(output: &mut Output, object: &str, text: String) {
    output.notes.add(Category::Materials, object, text);
}

/// Makes solid glass thin on meshes that enclose nothing: who enters would never leave. `meshes` are the primitives of
/// one mesh of the file, which may close each other. `thin` are the thin materials by their solid ones.
pub(super) fn thin_if_open(
    output: &mut Output,
    thin: &mut HashMap<u32, u32>,
    meshes: Range<usize>,
    object: &str,
) {
    let solid = |material: u32| output.scene.materials[material as usize].is_solid_glass();
    let of_glass: Vec<(usize, u32)> = meshes
        .clone()
        .filter_map(|mesh| Some((mesh, output.scene.meshes[mesh].material.filter(|&m| solid(m))?)))
        .collect();
    if of_glass.is_empty() || is_closed(&output.scene.meshes[meshes]) {
        return;
    }
    for (mesh, material) in of_glass {
        let materials = &mut output.scene.materials;
        let instead = *thin.entry(material).or_insert_with(|| {
            let mut like = materials[material as usize].clone();
            like.transmission =
                like.transmission.map(|passes| Transmission { volume: None, ..passes });
            materials.push(like);
            materials.len() as u32 - 1
        });
        output.scene.meshes[mesh].material = Some(instead);
    }
    note(output, object, "is of solid glass, but not closed; drawn as thin glass".into());
}

/// Whether no edge belongs to one triangle alone, equal positions being one.
fn is_closed(meshes: &[Mesh]) -> bool {
    let mut uses: HashMap<[[u32; 3]; 2], u32> = HashMap::new();
    for mesh in meshes {
        // Both zeros are one.
        let place =
            |corner: u32| (mesh.positions[corner as usize] + 0.0).to_array().map(f32::to_bits);
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(place);
            // Without an area it is no wall.
            if a == b || b == c || c == a {
                continue;
            }
            for (from, to) in [(a, b), (b, c), (c, a)] {
                *uses.entry([from.min(to), from.max(to)]).or_default() += 1;
            }
        }
    }
    uses.values().all(|&count| count > 1)
}

/// 1/m: white light has the colour after the distance. Without a distance nothing is absorbed.
fn absorption(output: &mut Output, row: &VolumeRow, object: &str) -> Rgb {
    let Some(distance) = &row.attenuation_distance else { return Rgb::ZERO };
    let distance = distance.f32();
    let told = row.attenuation_color.map_or(Rgb::ONE, |color| reals(color).into());
    // What is black lets through less than any picture shows, but no infinity comes of it.
    let color = told.clamp(Rgb::splat(f32::MIN_POSITIVE), Rgb::ONE);
    let is_black = told.cmpeq(Rgb::ZERO);
    let is_mended = (color.cmpne(told) & !is_black).any();
    let absorption = color.map(|part| -part.ln()) / distance;
    if is_mended || distance <= 0.0 || !absorption.is_finite() {
        note(
            output,
            object,
            format!("its {} absorbs more or less than can be; brought into range", NAMES[1]),
        );
    }
    let most = Rgb::splat(f32::MAX.sqrt());
    if distance > 0.0 { absorption.min(most) } else { Rgb::ZERO }
}
