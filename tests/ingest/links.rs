//! Linking: `extras.usdLinks`, `lightLink` and `shadowLink`.

use crate::files::{File, lamp};
use candelabra::scene::{Links, Scene};
use serde_json::{Value, json};

/// The lamp, a light at a node of its own, and cards that are in some sets.
fn with_cards(lux: Value, cards: &[Value]) -> File {
    let mut file = lamp();
    file.light(json!({"type": "point", "intensity": 5}));
    file.json["nodes"][0]["extras"] = json!({"usdLux": lux});
    let card = |links| json!({"mesh": 0, "extras": {"usdLinks": links}});
    let nodes = [file.json["nodes"][0].take()].into_iter().chain(cards.iter().map(card));
    file.json["nodes"] = nodes.collect();
    file.json["scenes"][0]["nodes"] = (0..=cards.len()).collect();
    file
}

fn load(file: &File) -> Scene {
    file.load().unwrap_or_else(|error| panic!("{error}"))
}

/// Whether the scene's first light lights, and is shadowed by, each instance.
fn told(scene: &Scene) -> Vec<[bool; 2]> {
    let Links { light, shadow, .. } = scene.linking.of_light(0);
    let of = |row| {
        let membership = scene.linking.of_instance(row).membership;
        [light, shadow].map(|set| scene.linking.holds(set, membership))
    };
    (0..scene.instances.len() as u32).map(of).collect()
}

#[test]
fn a_file_without_links_has_none() {
    let scene = load(&with_cards(json!({"type": "SphereLight"}), &[]));
    assert!(scene.linking.is_empty());
    // Nor has one in which no light names a set.
    let scene = load(&with_cards(json!({"type": "SphereLight"}), &[json!({"outside": [0]})]));
    assert!(scene.linking.is_empty());
    assert!(
        scene.notes.iter().any(|note| note.text.contains("no light and no filter names")),
        "{:?}",
        scene.notes
    );
    // Nor one whose sets hold everything.
    let scene = load(&with_cards(
        json!({"type": "SphereLight", "lightLink": 3}),
        &[json!({"outside": []})],
    ));
    assert!(scene.linking.is_empty() && scene.notes.is_empty());
}

#[test]
fn geometry_is_in_the_sets_that_it_says() {
    let cards = [
        json!({"outside": [0]}),
        json!({"inside": [0]}),
        json!({"inside": []}),
        json!({"outside": [0, 1]}),
        json!({"outside": []}),
        json!({"outside": [1]}),
    ];
    let scene =
        load(&with_cards(json!({"type": "SphereLight", "lightLink": 0, "shadowLink": 1}), &cards));
    // The lamp's own mesh is in every set.
    let expected = [
        [true, true],
        [false, true],
        [true, false],
        [false, false],
        [false, false],
        [true, true],
        [true, false],
    ];
    assert_eq!(told(&scene), expected);
    // Two of them say the same in two ways, twice.
    assert_eq!((scene.linking.sets(), scene.linking.memberships().len()), (2, 3));
    assert_eq!(scene.notes, []);
}

#[test]
fn a_part_of_a_mesh_may_be_in_other_sets() {
    let mut file =
        with_cards(json!({"type": "SphereLight", "lightLink": 0}), &[json!({"outside": [0]})]);
    let part = file.json["meshes"][0]["primitives"][0].clone();
    let primitives = [json!(null), json!({"outside": []}), json!({"inside": []})].map(|links| {
        let mut part = part.clone();
        if !links.is_null() {
            part["extras"] = json!({"usdLinks": links});
        }
        part
    });
    file.json["meshes"][0]["primitives"] = primitives.into();
    let lit: Vec<bool> = told(&load(&file)).into_iter().map(|[lit, _]| lit).collect();
    // At the lamp's node, then at the card's.
    assert_eq!(lit, [true, true, false, false, true, false]);
}

#[test]
fn every_kind_of_light_may_be_linked() {
    let dome = json!({"extras": {"usdLux": {"type": "DomeLight", "lightLink": 0}}});
    let mesh = json!({"mesh": 0, "extras": {"usdLux": {"type": "MeshLight", "shadowLink": 0}}});
    let sphere = json!({"mesh": 0, "extras": {
        "usdLux": {"type": "SphereLight", "radius": 1, "lightLink": 0}, "usdLinks": {"outside": [0]}}});
    let mut file = with_cards(json!({"type": "SphereLight"}), &[json!({"outside": [0]})]);
    for node in [dome, mesh, sphere] {
        file.add("nodes", node);
    }
    file.json["scenes"][0]["nodes"] = json!([0, 1, 2, 3, 4]);
    let scene = load(&file);
    let linking = &scene.linking;
    let lights: Vec<_> = (0..3).map(|row| linking.of_light(row)).collect();
    assert_eq!((lights[0], lights[1].light, lights[2].light), (Links::default(), Some(0), Some(0)));
    assert_eq!((linking.of_instance(2).shadow, lights[2].membership), (Some(0), Some(0)));
}

#[test]
fn fog_is_in_the_sets_of_its_node() {
    let mut file = with_cards(json!({"type": "SphereLight", "lightLink": 0}), &[]);
    file.add(
        "nodes",
        json!({"extras": {"usdFog": {"extinction": 0.5}, "usdLinks": {"outside": [0]}}}),
    );
    file.json["scenes"][0]["nodes"] = json!([0, 1]);
    let linking = load(&file).linking;
    assert!(!linking.holds(linking.of_light(0).light, linking.of_medium()));
}

#[test]
fn what_breaks_the_contract_is_refused() {
    let refuses = |file: &File, problem: &str| {
        let error = file.load().err().unwrap_or_else(|| panic!("loads in spite of: {problem}"));
        assert!(error.object.starts_with("node "), "{error}");
        assert!(error.problem.contains(problem), "{problem:?} is not in: {error}");
        assert!(!error.remedy.is_empty() && error.to_string().contains("scene.gltf"));
    };
    let linked = json!({"type": "SphereLight", "lightLink": 0});
    for (links, problem) in [
        (json!({}), "not just one of inside and outside"),
        (json!({"inside": [0], "outside": [1]}), "not just one"),
        (json!({"inside": [1, 0]}), "do not ascend"),
        (json!({"outside": [1, 1]}), "do not ascend"),
        (json!({"outside": [16384]}), "sets are 0 to 16383"),
        (json!({"outside": [-1]}), "invalid value"),
        (json!({"outside": [0.5]}), "invalid type"),
        (json!({"outside": 0}), "invalid type"),
        (json!([0]), "invalid"),
        (json!("all"), "invalid type"),
    ] {
        refuses(&with_cards(linked.clone(), &[links]), problem);
    }
    for (set, problem) in [
        (json!(16384), "sets are 0 to 16383"),
        (json!(-1), "invalid value"),
        (json!(1e300), "invalid type"),
        (json!([0]), "invalid type"),
    ] {
        for key in ["lightLink", "shadowLink"] {
            let mut lux = json!({"type": "SphereLight"});
            lux[key] = set.clone();
            refuses(&with_cards(lux, &[]), problem);
        }
    }
}

/// No file can ask for more memory than what it lists.
#[test]
fn sets_out_of_proportion_are_refused() {
    let lux = json!({"type": "SphereLight", "lightLink": 16383});
    load(&with_cards(lux.clone(), &vec![json!({"inside": [7]}); 20_000]));
    let many: Vec<Value> = (0..16_385u32)
        .map(|i| json!({"outside": if i < 16384 { vec![i] } else { vec![0, i - 16383] }}))
        .collect();
    let error = with_cards(lux, &many).load().unwrap_err();
    assert!(error.problem.contains("too many") || error.problem.contains("memory"), "{error}");
}
