//! Clear coats: `KHR_materials_clearcoat`.

use crate::files::{File, lamp, png};
use serde_json::{Value, json};

#[test]
fn a_clear_coat_is_compiled() {
    let coated = |coat: Value, change: &dyn Fn(&mut File)| {
        let mut file = lamp();
        let picture = file.view(&png(2, 3, [51, 102, 0, 255]));
        file.add("images", json!({"bufferView": picture, "mimeType": "image/png"}));
        file.add("textures", json!({"source": 0}));
        file.add("textures", json!({"source": 0}));
        let uv = file.floats(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0], "VEC2");
        file.attribute("TEXCOORD_0", uv);
        file.json["materials"][0] = json!({"extensions": {"KHR_materials_clearcoat": coat}});
        change(&mut file);
        let scene = file.load().unwrap();
        let told: Vec<String> = scene.notes.iter().map(|note| note.text.clone()).collect();
        let coat = scene.materials[0].coat;
        let sizes = coat.map(|coat| (coat.factor, coat.roughness));
        let maps = coat.map(|coat| [coat.factor_texture, coat.roughness_texture]);
        assert_eq!(scene.requirements().coats, usize::from(coat.is_some()));
        (sizes, maps.unwrap_or_default().map(|map| map.is_some()), told.join("; "))
    };
    let plain = |coat: Value| coated(coat, &|_| ());
    let none = [false; 2];
    assert_eq!(plain(json!({})), (None, none, String::new()));
    assert_eq!(plain(json!({"clearcoatFactor": 0.5})), (Some((0.5, 0.0)), none, String::new()));
    let textured = json!({"clearcoatFactor": 1, "clearcoatTexture": {"index": 0},
        "clearcoatRoughnessFactor": 0.25, "clearcoatRoughnessTexture": {"index": 0}});
    assert_eq!(plain(textured), (Some((1.0, 0.25)), [true; 2], String::new()));
    let (coat, _, told) = plain(json!({"clearcoatFactor": 3, "clearcoatRoughnessFactor": -1}));
    assert_eq!(coat, Some((1.0, 0.0)));
    assert!(told.contains("out of their range"), "{told}");
    let (coat, _, told) = plain(json!({"clearcoatFactor": "much"}));
    assert!(coat.is_none() && told.contains("cannot be read"), "{told}");
    let absent = json!({"clearcoatFactor": 0.5, "clearcoatTexture": {"index": 7}});
    let (coat, maps, told) = plain(absent);
    assert_eq!((coat, maps), (Some((0.5, 0.0)), none));
    assert!(told.contains("texture 7 is not in the file"), "{told}");
    // It has the normals of what is below, and should have: its own, or none.
    let mapped = |file: &mut File| {
        file.json["materials"][0]["normalTexture"] = json!({"index": 0});
    };
    let map =
        |index: u32| json!({"clearcoatFactor": 1, "clearcoatNormalTexture": {"index": index}});
    assert_eq!(coated(map(0), &mapped).2, "");
    for (coat, change) in [
        (map(0), &(|_: &mut File| ()) as &dyn Fn(&mut File)),
        (map(1), &mapped),
        (json!({"clearcoatFactor": 1}), &mapped),
    ] {
        assert!(coated(coat, change).2.contains("other normals"));
    }
    let glows = |file: &mut File| {
        file.json["materials"][0]["emissiveFactor"] = json!([1, 1, 1]);
    };
    let (_, _, told) = coated(json!({"clearcoatFactor": 1}), &glows);
    assert!(told.contains("does not darken its light"), "{told}");
}
