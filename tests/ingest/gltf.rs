//! What glTF can say, compiled.

use crate::files::{lamp, png};
use candelabra::scene::{
    AlphaMode, Channel, Interpolation, LightKind, Pixels, TextureUse, Trs, Wrap,
};
use candelabra::scene::{Note, Shaping};
use glam::{DVec3, Vec2, Vec3, Vec4};
use serde_json::json;
use std::f32::consts::{FRAC_1_SQRT_2, FRAC_PI_2, FRAC_PI_4};

const NO_NOTES: [Note; 0] = [];

#[test]
fn a_binary_file_is_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lamp.glb");
    std::fs::write(&path, lamp().glb()).unwrap();
    let (binary, text) = (candelabra::ingest::load(&path).unwrap(), lamp().load().unwrap());
    assert_eq!(binary.meshes[0].positions, text.meshes[0].positions);
    assert_eq!(binary.meshes[0].triangles, [[0, 1, 2]]);
    assert_eq!(binary.materials, text.materials);
    assert_eq!(binary.source, path);
}

#[test]
fn paths_follow_the_hierarchy_and_are_unique() {
    let mut file = lamp();
    file.add("nodes", json!({"name": "World", "children": [0, 2, 3]}));
    file.add("nodes", json!({"name": "lamp", "mesh": 0}));
    file.add("nodes", json!({"mesh": 0}));
    file.json["scenes"][0]["nodes"] = json!([1]);
    let scene = file.load().unwrap();
    let paths: Vec<&str> = scene.nodes.iter().map(|node| &*node.path).collect();
    assert_eq!(paths, ["/World", "/World/lamp", "/World/lamp_2", "/World/node_3"]);
    assert_eq!(scene.instances.len(), 3);
    assert_eq!(scene.meshes.len(), 1, "nodes share the mesh");
}

#[test]
fn usd_paths_are_the_prims() {
    let mut file = lamp();
    let primitive = file.json["meshes"][0]["primitives"][0].clone();
    file.json["meshes"][0]["primitives"] = json!([primitive, primitive]);
    file.json["meshes"][0]["primitives"][1]["extras"] = json!({"usdPath": "/Other/Mesh/subset"});
    file.json["nodes"][0]["extras"] = json!({"usdPath": "/World/Mesh"});
    file.add("nodes", json!({"name": "b", "mesh": 0}));
    file.json["scenes"][0]["nodes"] = json!([0, 1]);
    let scene = file.load().unwrap();
    let paths: Vec<&str> = scene.instances.iter().map(|i| &*i.path).collect();
    assert_eq!(paths, ["/World/Mesh/prim_0", "/World/Mesh/subset", "/b/prim_0", "/b/subset"]);
}

#[test]
fn without_a_scene_every_root_counts() {
    let mut file = lamp();
    file.add("nodes", json!({"mesh": 0}));
    file.json.as_object_mut().unwrap().remove("scenes");
    file.json.as_object_mut().unwrap().remove("scene");
    assert_eq!(file.load().unwrap().instances.len(), 2);
}

#[test]
fn transforms_are_read_as_they_are() {
    let mut file = lamp();
    file.json["nodes"][0]["translation"] = json!([1, 2, 3]);
    file.json["nodes"][0]["scale"] = json!([-1, 1, 1]);
    let scene = file.load().unwrap();
    let Trs::Parts { translation, scale, .. } = scene.nodes[0].local else { panic!() };
    assert_eq!((translation, scale), (DVec3::new(1.0, 2.0, 3.0), DVec3::new(-1.0, 1.0, 1.0)));
    let mut file = lamp();
    file.json["nodes"][0]["matrix"] = json!([0, 2, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1]);
    let world = file.load().unwrap().pose_at(0.0).world(0);
    assert_eq!(world.transform_point3(Vec3::X), Vec3::new(5.0, 8.0, 7.0));
}

#[test]
fn large_translations_keep_their_small_part() {
    let mut file = lamp();
    file.json["nodes"][0]["translation"] = json!([1e9 + 0.125, 0, 0]);
    // What stands out there is counted from an origin out there.
    let scene = file.load().unwrap();
    let place = scene.pose_at(0.0).world(0).translation.as_dvec3() + scene.origin;
    assert_eq!(place, DVec3::new(1e9 + 0.125, 0.0, 0.0));
    // What a child takes back is taken back exactly.
    file.json["nodes"][0]["children"] = json!([1]);
    file.json["nodes"][0].as_object_mut().unwrap().remove("mesh");
    file.add("nodes", json!({"mesh": 0, "translation": [-1e9, 0, 0]}));
    let scene = file.load().unwrap();
    assert_eq!(scene.origin, DVec3::ZERO);
    assert_eq!(scene.pose_at(0.0).world(1).translation, Vec3::new(0.125, 0.0, 0.0).into());
}

#[test]
fn gpu_instances_become_nodes() {
    let mut file = lamp();
    let places = file.floats(&[1.0, 0.0, 0.0, 2.0, 0.0, 0.0], "VEC3");
    let turns = file.array(&[0, 0, 0, 127, 0, 0, 127, 0], 5120, 2, "VEC4");
    file.json["accessors"][turns]["normalized"] = json!(true);
    file.json["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing": {
        "attributes": {"TRANSLATION": places, "ROTATION": turns},
    }});
    let scene = file.load().unwrap();
    let paths: Vec<&str> = scene.instances.iter().map(|i| &*i.path).collect();
    assert_eq!(paths, ["/lamp[0]", "/lamp[1]"]);
    assert_eq!(scene.meshes.len(), 1);
    let world = scene.pose_at(0.0).world(scene.instances[1].node);
    assert!(world.transform_point3(Vec3::X).distance(Vec3::new(1.0, 0.0, 0.0)) < 1e-6);
}

#[test]
fn hidden_nodes_are_left_out_with_their_children() {
    let mut file = lamp();
    file.add(
        "nodes",
        json!({
            "children": [0], "extensions": {"KHR_node_visibility": {"visible": false}},
        }),
    );
    file.json["scenes"][0]["nodes"] = json!([1]);
    let scene = file.load().unwrap();
    assert!(scene.instances.is_empty());
    assert!(scene.notes[0].text.contains("node 0 \"lamp\""), "{:?}", scene.notes);
}

#[test]
fn quantized_attributes_mean_what_they_say() {
    let mut file = lamp();
    file.json["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
    let shorts = |values: &[i16]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    // Three components and padding: attributes are aligned to four bytes.
    let positions = shorts(&[0, 0, 0, 0, 32767, 0, 0, 0, 0, -32768, 0, 0]);
    let positions = file.array(&positions, 5122, 3, "VEC3");
    file.json["accessors"][positions]["normalized"] = json!(true);
    let view = file.json["accessors"][positions]["bufferView"].as_u64().unwrap() as usize;
    file.json["bufferViews"][view]["byteStride"] = json!(8);
    file.attribute("POSITION", positions);
    let colors = file.array(&[255, 0, 51, 0, 0, 255, 0, 0, 0, 0, 255, 0], 5121, 3, "VEC3");
    file.json["accessors"][colors]["normalized"] = json!(true);
    let view = file.json["accessors"][colors]["bufferView"].as_u64().unwrap() as usize;
    file.json["bufferViews"][view]["byteStride"] = json!(4);
    file.attribute("COLOR_0", colors);
    let mesh = &file.load().unwrap().meshes[0];
    assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::NEG_Y]);
    assert_eq!(mesh.colors[0], Vec4::new(1.0, 0.0, 0.2, 1.0));
}

#[test]
fn sparse_accessors_override_their_base() {
    let mut file = lamp();
    let indices = file.view(&1u16.to_le_bytes());
    let values: Vec<u8> = [0.5f32, 0.25, 0.0].iter().flat_map(|v| v.to_le_bytes()).collect();
    let values = file.view(&values);
    let sparse = json!({
        "count": 1,
        "indices": {"bufferView": indices, "componentType": 5123},
        "values": {"bufferView": values},
    });
    file.json["accessors"][0]["sparse"] = sparse.clone();
    let mesh = &file.load().unwrap().meshes[0];
    assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::new(0.5, 0.25, 0.0), Vec3::Y]);
    // Without a base the others are zero.
    let base = json!({"componentType": 5126, "type": "VEC3", "count": 3});
    file.json["accessors"][0] = base;
    file.json["accessors"][0]["sparse"] = sparse;
    let mesh = &file.load().unwrap().meshes[0];
    assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::new(0.5, 0.25, 0.0), Vec3::ZERO]);
}

#[test]
fn strips_and_unindexed_triangles_are_triangles() {
    let mut file = lamp();
    file.json["meshes"][0]["primitives"][0]["mode"] = json!(5);
    let quad = file.floats(&[0., 0., 0., 1., 0., 0., 0., 1., 0., 1., 1., 0.], "VEC3");
    file.attribute("POSITION", quad);
    file.json["meshes"][0]["primitives"][0].as_object_mut().unwrap().remove("indices");
    assert_eq!(file.load().unwrap().meshes[0].triangles, [[0, 1, 2], [1, 3, 2]]);
    file.json["meshes"][0]["primitives"][0]["mode"] = json!(1);
    let scene = file.load().unwrap();
    assert!(scene.instances.is_empty());
    assert!(scene.notes[0].text.contains("mesh 0 \"flame\""), "{:?}", scene.notes);
}

#[test]
fn materials_are_compiled() {
    let mut file = lamp();
    file.json["materials"][0] = json!({
        "pbrMetallicRoughness": {
            "baseColorFactor": [0.1, 0.2, 0.3, 0.5], "metallicFactor": 0.25, "roughnessFactor": 0.75,
        },
        "alphaMode": "MASK", "alphaCutoff": 0.25, "doubleSided": true,
        "extensions": {
            "KHR_materials_ior": {"ior": 1.33},
            "KHR_materials_specular": {"specularFactor": 0.5, "specularColorFactor": [1, 0.5, 2]},
            "KHR_materials_sheen": {},
        },
    });
    let scene = file.load().unwrap();
    let material = &scene.materials[0];
    assert_eq!(material.base_color, Vec3::new(0.1, 0.2, 0.3));
    assert_eq!((material.opacity, material.alpha_mode), (0.5, AlphaMode::Mask(0.25)));
    assert_eq!((material.metallic, material.roughness, material.ior), (0.25, 0.75, 1.33));
    assert_eq!((material.specular, material.specular_color), (0.5, Vec3::new(1.0, 0.5, 2.0)));
    assert!(material.double_sided && !material.emits());
    let told: Vec<String> = scene.notes.iter().map(ToString::to_string).collect();
    assert_eq!(told, ["materials: material 0: KHR_materials_sheen is not read"]);
}

#[test]
fn specular_and_glossiness_are_a_dielectric_of_the_same_reflection() {
    let mut file = lamp();
    let extension = "KHR_materials_pbrSpecularGlossiness";
    file.json["materials"][0] = json!({"extensions": {extension: {
        "diffuseFactor": [0.8, 0.4, 0.2, 0.5], "specularFactor": [0.52, 0.28, 0.04], "glossinessFactor": 0.75,
    }}});
    let scene = file.load().unwrap();
    let material = &scene.materials[0];
    // (1 - 0.52) / (1 - 0.04) is one half.
    assert!(material.base_color.abs_diff_eq(Vec3::new(0.4, 0.2, 0.1), 1e-6), "{material:?}");
    assert!(material.specular_color.abs_diff_eq(Vec3::new(13.0, 7.0, 1.0), 1e-4), "{material:?}");
    assert_eq!((material.opacity, material.roughness, material.metallic), (0.5, 0.25, 0.0));
    assert_eq!(scene.notes, NO_NOTES);
}

#[test]
fn textures_of_specular_and_glossiness_are_read_each_texel_by_its_own() {
    let mut file = lamp();
    let extension = "KHR_materials_pbrSpecularGlossiness";
    let pictures =
        [[188, 188, 188, 255], [255, 188, 0, 51]].map(|color| file.view(&png(2, 3, color)));
    for (number, picture) in pictures.into_iter().enumerate() {
        file.add("images", json!({"bufferView": picture, "mimeType": "image/png"}));
        file.add("textures", json!({"source": number}));
    }
    let uv = file.floats(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0], "VEC2");
    file.attribute("TEXCOORD_0", uv);
    let glossy = json!({
        "diffuseTexture": {"index": 0}, "specularGlossinessTexture": {"index": 1}, "specularFactor": [0.5, 0.5, 0.5],
    });
    file.json["materials"][0] = json!({"extensions": {extension: glossy}});
    let scene = file.load().unwrap();
    let material = &scene.materials[0];
    let texel =
        |used: Option<TextureUse>| scene.textures[used.unwrap().texture as usize].texel(0, 0);
    let tint = texel(material.specular_color_texture).truncate() * material.specular_color * 0.04;
    assert!(tint.abs_diff_eq(Vec3::new(0.5, 0.25, 0.0), 2e-3), "{tint}");
    let rough = texel(material.metallic_roughness_texture).y * material.roughness;
    assert!((rough - 0.8).abs() < 3e-3, "{rough}");
    let base = texel(material.base_color_texture).x * material.base_color.x;
    assert!((base - 0.5 * 0.5 / 0.96).abs() < 5e-3, "{base}");
    assert_eq!(scene.notes, NO_NOTES);
    // Without a diffuse texture the diffuse part is the factor's.
    let of_material = &mut file.json["materials"][0]["extensions"][extension];
    of_material.as_object_mut().unwrap().remove("diffuseTexture");
    of_material["diffuseFactor"] = json!([0.2, 0.2, 0.2, 1.0]);
    let scene = file.load().unwrap();
    let material = &scene.materials[0];
    let used = material.base_color_texture.unwrap().texture as usize;
    let base = scene.textures[used].texel(0, 0).x * material.base_color.x;
    assert!((base - 0.2 * 0.5 / 0.96).abs() < 5e-3, "{base}");
    // Where they do not lie alike, that is said.
    let of_material = &mut file.json["materials"][0]["extensions"][extension];
    of_material["diffuseTexture"] = json!({"index": 0, "texCoord": 1});
    let scene = file.load().unwrap();
    let told: Vec<String> = scene.notes.iter().map(ToString::to_string).collect();
    assert!(told.iter().any(|note| note.contains("different coordinates")), "{told:?}");
}

#[test]
fn a_picture_used_as_colour_and_as_numbers_is_two_textures() {
    let mut file = lamp();
    let picture = file.view(&png(2, 3, [10, 20, 30, 255]));
    file.add("images", json!({"bufferView": picture, "mimeType": "image/png", "name": "p"}));
    file.add("images", json!({"bufferView": picture, "mimeType": "image/png", "name": "unused"}));
    file.add("samplers", json!({"magFilter": 9728, "wrapS": 33071, "wrapT": 33648}));
    file.add("textures", json!({"source": 0}));
    file.add("textures", json!({"source": 0, "sampler": 0}));
    file.add("textures", json!({"source": 1}));
    let transform = json!({"offset": [0.5, 0.25], "rotation": FRAC_PI_2, "scale": [2, 3]});
    file.json["materials"][0]["emissiveTexture"] =
        json!({"index": 0, "extensions": {"KHR_texture_transform": transform}});
    file.json["materials"][0]["pbrMetallicRoughness"] = json!({
        "baseColorTexture": {"index": 0},
        "metallicRoughnessTexture": {"index": 1, "texCoord": 1},
    });
    let uv = file.floats(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0], "VEC2");
    file.attribute("TEXCOORD_0", uv);
    file.attribute("TEXCOORD_1", uv);
    let scene = file.load().unwrap();
    assert_eq!(scene.textures.len(), 2);
    let material = &scene.materials[0];
    let (color, emission) =
        (material.base_color_texture.unwrap(), material.emission_texture.unwrap());
    assert_eq!(color.texture, emission.texture);
    let number = material.metallic_roughness_texture.unwrap();
    let (color, numbers) =
        (&scene.textures[color.texture as usize], &scene.textures[number.texture as usize]);
    assert!(matches!(&color.pixels, Pixels::Srgb8(texels) if texels.len() == 6));
    assert!(matches!(&numbers.pixels, Pixels::Linear8(texels) if texels[5] == [10, 20, 30, 255]));
    assert_eq!((color.width, color.height, color.bilinear), (2, 3, true));
    assert_eq!((numbers.wrap, numbers.bilinear), ([Wrap::Clamp, Wrap::Mirror], false));
    assert_eq!((number.uv_set, scene.meshes[0].uv_sets.len()), (1, 2));
    // Scaled, turned counter-clockwise in a space whose v points down, then moved.
    let moved = emission.map(Vec2::new(1.0, 0.0));
    assert!(moved.distance(Vec2::new(0.5, 0.25 - 2.0)) < 1e-6, "{moved}");
    assert_eq!(scene.notes, NO_NOTES);
}

#[test]
fn formats_that_are_not_read_are_noted() {
    let mut file = lamp();
    let picture = file.view(b"RIFF\x1a\0\0\0WEBPVP8L");
    file.add("images", json!({"bufferView": picture, "mimeType": "image/webp"}));
    file.add("textures", json!({"source": 0}));
    file.add("textures", json!({"extensions": {"KHR_texture_basisu": {"source": 0}}}));
    file.json["materials"][0]["emissiveTexture"] = json!({"index": 0});
    file.json["materials"][0]["normalTexture"] = json!({"index": 1});
    let scene = file.load().unwrap();
    assert_eq!(scene.materials[0].emission_texture, None);
    assert_eq!(scene.notes.len(), 2, "{:?}", scene.notes);
}

#[test]
fn punctual_lights_keep_their_units() {
    let kind = |light: serde_json::Value| {
        let mut file = lamp();
        file.light(light);
        let scene = file.load().unwrap();
        assert_eq!(scene.light_path(0), "/lamp");
        assert_eq!(scene.instance_path(0), "/lamp/mesh", "paths are unique");
        (scene.lights[0].kind.clone(), scene.lights[0].range_m)
    };
    let (point, range) = kind(json!({"type": "point", "color": [1, 0.5, 0], "intensity": 4}));
    let intensity_cd = Vec3::new(4.0, 2.0, 0.0);
    assert_eq!((point, range), (LightKind::Point { intensity_cd }, None));
    let (spot, range) = kind(json!({"type": "spot", "range": 7, "spot": {}}));
    let shaping = Shaping::Khr { inner_rad: 0.0, outer_rad: FRAC_PI_4 };
    assert_eq!((spot, range), (LightKind::Spot { intensity_cd: Vec3::ONE, shaping }, Some(7.0)));
    let (sun, range) = kind(json!({"type": "directional", "intensity": 3.0, "range": 7}));
    let sun_expected = LightKind::Distant { irradiance_lux: Vec3::splat(3.0), angle_rad: 0.0 };
    assert_eq!((sun, range), (sun_expected, None));
}

#[test]
fn animations_become_channels() {
    let mut file = lamp();
    let times = file.times(&[0.0, 2.0]);
    let moves = file.floats(&[0.0, 0.0, 0.0, 2.0, 0.0, 0.0], "VEC3");
    let turns = file.array(&[0, 0, 0, 127, 0, 0, 90, 90], 5120, 2, "VEC4");
    file.json["accessors"][turns]["normalized"] = json!(true);
    let scales: Vec<f32> = (0..18).map(|i| i as f32).collect();
    let scales = file.floats(&scales, "VEC3");
    file.add(
        "animations",
        json!({
            "samplers": [
                {"input": times, "output": moves},
                {"input": times, "output": turns, "interpolation": "STEP"},
                {"input": times, "output": scales, "interpolation": "CUBICSPLINE"},
            ],
            "channels": [
                {"sampler": 0, "target": {"path": "pointer", "extensions": {
                    "KHR_animation_pointer": {"pointer": "/nodes/0/translation"}}}},
                {"sampler": 1, "target": {"node": 0, "path": "rotation"}},
                {"sampler": 2, "target": {"node": 0, "path": "scale"}},
                {"sampler": 0, "target": {"path": "pointer", "extensions": {
                    "KHR_animation_pointer": {"pointer": "/materials/0/pbrMetallicRoughness/x"}}}},
            ],
        }),
    );
    let scene = file.load().unwrap();
    let [Channel::Translation(moves), Channel::Rotation(turns), Channel::Scale(scales)] =
        &scene.nodes[0].channels[..]
    else {
        panic!("{:?}", scene.nodes[0].channels);
    };
    assert_eq!((&moves.times_s[..], moves.values[1]), (&[0.0, 2.0][..], Vec3::new(2.0, 0.0, 0.0)));
    assert_eq!(turns.interpolation, Interpolation::Step);
    assert!((turns.values[1].w - FRAC_1_SQRT_2).abs() < 1e-3, "{}", turns.values[1]);
    assert_eq!((scales.interpolation, scales.values.len()), (Interpolation::Cubic, 6));
    assert_eq!(scene.pose_at(1.0).world(0).translation, Vec3::X.into());
    assert_eq!(scene.notes.len(), 1);
    assert!(
        scene.notes[0].text.contains("/materials/0/pbrMetallicRoughness/x"),
        "{:?}",
        scene.notes
    );
}

#[test]
fn vertices_of_a_shared_list_are_picked() {
    let mut file = lamp();
    let many: Vec<f32> = (0..300).map(|i| i as f32).collect();
    let many = file.floats(&many, "VEC3");
    file.attribute("POSITION", many);
    let indices: Vec<u8> = [90u16, 10, 50].iter().flat_map(|i| i.to_le_bytes()).collect();
    let indices = file.array(&indices, 5123, 3, "SCALAR");
    file.json["meshes"][0]["primitives"][0]["indices"] = json!(indices);
    let mesh = &file.load().unwrap().meshes[0];
    assert_eq!(mesh.positions.len(), 3);
    assert_eq!(mesh.positions[mesh.triangles[0][0] as usize], Vec3::new(270.0, 271.0, 272.0));
}
