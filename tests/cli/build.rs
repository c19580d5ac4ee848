//! `candelabra build` and `candelabra inspect`.

use crate::files::{SCENE, Shot, base64};
use candelabra::pipeline::{BuildError, BuildJob, Event, Watch};
use serde_json::json;
use std::io::Read;
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

#[test]
fn a_scene_becomes_a_tree_beside_it() {
    let shot = Shot::still();
    shot.candelabra(&format!("build {SCENE}"))
        .ends(0)
        .says("1 light, 2 emitters (0 change)")
        .says("shot.ltree");
    assert_eq!(shot.names(), [SCENE, "shot.ltree"], "no temporary files are left");
    shot.candelabra("inspect shot.ltree").ends(0).says("sound").says("/lamp");
    shot.candelabra(&format!("inspect {SCENE}")).ends(0).says("mesh lights").says("/eye");
}

#[test]
fn a_tree_that_is_up_to_date_is_left_alone() {
    let mut shot = Shot::still();
    let build = format!("build {SCENE} --output deep/er/it.ltree");
    shot.candelabra(&build).ends(0).keeps_quiet_about("up to date");
    let file = shot.path("deep/er/it.ltree");
    let written = || std::fs::metadata(&file).unwrap().modified().unwrap();
    let first = written();
    let whole = shot.read("deep/er/it.ltree");
    shot.candelabra(&build).ends(0).says("deep/er/it.ltree: up to date");
    // Whatever of the scene is no light.
    shot.edit(|json| json["nodes"][2]["translation"] = json!([0, 1, 4]));
    shot.candelabra(&build).ends(0).says("deep/er/it.ltree: up to date");
    assert_eq!(written(), first);
    assert!(shot.read("deep/er/it.ltree") == whole);
    shot.candelabra(&format!("{build} --force")).ends(0).keeps_quiet_about("up to date");
    assert_ne!(written(), first);
    // Damaged or for another scene, it is built anew.
    shot.write("deep/er/it.ltree", &whole[..whole.len() - 1]);
    shot.candelabra(&build).ends(0).keeps_quiet_about("up to date");
    assert_eq!(shot.read("deep/er/it.ltree"), whole);
    shot.edit(|json| json["nodes"][1]["translation"] = json!([0, 0, 2]));
    shot.candelabra(&build).ends(0).keeps_quiet_about("up to date");
    assert_ne!(shot.read("deep/er/it.ltree"), whole);
}

/// Wants a job to stop when it asks for the last time but so many.
struct Impatient {
    left: AtomicUsize,
    stages: Mutex<Vec<String>>,
}

impl Watch for Impatient {
    fn tell(&self, event: Event) {
        if let Event::Stage { name } = event {
            self.stages.lock().unwrap().push(name);
        }
    }

    fn is_stopped(&self) -> bool {
        let less = |left: usize| left.checked_sub(1);
        self.left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, less).is_err()
    }
}

/// Wherever a job is stopped, the file is whole or not there.
#[test]
fn a_job_stops_between_its_stages() {
    let shot = Shot::moving();
    let job = BuildJob { scene: shot.path(SCENE), ..BuildJob::default() };
    for asked in 0.. {
        let watch = Impatient { left: AtomicUsize::new(asked), stages: Mutex::default() };
        let done = job.run(&watch);
        let stages = watch.stages.into_inner().unwrap();
        assert!(stages.len() >= asked.min(5), "{stages:?}");
        match done {
            Err(error) => {
                assert!(matches!(error, BuildError::Stopped), "{error}");
                assert!(asked < 5 && stages.len() == asked, "{stages:?}");
                assert_eq!(shot.names(), [SCENE]);
            }
            Ok(report) => {
                assert_eq!((asked, shot.names()), (5, vec![SCENE.into(), "shot.ltree".into()]));
                // Who has no time is not told what the file saves.
                assert!(report.built.unwrap().break_even.is_none());
                break;
            }
        }
    }
    let again = job.run(&()).unwrap();
    assert!(again.built.is_none(), "it is up to date");
    let forced = BuildJob { force: true, ..job }.run(&()).unwrap();
    assert!(forced.built.unwrap().break_even.is_some());
}

/// So many point lights in a row.
fn lights(shot: &mut Shot, count: usize) {
    shot.edit(|json| {
        json["extensionsUsed"].as_array_mut().unwrap().push(json!("KHR_lights_punctual"));
        json["extensions"]["KHR_lights_punctual"]["lights"] =
            json!([{"type": "point"}, {"type": "point", "intensity": 7}]);
        for i in 0..count {
            let extension = json!({"KHR_lights_punctual": {"light": 0}});
            let node = json!({"name": format!("bulb_{i}"), "translation": [i, i % 7, 3],
                "extensions": extension});
            json["nodes"].as_array_mut().unwrap().push(node);
            json["scenes"][0]["nodes"].as_array_mut().unwrap().push(json!(3 + i));
        }
    });
}

fn strengthen(shot: &mut Shot, light: usize) {
    shot.edit(|json| {
        json["nodes"][3 + light]["extensions"]["KHR_lights_punctual"]["light"] = json!(1);
    });
}

/// How many leaves were taken over, by the line that tells.
#[track_caller]
fn taken_over(out: &str, base: &str) -> usize {
    let line = out.lines().find(|line| line.starts_with(base) && line.contains("taken over"));
    let number = line.and_then(|line| line.split_whitespace().nth(1));
    number.and_then(|number| number.parse().ok()).unwrap_or_else(|| panic!("{out}"))
}

#[test]
fn a_build_takes_over_what_has_not_changed() {
    let mut shot = Shot::still();
    lights(&mut shot, 500);
    shot.candelabra(&format!("build {SCENE} -o old.ltree")).ends(0).keeps_quiet_about("taken over");
    shot.candelabra(&format!("build {SCENE}")).ends(0);
    strengthen(&mut shot, 200);
    let over = shot.candelabra(&format!("build {SCENE}")).ends(0);
    assert!((400..502).contains(&taken_over(&over.out, "shot.ltree")), "{over:?}");
    let upon = shot.candelabra(&format!("build {SCENE} -o new.ltree --base old.ltree")).ends(0);
    assert!((400..502).contains(&taken_over(&upon.out, "old.ltree")), "{upon:?}");
    shot.candelabra(&format!("build {SCENE} -o full.ltree --force"))
        .ends(0)
        .keeps_quiet_about("taken over");
    shot.candelabra(&format!("build {SCENE} --force")).ends(0).keeps_quiet_about("taken over");
    let full = shot.read("full.ltree");
    for name in ["new.ltree", "shot.ltree"] {
        assert!(shot.read(name) == full, "{name}");
    }
}

/// A base that cannot be used is not worse than none, and said to be none.
#[test]
fn a_base_that_does_not_fit_is_not_used() {
    let mut shot = Shot::still();
    lights(&mut shot, 100);
    shot.candelabra(&format!("build {SCENE} -o full.ltree")).ends(0);
    let full = shot.read("full.ltree");
    let mut damaged = full.clone();
    *damaged.last_mut().unwrap() ^= 1;
    shot.write("damaged.ltree", damaged);
    shot.write("notes.ltree", "these are notes");
    // A later version of the algorithm has written it.
    let mut other = full.clone();
    let version = b"\"algorithmVersion\":";
    let at = other.windows(version.len()).position(|bytes| bytes == version).unwrap();
    other[at + version.len()] = b'9';
    // Checksums: of `META`, the first section, in the table; of the table, in the header.
    let number = |bytes: &[u8]| u64::from_le_bytes(bytes.try_into().unwrap()) as usize;
    let (offset, length) = (number(&other[72..80]), number(&other[80..88]));
    let checksum = crc32fast::hash(&other[offset..offset + length]);
    other[92..96].copy_from_slice(&checksum.to_le_bytes());
    other[28..32].fill(0);
    let sections = u32::from_le_bytes(other[24..28].try_into().unwrap()) as usize;
    let checksum = crc32fast::hash(&other[..64 + 32 * sections]);
    other[28..32].copy_from_slice(&checksum.to_le_bytes());
    shot.write("other.ltree", other);
    for (base, why) in [
        ("damaged", "damaged"),
        ("notes", "not a Candelabra tree file"),
        ("absent", "No such file"),
        ("other", "another version of the algorithm"),
    ] {
        let build = format!("build {SCENE} -o new.ltree --base {base}.ltree");
        shot.candelabra(&build).ends(0).complains(&["note:", &format!("{base}.ltree"), why]);
        assert!(shot.read("new.ltree") == full, "{base}");
        std::fs::remove_file(shot.path("new.ltree")).unwrap();
        // Nor is it when the output is such a file; but what is no tree is not overwritten.
        if base == "notes" {
            let over = shot.candelabra(&format!("build {SCENE} -o notes.ltree"));
            over.ends(1).complains(&["notes.ltree", "exists and is no tree file"]);
        } else if base != "absent" {
            let over = shot.candelabra(&format!("build {SCENE} -o {base}.ltree")).ends(0);
            assert!(shot.read(&format!("{base}.ltree")) == full, "{base}: {over:?}");
            shot.write(&format!("{base}.ltree"), &full[..100]);
        }
    }
    Shot::still().candelabra(&format!("build {SCENE} --force --base a.ltree")).ends(2);
}

#[test]
fn lights_are_known_by_their_content_not_by_their_names() {
    let mut shot = Shot::still();
    lights(&mut shot, 100);
    shot.candelabra(&format!("build {SCENE} -o old.ltree")).ends(0);
    let upon = |shot: &Shot| {
        let told = shot.candelabra(&format!("build {SCENE} -o new.ltree --base old.ltree")).ends(0);
        shot.candelabra(&format!("build {SCENE} -o full.ltree --force")).ends(0);
        assert!(shot.read("new.ltree") == shot.read("full.ltree"));
        taken_over(&told.out, "old.ltree")
    };
    shot.edit(|json| {
        for (i, node) in json["nodes"].as_array_mut().unwrap().iter_mut().enumerate() {
            node["name"] = json!(format!("renamed_{}", i * 37 % 103));
        }
    });
    assert_eq!(upon(&shot), 102, "the bulbs and the two triangles of the lamp");
    // A base of another scene has nothing to give.
    shot.edit(|json| {
        json["extensions"]["KHR_lights_punctual"]["lights"][0]["intensity"] = json!(3);
        json["nodes"][1]["scale"] = json!([2, 1, 1]);
    });
    assert_eq!(upon(&shot), 0);
}

#[test]
fn a_moving_light_has_a_tree_for_every_frame() {
    let shot = Shot::moving();
    shot.candelabra(&format!("build {SCENE}")).ends(0).says("2 emitters (2 change)");
    shot.candelabra("inspect shot.ltree").ends(0).says("25 trees, 0 instances, 25 frames");
    shot.candelabra(&format!("build {SCENE} --frames 5,1,9")).ends(0).says("(2 change)");
    shot.candelabra("inspect shot.ltree").ends(0).says("3 trees, 0 instances, 3 frames");
}

/// A lamp of twelve triangles that turns, with some more keys: of a part, at seconds 0 and 1.
fn turning(more: &[(&str, [[f32; 4]; 2])]) -> Shot {
    let mut shot = Shot::still();
    let corner = |i: u32| [(i / 3) as f32, (i % 3 / 2) as f32, (i % 3 % 2) as f32 + 0.1];
    let mut data: Vec<f32> = (0..36).flat_map(corner).collect();
    data.extend([0.0, 1.0]);
    let turns = [("rotation", [[0.0, 0.0, 0.0, 1.0], [0.0, 0.6, 0.0, 0.8]])];
    let tracks: Vec<_> = turns.iter().chain(more).collect();
    let mut offsets = Vec::new();
    for (path, keys) in &tracks {
        offsets.push(4 * data.len());
        let parts = if *path == "rotation" { 4 } else { 3 };
        keys.iter().for_each(|key| data.extend(&key[..parts]));
    }
    let bytes: Vec<u8> = data.iter().flat_map(|x| x.to_le_bytes()).collect();
    shot.edit(|json| {
        let uri = format!("data:application/octet-stream;base64,{}", base64(&bytes));
        let list = |json: &mut serde_json::Value, name: &str, row: serde_json::Value| {
            let rows = json[name].as_array_mut().unwrap();
            rows.push(row);
            rows.len() - 1
        };
        list(json, "buffers", json!({"uri": uri, "byteLength": bytes.len()}));
        let mut accessor = |at: usize, count: usize, kind: &str, bounds: Option<[[f32; 3]; 2]>| {
            let parts = match kind {
                "SCALAR" => 1,
                "VEC3" => 3,
                _ => 4,
            };
            let view = json!({"buffer": 1, "byteOffset": at, "byteLength": 4 * parts * count});
            let view = list(json, "bufferViews", view);
            let mut row =
                json!({"bufferView": view, "componentType": 5126, "count": count, "type": kind});
            match (kind, bounds) {
                ("SCALAR", _) => (row["min"], row["max"]) = (json!([0]), json!([1])),
                (_, Some([min, max])) => (row["min"], row["max"]) = (json!(min), json!(max)),
                _ => {}
            }
            list(json, "accessors", row)
        };
        let positions = accessor(0, 36, "VEC3", Some([[0.0, 0.0, 0.1], [11.0, 1.0, 1.1]]));
        let times = accessor(432, 2, "SCALAR", None);
        let (mut samplers, mut channels) = (Vec::new(), Vec::new());
        for ((path, _), at) in tracks.iter().zip(&offsets) {
            let kind = if *path == "rotation" { "VEC4" } else { "VEC3" };
            let output = accessor(*at, 2, kind, None);
            let target = json!({"node": 1, "path": path});
            channels.push(json!({"sampler": samplers.len(), "target": target}));
            samplers.push(json!({"input": times, "output": output}));
        }
        json["animations"] = json!([{"samplers": samplers, "channels": channels}]);
        json["meshes"][1]["primitives"] =
            json!([{"attributes": {"POSITION": positions}, "material": 1}]);
        json["nodes"][1] = json!({"name": "lamp", "mesh": 1});
    });
    shot
}

/// What counts is whether values vary, not whether there are keys.
#[test]
fn a_track_that_says_one_thing_costs_nothing() {
    let trees = |shot: &Shot| {
        shot.candelabra(&format!("build {SCENE} -o a.ltree"))
            .ends(0)
            .says("12 emitters (12 change)");
        let inspected = shot.candelabra("inspect a.ltree").ends(0).out;
        (
            shot.read("a.ltree").len(),
            inspected.lines().find(|line| line.contains(" trees, ")).map(str::to_owned),
        )
    };
    let plain = trees(&turning(&[]));
    let steady = [[1.0, 1.0, 1.0, 0.0], [1.000_000_1, 0.999_999_9, 1.0, 0.0]];
    let here = [[0.0; 4]; 2];
    for more in [
        vec![("scale", steady)],
        vec![("translation", here)],
        vec![("translation", here), ("scale", steady)],
    ] {
        assert_eq!(trees(&turning(&more)), plain);
    }
    // It grows evenly: it keeps its shape, and its tree.
    let grows = [[1.0, 1.0, 1.0, 0.0], [3.0, 3.0, 3.0, 0.0]];
    assert_eq!(trees(&turning(&[("scale", grows)])), plain);
    // It is bent: it has a tree for every frame.
    let bends = [[1.0, 1.0, 1.0, 0.0], [3.0, 1.0, 1.0, 0.0]];
    assert_ne!(trees(&turning(&[("scale", bends)])).1, plain.1);
}

#[test]
fn a_scene_that_cannot_be_read_is_named() {
    let shot = Shot::still();
    shot.candelabra("build nothing.gltf").ends(1).complains(&["candelabra:", "nothing.gltf"]);
    shot.write("broken.gltf", "{\"asset\": ");
    shot.candelabra("build broken.gltf").ends(1).complains(&["broken.gltf"]);
    shot.candelabra("build shot.usda").ends(1).complains(&["shot.usda"]);
    shot.candelabra(&format!("build {SCENE} -o {SCENE}/below.ltree"))
        .ends(1)
        .complains(&["below.ltree"]);
    assert_eq!(shot.names(), ["broken.gltf", SCENE]);
}

#[test]
fn usage_is_exit_code_two() {
    let shot = Shot::still();
    for wrong in ["", "burn", "build", "build shot.gltf --frames 1-x", "inspect a b"] {
        let told = shot.candelabra(wrong).ends(2);
        assert!(told.out.is_empty() && !told.err.is_empty(), "{told:?}");
    }
    shot.candelabra("--version").ends(0).says(env!("CARGO_PKG_VERSION"));
}

#[test]
fn a_file_that_is_no_tree_is_not_inspected() {
    let shot = Shot::still();
    shot.write("empty.ltree", "");
    shot.write("notes.ltree", "these are notes");
    std::fs::create_dir(shot.path("folder.ltree")).unwrap();
    for name in ["empty", "notes", "folder", "absent"] {
        let file = format!("{name}.ltree");
        shot.candelabra(&format!("inspect {file}")).ends(1).complains(&["candelabra:", &file]);
    }
}

/// `candelabra inspect SCENE | head -c 1`: a reader that has seen enough is no failure.
#[test]
fn a_closed_pipe_is_fine() {
    let mut shot = Shot::still();
    // More than any pipe holds.
    shot.edit(|json| {
        for i in 0..3000 {
            let name = format!("{}{i}", "a long name of a camera ".repeat(4));
            json["nodes"].as_array_mut().unwrap().push(json!({"name": name, "camera": 0}));
            json["scenes"][0]["nodes"].as_array_mut().unwrap().push(json!(3 + i));
        }
    });
    let mut running = Command::new(env!("CARGO_BIN_EXE_candelabra"))
        .args(["inspect".as_ref(), shot.path(SCENE).as_os_str()])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut out = running.stdout.take().unwrap();
    out.read_exact(&mut [0]).unwrap();
    drop(out);
    let output = running.wait_with_output().unwrap();
    let complaint = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success() && complaint.is_empty(), "{}: {complaint}", output.status);
}

/// Whatever a user mistypes, the scene survives it.
#[test]
fn inputs_are_never_overwritten() {
    let shot = Shot::still();
    let scene = shot.read(SCENE);
    shot.candelabra(&format!("build {SCENE} -o {SCENE}")).ends(1).complains(&["own file"]);
    shot.render(&format!("-o {SCENE}")).ends(2).complains(&[".exr"]);
    assert_eq!(shot.read(SCENE), scene);
}
