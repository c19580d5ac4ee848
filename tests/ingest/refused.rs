//! What is refused, and the object that the error names: what is not safe to read, or not there.

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
    assert_eq!(&*scene.instances[0].path, "/lamp");
    assert_eq!(scene.materials[0].emission_nits.to_array(), [8.0, 4.0, 2.0]);
    assert_eq!(scene.notes, []);
}

#[test]
fn versions_and_extensions() {
    refuses("asset", "version \"1.0\"", |f| f.json["asset"]["version"] = json!("1.0"));
    refuses("asset", "version \"2.1\"", |f| f.json["asset"]["minVersion"] = json!("2.1"));
    refuses("extensionsRequired", "KHR_draco_mesh_compression", |f| {
        f.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
    });
    let mut fine = lamp();
    fine.json["extensionsRequired"] = json!(["KHR_texture_transform", "EXT_mesh_gpu_instancing"]);
    fine.load().unwrap();
}

#[test]
fn nodes_can_be_walked() {
    refuses("node 1", "its own ancestor", |f| {
        f.add("nodes", json!({"children": [2]}));
        f.add("nodes", json!({"children": [1]}));
    });
    refuses("node 0", "its own ancestor", |f| {
        f.json["nodes"][0]["children"] = json!([0]);
        f.json["scenes"][0]["nodes"] = json!([]);
    });
    refuses("node", "more than 512 ancestors", |f| {
        let last = 100_000;
        let nodes = (0..last).map(|i| json!({"children": [i + 1]}));
        f.json["nodes"] = nodes.chain([json!({"mesh": 0})]).collect();
    });
    // Two parents each: 2^60 nodes of 61.
    refuses("nodes", "out of proportion", |f| {
        let node = |i: usize| json!({"children": [2 * i + 2, 2 * i + 3]});
        f.json["nodes"] =
            (0..60).flat_map(|i| [node(i), node(i)]).chain([json!({}), json!({})]).collect();
    });
}

#[test]
fn places_can_be_calculated_with() {
    refuses("/lamp", "farther than", |f| f.json["nodes"][0]["scale"] = json!([1e20, 1, 1]));
    refuses("/lamp/node_1", "farther than", |f| {
        f.json["nodes"][0]["scale"] = json!([1e30, 1, 1]);
        f.json["nodes"][0]["children"] = json!([1]);
        f.json["nodes"][0].as_object_mut().unwrap().remove("mesh");
        f.add("nodes", json!({"translation": [1e30, 0, 0]}));
    });
}

#[test]
fn buffers_are_whole() {
    let truncate = |f: &mut File, bytes: usize| {
        f.json["buffers"][0]["byteLength"] = json!(bytes);
        f.json["bufferViews"][1]["byteLength"] = json!(bytes - 36);
    };
    refuses("buffer 0", "declares 4000000000", |f| truncate(f, 4_000_000_000));
    refuses("buffer 0", "declares 45", |f| truncate(f, 45));
    refuses("buffer 0", "cannot be read", |f| f.json["buffers"][0]["uri"] = json!("absent.bin"));
    refuses("buffer 0", "Git LFS pointer", |f| {
        f.data = b"version https://git-lfs.github.com/spec/v1\noid sha256:0".to_vec();
    });
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
fn extras_of_our_own_are_what_they_should_be() {
    refuses("node 0 \"lamp\", extras.usdLux", "invalid type", |f| f.lux(json!({"type": 3})));
    refuses("node 0", "radius is not positive", |f| {
        f.lux(json!({"type": "SphereLight", "radius": 0}));
    });
}

#[test]
fn nothing_outside_the_folder_is_read() {
    for uri in ["../data.bin", "/etc/passwd", "file:///etc/passwd", "http://a/data.bin"] {
        refuses("buffer 0", "", |f| f.json["buffers"][0]["uri"] = json!(uri));
    }
}

#[test]
fn little_data_cannot_ask_for_much_memory() {
    let of = |file: &mut File, row: serde_json::Value| {
        let positions = file.add("accessors", row);
        primitive(file)["attributes"]["POSITION"] = json!(positions);
        primitive(file).as_object_mut().unwrap().remove("indices");
    };
    let endless = json!({"componentType": 5126, "type": "VEC3", "count": 4_000_000_000u32});
    refuses("mesh", "out of proportion", |f| of(f, endless.clone()));
    refuses("mesh", "out of proportion", |f| {
        let mut row = endless.clone();
        row["sparse"] = json!({
            "count": 1,
            "indices": {"bufferView": 1, "componentType": 5123},
            "values": {"bufferView": 0},
        });
        of(f, row);
    });
    refuses("mesh", "out of proportion", |f| {
        // A thousand meshes of two million vertices, of one accessor.
        let data = vec![0; 24 << 20];
        let view = f.view(&data);
        let row =
            json!({"bufferView": view, "componentType": 5126, "type": "VEC3", "count": 2 << 20});
        let positions = f.add("accessors", row);
        let mesh = json!({"primitives": [{"attributes": {"POSITION": positions}}]});
        f.json["meshes"] = vec![mesh; 1000].into();
        f.json["nodes"] = (0..1000).map(|i| json!({"mesh": i})).collect();
        f.json["scenes"][0]["nodes"] = (0..1000).collect();
    });
}

/// JSON is refused before it is parsed to many times its size, whatever it is made of.
#[test]
fn little_text_cannot_ask_for_much_memory() {
    const ROWS: usize = 1_000_000;
    let empty = vec!["{}"; ROWS].join(",");
    let tables = [
        "scenes",
        "nodes",
        "meshes",
        "accessors",
        "bufferViews",
        "buffers",
        "materials",
        "textures",
        "images",
        "samplers",
        "cameras",
        "animations",
    ];
    let mut texts: Vec<String> = tables
        .map(|table| format!(r#"{{"asset":{{"version":"2.0"}},"{table}":[{empty}]}}"#))
        .into();
    texts.push(format!(
        r#"{{"asset":{{"version":"2.0"}},"extensions":{{"KHR_lights_punctual":{{"lights":[{empty}]}}}}}}"#
    ));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.gltf");
    for text in texts {
        let start = text[..text.len().min(60)].to_string();
        std::fs::write(&path, text).unwrap();
        let error =
            candelabra::ingest::load(&path).err().unwrap_or_else(|| panic!("loads: {start}"));
        assert!(error.problem.contains("out of proportion"), "{start}: {error}");
    }
}

#[cfg(unix)]
#[test]
fn only_regular_files_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = |name: &str| {
        let path = folder.path().join(name);
        assert!(std::process::Command::new("mkfifo").arg(&path).status().unwrap().success());
        path
    };
    for name in ["pipe.gltf", "pipe.glb", "pipe.obj"] {
        let error = candelabra::ingest::load(&pipe(name)).unwrap_err();
        assert!(error.problem.contains("not a regular file"), "{error}");
    }
    let zero = folder.path().join("zero.gltf");
    std::os::unix::fs::symlink("/dev/zero", &zero).unwrap();
    assert!(candelabra::ingest::load(&zero).unwrap_err().problem.contains("not a regular file"));
    pipe("pipe.bin");
    let mut file = lamp();
    file.json["buffers"][0]["uri"] = json!("pipe.bin");
    assert!(file.load_in(folder.path()).unwrap_err().problem.contains("not a file"));
    pipe("pipe.png");
    pipe("pipe.mtl");
    let obj = "mtllib pipe.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let path = folder.path().join("scene.obj");
    std::fs::write(&path, obj).unwrap();
    assert!(candelabra::ingest::load(&path).unwrap().notes[0].text.contains("not a file"));
}

#[test]
fn a_file_that_is_no_scene_says_so() {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes, problem) in [
        ("a.glb", &b"glTX"[..], "does not start with"),
        ("b.gltf", b"", "cannot be parsed"),
        ("c.gltf", b"[]", "not an object"),
        ("d.gltf", b"\xFF\xFE{\0}\0", "UTF-16"),
        ("e.obj", b"\xFF\xFEv\0", "UTF-16"),
        ("f.obj", b"v 0 0 0\n", "holds no faces"),
        ("g.obj", b"v 0 0 0\nf 1 2 3\n", "holds no faces"),
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
