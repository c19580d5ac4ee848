//! Light filters: `extras.usdLightFilter`, and `filters` in `extras.usdLux`.

use crate::files::{File, lamp};
use candelabra::scene::{BlockerShape, FilterKind, Rod, Scene};
use glam::Vec3;
use serde_json::{Value, json};

/// The lamp, which names some filters, and nodes with filters.
fn with_filters(names: &[&str], filters: &[Value]) -> File {
    let mut file = lamp();
    file.json["nodes"][0]["extras"] = json!({"usdLux": {"type": "MeshLight", "filters": names}});
    let nodes = filters.iter().enumerate().map(|(i, filter)| {
        json!({"name": format!("F{i}"), "extras": {"usdPath": format!("/F{i}"), "usdLightFilter": filter}})
    });
    let nodes = [file.json["nodes"][0].take()].into_iter().chain(nodes);
    file.json["nodes"] = nodes.collect();
    file.json["scenes"][0]["nodes"] = (0..=filters.len()).collect();
    file
}

fn load(file: &File) -> Scene {
    file.load().unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn filters_are_read_and_found_by_path() {
    let filters = [
        json!({"type": "rod", "min": [-1, -2, -3], "max": [1, 2, 3], "radius": 0.5, "edge": 0.25,
            "ramp": [[0, 0], [0.5, 0.1], [1, 1]], "inside": [0, 0.5, 1], "outside": [1, 1, 0.5]}),
        json!({"type": "blocker", "shape": "sphere", "through": [0.25, 0.5, 1]}),
        json!({"type": "decay", "near": [1, 2], "far": [3, 4]}),
        json!({"type": "rod"}),
    ];
    let scene = load(&with_filters(&["/F2", "/F0"], &filters));
    assert_eq!(scene.notes, []);
    let found = &scene.light_filters;
    assert!(!found.is_empty());
    assert_eq!(found.of_instance(0), [2, 0]);
    assert_eq!((found.of_light(0), found.of_instance(1)), (&[][..], &[][..]));
    assert_eq!(scene.requirements().filtered_lights, 1);
    let kinds: Vec<&FilterKind> = found.all().iter().map(|filter| &filter.kind).collect();
    let rod = Rod {
        min: Vec3::new(-1.0, -2.0, -3.0),
        max: Vec3::new(1.0, 2.0, 3.0),
        radius: 0.5,
        edge: 0.25,
        ramp: vec![[0.0, 0.0], [0.5, 0.1], [1.0, 1.0]],
        inside: Vec3::new(0.0, 0.5, 1.0),
        outside: Vec3::new(1.0, 1.0, 0.5),
    };
    assert_eq!(kinds[0], &FilterKind::Rod(rod));
    let through = Vec3::new(0.25, 0.5, 1.0);
    assert_eq!(kinds[1], &FilterKind::Blocker { shape: BlockerShape::Sphere, through });
    assert_eq!(kinds[2], &FilterKind::Decay { near_m: Some([1.0, 2.0]), far_m: Some([3.0, 4.0]) });
    let FilterKind::Rod(bare) = kinds[3] else { panic!("{:?}", kinds[3]) };
    assert_eq!((bare.inside, bare.outside, bare.edge), (Vec3::ZERO, Vec3::ONE, 0.0));
    assert_eq!(bare.ramp, [[0.0, 0.0], [1.0, 1.0]]);
    assert_eq!(scene.nodes[found.all()[1].node as usize].path.as_ref(), "/F1");
}

/// For what each filter filters: the lamp's own mesh, and a card.
#[test]
fn filters_are_for_the_geometry_of_their_sets() {
    let filters = [
        json!({"type": "rod", "filterLink": 1}),
        json!({"type": "multiplier", "share": [0.5, 1, 2], "filterLink": 0}),
        json!({"type": "multiplier"}),
        json!({"type": "rod", "filterLink": 7}),
    ];
    let mut file = with_filters(&["/F0", "/F1"], &filters);
    let card = json!({"mesh": 0, "extras": {"usdLinks": {"outside": [0]}}});
    file.add("nodes", card);
    file.json["nodes"][0]["extras"]["usdLinks"] = json!({"outside": [1]});
    file.json["scenes"][0]["nodes"] = (0..=filters.len() + 1).collect();
    let scene = load(&file);
    assert_eq!(scene.notes, []);
    let linking = &scene.linking;
    let holds = |filter: u32, row: u32| {
        linking.holds(linking.of_filter(filter), linking.of_instance(row).membership)
    };
    let told: Vec<_> = (0..4).map(|filter| [holds(filter, 0), holds(filter, 1)]).collect();
    // Set 7 holds everything.
    assert_eq!(told, [[false, true], [true, false], [true, true], [true, true]]);
    assert_eq!((linking.sets(), scene.requirements().filter_links), (2, 2));
    let kinds = scene.light_filters.all().iter().map(|filter| &filter.kind);
    let shares: Vec<_> = kinds.filter(|kind| matches!(kind, FilterKind::Multiplier(_))).collect();
    let (own, plain) = (Vec3::new(0.5, 1.0, 2.0), Vec3::ONE);
    assert_eq!(shares, [&FilterKind::Multiplier(own), &FilterKind::Multiplier(plain)]);
    // A filter that no light names links nothing that anybody sees, and is no reason for a note.
    let mut file = with_filters(&[], &[json!({"type": "rod", "filterLink": 3})]);
    file.json["nodes"][0]["extras"]["usdLinks"] = json!({"outside": [3, 4]});
    let notes = load(&file).notes;
    assert!(notes.len() == 1 && notes[0].text.contains("no filter names"), "{notes:?}");
}

#[test]
fn filters_that_are_not_there_or_unknown_are_noted() {
    let scene = load(&with_filters(&["/Gone", "/F0"], &[json!({"type": "gobo"})]));
    assert!(scene.light_filters.of_instance(0).is_empty());
    let said = format!("{:?}", scene.notes);
    for words in ["/Gone is not in the file", "/F0 is not in the file", "unknown type \\\"gobo\\\""]
    {
        assert!(said.contains(words), "{said}");
    }
    assert!(scene.notes.iter().all(|note| note.category == candelabra::scene::Category::Lights));
}

#[test]
fn filters_that_make_no_sense_are_refused() {
    for (filter, words) in [
        (json!({"type": "rod", "radius": -1}), "radius or edge is negative"),
        (json!({"type": "rod", "edge": -1}), "radius or edge is negative"),
        (json!({"type": "rod", "inside": [0, -1, 0]}), "a share is negative"),
        (json!({"type": "rod", "min": [1, 0, 0], "max": [0, 0, 0]}), "min is above max"),
        (json!({"type": "rod", "ramp": [[0, 0]]}), "its ramp does not ascend"),
        (json!({"type": "rod", "ramp": []}), "its ramp does not ascend"),
        (json!({"type": "rod", "ramp": [[0, 0], [0, 0.5], [1, 1]]}), "its ramp does not ascend"),
        (json!({"type": "rod", "ramp": [[0, 0], [0.5, 2], [1, 1]]}), "its ramp does not ascend"),
        (json!({"type": "blocker"}), "shape is none of"),
        (json!({"type": "blocker", "shape": "cone"}), "shape is none of"),
        (json!({"type": "blocker", "shape": "box", "through": [-1, 0, 0]}), "a share is negative"),
        (json!({"type": "decay", "near": [2, 1]}), "ends before it starts"),
        (json!({"type": "decay", "far": [2, 1]}), "ends before it starts"),
        (json!({"type": "multiplier", "share": [0, 0, -1]}), "a share is negative"),
        (
            json!({"type": "rod", "filterLink": 16384}),
            "filterLink is 16384, and sets are 0 to 16383",
        ),
        (json!({"type": "rod", "filterLink": -1}), "invalid value"),
        (json!({"type": "rod", "filterLink": 0.5}), "invalid type"),
        (json!({"type": "rod", "filterLink": [0]}), "invalid type"),
        (json!({"type": "decay", "far": "far"}), "usdLightFilter"),
        (json!({}), "usdLightFilter"),
    ] {
        let error =
            with_filters(&[], std::slice::from_ref(&filter)).load().unwrap_err().to_string();
        assert!(error.contains(words), "{filter}: {error}");
    }
    let many: Vec<&str> = vec!["/F0"; 65];
    let error = with_filters(&many, &[]).load().unwrap_err().to_string();
    assert!(error.contains("65 filters are more than 64"), "{error}");
}
