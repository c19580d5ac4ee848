//! `candelabra inspect`: what is said of a tree, to people and to programs.

use crate::files::{SCENE, Shot};
use serde_json::{Value, json};
use std::process::Command;

/// A scene of so many point lights in a row, the last the strongest, with its tree.
fn lamps(count: usize) -> Shot {
    let mut shot = Shot::still();
    shot.edit(|json| {
        json["extensionsUsed"].as_array_mut().unwrap().push(json!("KHR_lights_punctual"));
        let lights: Vec<Value> =
            (0..count).map(|i| json!({"type": "point", "intensity": i + 1})).collect();
        json["extensions"] = json!({"KHR_lights_punctual": {"lights": lights}});
        let first = json["nodes"].as_array().unwrap().len();
        for i in 0..count {
            json["nodes"].as_array_mut().unwrap().push(json!({
                "name": format!("point_{i}"),
                "translation": [i % 100, 2 + i % 3, i / 100],
                "extensions": {"KHR_lights_punctual": {"light": i}},
            }));
            json["scenes"][0]["nodes"].as_array_mut().unwrap().push(json!(first + i));
        }
        json["scenes"][0]["nodes"].as_array_mut().unwrap().remove(1);
    });
    shot.candelabra(&format!("build {SCENE}")).ends(0);
    shot
}

fn json_of(shot: &Shot, arguments: &str) -> Value {
    serde_json::from_str(&shot.candelabra(arguments).ends(0).out).unwrap()
}

#[test]
fn the_numbers_of_a_tree_agree_with_each_other() {
    let shot = lamps(300);
    let report = json_of(&shot, "inspect shot.ltree --json --lights 3");
    assert_eq!((&report["schema"], &report["version"]), (&json!("candelabra.tree"), &json!(2)));
    assert_eq!((&report["lights"], &report["emitters"]), (&json!(300), &json!(300)));
    assert_eq!(report["bytes"], shot.read("shot.ltree").len());
    let sections = report["sections"].as_array().unwrap();
    let bytes: u64 = sections.iter().map(|section| section["bytes"].as_u64().unwrap()).sum();
    assert!(bytes < report["bytes"].as_u64().unwrap());
    let [still] = report["trees"].as_array().unwrap().as_slice() else { panic!("{report}") };
    let number = |name: &str| still[name].as_f64().unwrap();
    assert_eq!((still["kind"].as_str(), number("leaves")), (Some("still"), 300.0));
    // Every group but the root is one lane of another.
    let used = number("leaves") + number("groups") - 1.0;
    assert!((number("fill") - used / (8.0 * number("groups"))).abs() < 1e-12);
    assert!(number("deepest") >= number("mean_depth") && number("mean_depth") >= 300f64.log(8.0));
    assert!(number("cost") > 1.0 && number("cost") < number("groups"));
    let heaviest: Vec<&str> = report["heaviest"]
        .as_array()
        .unwrap()
        .iter()
        .map(|light| light["path"].as_str().unwrap())
        .collect();
    assert_eq!(heaviest, ["/point_299", "/point_298", "/point_297"]);
    let energy = 300.0 * 301.0 / 2.0;
    assert!((report["energy"].as_f64().unwrap() / energy - 1.0).abs() < 1e-6);
    let share = report["heaviest"][0]["share"].as_f64().unwrap();
    assert!((share - 300.0 / energy).abs() < 1e-6);
}

#[test]
fn one_group_costs_one() {
    let report = json_of(&lamps(8), "inspect shot.ltree --json");
    let still = &report["trees"][0];
    assert_eq!((&still["groups"], &still["deepest"]), (&json!(1), &json!(1)));
    assert_eq!((&still["fill"], &still["cost"]), (&json!(1.0), &json!(1.0)));
}

#[test]
fn kinds_of_trees_are_told_apart() {
    let shot = Shot::moving();
    shot.candelabra(&format!("build {SCENE} --frames 1-4 --force-light /lamp")).ends(0);
    let report = json_of(&shot, "inspect shot.ltree --json");
    assert_eq!((&report["changing"], &report["forced"]), (&json!(1), &json!(1)));
    assert_eq!(report["frames"], json!({"first": 1, "last": 4, "count": 4}));
    assert_eq!(report["heaviest"][0]["kind"], "mesh");
    assert_eq!(report["heaviest"][0]["color"], json!([1.0, 1.0, 1.0]));
}

#[test]
fn a_scene_as_json_says_what_it_requires() {
    let report = json_of(&Shot::moving(), &format!("inspect {SCENE} --json"));
    assert_eq!(report["schema"], "candelabra.scene");
    assert_eq!(report["requires"]["mesh_lights"], 1);
    assert_eq!(report["cameras"][0]["path"], "/eye");
    assert_eq!(report["frames"]["count"], 25);
}

/// What a report says of a feature: how many are found, whether it is on, and its bytes.
fn feature(report: &Value, name: &str) -> (u64, String, Option<u64>) {
    let features = report["features"].as_array().unwrap();
    let row = features.iter().find(|row| row["name"] == name).unwrap_or_else(|| panic!("{name}"));
    (row["found"].as_u64().unwrap(), row["state"].as_str().unwrap().into(), row["bytes"].as_u64())
}

#[test]
fn what_a_scene_lacks_is_off_and_costs_nothing() {
    let report = json_of(&Shot::still(), &format!("inspect {SCENE} --json"));
    let (mut on, mut off) = (Vec::new(), 0);
    for row in report["features"].as_array().unwrap() {
        match row["state"].as_str().unwrap() {
            "on" => on.push(row["name"].as_str().unwrap()),
            state => {
                off += 1;
                let is_nothing = row["found"] == 0 && row["bytes"].is_null();
                assert!(state == "off" && (is_nothing || !row["note"].is_null()), "{row}");
            }
        }
    }
    // The default knob splits between the lamp's two triangles.
    assert_eq!(on, ["mesh lights", "splitting", "glossy materials"]);
    assert!(off > 15, "{report}");
    assert_eq!(report["light_groups"], json!([]));
}

#[test]
fn the_tree_of_a_plain_scene_has_no_section_for_what_it_lacks() {
    let report = json_of(&lamps(8), "inspect shot.ltree --json");
    let mut ids: Vec<&str> =
        report["sections"].as_array().unwrap().iter().map(|s| s["id"].as_str().unwrap()).collect();
    ids.sort();
    assert_eq!(ids, ["GRUP", "LGHT", "META", "PATH", "TREE"]);
}

#[test]
fn textures_that_no_light_uses_are_not_baked() {
    let shot = Shot::still().with_picture_file();
    let report = json_of(&shot, &format!("inspect {SCENE} --json"));
    assert_eq!(feature(&report, "textures"), (1, "on".into(), Some(4 * 4 * 4)));
    assert_eq!(feature(&report, "textured mesh lights"), (0, "off".into(), None));
    shot.candelabra(&format!("inspect {SCENE}")).ends(0).says("none on emitters");
}

#[test]
fn a_texture_on_a_light_is_baked_into_as_many_bytes_as_the_report_says() {
    let mut shot = Shot::still().with_picture_file();
    shot.edit(|json| json["materials"][1]["emissiveTexture"] = json!({"index": 0}));
    let report = json_of(&shot, &format!("inspect {SCENE} --json"));
    let (found, state, bytes) = feature(&report, "textured mesh lights");
    assert_eq!((found, state.as_str()), (1, "on"));
    shot.candelabra(&format!("build {SCENE}")).ends(0);
    let tree = json_of(&shot, "inspect shot.ltree --json");
    let sections = tree["sections"].as_array().unwrap().iter();
    let baked =
        sections.filter(|section| ["TXTR", "MEAN"].contains(&section["id"].as_str().unwrap()));
    assert_eq!(bytes, Some(baked.map(|section| section["bytes"].as_u64().unwrap()).sum()));
}

#[test]
fn a_texture_that_nothing_uses_is_off() {
    let mut shot = Shot::still().with_picture_file();
    shot.edit(|json| {
        json["materials"][0]["pbrMetallicRoughness"] = json!({"metallicFactor": 0});
        // The wall does not emit.
        json["materials"][0]["emissiveTexture"] = json!({"index": 0});
    });
    let report = json_of(&shot, &format!("inspect {SCENE} --json"));
    assert!(
        matches!(feature(&report, "textures"), (0 | 1, state, None) if state == "off"),
        "{report}"
    );
}

#[test]
fn one_light_that_moves_switches_on_the_rows_of_all_frames() {
    let shot = Shot::moving();
    let report = json_of(&shot, &format!("inspect {SCENE} --json"));
    let (found, state, bytes) = feature(&report, "lights that move, vary or deform");
    assert_eq!((found, state.as_str()), (1, "on"));
    shot.candelabra(&format!("build {SCENE}")).ends(0);
    let tree = json_of(&shot, "inspect shot.ltree --json");
    let sections = tree["sections"].as_array().unwrap().iter();
    let rows =
        sections.filter(|section| ["FRAM", "FPRT"].contains(&section["id"].as_str().unwrap()));
    assert_eq!(bytes, Some(rows.map(|section| section["bytes"].as_u64().unwrap()).sum()));
}

#[test]
fn fog_is_on_where_it_is() {
    let mut shot = Shot::still();
    shot.edit(|json| json["scenes"][0]["extras"] = json!({"usdFog": {"extinction": 0.1}}));
    let report = json_of(&shot, &format!("inspect {SCENE} --json"));
    assert_eq!(feature(&report, "fog"), (1, "on".into(), None));
}

#[test]
fn light_groups_are_listed_with_their_lights() {
    let mut shot = lamps(3);
    shot.edit(|json| {
        for node in json["nodes"].as_array_mut().unwrap().iter_mut().rev().take(2) {
            node["extras"] = json!({"usdLux": {"type": "SphereLight", "group": "key"}});
        }
    });
    let report = json_of(&shot, &format!("inspect {SCENE} --json"));
    let groups = json!([{"name": "default", "lights": 1}, {"name": "key", "lights": 2}]);
    assert_eq!(report["light_groups"], groups);
    assert_eq!(feature(&report, "light groups").1, "offered");
    shot.candelabra(&format!("inspect {SCENE}")).ends(0).says("light group key: 2 lights");
    shot.candelabra(&format!("inspect {SCENE} --html a.html")).ends(0);
    let html = String::from_utf8(shot.read("a.html")).unwrap();
    assert!(html.contains("<td>key</td>") && html.contains("What the scene requires"));
}

/// The share of the energy that a line of the graph states.
fn percent(line: &str) -> f64 {
    let before = line.split(" % of").next().unwrap();
    before.rsplit(['"', 'n']).next().unwrap().parse().unwrap()
}

#[test]
fn the_graph_is_the_top_of_the_tree() {
    let shot = lamps(300);
    let nodes = |depth: usize| {
        let told = shot.candelabra(&format!("inspect shot.ltree --dot --depth {depth}")).ends(0);
        let lines = told.out.lines();
        let (nodes, rest): (Vec<_>, Vec<_>) =
            lines.map(String::from).partition(|line| line.contains("label="));
        let edges = rest.iter().filter(|line| line.contains("->")).count();
        assert_eq!(nodes.len(), edges + 1, "a tree");
        nodes
    };
    let [root] = nodes(0).try_into().unwrap();
    assert!(root.contains("100.00 % of the energy") && root.contains("dashed"));
    let top = nodes(1);
    assert!(top.len() > 2 && top.len() <= 9);
    let parts: f64 = top[1..].iter().map(|line| percent(line)).sum();
    assert!((parts - 100.0).abs() < 0.1, "{top:?}");
    // Deep enough, every light is there by its name, and nothing is left out.
    let all = nodes(99);
    assert_eq!(all.iter().filter(|line| line.contains("/point_")).count(), 300);
    assert!(!all.iter().any(|line| line.contains("dashed")));
    // A scene's tree is built for it.
    shot.candelabra(&format!("inspect {SCENE} --dot --depth 0")).ends(0).says(&root);
}

#[test]
fn hostile_names_stay_names_in_a_graph() {
    let mut shot = Shot::still();
    shot.edit(|json| json["nodes"][1]["name"] = json!("a\"];\n x -> y [label=\"\\"));
    shot.candelabra(&format!("build {SCENE}")).ends(0);
    let told = shot.candelabra("inspect shot.ltree --dot").ends(0);
    let quotes = |line: &str| line.replace("\\\\", "").replace("\\\"", "").matches('"').count();
    assert!(told.out.lines().all(|line| quotes(line) % 2 == 0), "{}", told.out);
    assert!(told.out.lines().all(|line| !line.trim_start().starts_with("x ->")), "{}", told.out);
}

#[test]
fn a_page_of_very_many_lights_is_small_and_says_what_it_leaves_out() {
    let shot = lamps(12_000);
    let page = |name: &str, threads: &str| {
        let done = Command::new(env!("CARGO_BIN_EXE_candelabra"))
            .current_dir(shot.path(""))
            .args(["inspect", "shot.ltree", "--html", name])
            .env("RAYON_NUM_THREADS", threads)
            .output()
            .unwrap();
        assert!(done.status.success(), "{done:?}");
        String::from_utf8(shot.read(name)).unwrap()
    };
    let html = page("a.html", "1");
    assert_eq!(html, page("b.html", "2"));
    assert_eq!(html.matches("<circle").count(), 2 * 10_000);
    assert!(html.contains("The 10,000 heaviest of 12,000 lights"));
    assert!(html.contains("The 1,000 heaviest of 12,000."));
    assert!(html.contains("data:image/png") && html.len() < 6_000_000, "{}", html.len());
}

#[test]
fn one_form_at_a_time() {
    let shot = lamps(1);
    shot.candelabra("inspect shot.ltree --html a.html --json").ends(2);
    shot.candelabra("inspect shot.ltree --depth 3").ends(2);
}
