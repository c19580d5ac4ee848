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
    // It has its own normals, or none: those of what is below are not its own.
    let mapped = |file: &mut File| {
        file.json["materials"][0]["normalTexture"] = json!({"index": 0});
    };
    let map =
        |index: u32| json!({"clearcoatFactor": 1, "clearcoatNormalTexture": {"index": index}});
    let none = json!({"clearcoatFactor": 1});
    for coat in [map(0), map(1), none.clone()] {
        for change in [&(|_: &mut File| ()) as &dyn Fn(&mut File), &mapped] {
            assert_eq!(coated(coat.clone(), change).2, "");
        }
    }
    let absent = coated(map(7), &mapped);
    assert!(absent.2.contains("drawn without a normal map") && absent.0.is_some(), "{absent:?}");
    for wrong in [json!({"index": "a"}), json!({"index": 0, "scale": "b"}), json!(3)] {
        let told = coated(json!({"clearcoatFactor": 1, "clearcoatNormalTexture": wrong}), &mapped);
        assert!(told.2.contains("normal map that cannot be read"), "{told:?}");
        assert!(told.0.is_some());
    }
    let glows = |file: &mut File| {
        file.json["materials"][0]["emissiveFactor"] = json!([1, 1, 1]);
    };
    let (_, _, told) = coated(json!({"clearcoatFactor": 1}), &glows);
    assert!(told.contains("does not darken its light"), "{told}");
}

#[test]
fn a_coat_has_normals_of_its_own_or_those_of_the_mesh() {
    let material = |coat: Value, own: Option<Value>| {
        let mut file = lamp();
        let picture = file.view(&png(2, 3, [51, 102, 0, 255]));
        file.add("images", json!({"bufferView": picture, "mimeType": "image/png"}));
        file.add("textures", json!({"source": 0}));
        file.add("samplers", json!({"wrapS": 33071}));
        file.add("textures", json!({"source": 0, "sampler": 0}));
        let uv = file.floats(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0], "VEC2");
        file.attribute("TEXCOORD_0", uv);
        file.attribute("TEXCOORD_1", uv);
        let tangents = file.floats(&[1.0, 0.0, 0.0, 1.0].repeat(3), "VEC4");
        file.attribute("TANGENT", tangents);
        file.json["extensionsUsed"] = json!(["KHR_materials_clearcoat", "KHR_texture_transform"]);
        file.json["materials"][0] = json!({"extensions": {"KHR_materials_clearcoat": coat}});
        if let Some(own) = own {
            file.json["materials"][0]["normalTexture"] = own;
        }
        let scene = file.load().unwrap();
        assert!(scene.notes.is_empty(), "{:?}", scene.notes);
        let material = scene.materials[0].clone();
        let (tangents, sets) = (&scene.meshes[0].tangents, scene.meshes[0].uv_sets.len());
        assert_eq!(!tangents.is_empty(), material.has_normal_map());
        assert_eq!(scene.requirements().normal_maps, usize::from(material.has_normal_map()));
        (material, sets)
    };
    let coat = |map: Option<Value>| match map {
        Some(map) => json!({"clearcoatFactor": 1, "clearcoatNormalTexture": map}),
        None => json!({"clearcoatFactor": 1}),
    };
    let map = |index: u32, scale: f32| Some(json!({"index": index, "scale": scale}));
    let is_apart = |own: Option<Value>, below: Option<Value>| {
        let (material, _) = material(coat(own), below);
        material.has_coat_normals()
    };
    assert!(!is_apart(None, None));
    assert!(!is_apart(map(0, 1.0), map(0, 1.0)));
    assert!(!is_apart(Some(json!({"index": 0})), map(0, 1.0)));
    assert!(is_apart(map(0, 1.0), None) && is_apart(None, map(0, 1.0)));
    assert!(is_apart(map(0, 0.5), map(0, 1.0)) && is_apart(map(0, 1.0), map(1, 1.0)));
    let moved = json!({"index": 0, "scale": 0.25, "texCoord": 1, "extensions": {
        "KHR_texture_transform": {"offset": [0.5, 0.25]}}});
    let (material, sets) = material(coat(Some(moved.clone())), Some(json!({"index": 0})));
    let coat = material.coat.unwrap();
    let used = coat.normal_texture.unwrap();
    assert_eq!((coat.normal_scale, used.uv_set, sets), (0.25, 1, 2));
    assert!(used.transform.is_some() && material.has_coat_normals());
}
