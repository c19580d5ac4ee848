//! `--html`: pages, and what becomes of what they are about. What they look like, `tests/pages` sees.

use crate::files::{SCENE, Shot};
use serde_json::json;

/// A scene, and a second version of it in which the lamp is elsewhere.
fn versions() -> Shot {
    let mut shot = Shot::still();
    shot.edit(|json| json["nodes"][1]["translation"] = json!([1, 0, 1]));
    std::fs::rename(shot.path(SCENE), shot.path("after.gltf")).unwrap();
    shot.edit(|json| json["nodes"][1]["translation"] = json!([0, 0, 1]));
    shot
}

fn page(shot: &Shot, name: &str) -> String {
    String::from_utf8(shot.read(name)).unwrap()
}

#[test]
fn a_comparison_is_printed_and_drawn() {
    let shot = versions();
    let compare = format!("diff {SCENE} after.gltf");
    let told = shot.candelabra(&format!("{compare} --html deep/page.html")).ends(1);
    assert_eq!(told.out, shot.candelabra(&compare).ends(1).out);
    let html = page(&shot, "deep/page.html");
    assert!(html.contains("moved 1 m") && html.contains("class=\"trace orange\""), "{html}");
    assert_eq!(html.matches("class=\"heat\"").count(), 3);
    shot.candelabra(&format!("{compare} --html b.html --threads 1")).ends(1);
    assert_eq!(html, page(&shot, "b.html"));
    // Trees are seen by no camera.
    for scene in [SCENE, "after.gltf"] {
        shot.candelabra(&format!("build {scene}")).ends(0);
    }
    shot.candelabra("diff shot.ltree after.ltree --html trees.html").ends(1);
    let html = page(&shot, "trees.html");
    assert!(html.contains("moved 1 m") && !html.contains("class=\"heat\""));
}

#[test]
fn versions_that_are_the_same_have_a_page_too() {
    let shot = Shot::still();
    shot.candelabra(&format!("diff {SCENE} {SCENE} --html page.html")).ends(0);
    let html = page(&shot, "page.html");
    assert!(html.contains("<p>None.</p>") && html.matches("<circle class=\"grey\"").count() == 2);
}

#[test]
fn a_page_does_not_replace_what_it_is_about() {
    let shot = versions();
    let inputs = [SCENE, "after.gltf"].map(|name| (name, shot.read(name)));
    for (name, content) in &inputs {
        let diff = format!("diff {SCENE} after.gltf --html ./{name}");
        shot.candelabra(&diff).ends(2).complains(&[name, "choose another name"]);
        let inspect = format!("inspect {name} --html {name}");
        shot.candelabra(&inspect).ends(1).complains(&[name, "choose another name"]);
        assert_eq!(&shot.read(name), content);
    }
    shot.candelabra(&format!("inspect {SCENE} --html deep/page.html")).ends(0);
    assert!(page(&shot, "deep/page.html").starts_with("<!DOCTYPE html>"));
}

#[test]
fn folders_have_no_page() {
    let shot = Shot::still();
    shot.candelabra("diff . . --html page.html").ends(2).complains(&["page", "folders"]);
    assert_eq!(shot.names(), [SCENE]);
}
