//! One broken rule a file, and the object that the error names.

use crate::files;
use crate::files::{File, lamp};
use serde_json::json;

/// Breaks one rule of the lamp; the error must name the object and speak of the problem.
fn refuses(object: &str, problem: &str, damage: impl FnOnce(&mut File)) {
    let mut file = lamp();
    damage(&mut file);
    let error = file.load().err().unwrap_or_else(|| panic!("loads in spite of: {problem}"));
    assert!(error.object.contains(object), "object {object:?} is not in: {error}");
    assert!(error.problem.contains(problem), "problem {problem:?} is not in: {error}");
    assert!(!error.remedy.is_empty());
    assert!(error.to_string().contains("scene.gltf"));
}

fn primitive(file: &mut File) -> &mut serde_json::Value {
    &mut file.json["meshes"][0]["primitives"][0]
}

#[test]
fn the_lamp_itself_is_good() {
    let scene = lamp().load().unwrap();
    assert_eq!(scene.instances[0].path, "/lamp");
    assert_eq!(scene.materials[0].emission_nits.to_array(), [8.0, 4.0, 2.0]);
    assert_eq!(scene.notes, []);
}

#[test]
fn versions_and_extensions() {
    refuses("asset", "version \"1.0\"", |f| f.json["asset"]["version"] = json!("1.0"));
    refuses("asset", "version \"2.1\"", |f| f.json["asset"]["minVersion"] = json!("2.1"));
    refuses("asset", "missing", |f| drop(f.json.as_object_mut().unwrap().remove("asset")));
    refuses("extensionsRequired", "KHR_draco_mesh_compression", |f| {
        f.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
    });
    let mut fine = lamp();
    fine.json["extensionsRequired"] = json!(["KHR_texture_transform", "EXT_mesh_gpu_instancing"]);
    fine.load().unwrap();
}

#[test]
fn references_lead_somewhere() {
    refuses("node 0 \"lamp\"", "mesh 7", |f| f.json["nodes"][0]["mesh"] = json!(7));
    refuses("node 0", "camera 0, but the file has none", |f| {
        f.json["nodes"][0]["camera"] = json!(0);
    });
    refuses("scene 0", "node 9", |f| f.json["scenes"][0]["nodes"] = json!([9]));
    refuses("mesh 0 \"flame\"", "accessor 5", |f| primitive(f)["indices"] = json!(5));
    refuses("mesh 0", "material 1", |f| primitive(f)["material"] = json!(1));
    refuses("mesh 0", "invalid value", |f| primitive(f)["material"] = json!(-1));
    refuses("node 0", "invalid value 4294967296", |f| {
        f.json["nodes"][0]["mesh"] = json!(1u64 << 32);
    });
    refuses("mesh 0", "invalid value 4294967296", |f| {
        primitive(f)["attributes"]["POSITION"] = json!(1u64 << 32);
    });
    refuses("mesh 0", "accessor 9", |f| primitive(f)["targets"] = json!([{"COLOR_0": 9}]));
    refuses("buffer view 1", "buffer 3", |f| f.json["bufferViews"][1]["buffer"] = json!(3));
    refuses("accessor 1", "buffer view 8", |f| f.json["accessors"][1]["bufferView"] = json!(8));
    refuses("material 0 \"glow\"", "texture 0", |f| {
        f.json["materials"][0]["emissiveTexture"] = json!({"index": 0});
    });
    refuses("node 0", "light 0", |f| {
        f.json["nodes"][0]["extensions"] = json!({"KHR_lights_punctual": {"light": 0}});
    });
}

#[test]
fn nodes_are_a_forest() {
    refuses("node 1", "its own ancestor", |f| {
        f.add("nodes", json!({"children": [2]}));
        f.add("nodes", json!({"children": [1]}));
    });
    refuses("node 0", "its own ancestor", |f| {
        f.json["nodes"][0]["children"] = json!([0]);
        f.json["scenes"][0]["nodes"] = json!([]);
    });
    refuses("node 0", "child of two nodes", |f| {
        f.add("nodes", json!({"children": [0]}));
        f.add("nodes", json!({"children": [0]}));
    });
    refuses("scene 0", "has a parent", |f| {
        f.add("nodes", json!({"children": [0]}));
    });
    refuses("node", "more than 512 ancestors", |f| {
        let last = 100_000;
        let nodes = (0..last).map(|i| json!({"children": [i + 1]}));
        f.json["nodes"] = nodes.chain([json!({"mesh": 0})]).collect();
    });
}

#[test]
fn transforms_can_be_composed() {
    refuses("node 0", "unit quaternion", |f| f.json["nodes"][0]["rotation"] = json!([0, 0, 0, 0]));
    refuses("node 0", "unit quaternion", |f| f.json["nodes"][0]["rotation"] = json!([0, 2, 0, 0]));
    refuses("node 0", "too large", |f| f.json["nodes"][0]["translation"] = json!([1e300, 0, 0]));
    refuses("node 0", "both a matrix", |f| {
        f.json["nodes"][0]["matrix"] = json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
        f.json["nodes"][0]["scale"] = json!([1, 1, 1]);
    });
    refuses("/lamp", "farther than", |f| f.json["nodes"][0]["scale"] = json!([1e20, 1, 1]));
    refuses("/lamp/node_1", "farther than", |f| {
        f.json["nodes"][0]["scale"] = json!([1e30, 1, 1]);
        f.json["nodes"][0]["children"] = json!([1]);
        f.json["nodes"][0].as_object_mut().unwrap().remove("mesh");
        f.add("nodes", json!({"translation": [1e30, 0, 0]}));
    });
    refuses("node 0", "not affine", |f| {
        f.json["nodes"][0]["matrix"] = json!([1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
    });
}

#[test]
fn arrays_are_inside_their_buffers() {
    refuses("accessor 0", "do not fit", |f| f.json["accessors"][0]["count"] = json!(4));
    refuses("accessor 0", "elements", |f| f.json["accessors"][0]["count"] = json!(0));
    refuses("accessor 0", "elements", |f| f.json["accessors"][0]["count"] = json!(u64::MAX));
    refuses("accessor 0", "do not fit", |f| {
        f.json["accessors"][0]["byteOffset"] = json!(u64::MAX - 3);
    });
    refuses("accessor 0", "not aligned", |f| f.json["accessors"][0]["byteOffset"] = json!(1));
    refuses("accessor 0", "overlap", |f| f.json["bufferViews"][0]["byteStride"] = json!(8));
    refuses("buffer view 0", "stride 5", |f| f.json["bufferViews"][0]["byteStride"] = json!(5));
    refuses("buffer view 0", "not inside", |f| {
        f.json["bufferViews"][0]["byteOffset"] = json!(u64::MAX);
    });
    refuses("buffer view 1", "not inside", |f| f.json["bufferViews"][1]["byteLength"] = json!(9));
    refuses("buffer 0", "declares 4000000000", |f| {
        f.json["buffers"][0]["byteLength"] = json!(4_000_000_000u32);
    });
    refuses("accessor 0", "has none", |f| {
        f.json["buffers"][0].as_object_mut().unwrap().remove("uri");
    });
    let sparse = |count: u32, offset: u32| {
        json!({
            "count": count,
            "indices": {"bufferView": 1, "componentType": 5123, "byteOffset": offset},
            "values": {"bufferView": 0},
        })
    };
    refuses("accessor 0", "count is out of range", |f| {
        f.json["accessors"][0]["sparse"] = sparse(4, 0);
    });
    refuses("accessor 0", "data does not fit", |f| {
        f.json["accessors"][0]["sparse"] = sparse(3, 4);
    });
    refuses("accessor 0", "do not ascend", |f| {
        f.json["accessors"][0]["sparse"] = sparse(2, 4);
    });
    refuses("accessor 2", "too many elements without data", |f| {
        let row = json!({"componentType": 5126, "type": "VEC3", "count": 4_000_000_000u32});
        let index = f.add("accessors", row);
        f.json["accessors"][index]["sparse"] = sparse(2, 0);
    });
}

#[test]
fn arrays_have_the_types_of_their_uses() {
    refuses("mesh 0", "POSITION cannot be", |f| {
        f.json["accessors"][0]["type"] = json!("VEC2");
        f.json["accessors"][0]["min"] = json!([0, 0]);
        f.json["accessors"][0]["max"] = json!([1, 1]);
    });
    refuses("mesh 0", "POSITION cannot be I16", |f| {
        f.json["accessors"][0]["componentType"] = json!(5122);
        f.json["accessors"][0].as_object_mut().unwrap().remove("max");
    });
    refuses("mesh 0", "unsigned integers", |f| primitive(f)["indices"] = json!(0));
    refuses("accessor 0", "unknown component type", |f| {
        f.json["accessors"][0]["componentType"] = json!(5124);
    });
    refuses("accessor 0", "unknown component type", |f| {
        f.json["accessors"][0]["componentType"] = json!(5126 + (1u64 << 32));
    });
    refuses("accessor 0", "normalised", |f| f.json["accessors"][0]["normalized"] = json!(true));
    refuses("mesh 0", "different numbers of vertices", |f| {
        let normals = f.floats(&[0.0, 0.0, 1.0], "VEC3");
        f.attribute("NORMAL", normals);
    });
    for name in ["HEAT", "COLOUR", "TEXCOORD_00", "_HEAT"] {
        refuses("mesh 0", "different numbers of vertices", |f| {
            let short = f.floats(&[0.0], "SCALAR");
            f.attribute("ODD", 0);
            f.attribute(name, short);
        });
    }
    refuses("mesh 0", "index 3, but only 3", |f| f.data[40] = 3);
    refuses("mesh 0", "mode 9", |f| primitive(f)["mode"] = json!(9));
    refuses("mesh 0", "no primitives", |f| f.json["meshes"][0]["primitives"] = json!([]));
}

#[test]
fn numbers_are_finite_and_as_declared() {
    refuses("accessor 0", "not a number", |f| {
        f.data[..4].copy_from_slice(&f32::NAN.to_le_bytes());
    });
    refuses("accessor 0", "infinite", |f| {
        f.data[..4].copy_from_slice(&f32::INFINITY.to_le_bytes());
    });
    refuses("accessor 0", "outside the min and max", |f| {
        f.data[..4].copy_from_slice(&5.0f32.to_le_bytes());
    });
    refuses("accessor 0", "number of components", |f| f.json["accessors"][0]["max"] = json!([1]));
    refuses("material 0", "negative", |f| {
        f.json["materials"][0]["emissiveFactor"] = json!([-1, 0, 0]);
    });
    refuses("material 0", "too strong", |f| {
        f.json["materials"][0]["emissiveFactor"] = json!([1e30, 0, 0]);
        let strength = json!({"emissiveStrength": 1e30});
        f.json["materials"][0]["extensions"]["KHR_materials_emissive_strength"] = strength;
    });
    refuses("material 0", "outside [0, 1]", |f| {
        f.json["materials"][0]["pbrMetallicRoughness"] = json!({"roughnessFactor": 1.5});
    });
}

#[test]
fn lights_and_cameras_make_sense() {
    refuses("light 0", "without cone angles", |f| f.light(json!({"type": "spot"})));
    refuses("light 0", "unknown type", |f| f.light(json!({"type": "area"})));
    refuses("light 0", "negative", |f| f.light(json!({"type": "point", "intensity": -1})));
    refuses("light 0", "cone angles", |f| {
        f.light(json!({"type": "spot", "spot": {"innerConeAngle": 1.0, "outerConeAngle": 0.5}}));
    });
    refuses("light 0", "range", |f| f.light(json!({"type": "point", "range": 0})));
    refuses("camera 0", "field of view", |f| {
        f.add("cameras", json!({"type": "perspective", "perspective": {"yfov": 3.2}}));
    });
    refuses("node 0 \"lamp\", extras.usdLux", "invalid type", |f| f.lux(json!({"type": 3})));
    refuses("node 0", "radius is not positive", |f| {
        f.lux(json!({"type": "SphereLight", "radius": 0}));
    });
}

#[test]
fn animations_can_be_evaluated() {
    let animate = |f: &mut File, times: &[f32], values: &[f32], path: &str, how: &str| {
        let input = f.times(times);
        let shape = if path == "rotation" { "VEC4" } else { "VEC3" };
        let output = f.floats(values, shape);
        f.add(
            "animations",
            json!({
                "samplers": [{"input": input, "output": output, "interpolation": how}],
                "channels": [{"sampler": 0, "target": {"node": 0, "path": path}}],
            }),
        );
    };
    refuses("animation 0", "do not ascend", |f| {
        animate(f, &[1.0, 1.0], &[0.0; 6], "translation", "LINEAR");
    });
    refuses("animation 0", "2 keys, but 1 translation", |f| {
        animate(f, &[0.0, 1.0], &[0.0; 3], "translation", "LINEAR");
    });
    refuses("animation 0", "2 keys, but 2 translation", |f| {
        animate(f, &[0.0, 1.0], &[0.0; 6], "translation", "CUBICSPLINE");
    });
    refuses("animation 0", "unit quaternion", |f| {
        animate(f, &[0.0], &[0.0; 4], "rotation", "LINEAR");
    });
    refuses("animation 0", "unknown interpolation", |f| {
        animate(f, &[0.0], &[0.0; 3], "scale", "BEZIER");
    });
    refuses("animation 0", "has a matrix", |f| {
        f.json["nodes"][0]["matrix"] = json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
        animate(f, &[0.0], &[0.0; 3], "translation", "STEP");
    });
}

#[test]
fn pictures_that_are_used_are_whole() {
    let textured = |f: &mut File, bytes: &[u8]| {
        let view = f.view(bytes);
        f.add("images", json!({"bufferView": view, "mimeType": "image/png"}));
        f.add("textures", json!({"source": 0}));
        f.json["materials"][0]["emissiveTexture"] = json!({"index": 0});
    };
    let png = files::png(64, 64, [1, 2, 3, 255]);
    refuses("image 0", "cannot be decoded", |f| textured(f, &png[..png.len() / 2]));
    refuses("image 0", "cannot be read", |f| {
        f.add("images", json!({"uri": "absent.png"}));
    });
    refuses("image 0", "absolute", |f| {
        f.add("images", json!({"uri": "http://a/b.png"}));
    });
    // A small file must not ask for a large picture: the header says 60,000 x 60,000.
    let mut bomb = png.clone();
    bomb[16..24].copy_from_slice(&[0, 0, 0xEA, 0x60, 0, 0, 0xEA, 0x60]);
    let checksum = crc32fast::hash(&bomb[12..29]);
    bomb[29..33].copy_from_slice(&checksum.to_be_bytes());
    refuses("image 0", "60000 x 60000", |f| textured(f, &bomb));
}

#[test]
fn light_values_are_light_over_time() {
    let broken = |problem: &str, times: serde_json::Value, rgb: serde_json::Value| {
        refuses("node 0 \"lamp\"", problem, |f| {
            let values = json!({"times": times, "rgb": rgb});
            f.lux(json!({"type": "RectLight", "values": values}));
        });
    };
    broken("do not ascend", json!([1, 0]), json!([[1, 1, 1], [1, 1, 1]]));
    broken("do not ascend", json!([1, 1.00000001]), json!([[1, 1, 1], [1, 1, 1]]));
    broken("2 times and 1 rgb", json!([0, 1]), json!([[1, 1, 1]]));
    broken("0 keys", json!([]), json!([]));
    broken("negative", json!([0]), json!([[1, -0.5, 1]]));
    broken("too large", json!([0]), json!([[1, 1e39, 1]]));
    broken("too large", json!([1e300]), json!([[1, 1, 1]]));
    broken("1048577 keys", json!(vec![0; (1 << 20) + 1]), json!([]));
    broken("invalid length 2", json!([0]), json!([[1, 1]]));
    refuses("usdLux", "missing field `rgb`", |f| {
        f.lux(json!({"type": "RectLight", "values": {"times": [0]}}));
    });
}

#[test]
fn nothing_outside_the_folder_is_read() {
    for uri in ["../data.bin", "/etc/passwd", "file:///etc/passwd", "http://a/data.bin"] {
        refuses("buffer 0", "", |f| f.json["buffers"][0]["uri"] = json!(uri));
    }
    refuses("dome texture", "outside", |f| {
        f.lux(json!({"type": "DomeLight", "radiance": [1, 1, 1], "texture": "../sky.exr"}));
    });
}

#[test]
fn little_data_cannot_ask_for_much_memory() {
    refuses("mesh", "out of proportion", |f| {
        let row = json!({"componentType": 5126, "type": "VEC3", "count": 4_000_000_000u32});
        let positions = f.add("accessors", row);
        primitive(f)["attributes"]["POSITION"] = json!(positions);
        primitive(f).as_object_mut().unwrap().remove("indices");
    });
}

#[test]
fn a_file_that_is_no_scene_says_so() {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes, problem) in [
        ("a.glb", &b"glTX"[..], "does not start with"),
        ("b.gltf", b"", "cannot be parsed"),
        ("c.gltf", b"[]", "not an object"),
        ("d.gltf", b"\xEF\xBB\xBF{}", "byte order mark"),
        ("e.obj", b"\xFF\xFEv\0", "UTF-16"),
        ("f.obj", b"v 0 0 0\n", "holds no faces"),
        ("g.obj", b"v 0 0 0\nf 1 2 3\n", "cannot be parsed"),
        ("j.obj", b"v 0 0 0\nvt 0 0\nf 1/-2 1/1 1/1\n", "out of range"),
        ("h.usda", b"#usda 1.0", "not read"),
        ("i.obj", b"\x7FELF\0\0\0", "not text"),
    ] {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        let error = candelabra::ingest::load(&path).unwrap_err();
        assert!(error.problem.contains(problem), "{error}");
        assert_eq!(error.file, path);
    }
    let deep = format!("{}{}", "[".repeat(100_000), "]".repeat(100_000));
    let path = folder.path().join("deep.gltf");
    std::fs::write(&path, deep).unwrap();
    assert!(candelabra::ingest::load(&path).is_err());
    assert!(candelabra::ingest::load(&folder.path().join("absent.glb")).is_err());
}
