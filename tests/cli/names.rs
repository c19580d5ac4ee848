//! Names that would do something to a terminal, and files that are not what they seem.

use crate::files::{SCENE, Shot};
use candelabra::light_tree::LightTree;
use serde_json::json;
use std::fs;
use std::path::Path;

/// Colours, clears the screen, ends the line and fakes another, turns the direction of writing.
const EVIL: &str =
    "\u{1b}[31m\u{1b}]0;x\u{7}\u{9b}2J\0\r\nerror: fake\u{202e}\u{2066}gpj.\u{200b}\u{feff}";

/// A scene in which everything that has a name has this one.
fn evil(place: f64) -> Shot {
    let mut shot = Shot::still();
    shot.edit(|json| {
        for node in json["nodes"].as_array_mut().unwrap() {
            let name = format!("{}{EVIL}", node["name"].as_str().unwrap());
            node["name"] = json!(name);
            node["extras"] = json!({"usdPath": format!("/{name}")});
        }
        json["nodes"][1]["translation"] = json!([place, 0, 1]);
        for table in ["materials", "cameras"] {
            json[table][0]["name"] = json!(EVIL);
        }
        json["materials"][0]["extensions"] = json!({EVIL: {}});
        json["extensionsUsed"] = json!([EVIL]);
        json["extensions"] =
            json!({"KHR_lights_punctual": {"lights": [{"type": EVIL, "name": EVIL}]}});
        json["nodes"][0]["extensions"] = json!({"KHR_lights_punctual": {"light": 0}});
        json["materials"][0]["normalTexture"] = json!({"index": 0});
        json["textures"] = json!([{"source": 0, "name": EVIL}]);
        json["images"] = json!([{"uri": EVIL, "name": EVIL}]);
    });
    shot
}

fn assert_plain(text: &str, what: &str) {
    let visible =
        |c: char| c == '\n' || !(c.is_control() || "\u{202e}\u{2066}\u{200b}\u{feff}".contains(c));
    assert!(text.chars().all(visible), "{what}: {text:?}");
    assert!(!text.lines().any(|line| line.starts_with("error: fake")), "{what}: {text:?}");
}

#[test]
fn no_name_reaches_a_terminal_as_it_is() {
    let shot = evil(0.0);
    shot.write("other.gltf", evil(0.5).json.to_string());
    shot.candelabra(&format!("build {SCENE} -o a.ltree")).ends(0);
    shot.candelabra("build other.gltf -o b.ltree").ends(0);
    fs::create_dir_all(shot.path("old")).unwrap();
    fs::create_dir_all(shot.path("new")).unwrap();
    let strange = format!("{}.ltree", EVIL.replace('\0', ""));
    fs::copy(shot.path("a.ltree"), shot.path("old").join(&strange)).unwrap();
    fs::copy(shot.path("b.ltree"), shot.path("new").join(&strange)).unwrap();
    fs::write(shot.path("new").join(format!("{}.obj", EVIL.replace('\0', ""))), "x").unwrap();
    for (code, arguments) in [
        (0, "build shot.gltf -o c.ltree --force".to_string()),
        (1, "build shot.gltf --strict".into()),
        (1, "build shot.gltf --force-light /absent".into()),
        (0, "inspect shot.gltf".into()),
        (0, "inspect shot.gltf --json".into()),
        (0, "inspect shot.gltf --dot".into()),
        (0, "inspect a.ltree".into()),
        (0, "inspect a.ltree --json".into()),
        (0, "inspect a.ltree --dot".into()),
        (0, "inspect a.ltree --html a.html".into()),
        (0, "inspect shot.gltf --html b.html".into()),
        (0, "verify a.ltree".into()),
        (1, "diff a.ltree b.ltree".into()),
        (1, "diff shot.gltf other.gltf".into()),
        (1, "diff a.ltree b.ltree --json".into()),
        (1, "diff shot.gltf other.gltf --html c.html".into()),
        (1, "diff old new".into()),
        (1, "diff old new --json".into()),
        (1, "measure shot.gltf --camera absent".into()),
    ] {
        let told = shot.candelabra(&arguments).ends(code);
        assert_plain(&told.out, &arguments);
        assert_plain(&told.err, &arguments);
    }
    for page in ["a.html", "b.html", "c.html"] {
        // Where lines end means nothing in a page.
        let html = String::from_utf8(shot.read(page)).unwrap().replace(['\r', '\n'], " ");
        assert_plain(&html, page);
    }
    for (code, arguments) in
        [(0, "-o x.exr"), (1, "-o x.exr --camera absent"), (3, "-o x.exr --tree b.ltree")]
    {
        let told = shot.render(arguments).ends(code);
        assert_plain(&told.out, arguments);
        assert_plain(&told.err, arguments);
    }
    // The paths themselves are as the file has them.
    let tree = LightTree::open(candelabra::store::MappedFile::open(&shot.path("a.ltree")).unwrap())
        .unwrap();
    assert!(tree.light_path(&tree.lights()[0]).contains('\u{202e}'));
    let mut shot = evil(0.0);
    shot.edit(|json| json["extensionsRequired"] = json!([EVIL]));
    let told = shot.candelabra(&format!("inspect {SCENE}")).ends(1);
    assert_plain(&told.err, "extensionsRequired");
}

/// A tree is written over a tree, or over nothing.
#[test]
fn nothing_but_a_tree_is_overwritten() {
    let shot = Shot::still();
    shot.write("notes.txt", "years of work");
    shot.write("empty", "");
    let build = |output: &str| shot.candelabra(&format!("build {SCENE} -o {output}"));
    build("notes.txt").ends(1).complains(&["notes.txt", "no tree file", "choose another output"]);
    build(SCENE).ends(1).complains(&["own file"]);
    assert_eq!(shot.read("notes.txt"), b"years of work");
    build("empty").ends(0);
    build("new.ltree").ends(0);
    // Whatever has become of it, it was one.
    let damaged = shot.read("new.ltree")[..100].to_vec();
    shot.write("new.ltree", damaged);
    build("new.ltree").ends(0);
    build("/dev/null").ends(1).complains(&["/dev/null", "a device or a pipe"]);
    assert!(!Path::new("/dev/null").is_file());
}

#[cfg(unix)]
#[test]
fn pipes_and_devices_are_refused_at_once() {
    let shot = Shot::still();
    for name in ["pipe.ltree", "pipe.gltf", "pipe.exr"] {
        let made = std::process::Command::new("mkfifo").arg(shot.path(name)).status();
        assert!(made.unwrap().success());
    }
    std::os::unix::fs::symlink("/dev/zero", shot.path("zero.ltree")).unwrap();
    shot.candelabra(&format!("build {SCENE} -o good.ltree")).ends(0);
    let refused = &["not a regular file"];
    for name in ["pipe.ltree", "zero.ltree"] {
        shot.candelabra(&format!("inspect {name}")).ends(1).complains(refused);
        shot.candelabra(&format!("verify {name}")).ends(2).complains(refused);
        shot.candelabra(&format!("diff good.ltree {name}")).ends(2).complains(refused);
        shot.candelabra(&format!("build {SCENE} --base {name} -o c{name}"))
            .ends(0)
            .complains(refused);
        let overwrite = shot.candelabra(&format!("build {SCENE} -o {name}"));
        overwrite.ends(1).complains(&["a device or a pipe"]);
        shot.render(&format!("-o x.exr --tree {name}")).ends(1).complains(refused);
    }
    shot.candelabra("build pipe.gltf -o d.ltree").ends(1).complains(refused);
    shot.candelabra("diff pipe.gltf good.ltree").ends(2).complains(refused);
}
