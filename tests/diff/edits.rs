//! Each edit of a light is reported as just what it is, with its amount.

use crate::street::{
    POINT, SPHERE, SPOT, SUN, aspects, at, diff, edited, node, only, rename, street,
};
use candelabra::diff::{Difference, Kind, Verb};
use candelabra::scene::{
    BlockerShape, Channel, FilterKind, IesProfile, IesTable, Interpolation, Keys, LightFilter,
    LightFilters, LightKind, Pixels, Pole, Scene, Shaping, Texture, TextureUse, Wrap,
};
use glam::{DQuat, Vec2, Vec3};
use std::f64::consts::TAU;

fn is_near(a: f32, b: f32) -> bool {
    (a - b).abs() <= 1e-4 * b.abs().max(1e-2)
}

#[test]
fn a_light_that_moves_is_told_by_how_far() {
    for name in ["point", "spot", "sphere", "panel", "bulb_1"] {
        let all = edited(|scene| {
            let node = node(scene, name);
            let candelabra::scene::Trs::Parts { translation, .. } = &mut node.local else {
                panic!()
            };
            translation.y += 0.25;
        });
        for diff in all {
            assert_eq!(aspects(&diff, name), ["transform"]);
            let Difference::Transform { moved_m, turned_deg, scaled } = only(&diff).differences[0]
            else {
                panic!()
            };
            assert!(is_near(moved_m, 0.25), "{name}: {moved_m}");
            assert_eq!((turned_deg, scaled), (0.0, 1.0), "{name}");
            // No probe happens to be in the cone of the spot.
            assert!(name == "spot" || only(&diff).share > 0.0, "{name}");
        }
    }
}

#[test]
fn a_light_that_turns_is_told_by_what_angle() {
    for name in ["spot", "panel"] {
        let all = edited(|scene| {
            let node = node(scene, name);
            let candelabra::scene::Trs::Parts { rotation, .. } = &mut node.local else { panic!() };
            *rotation = DQuat::from_rotation_x(0.5);
        });
        for diff in all {
            assert_eq!(aspects(&diff, name), ["transform"]);
            let Difference::Transform { moved_m, turned_deg, scaled } = only(&diff).differences[0]
            else {
                panic!()
            };
            assert!((turned_deg - 0.5f32.to_degrees()).abs() < 0.02, "{turned_deg}");
            assert!(moved_m < 1e-6 && scaled == 1.0, "{moved_m} {scaled}");
        }
    }
}

#[test]
fn a_light_that_grows_is_told_by_what_factor() {
    for name in ["sphere", "panel", "bulb_2"] {
        let all = edited(|scene| {
            let node = node(scene, name);
            let candelabra::scene::Trs::Parts { scale, .. } = &mut node.local else { panic!() };
            *scale *= 2.0;
        });
        for diff in all {
            assert_eq!(aspects(&diff, name), ["transform", "energy"]);
            let Difference::Transform { scaled, .. } = only(&diff).differences[0] else { panic!() };
            assert!((scaled - 2.0).abs() < 0.02, "{scaled}");
            let Difference::Energy { stops, .. } = only(&diff).differences[1] else { panic!() };
            assert!(is_near(stops.unwrap(), 2.0), "four times the area");
        }
    }
}

#[test]
fn energy_is_told_in_stops() {
    let all = edited(|scene| {
        scene.lights[POINT].kind = LightKind::Point { intensity_cd: Vec3::splat(80.0) };
    });
    for diff in all {
        assert_eq!(aspects(&diff, "point"), ["energy"]);
        let Difference::Energy { before, after, stops } = only(&diff).differences[0] else {
            panic!()
        };
        assert!(is_near(before, 40.0) && is_near(after, 80.0) && is_near(stops.unwrap(), 1.0));
        let gained = (diff.totals.after.energy_cd - diff.totals.before.energy_cd) as f32;
        assert!(is_near(gained, 40.0));
    }
    // Two bulbs share a material: both are dirtied.
    for diff in edited(|scene| scene.materials[1].emission_nits *= 0.5) {
        let mut paths: Vec<_> = diff.changes.iter().map(|change| change.path()).collect();
        paths.sort_unstable();
        assert_eq!(paths, ["/street/bulb_1", "/street/bulb_2"]);
        for change in &diff.changes {
            assert_eq!(change.differences.len(), 1);
            let Difference::Energy { stops, .. } = change.differences[0] else { panic!() };
            assert!(is_near(stops.unwrap(), -1.0));
        }
    }
}

#[test]
fn a_hue_of_the_same_luminance_is_a_colour_alone() {
    let luminance = 0.2126 + 0.7152 * 0.5 + 0.0722 * 0.25;
    let all = edited(|scene| {
        let Shaping::Khr { .. } = (match scene.lights[SPOT].kind {
            LightKind::Spot { shaping, .. } => shaping,
            _ => panic!(),
        }) else {
            panic!()
        };
        let LightKind::Spot { intensity_cd, .. } = &mut scene.lights[SPOT].kind else { panic!() };
        *intensity_cd = Vec3::splat(50.0 * luminance);
    });
    for diff in all {
        // Rounding of the luminance may show as energy; nothing else may.
        assert!(aspects(&diff, "spot").iter().all(|aspect| ["energy", "color"].contains(aspect)));
        let color = only(&diff).differences.iter().find(|d| d.aspect() == "color").unwrap();
        let Difference::Color { before, after } = color else { panic!() };
        let before = before.unwrap();
        assert!((before[1] - 0.5).abs() < 1e-4 && (before[2] - 0.25).abs() < 1e-4);
        assert_eq!(after, &Some([1.0; 3]));
    }
}

#[test]
fn a_cone_is_told_by_its_half_angles() {
    let [exact, bounds] = edited(|scene| {
        let LightKind::Spot { shaping, .. } = &mut scene.lights[SPOT].kind else { panic!() };
        *shaping = Shaping::Khr { inner_rad: 0.2, outer_rad: 0.9 };
    });
    for (diff, tolerance) in [(exact, 1e-3), (bounds, 0.5)] {
        assert_eq!(aspects(&diff, "spot"), ["cone"]);
        let Difference::Cone { before_deg, after_deg } = only(&diff).differences[0] else {
            panic!()
        };
        assert!((before_deg - 0.6f32.to_degrees()).abs() < tolerance, "{before_deg}");
        assert!((after_deg - 0.9f32.to_degrees()).abs() < tolerance, "{after_deg}");
    }
}

#[test]
fn a_penumbra_is_a_pattern_that_only_scenes_tell() {
    let [of_scenes, of_trees] = edited(|scene| {
        let LightKind::Spot { shaping, .. } = &mut scene.lights[SPOT].kind else { panic!() };
        *shaping = Shaping::Khr { inner_rad: 0.5, outer_rad: 0.6 };
    });
    assert_eq!(aspects(&of_scenes, "spot"), ["pattern"]);
    assert!(of_trees.is_same());
}

#[test]
fn a_photometric_profile_is_a_pattern() {
    let profiled = |values: [f32; 8]| {
        let mut scene = street();
        let (polar_rad, around_rad) = (vec![0.0, 0.9], vec![0.0, 2.0, 4.0, TAU]);
        let table = IesTable { pole: Pole::Nadir, polar_rad, around_rad, values: values.into() };
        scene.profiles.push(IesProfile::new("lamp.ies".into(), table, 0.0));
        let LightKind::Spot { shaping, .. } = &mut scene.lights[SPOT].kind else { panic!() };
        let (softness, focus, focus_tint) = (0.0, 0.0, [0.0; 3]);
        *shaping = Shaping::Usd { cone_rad: 0.9, softness, focus, focus_tint, profile: Some(0) };
        scene
    };
    let lamp = [1.0, 2.0, 1.0, 3.0, 1.0, 2.0, 1.0, 2.0];
    assert!(diff(profiled(lamp), profiled(lamp)).is_same());
    // Another side is bright; or the whole lamp is brighter.
    let turned = [1.0, 2.0, 1.0, 2.0, 1.0, 3.0, 1.0, 2.0];
    let found = diff(profiled(lamp), profiled(turned));
    assert!(aspects(&found, "spot").contains(&"pattern"), "{:?}", aspects(&found, "spot"));
    let found = diff(profiled(lamp), profiled(lamp.map(|value| 2.0 * value)));
    let told = aspects(&found, "spot");
    assert!(told.contains(&"pattern") && told.contains(&"energy"), "{told:?}");
}

/// The street whose spot has a photometric profile of four half planes, in a cone.
fn with_beam(cone_deg: f32, values: [f32; 20]) -> Scene {
    let mut scene = street();
    let polar_rad = [0.0, 0.7, 0.9, 1.1, 1.3].into();
    let around_rad = vec![0.0, 0.2, 0.4, TAU];
    let table = IesTable { pole: Pole::Nadir, polar_rad, around_rad, values: values.into() };
    scene.profiles.push(IesProfile::new("lamp.ies".into(), table, 0.0));
    let LightKind::Spot { shaping, .. } = &mut scene.lights[SPOT].kind else { panic!() };
    let (softness, focus, focus_tint) = (0.0, 0.0, [0.0; 3]);
    let cone_rad = cone_deg.to_radians();
    *shaping = Shaping::Usd { cone_rad, softness, focus, focus_tint, profile: Some(0) };
    scene
}

#[test]
fn a_cone_that_cuts_off_a_beam_aimed_aside_is_a_pattern() {
    // The beam goes from 40 to 75 degrees off the axis on one side: it is narrower than the cone.
    let aside = |cone_deg| {
        let mut values = [0.0; 20];
        values[5..10].copy_from_slice(&[0.0, 0.0, 1.0, 1.0, 0.0]);
        with_beam(cone_deg, values)
    };
    assert!(diff(aside(60.0), aside(60.0)).is_same());
    assert_eq!(aspects(&diff(aside(60.0), aside(70.0)), "spot"), ["pattern"]);
}

#[test]
fn a_turn_about_its_own_axis_is_told_of_a_light_that_is_not_round() {
    let turned = |mut scene: Scene, angle: f64| {
        let node = node(&mut scene, "spot");
        let candelabra::scene::Trs::Parts { rotation, .. } = &mut node.local else { panic!() };
        *rotation *= DQuat::from_rotation_z(angle);
        scene
    };
    let plane = [3.0, 2.0, 1.0, 1.0, 0.5];
    let round = || with_beam(90.0, std::array::from_fn(|i| plane[i % 5]));
    let oblong =
        || with_beam(90.0, std::array::from_fn(|i| plane[i % 5] * [1.0, 2.0, 1.0, 1.0][i / 5]));
    let is_same = |of: &dyn Fn() -> Scene, angle| diff(of(), turned(of(), angle)).is_same();
    for angle in [1e-3, 0.5, 3.0] {
        assert!(is_same(&round, angle), "{angle}");
        let found = diff(oblong(), turned(oblong(), angle));
        assert_eq!(aspects(&found, "spot"), ["transform"], "{angle}");
        let Difference::Transform { turned_deg, .. } = only(&found).differences[0] else {
            panic!()
        };
        assert!((turned_deg - angle.to_degrees() as f32).abs() < 0.05, "{turned_deg}");
    }
    assert!(is_same(&oblong, 0.0));
}

#[test]
fn a_texture_is_a_pattern() {
    let textured = |texels: [[f32; 3]; 2]| {
        let mut scene = street();
        scene.textures.push(Texture {
            name: "texture".into(),
            width: 2,
            height: 1,
            pixels: Pixels::Float(texels.into()),
            wrap: [Wrap::Clamp; 2],
            bilinear: false,
        });
        scene.materials[0].emission_texture =
            Some(TextureUse { texture: 0, uv_set: 0, transform: None });
        scene.meshes[0].uv_sets = vec![[0.0, 0.5, 1.0, 1.0].map(|u| Vec2::new(u, 0.5)).into()];
        scene
    };
    let found = diff(textured([[1.0; 3], [0.5; 3]]), textured([[0.5; 3], [1.0; 3]]));
    let aspects = aspects(&found, "panel");
    assert!(aspects.contains(&"pattern"), "{aspects:?}");
    assert!(diff(textured([[1.0; 3]; 2]), textured([[1.0; 3]; 2])).is_same());
}

#[test]
fn a_kind_is_told() {
    let all = edited(|scene| {
        let intensity_cd = Vec3::splat(40.0);
        let shaping = Shaping::Khr { inner_rad: 0.2, outer_rad: 0.6 };
        scene.lights[POINT].kind = LightKind::Spot { intensity_cd, shaping };
    });
    for diff in all {
        assert_eq!(aspects(&diff, "point"), ["kind", "cone"]);
        let kinds = Difference::Kind { before: Some(Kind::Point), after: Some(Kind::Spot) };
        assert_eq!(only(&diff).differences[0], kinds);
    }
}

#[test]
fn topology_is_told_in_emitters() {
    for diff in edited(|scene| scene.meshes[0].triangles.truncate(1)) {
        let aspects = aspects(&diff, "panel");
        assert!(aspects.contains(&"topology") && aspects.contains(&"energy"), "{aspects:?}");
        let change = only(&diff);
        let is_topology = |d: &&Difference| d.aspect() == "topology";
        let topology = change.differences.iter().find(is_topology);
        assert_eq!(topology, Some(&Difference::Topology { before: 2, after: 1 }));
    }
    // Scenes tell another shape of as many triangles.
    let [of_scenes, _] = edited(|scene| scene.meshes[0].positions[2].z = 0.5);
    let same_count = Difference::Topology { before: 2, after: 2 };
    assert!(only(&of_scenes).differences.contains(&same_count));
}

#[test]
fn a_range_is_told_in_metres() {
    let [of_scenes, of_trees] = edited(|scene| scene.lights[SPHERE].range_m = Some(10.0));
    assert_eq!(aspects(&of_scenes, "sphere"), ["range"]);
    let range = Difference::Range { before_m: None, after_m: Some(10.0) };
    assert_eq!(only(&of_scenes).differences, [range]);
    assert_eq!(aspects(&of_trees, "sphere"), ["range"]);
}

#[test]
fn forcing_is_told() {
    for name in ["point", "panel", "bulb_1"] {
        let all = edited(|scene| {
            let path = format!("/street/{name}");
            candelabra::pipeline::force_lights(scene, &[path]).unwrap();
        });
        for diff in all {
            assert_eq!(aspects(&diff, name), ["forced"]);
            let forced = Difference::Forced { before: false, after: true };
            assert_eq!(only(&diff).differences, [forced]);
        }
    }
}

#[test]
fn what_changes_with_time_is_told() {
    let keys = |last: f32| Keys {
        times_s: vec![0.0, 1.0],
        values: vec![Vec3::splat(40.0), Vec3::splat(last)],
        interpolation: Interpolation::Linear,
    };
    for diff in edited(|scene| scene.lights[POINT].values = Some(keys(10.0).into())) {
        assert_eq!(aspects(&diff, "point"), ["over_time"]);
        let over_time = Difference::OverTime { before: false, after: true, apart: None };
        assert_eq!(only(&diff).differences, [over_time]);
    }
    let [mut before, mut after] = [street(), street()];
    before.lights[POINT].values = Some(keys(10.0).into());
    after.lights[POINT].values = Some(keys(20.0).into());
    let found = diff(before, after);
    // From 40 to 10 or to 20 in frames 1 to 25: apart in all but the first.
    let Difference::OverTime { apart: Some(apart), .. } = only(&found).differences[0] else {
        panic!()
    };
    assert_eq!((only(&found).differences.len(), apart.frames, apart.most_moved_m), (1, 24, 0.0));
    assert!(is_near(apart.most_stops, 1.0));
    // The same end by another way.
    let [mut before, mut after] = [street(), street()];
    let way = |x: f32| {
        Channel::Translation(Keys {
            times_s: vec![0.0, 1.0],
            values: vec![Vec3::new(6.0, 2.0, 0.0), Vec3::new(x, 2.0, 0.0)],
            interpolation: Interpolation::Linear,
        })
    };
    node(&mut before, "panel").channels.push(way(7.0));
    node(&mut after, "panel").channels.push(way(5.0));
    let found = diff(before, after);
    assert_eq!(aspects(&found, "panel"), ["over_time"]);
    let Difference::OverTime { apart: Some(apart), .. } = only(&found).differences[0] else {
        panic!()
    };
    assert_eq!((apart.frames, apart.most_stops), (24, 0.0));
    assert!(is_near(apart.most_moved_m, 2.0));
}

#[test]
fn a_light_that_is_switched_off_is_dirtied_in_scenes_and_removed_in_trees() {
    let [of_scenes, of_trees] = edited(|scene| scene.materials[0].emission_nits = Vec3::ZERO);
    assert_eq!(aspects(&of_scenes, "panel"), ["topology", "energy"]);
    let off = only(&of_scenes).after.as_ref().unwrap();
    assert_eq!((off.emitters, off.energy, off.kind), (0, 0.0, Some(Kind::Mesh)));
    assert_eq!((only(&of_trees).verb, only(&of_trees).path()), (Verb::Removed, "/street/panel"));
}

#[test]
fn a_sun_is_compared_by_scenes() {
    let [of_scenes, of_trees] = edited(|scene| {
        let LightKind::Distant { irradiance_lux, .. } = &mut scene.lights[SUN].kind else {
            panic!()
        };
        *irradiance_lux *= 4.0;
    });
    assert!(of_trees.is_same(), "no tree holds a sun");
    assert_eq!(aspects(&of_scenes, "sun"), ["energy"]);
    let Difference::Energy { before, after, stops } = only(&of_scenes).differences[0] else {
        panic!()
    };
    assert!(is_near(before, 2.0) && is_near(after, 8.0) && is_near(stops.unwrap(), 2.0));
    assert!(of_scenes.picking.unwrap().mean > 0.0);

    let [turned, _] = edited(|scene| {
        node(scene, "sun").local = at([0.0; 3], DQuat::from_rotation_x(0.3), 1.0);
    });
    let Difference::Transform { moved_m, turned_deg, .. } = only(&turned).differences[0] else {
        panic!()
    };
    assert!(moved_m == 0.0 && is_near(turned_deg, 0.3f32.to_degrees()));
}

#[test]
fn a_rename_is_no_removal() {
    for name in ["point", "panel", "bulb_2"] {
        for diff in edited(|scene| rename(scene, name, "/elsewhere/lantern")) {
            let change = only(&diff);
            assert_eq!((change.verb, change.path()), (Verb::Renamed, "/elsewhere/lantern"));
            assert_eq!(change.before.as_ref().unwrap().path, format!("/street/{name}"));
            assert!(change.differences.is_empty() && change.share == 0.0, "{change:#?}");
            assert_eq!(diff.picking.unwrap().worst, 0.0);
        }
    }
    // Carried along by a prim above it, it has moved as well.
    let all = edited(|scene| {
        node(scene, "point").local = at([0.0, 3.0, 5.0], DQuat::IDENTITY, 1.0);
        rename(scene, "point", "/alley/point");
    });
    for diff in all {
        assert_eq!(only(&diff).verb, Verb::Renamed);
        assert_eq!(only(&diff).differences.len(), 1);
        assert_eq!(only(&diff).differences[0].aspect(), "transform");
    }
}

/// A mesh light has a tree of its own only while another instance shares it.
#[test]
fn another_instance_dirties_nothing_but_itself() {
    let all = edited(|scene| {
        let gone = scene.instances.iter().position(|i| &*i.path == "/street/bulb_2").unwrap();
        scene.instances.remove(gone);
    });
    for diff in all {
        assert_eq!((only(&diff).verb, only(&diff).path()), (Verb::Removed, "/street/bulb_2"));
    }
}

#[test]
fn what_sends_no_light_is_not_compared() {
    for diff in edited(|scene| {
        node(scene, "wall").local = at([0.0; 3], DQuat::IDENTITY, 2.0);
        scene.materials[2].base_color = Vec3::X;
    }) {
        assert!(diff.is_same() && diff.changes.is_empty());
    }
}

/// Trees do not know filters; scenes tell whether there is one, what it does and where it stands.
#[test]
fn a_light_with_another_filter_has_another_pattern_that_only_scenes_tell() {
    let filtered = |row: usize, through: f32, at: &str| {
        let mut scene = street();
        let node = scene.nodes.iter().position(|node| node.path.ends_with(at)).unwrap() as u32;
        let (shape, through) = (BlockerShape::Box, Vec3::splat(through));
        let filters = vec![LightFilter { node, kind: FilterKind::Blocker { shape, through } }];
        let lights = [(row as u32, 0)].into();
        scene.light_filters = LightFilters::new(filters, vec![[0].into()], lights, [].into());
        scene
    };
    for (row, name) in [(POINT, "point"), (SUN, "sun")] {
        let half = || filtered(row, 0.5, "panel");
        assert!(diff(half(), half()).changes.is_empty());
        for other in [street(), filtered(row, 0.4, "panel"), filtered(row, 0.5, "bulb_1")] {
            assert_eq!(aspects(&diff(half(), other), name), ["pattern"]);
        }
    }
}
