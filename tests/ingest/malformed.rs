//! Files that others collected because they broke something, and files broken here.

use crate::{files, posing, shared};
use candelabra::ingest::load;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Files that are refused, and what is not safe, or not there.
const REFUSED: &[(&str, &str)] = &[
    ("glb/empty_json_chunk.glb", "there is no JSON"),
    ("glb/invalid_json_chunk.glb", "what is there is no JSON"),
    ("glb/invalid_magic.glb", "what is there is no GLB"),
    ("glb/invalid_version.glb", "another version may mean anything"),
    ("glb/no_header.glb", "there is no header"),
    ("glb/only_bin_chunk.glb", "there is no JSON"),
    ("glb/only_header.glb", "there is no JSON"),
    ("glb/truncated_chunk_data.glb", "the end of the JSON is not there"),
    ("glb/truncated_chunk_header.glb", "there is no JSON"),
    ("glb/two_bin_chunks.glb", "there is no JSON"),
    ("glb/two_empty_bin_chunks.glb", "there is no JSON"),
    ("glb/two_empty_json_chunks.glb", "there is no JSON"),
    ("glb/unknown_chunk.glb", "there is no JSON"),
    ("glb/zero_chunk_header.glb", "there is no JSON"),
    ("glb/zero_length.glb", "there is no JSON"),
    ("glb/empty_file.glb", "there is nothing"),
    ("node/node_loop.gltf", "a walk would not end"),
    ("node/node_loop_scene.gltf", "a walk would not end"),
    ("root/undefined_used_extensions.gltf", "it says that it cannot be read without an extension"),
];

/// The validator's error codes for a file, if it was asked.
fn verdict(file: &Path) -> Option<Vec<String>> {
    let report = std::fs::read(format!("{}.report.json", file.display())).ok()?;
    let report: Value = serde_json::from_slice(&report).unwrap();
    let messages = report["issues"]["messages"].as_array().cloned().unwrap_or_default();
    let errors = messages.iter().filter(|message| message["severity"] == 0);
    Some(errors.map(|message| message["code"].as_str().unwrap().to_string()).collect())
}

fn malformed(extensions: &[&str]) -> Option<(PathBuf, Vec<PathBuf>)> {
    let folder = shared::folder("real/malformed")?;
    let mut files = shared::files_below(&folder);
    files.retain(|file| {
        let extension = file.extension().unwrap_or_default().to_string_lossy();
        extensions.contains(&&*extension)
    });
    Some((folder, files))
}

/// Whatever can be read safely is read, whatever the validator calls it.
#[test]
fn gltf_files_load_unless_that_is_not_safe() {
    let Some((folder, files)) = malformed(&["gltf", "glb"]) else { return };
    let (mut surprises, mut judged) = (Vec::new(), 0);
    for file in files {
        let result = load(&file);
        let Some(codes) = verdict(&file) else { continue };
        judged += 1;
        let name = file.strip_prefix(&folder).unwrap().display().to_string();
        let refused = REFUSED.iter().any(|(part, _)| name.ends_with(part));
        match result {
            Ok(_) if refused => surprises.push(format!("{name} should be refused")),
            Ok(scene) => assert_promises_are_kept(&scene),
            Err(error) if codes.is_empty() || !refused => {
                surprises.push(format!("{name} should load: {error}"));
            }
            Err(_) => {}
        }
    }
    assert!(judged > 200, "only {judged} files with a verdict below {}", folder.display());
    assert!(surprises.is_empty(), "{}", surprises.join("\n"));
}

#[test]
fn odd_obj_files_load_or_say_why_not() {
    let Some((_, files)) = malformed(&["obj"]) else { return };
    assert!(files.len() > 50);
    let mut refused = Vec::new();
    for file in &files {
        match load(file) {
            Ok(scene) => assert_promises_are_kept(&scene),
            Err(error) => refused.push(error.to_string()),
        }
    }
    // Nearly all of them are merely odd.
    assert!(refused.len() * 3 < files.len(), "{}", refused.join("\n"));
}

#[test]
fn damaged_exr_domes_do_no_harm() {
    let Some(folder) = shared::folder("real/malformed/exr_openexr_damaged") else { return };
    let mut left_out = 0;
    let files = shared::files_below(&folder);
    for file in &files {
        let scene = tempfile::tempdir().unwrap();
        std::fs::copy(file, scene.path().join("sky.exr")).unwrap();
        let mut dome = files::lamp();
        dome.lux(json!({"type": "DomeLight", "radiance": [1, 1, 1], "texture": "sky.exr"}));
        let scene = dome.load_in(scene.path()).unwrap();
        assert_eq!(scene.lights.is_empty(), !scene.notes.is_empty(), "{}", file.display());
        left_out += usize::from(scene.lights.is_empty());
    }
    assert!(left_out * 10 > files.len() * 9, "{left_out} of {} are left out", files.len());
}

/// Every seed of a variant makes the same one on every run.
struct Dice(u64);

impl Dice {
    fn below(&mut self, bound: usize) -> usize {
        // Steele, Lea and Flood's SplitMix64.
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) % bound as u64) as usize
    }
}

/// A copy with a few bytes changed, some removed, or the end cut off.
fn damage(bytes: &[u8], dice: &mut Dice) -> Vec<u8> {
    let mut damaged = bytes.to_vec();
    for _ in 0..=dice.below(3) {
        let at = dice.below(damaged.len().max(1));
        match dice.below(8) {
            0 => damaged.truncate(at),
            1 => drop(damaged.drain(at..(at + dice.below(8)).min(damaged.len()))),
            2 | 3 if at < damaged.len() => damaged[at] = dice.below(256) as u8,
            // Digits for digits: numbers change and the text stays JSON.
            _ => {
                let digits: Vec<usize> =
                    (0..damaged.len()).filter(|&i| damaged[i].is_ascii_digit()).collect();
                if !digits.is_empty() {
                    let digit = digits[dice.below(digits.len())];
                    damaged[digit] = b"0123456789-.eE"[dice.below(14)];
                }
            }
        }
    }
    damaged
}

/// What `Scene` says of itself, for whatever was loaded.
fn assert_promises_are_kept(scene: &candelabra::scene::Scene) {
    for (i, node) in scene.nodes.iter().enumerate() {
        assert!(node.parent.is_none_or(|parent| (parent as usize) < i));
    }
    for mesh in &scene.meshes {
        let count = mesh.positions.len();
        assert!(mesh.triangles.as_flattened().iter().all(|&corner| (corner as usize) < count));
        assert!(mesh.positions.iter().all(|p| p.is_finite()));
        assert!(mesh.normals.is_empty() || mesh.normals.len() == count);
        assert!(mesh.normals.iter().all(|n| n.is_normalized()));
        assert!(mesh.tangents.is_empty() || mesh.tangents.len() == count);
        assert!(mesh.colors.is_empty() || mesh.colors.len() == count);
        assert!(mesh.uv_sets.iter().all(|set| set.is_empty() || set.len() == count));
        assert!(mesh.material.is_none_or(|m| (m as usize) < scene.materials.len()));
    }
    let keys = scene.lights.iter().filter_map(|light| light.values.as_deref());
    for keys in keys.chain(scene.instances.iter().filter_map(|i| i.values.as_deref())) {
        assert!(!keys.times_s.is_empty() && keys.times_s.len() == keys.values.len());
        assert!(keys.times_s.is_sorted_by(|a, b| a < b));
        assert!(keys.values.iter().all(|v| v.is_finite() && v.min_element() >= 0.0));
    }
    if let Some(medium) = &scene.medium {
        assert!(medium.scattering.is_finite() && medium.scattering.min_element() >= 0.0);
        assert!(medium.absorption.is_finite() && medium.absorption.min_element() >= 0.0);
        assert!(medium.anisotropy.abs() < 1.0);
        assert!(medium.region.is_none_or(|region| region.min.cmplt(region.max).all()));
    }
    let mut paths: Vec<_> = (0..scene.instances.len()).map(|i| scene.instance_path(i)).collect();
    paths.extend((0..scene.lights.len()).map(|i| scene.light_path(i)));
    paths.sort_unstable();
    assert!(paths.windows(2).all(|pair| pair[0] != pair[1]), "paths are unique");
    scene.pose_at(0.5);
    scene.requirements();
}

/// A file with some of everything.
fn rich() -> files::File {
    let mut file = files::lamp();
    let uv = file.floats(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0], "VEC2");
    file.attribute("TEXCOORD_0", uv);
    let normals = file.floats(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0], "VEC3");
    file.attribute("NORMAL", normals);
    let picture = file.view(&files::png(2, 2, [255, 128, 0, 255]));
    file.add("images", json!({"bufferView": picture, "mimeType": "image/png"}));
    file.add("textures", json!({"source": 0}));
    file.json["materials"][0]["emissiveTexture"] = json!({"index": 0});
    let times = file.times(&[0.0, 1.0]);
    let moves = file.floats(&[0.0, 0.0, 0.0, 1.0, 2.0, 3.0], "VEC3");
    let turns = file.floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0], "VEC4");
    file.add(
        "animations",
        json!({
            "samplers": [{"input": times, "output": moves}, {"input": times, "output": turns}],
            "channels": [
                {"sampler": 0, "target": {"node": 0, "path": "translation"}},
                {"sampler": 1, "target": {"node": 0, "path": "rotation"}},
            ],
        }),
    );
    let places = file.floats(&[0.0, 0.0, 0.0, 5.0, 0.0, 0.0], "VEC3");
    file.light(json!({"type": "spot", "spot": {"outerConeAngle": 0.7}}));
    file.add(
        "nodes",
        json!({"mesh": 0, "extensions": {
            "EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}},
        }}),
    );
    file.add("cameras", json!({"type": "perspective", "perspective": {"yfov": 0.7}}));
    let fog = json!({"extinction": [0.1, 0.2, 0.3], "albedo": [0.5, 1, 0], "anisotropy": 0.75,
        "min": [-1, -1, -1], "max": [1, 1, 1]});
    file.add("nodes", json!({"camera": 0, "children": [1], "extras": {"usdFog": fog}}));
    file.lux(
        json!({"type": "SphereLight", "values": {"times": [0, 1], "rgb": [[1, 2, 3], [0, 0, 4]]}}),
    );
    file.json["scenes"][0]["nodes"] = json!([0, 2]);
    posing::target(&mut file, &[("POSITION", &[0.5; 9]), ("NORMAL", &[0.0; 9])]);
    posing::animate(&mut file, 0, "weights", &[0.0, 1.0], &[1.0, 0.5], "LINEAR");
    let influences = vec![[(0, 0.5), (1, 0.25), (0, 0.25), (0, 0.0)]; 3];
    posing::bind(&mut file, &[2, 0], Some(&[glam::Mat4::IDENTITY; 2]), &[influences]);
    file.json["accessors"][0]["sparse"] = json!({
        "count": 1,
        "indices": {"bufferView": 1, "componentType": 5123},
        "values": {"bufferView": 0},
    });
    file
}

#[test]
fn no_damage_to_a_file_is_fatal() {
    const VARIANTS: usize = 4000;
    // Thousands of files: in memory, where there is such a folder.
    let folder = tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir()).unwrap();
    let rich = rich();
    rich.load().expect("the undamaged file is good");
    std::fs::write(folder.path().join("data.bin"), &rich.data).unwrap();
    let text = rich.json.to_string().into_bytes();
    let obj = b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\no lamp\nusemtl a\n\
        f 1/1/1 2/1/1 3/1/1\nf -3//1 -2//1 -1//1\n"
        .to_vec();
    std::fs::write(folder.path().join("a.mtl"), "newmtl a\nKe 1 1 1\nmap_Ke a.png\nNs 10\n")
        .unwrap();
    let seeds = [("scene.glb", rich.glb()), ("scene.gltf", text), ("scene.obj", obj)];
    let mut loaded = 0;
    for (name, bytes) in seeds {
        let path = folder.path().join(name);
        for variant in 0..VARIANTS {
            let damaged = damage(&bytes, &mut Dice(variant as u64));
            std::fs::write(&path, damaged).unwrap();
            if let Ok(scene) = load(&path) {
                assert_promises_are_kept(&scene);
                loaded += 1;
            }
        }
    }
    assert!(loaded > VARIANTS / 10, "the damage is too coarse to reach far: {loaded} loaded");
}
