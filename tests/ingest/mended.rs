//! What is broken and can be read safely: mended or left out, with one note that names it.

use crate::files::{File, lamp};
use candelabra::scene::{Category, LightKind, Projection, Scene, Shaping, Trs};
use glam::DVec3;
use serde_json::json;
use std::f32::consts::FRAC_PI_4;

/// Damages the lamp, which must load with one note of a category that names an object and says a text.
pub fn mends(
    category: Category,
    object: &str,
    text: &str,
    damage: impl FnOnce(&mut File),
) -> Scene {
    let mut file = lamp();
    damage(&mut file);
    let scene = file.load().unwrap_or_else(|error| panic!("{object}, {text}: {error}"));
    let [note] = &scene.notes[..] else { panic!("{object}, {text}: {:?}", scene.notes) };
    assert_eq!(note.category, category, "{note}");
    assert!(note.text.contains(object) && note.text.contains(text), "{object}, {text}: {note}");
    scene
}

/// The same of a damage that costs nothing, so that nothing is said.
pub fn takes(damage: impl FnOnce(&mut File)) -> Scene {
    let mut file = lamp();
    damage(&mut file);
    let scene = file.load().unwrap();
    assert_eq!(scene.notes, []);
    scene
}

fn primitive(file: &mut File) -> &mut serde_json::Value {
    &mut file.json["meshes"][0]["primitives"][0]
}

use Category::{Animation, Cameras, Geometry, Lights, Materials, Other};

#[test]
fn references_that_lead_nowhere() {
    let scene = mends(Lights, "node 0 \"lamp\"", "mesh is not in the file", |f| {
        f.json["nodes"][0]["mesh"] = json!(7);
    });
    assert!(scene.instances.is_empty());
    mends(Cameras, "node 0", "camera is not", |f| f.json["nodes"][0]["camera"] = json!(0));
    mends(Geometry, "scene 0", "not in the file", |f| {
        f.json["scenes"][0]["nodes"] = json!([0, 9]);
    });
    mends(Geometry, "node 0", "children that are not", |f| {
        f.json["nodes"][0]["children"] = json!([5]);
    });
    mends(Other, "file", "default scene", |f| f.json["scene"] = json!(3));
    mends(Lights, "mesh 0 \"flame\"", "accessor 5 is not", |f| primitive(f)["indices"] = json!(5));
    mends(Lights, "mesh 0", "material is not in the file", |f| primitive(f)["material"] = json!(1));
    mends(Lights, "mesh 0", "invalid value", |f| primitive(f)["material"] = json!(-1));
    mends(Lights, "node 0", "invalid value 4294967296", |f| {
        f.json["nodes"][0]["mesh"] = json!(1u64 << 32);
    });
    mends(Lights, "mesh 0", "absent buffer view 8", |f| {
        f.json["accessors"][1]["bufferView"] = json!(8);
    });
    mends(Lights, "mesh 0", "absent buffer view 1", |f| {
        f.json["bufferViews"][1]["buffer"] = json!(3);
    });
    mends(Lights, "node 0", "light is not", |f| {
        f.json["nodes"][0]["extensions"] = json!({"KHR_lights_punctual": {"light": 0}});
    });
    takes(|f| primitive(f)["targets"] = json!([]));
    takes(|f| f.json["nodes"][0]["skin"] = json!(9));
}

#[test]
fn nodes_that_are_no_forest() {
    let shared = |f: &mut File| {
        f.add("nodes", json!({"children": [0]}));
        f.add("nodes", json!({"children": [0, 0], "translation": [5, 0, 0]}));
        f.json["scenes"][0]["nodes"] = json!([1, 2]);
    };
    let mut file = lamp();
    shared(&mut file);
    let scene = file.load().unwrap();
    let told: Vec<String> = scene.notes.iter().map(ToString::to_string).collect();
    assert_eq!(
        told,
        [
            "geometry: node 0 \"lamp\": is the child of several nodes; it is drawn below each",
            "geometry: node 2: names a child twice; it is drawn once",
        ]
    );
    let paths: Vec<&str> = scene.instances.iter().map(|i| &*i.path).collect();
    assert_eq!(paths, ["/node_1/lamp", "/node_2/lamp"]);
    let scene = mends(Geometry, "scene", "below others", |f| {
        f.add("nodes", json!({"children": [0]}));
        f.json["scenes"][0]["nodes"] = json!([0, 1]);
    });
    assert_eq!(&*scene.instances[0].path, "/node_1/lamp");
    let scene = mends(Geometry, "scene 0", "names a node twice", |f| {
        f.json["scenes"][0]["nodes"] = json!([0, 0]);
    });
    assert_eq!(scene.instances.len(), 1);
    // Its parent is not in the scene, so that it stands for itself.
    takes(|f| {
        f.add("nodes", json!({"children": [0]}));
    });
}

#[test]
fn transforms_that_are_none() {
    let rotated = |rotation: serde_json::Value| {
        mends(Geometry, "node 0", "unit quaternion", |f| f.json["nodes"][0]["rotation"] = rotation)
    };
    rotated(json!([0, 0, 0, 0]));
    let scene = rotated(json!([0, 2, 0, 0]));
    let Trs::Parts { rotation, .. } = scene.nodes[0].local else { panic!() };
    assert_eq!(rotation.to_array(), [0.0, 1.0, 0.0, 0.0]);
    mends(Lights, "node 0", "too large", |f| {
        f.json["nodes"][0]["translation"] = json!([1e300, 0, 0]);
    });
    let matrix = |last: f64| json!([1, 0, 0, last, 0, 1, 0, 0, 0, 0, 1, 0, 2, 0, 0, 1]);
    let scene = mends(Geometry, "node 0", "the matrix counts", |f| {
        f.json["nodes"][0]["matrix"] = matrix(0.0);
        f.json["nodes"][0]["translation"] = json!([1, 1, 1]);
    });
    let Trs::Matrix(matrix_of) = scene.nodes[0].local else { panic!() };
    assert_eq!(matrix_of.translation, DVec3::X * 2.0);
    mends(Geometry, "node 0", "not affine", |f| f.json["nodes"][0]["matrix"] = matrix(1.0));
    takes(|f| f.json["nodes"][0]["matrix"] = matrix(1e-9));
}

#[test]
fn arrays_that_cannot_be_read() {
    // Of a mesh that emits it is light that is lost.
    let light = |text: &str, damage: &dyn Fn(&mut File)| {
        assert!(mends(Lights, "mesh 0 \"flame\"", text, damage).instances.is_empty());
    };
    light("do not fit", &|f| f.json["accessors"][0]["count"] = json!(4));
    light("0 elements", &|f| f.json["accessors"][0]["count"] = json!(0));
    light("elements", &|f| f.json["accessors"][0]["count"] = json!(u64::MAX));
    light("do not fit", &|f| f.json["accessors"][0]["byteOffset"] = json!(u64::MAX - 3));
    light("overlap", &|f| f.json["bufferViews"][0]["byteStride"] = json!(8));
    light("not inside", &|f| f.json["bufferViews"][0]["byteLength"] = json!(45));
    light("unknown type", &|f| f.json["accessors"][0]["componentType"] = json!(5124));
    light("POSITION cannot be F32 x 2", &|f| f.json["accessors"][0]["type"] = json!("VEC2"));
    light("not unsigned integers", &|f| primitive(f)["indices"] = json!(0));
    light("not made of triangles", &|f| primitive(f)["mode"] = json!(9));
    light("not made of triangles", &|f| primitive(f)["mode"] = json!(4 + (1u64 << 32)));
    light("has no positions", &|f| primitive(f)["attributes"] = json!({}));
    light("has none", &|f| drop(f.json["buffers"][0].as_object_mut().unwrap().remove("uri")));
    let sparse = |count: u32, offset: u32| {
        json!({
            "count": count,
            "indices": {"bufferView": 1, "componentType": 5123, "byteOffset": offset},
            "values": {"bufferView": 0},
        })
    };
    for (count, offset, text) in
        [(4, 0, "count is out of range"), (3, 4, "data does not fit"), (2, 4, "do not ascend")]
    {
        light(text, &|f| f.json["accessors"][0]["sparse"] = sparse(count, offset));
    }
    // Of another mesh it is not.
    mends(Geometry, "mesh 0", "do not fit", |f| {
        f.json["materials"][0] = json!({});
        f.json["accessors"][0]["count"] = json!(4);
    });
    // Bytes are bytes, wherever they begin and whatever bounds are declared.
    takes(|f| {
        f.data.insert(0, 7);
        f.json["buffers"][0]["byteLength"] = json!(45);
        for (view, offset) in [(0, 1), (1, 37)] {
            f.json["bufferViews"][view]["byteOffset"] = json!(offset);
        }
    });
    takes(|f| f.json["accessors"][0]["normalized"] = json!(true));
    mends(Geometry, "mesh 0", "outside the min and max", |f| {
        f.data[..4].copy_from_slice(&5.0f32.to_le_bytes());
    });
    mends(Geometry, "mesh 0", "outside the min and max", |f| {
        f.json["accessors"][0]["max"] = json!([1]);
    });
    takes(|f| primitive(f)["attributes"]["_HEAT"] = json!(99));
    for semantic in ["NORMAL", "COLOR_0"] {
        mends(Geometry, "mesh 0", "fewer elements", |f| {
            let short = f.floats(&[0.0, 0.0, 1.0], "VEC3");
            f.attribute(semantic, short);
        });
    }
}

#[test]
fn triangles_that_are_not_there() {
    for bad in [f32::NAN, f32::INFINITY] {
        let scene = mends(Lights, "mesh 0", "not finite", |f| {
            let mut places = [0.0f32; 12];
            places[9] = bad;
            places[3] = 1.0;
            places[7] = 1.0;
            let positions = f.floats(&places, "VEC3");
            f.attribute("POSITION", positions);
            let view: Vec<u8> =
                [0u16, 1, 2, 1, 2, 3].iter().flat_map(|i| i.to_le_bytes()).collect();
            let indices = f.array(&view, 5123, 6, "SCALAR");
            primitive(f)["indices"] = json!(indices);
        });
        assert_eq!(scene.meshes[0].triangles, [[0, 1, 2]]);
        assert!(scene.meshes[0].positions.iter().all(|place| place.is_finite()));
    }
    let mut file = lamp();
    file.data[40] = 3;
    let scene = file.load().unwrap();
    assert!(scene.meshes.is_empty());
    assert!(scene.notes.iter().any(|note| note.text.contains("not there")), "{:?}", scene.notes);
}

#[test]
fn materials_out_of_range() {
    let scene = mends(Materials, "material 0", "out of their range", |f| {
        f.json["materials"][0]["pbrMetallicRoughness"] =
            json!({"roughnessFactor": 1.5, "metallicFactor": -1});
    });
    assert_eq!((scene.materials[0].roughness, scene.materials[0].metallic), (1.0, 0.0));
    mends(Materials, "material 0", "alpha mode", |f| {
        f.json["materials"][0]["alphaMode"] = json!("GLASS");
    });
    for emission in [json!([-1, 0, 0]), json!([1, 0, -0.25])] {
        mends(Lights, "material 0", "negative", |f| {
            f.json["materials"][0]["emissiveFactor"] = emission;
        });
    }
    let scene = mends(Lights, "material 0", "too strong", |f| {
        f.json["materials"][0]["emissiveFactor"] = json!([1e30, 0, 0]);
        let strength = json!({"emissiveStrength": 1e30});
        f.json["materials"][0]["extensions"]["KHR_materials_emissive_strength"] = strength;
    });
    assert!(!scene.materials[0].emits());
}

#[test]
fn lights_and_cameras_out_of_range() {
    let shaping = |scene: &Scene| match &scene.lights[..] {
        [light] => match light.kind {
            LightKind::Spot { shaping: Shaping::Khr { inner_rad, outer_rad }, .. } => {
                (inner_rad, outer_rad)
            }
            _ => panic!("{light:?}"),
        },
        _ => panic!("{:?}", scene.lights),
    };
    let scene =
        mends(Lights, "light 0", "without cone angles", |f| f.light(json!({"type": "spot"})));
    assert_eq!(shaping(&scene), (0.0, FRAC_PI_4));
    for light in [json!({"type": "area"}), json!({}), json!({"type": "POINT"})] {
        assert!(mends(Lights, "light 0", "unknown type", |f| f.light(light)).lights.is_empty());
    }
    for light in [json!({"type": 7}), json!(3), json!({"type": "point", "color": "red"})] {
        let scene = mends(Lights, "light 0", "", |f| f.light(light));
        assert_eq!(scene.lights[0].kind.rgb().max_element(), 0.0);
    }
    mends(Lights, "light 0", "negative", |f| f.light(json!({"type": "point", "intensity": -1})));
    let spot = |inner: f64, outer: f64| json!({"type": "spot", "spot": {"innerConeAngle": inner, "outerConeAngle": outer}});
    let scene = mends(Lights, "light 0", "its edge is hard", |f| f.light(spot(1.0, 0.5)));
    assert_eq!(shaping(&scene), (0.5, 0.5));
    // Sixty-four bits tell them apart and thirty-two do not; or nothing does.
    for (inner, outer) in [(0.5, 0.5 + 1e-12), (0.5, 0.5)] {
        assert_eq!(shaping(&takes(|f| f.light(spot(inner, outer)))), (0.5, 0.5));
    }
    mends(Lights, "light 0", "larger than pi/2", |f| f.light(spot(0.0, 3.0)));
    mends(Lights, "light 0", "not positive", |f| f.light(spot(0.0, 0.0)));
    for range in [0, -3] {
        let scene = mends(Lights, "light 0", "range", |f| {
            f.light(json!({"type": "point", "range": range}));
        });
        assert_eq!(scene.lights[0].range_m, None);
    }
    for yfov in [4.0, 0.0, -1.0, 45.0] {
        let scene = mends(Cameras, "node 0", "field of view", |f| {
            f.add("cameras", json!({"type": "perspective", "perspective": {"yfov": yfov}}));
            f.json["nodes"][0]["camera"] = json!(0);
        });
        let Projection::Perspective { yfov_rad } = scene.cameras[0].projection else { panic!() };
        assert_eq!(yfov_rad, 45f32.to_radians());
    }
}

#[test]
fn animations_that_are_broken() {
    let animate = |f: &mut File, times: &[f32], values: &[f32], path: &str, how: &str| {
        let input = f.floats(times, "SCALAR");
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
    let left_out = |text: &str, damage: &dyn Fn(&mut File)| {
        assert!(mends(Animation, "animation 0", text, damage).nodes[0].channels.is_empty());
    };
    let scene = mends(Animation, "animation 0", "do not ascend", |f| {
        let moved: Vec<f32> = (0..15).map(|i| i as f32).collect();
        animate(f, &[-1.0, 1.0, 1.0, f32::NAN, 2.0], &moved, "translation", "LINEAR");
    });
    let candelabra::scene::Channel::Translation(keys) = &scene.nodes[0].channels[0] else {
        panic!()
    };
    assert_eq!(keys.times_s.len(), 3);
    left_out("2 keys, but 1 translation", &|f| {
        animate(f, &[0.0, 1.0], &[0.0; 3], "translation", "LINEAR");
    });
    left_out("2 keys, but 2 translation", &|f| {
        animate(f, &[0.0, 1.0], &[0.0; 6], "translation", "CUBICSPLINE");
    });
    mends(Animation, "animation 0", "unit quaternions", |f| {
        animate(f, &[0.0], &[0.0; 4], "rotation", "LINEAR");
    });
    left_out("interpolation", &|f| animate(f, &[0.0], &[0.0; 3], "scale", "BEZIER"));
    left_out("moves nothing", &|f| {
        f.json["nodes"][0]["matrix"] = json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
        animate(f, &[0.0], &[0.0; 3], "translation", "STEP");
    });
    left_out("sampler is not", &|f| {
        animate(f, &[0.0], &[0.0; 3], "translation", "STEP");
        f.json["animations"][0]["channels"][0]["sampler"] = json!(4);
    });
    left_out("accessor 99", &|f| {
        animate(f, &[0.0], &[0.0; 3], "translation", "STEP");
        f.json["animations"][0]["samplers"][0]["input"] = json!(99);
    });
    let scene = takes(|f| {
        animate(f, &[0.0], &[9.0, 9.0, 9.0, 1.0, 2.0, 3.0, 9.0, 9.0, 9.0], "scale", "CUBICSPLINE")
    });
    let Trs::Parts { scale, .. } = scene.nodes[0].local else { panic!() };
    assert_eq!(scale, glam::DVec3::new(1.0, 2.0, 3.0), "a spline of one key is its value");
    assert!(scene.nodes[0].channels.is_empty(), "and holds still");
}

#[test]
fn rows_of_a_wrong_type_are_left_out() {
    mends(Materials, "texture 0", "not an object", |f| f.json["textures"] = json!([3]));
    mends(Materials, "samplers", "all are left out", |f| f.json["samplers"] = json!({}));
    mends(Lights, "material 1", "invalid type", |f| {
        f.add("materials", json!({"emissiveFactor": "red"}));
    });
    mends(Animation, "animation 0", "not an object", |f| f.json["animations"] = json!([[]]));
    let scene = mends(Lights, "node 1 \"b\"", "invalid type", |f| {
        f.json["nodes"][0]["children"] = json!([1, 2]);
        f.add("nodes", json!({"name": "b", "scale": 3}));
        f.add("nodes", json!({"name": "c"}));
    });
    assert_eq!(scene.nodes.len(), 3, "numbers stay as they are");
    mends(Other, "asset", "missing", |f| drop(f.json.as_object_mut().unwrap().remove("asset")));
}

#[test]
fn instances_that_cannot_be_read() {
    let instanced = |attributes: &dyn Fn(&mut File) -> serde_json::Value| {
        let mut file = lamp();
        let attributes = attributes(&mut file);
        file.json["nodes"][0]["extensions"] =
            json!({"EXT_mesh_gpu_instancing": {"attributes": attributes}});
        let scene = file.load().unwrap();
        (scene.instances.len(), scene.notes)
    };
    for attributes in [
        &(|_: &mut File| json!({})) as &dyn Fn(&mut File) -> serde_json::Value,
        &|_| json!({"TRANSLATION": 77}),
        &|f| json!({"TRANSLATION": f.floats(&[0.0; 4], "VEC4")}),
        &|f| json!({"TRANSLATION": f.floats(&[f32::NAN; 3], "VEC3")}),
        &|f| json!({"TRANSLATION": f.floats(&[0.0; 3], "VEC3"), "SCALE": f.floats(&[1.0; 6], "VEC3")}),
    ] {
        let (instances, notes) = instanced(attributes);
        assert_eq!((instances, notes.len(), notes[0].category), (0, 1, Lights), "{notes:?}");
    }
    let (instances, notes) = instanced(&|f| json!({"ROTATION": f.floats(&[0.0; 4], "VEC4")}));
    assert_eq!((instances, notes.len(), notes[0].category), (1, 1, Geometry));
}

#[test]
fn containers_of_other_writers() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lamp.glb");
    let whole = lamp().glb();
    let json_length = u32::from_le_bytes(whole[12..16].try_into().unwrap()) as usize;
    let trimmed = whole[20..20 + json_length].trim_ascii_end().len();
    // The padding is not counted, or not there; or it is zeros.
    let mut uncounted = whole.clone();
    uncounted[12..16].copy_from_slice(&(trimmed as u32).to_le_bytes());
    let mut absent = uncounted.clone();
    absent.drain(20 + trimmed..20 + json_length);
    let mut zeros = whole.clone();
    zeros[20 + trimmed..20 + json_length].fill(0);
    let mut long = whole.clone();
    long[8..12].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(trimmed < json_length, "the JSON is padded");
    for bytes in [uncounted, absent, zeros, long] {
        std::fs::write(&path, bytes).unwrap();
        let scene = candelabra::ingest::load(&path).unwrap();
        assert_eq!((scene.meshes[0].triangles.len(), scene.notes.len()), (1, scene.notes.len()));
        assert!(scene.notes.iter().all(|note| note.category == Other) && !scene.notes.is_empty());
    }
    std::fs::write(&path, [b"\xEF\xBB\xBF".to_vec(), lamp().json.to_string().into()].concat())
        .unwrap();
    assert!(candelabra::ingest::load(&path).unwrap_err().problem.contains("does not start with"));
    std::fs::write(folder.path().join("data.bin"), lamp().data).unwrap();
    std::fs::write(&path, lamp().json.to_string()).unwrap();
    assert_eq!(candelabra::ingest::load(&path).unwrap().notes.len(), 1);
}
