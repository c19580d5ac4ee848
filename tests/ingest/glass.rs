//! Glass: `KHR_materials_transmission`, `KHR_materials_volume`, `KHR_materials_ior`.

use crate::files::{File, lamp, png};
use candelabra::math::color::Rgb;
use candelabra::scene::{Category, Material, Transmission, Volume};
use serde_json::{Value, json};

/// Gives the lamp a back.
fn closed(file: &mut File) {
    let bytes: Vec<u8> = [0u16, 1, 2, 0, 2, 1].iter().flat_map(|i| i.to_le_bytes()).collect();
    let indices = file.array(&bytes, 5123, 6, "SCALAR");
    file.json["meshes"][0]["primitives"][0]["indices"] = json!(indices);
}

/// A material with some extensions, and what is noted of it.
fn material(extensions: Value) -> (Material, String) {
    let mut file: File = lamp();
    let picture = file.view(&png(2, 3, [51, 102, 0, 255]));
    file.add("images", json!({"bufferView": picture, "mimeType": "image/png"}));
    file.add("textures", json!({"source": 0}));
    let uv = file.floats(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0], "VEC2");
    file.attribute("TEXCOORD_0", uv);
    closed(&mut file);
    file.json["materials"][0] = json!({"extensions": extensions});
    let scene = file.load().unwrap();
    let told: Vec<String> = scene.notes.iter().map(|note| note.text.clone()).collect();
    let needs = scene.requirements();
    let material = scene.materials[0].clone();
    let is_solid = material.transmission.is_some_and(|passes| passes.volume.is_some());
    let counts = (usize::from(material.transmission.is_some()), usize::from(is_solid));
    assert_eq!((needs.glass, needs.solid_glass), counts);
    (material, told.join("; "))
}

/// The same of a transmission and a volume.
fn glass(transmission: Value, volume: Value) -> (Option<Transmission>, String) {
    let (material, told) = material(json!({
        "KHR_materials_transmission": transmission, "KHR_materials_volume": volume,
    }));
    (material.transmission, told)
}

#[test]
fn glass_is_compiled() {
    let thin = |factor| Some(Transmission { factor, factor_texture: None, volume: None });
    assert_eq!(glass(json!({}), json!({})), (None, String::new()));
    assert_eq!(glass(json!({}), json!({"thicknessFactor": 1})), (None, String::new()));
    let half = json!({"transmissionFactor": 0.5});
    assert_eq!(glass(half.clone(), json!({})), (thin(0.5), String::new()));
    let zero = json!({"thicknessFactor": 0, "attenuationDistance": 1});
    assert_eq!(glass(half.clone(), zero), (thin(0.5), String::new()));
    let textured = json!({"transmissionFactor": 1, "transmissionTexture": {"index": 0}});
    let (passes, told) = glass(textured, json!({}));
    assert!(passes.unwrap().factor_texture.is_some() && told.is_empty());
    // A volume that absorbs nothing, and one that leaves its colour after its distance.
    let absorption = |volume: Value| {
        let (passes, told) = glass(half.clone(), volume);
        (passes.unwrap().volume.map(|Volume { absorption }| absorption), told)
    };
    let clear = (Some(Rgb::ZERO), String::new());
    assert_eq!(absorption(json!({"thicknessFactor": 2})), clear);
    assert_eq!(
        absorption(json!({"thicknessFactor": 2, "attenuationColor": [0.1, 0.2, 0.3]})),
        clear
    );
    let (found, told) = absorption(json!({
        "thicknessFactor": 1, "attenuationDistance": 0.25, "attenuationColor": [0.5, 1, 0],
    }));
    let left = (-0.25 * found.unwrap()).exp();
    assert!((left - Rgb::new(0.5, 1.0, 0.0)).abs().max_element() < 1e-6 && told.is_empty());
    let (diamond, told) = material(json!({
        "KHR_materials_transmission": {"transmissionFactor": 1}, "KHR_materials_ior": {"ior": 2.4},
        "KHR_materials_dispersion": {"dispersion": 1},
    }));
    assert!(diamond.ior == 2.4 && told.ends_with("KHR_materials_dispersion is not read"), "{told}");
}

#[test]
fn glass_that_cannot_be_is_mended() {
    let (passes, told) = glass(json!({"transmissionFactor": 3}), json!({}));
    assert!(passes.unwrap().factor == 1.0 && told.contains("out of their range"), "{told}");
    let (passes, told) = glass(json!({"transmissionFactor": "much"}), json!({}));
    assert!(passes.is_none() && told.contains("cannot be read"), "{told}");
    let whole = json!({"transmissionFactor": 1});
    let (passes, told) = glass(whole.clone(), json!({"thicknessFactor": "thick"}));
    assert!(passes.unwrap().volume.is_none() && told.contains("cannot be read"), "{told}");
    let (passes, told) = glass(whole.clone(), json!({"thicknessFactor": -1}));
    assert!(passes.unwrap().volume.is_none() && told.contains("negative thickness"), "{told}");
    let absent = json!({"transmissionFactor": 1, "transmissionTexture": {"index": 7}});
    let (passes, told) = glass(absent, json!({}));
    assert!(passes.unwrap().factor_texture.is_none());
    assert!(told.contains("texture 7 is not in the file"), "{told}");
    for (distance, color) in [(0.0, 0.5), (-1.0, 0.5), (1.0, 2.0), (1.0, -1.0), (1e-38, 0.5)] {
        let volume = json!({
            "thicknessFactor": 1, "attenuationDistance": distance, "attenuationColor": [color, 1, 1],
        });
        let (passes, told) = glass(whole.clone(), volume);
        let absorption = passes.unwrap().volume.unwrap().absorption;
        assert!(absorption.is_finite() && absorption.min_element() >= 0.0, "{absorption}");
        assert_eq!(
            told.contains("absorbs"),
            distance <= 0.0 || !(0.0..=1.0).contains(&color),
            "{told}"
        );
    }
}

/// The primitives of a mesh close each other; those of another mesh do not, though they share the material.
#[test]
fn solid_glass_that_is_not_closed_is_thin() {
    let mut file: File = lamp();
    file.json["materials"][0] = json!({"extensions": {
        "KHR_materials_transmission": {"transmissionFactor": 1},
        "KHR_materials_volume": {"thicknessFactor": 1},
    }});
    // A tetrahedron without common vertices, but for the face that the lamp is.
    let [o, x, y, z] = [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-0.0, 0.0, 1.0]];
    let walls: Vec<f32> = [o, z, x, o, y, z, x, z, y].into_iter().flatten().collect();
    let positions = file.floats(&walls, "VEC3");
    let face = file.json["meshes"][0]["primitives"][0].clone();
    let walls = json!({"attributes": {"POSITION": positions}, "material": 0});
    let mesh = |name: &str, primitives: &[&Value]| json!({"name": name, "primitives": primitives});
    file.json["meshes"] =
        json!(
            [mesh("whole", &[&face, &walls]), mesh("window", &[&face]), mesh("tent", &[&walls]),]
        );
    file.json["nodes"] = json!([0, 1, 2].map(|row| json!({"name": row.to_string(), "mesh": row})));
    file.json["scenes"][0]["nodes"] = json!([0, 1, 2]);
    let scene = file.load().unwrap();
    let is_solid = |mesh: u32| scene.material_of(mesh).unwrap().is_solid_glass();
    let solid: Vec<bool> = scene.instances.iter().map(|instance| is_solid(instance.mesh)).collect();
    assert_eq!(solid, [true, true, false, false]);
    assert!(scene.materials.iter().all(|material| material.transmission.is_some()));
    assert_eq!(scene.materials.len(), 2);
    let told = scene.notes.iter().find(|note| note.text.contains("not closed")).unwrap();
    let named = ["whole", "window", "tent"].map(|name| told.text.contains(name));
    assert!(told.category == Category::Materials && named == [false, true, true], "{told}");
}
