//! A tree is stale if something has changed that it depends on, and then alone.

use candelabra::emitter::Emitters;
use candelabra::light_tree::LightTree;
use candelabra::pipeline::{self, StaleTree, TreeError};
use candelabra::scene::{
    Camera, Channel, IesProfile, IesTable, Instance, Interpolation, Keys, Light, LightKind,
    Material, Medium, Mesh, Node, Pixels, Pole, Scene, Shaping, Texture, TextureUse, Trs, Wrap,
};
use glam::{DQuat, DVec3, Quat, Vec2, Vec3};
use std::f32::consts::PI;
use std::path::Path;

fn keys(values: [Vec3; 2]) -> Keys<Vec3> {
    Keys { times_s: vec![0.0, 0.1], values: values.into(), interpolation: Interpolation::Linear }
}

fn texture(texels: [[f32; 3]; 2]) -> Texture {
    let (name, pixels) = ("picture".into(), Pixels::Float(texels.into()));
    Texture { name, width: 2, height: 1, pixels, wrap: [Wrap::Clamp; 2], bilinear: false }
}

/// Triangles around the first corner.
fn fan(corners: u32, material: u32) -> Mesh {
    let corner = |i: u32| Vec3::new((i as f32).cos(), (i as f32).sin(), 0.0);
    Mesh {
        positions: (0..corners + 2).map(corner).collect(),
        uv_sets: vec![(0..corners + 2).map(|i| Vec2::splat(i as f32 / 12.0)).collect()],
        triangles: (0..corners).map(|i| [0, i + 1, i + 2]).collect(),
        material: Some(material),
        ..Mesh::default()
    }
}

const WALL: usize = 0;
const NEON: usize = 1;
const LANTERN: usize = 2;
const BULB: usize = 0;
const TORCH: usize = 1;
const MOON: usize = 2;
const TRAM: usize = 3;
const SIGN: usize = 4;
const SUN: usize = 5;
const SKY: usize = 6;

/// One of everything: lights of all kinds, and what is no light or lies at infinity.
fn street() -> Scene {
    let in_texture = |texture| Some(TextureUse { texture, uv_set: 0, transform: None });
    let plaster = Material { base_color_texture: in_texture(0), ..Material::default() };
    let glow = Material { emission_nits: Vec3::ONE, ..Material::default() };
    let picture = Material { emission_texture: in_texture(1), ..glow.clone() };
    let mut scene = Scene {
        source: "street.gltf".into(),
        meshes: vec![fan(3, WALL as u32), fan(4, NEON as u32), fan(9, LANTERN as u32)],
        materials: vec![plaster, picture, glow],
        textures: vec![texture([[0.5; 3]; 2]), texture([[1.0; 3], [0.2; 3]])],
        ..Scene::default()
    };
    let mut node = |path: &str| {
        let translation = DVec3::new(scene.nodes.len() as f64, 1.0, 0.0);
        let place = Trs::Parts { translation, rotation: DQuat::IDENTITY, scale: DVec3::ONE };
        scene.nodes.push(Node::fixed(path, None, place));
        scene.nodes.len() as u32 - 1
    };
    for (path, mesh) in [("/wall", 0), ("/neon", 1), ("/lantern_a", 2), ("/lantern_b", 2)] {
        let (node, path) = (node(path), path.into());
        let (values, shaping) = (None, None);
        scene.instances.push(Instance {
            path,
            node,
            mesh,
            values,
            shaping,
            forced: false,
            visibility: Default::default(),
        });
    }
    let intensity_cd = Vec3::new(1.0, 2.0, 3.0);
    let khr = Shaping::Khr { inner_rad: 0.2, outer_rad: 0.5 };
    let usd = Shaping::Usd {
        cone_rad: 1.0,
        softness: 0.5,
        focus: 0.0,
        focus_tint: [0.0; 3],
        profile: None,
    };
    for (path, kind) in [
        ("/bulb", LightKind::Point { intensity_cd }),
        ("/torch", LightKind::Spot { intensity_cd, shaping: khr }),
        ("/moon", LightKind::Sphere { radiance_nits: Vec3::ONE, radius: 0.5, shaping: Some(usd) }),
        ("/tram", LightKind::Point { intensity_cd }),
        ("/sign", LightKind::Point { intensity_cd }),
        ("/sun", LightKind::Distant { irradiance_lux: Vec3::ONE, angle_rad: 0.01 }),
        ("/sky", LightKind::Dome { radiance_nits: Vec3::ONE, texture: None }),
    ] {
        let node = node(path);
        scene.lights.push(Light {
            node,
            kind,
            values: None,
            range_m: None,
            forced: false,
            visibility: Default::default(),
        });
    }
    let eye = node("/eye");
    scene.cameras.push(Camera::perspective(eye, 0.8));
    let (tram, eye) = (scene.lights[TRAM].node as usize, eye as usize);
    scene.nodes[tram].channels = vec![Channel::Translation(keys([Vec3::ZERO, Vec3::X]))];
    scene.nodes[eye].channels = vec![Channel::Translation(keys([Vec3::ZERO, Vec3::X]))];
    scene.lights[SIGN].values = Some(keys([Vec3::ONE, Vec3::splat(3.0)]).into());
    scene
}

/// What the tree of the street says to a scene.
fn staleness(scene: &Scene) -> Option<StaleTree> {
    let street = street();
    let survey = pipeline::survey(&street, &Emitters::collect(&street), &[1, 2, 3]).unwrap();
    let tree = LightTree::open(pipeline::build_tree(&survey)).unwrap();
    let emitters = Emitters::collect(scene);
    match pipeline::check_fresh(&tree, Path::new("street.ltree"), scene, &emitters, &[], true) {
        Ok(()) => None,
        Err(TreeError::Stale { cause, .. }) => Some(cause),
        Err(other) => panic!("{other}"),
    }
}

fn edited(edit: fn(&mut Scene)) -> Scene {
    let mut scene = street();
    edit(&mut scene);
    scene
}

fn move_node(
    scene: &mut Scene,
    path: &str,
    change: impl FnOnce(&mut DVec3, &mut DQuat, &mut DVec3),
) {
    let node = scene.nodes.iter_mut().find(|node| &*node.path == path).unwrap();
    let Trs::Parts { translation, rotation, scale } = &mut node.local else { unreachable!() };
    change(translation, rotation, scale);
}

fn channels<'a>(scene: &'a mut Scene, path: &str) -> &'a mut Vec<Channel> {
    &mut scene.nodes.iter_mut().find(|node| &*node.path == path).unwrap().channels
}

type Edits<T> = Vec<(&'static str, T, fn(&mut Scene))>;

#[test]
fn what_the_tree_does_not_depend_on_keeps_it_fresh() {
    assert_eq!(staleness(&street()), None);
    let edits: Edits<()> = vec![
        ("camera moved", (), |s| move_node(s, "/eye", |t, _, _| t.x += 9.0)),
        ("lens", (), |s| s.cameras[0] = Camera::perspective(s.cameras[0].node, 0.5)),
        ("camera removed", (), |s| s.cameras.clear()),
        ("camera moves for longer", (), |s| {
            let longer = Keys { times_s: vec![0.0, 9.0], ..keys([Vec3::ZERO, Vec3::Y]) };
            *channels(s, "/eye") = vec![Channel::Translation(longer)];
        }),
        ("wall moved", (), |s| move_node(s, "/wall", |t, _, _| t.x += 9.0)),
        ("wall moves", (), |s| {
            channels(s, "/wall").push(Channel::Translation(keys([Vec3::ZERO, Vec3::X])));
        }),
        ("wall of another shape", (), |s| s.meshes[WALL].positions[1] *= 3.0),
        ("wall painted", (), |s| s.materials[WALL].base_color = Vec3::X),
        ("wallpaper", (), |s| s.textures[0] = texture([[0.1; 3], [0.9; 3]])),
        ("wall removed", (), |s| drop(s.instances.remove(WALL))),
        ("wall forced", (), |s| s.instances[WALL].forced = true),
        ("lamp's own paint", (), |s| s.materials[NEON].base_color = Vec3::X),
        ("fog", (), |s| {
            let (scattering, absorption) = (Vec3::ONE, Vec3::ZERO);
            s.medium = Some(Medium { scattering, absorption, anisotropy: 0.0, region: None });
        }),
        ("another order in the file", (), |s| {
            s.lights.reverse();
            s.instances.reverse();
        }),
        // Lights at infinity are beside the tree, and how a spot fades inside its cone is not in it.
        ("sun", (), |s| move_node(s, "/sun", |_, r, _| *r = DQuat::from_rotation_x(1.0))),
        ("sky", (), |s| s.lights[SKY].kind = s.lights[SUN].kind.clone()),
        ("fading", (), |s| {
            let LightKind::Spot { shaping, .. } = &mut s.lights[TORCH].kind else { return };
            *shaping = Shaping::Khr { inner_rad: 0.3, outer_rad: 0.5 };
        }),
        ("point turned", (), |s| move_node(s, "/bulb", |_, r, _| *r = DQuat::from_rotation_x(1.0))),
    ];
    for (name, (), edit) in edits {
        assert_eq!(staleness(&edited(edit)), None, "{name}");
    }
}

#[test]
fn an_edit_of_a_light_makes_it_stale_and_names_the_light() {
    let edits: Edits<&str> = vec![
        ("moved", "/bulb", |s| move_node(s, "/bulb", |t, _, _| t.y = t.y.next_up() + 1e-6)),
        ("intensity", "/bulb", |s| {
            s.lights[BULB].kind = LightKind::Point { intensity_cd: Vec3::ONE };
        }),
        ("range", "/bulb", |s| s.lights[BULB].range_m = Some(10.0)),
        ("kind", "/bulb", |s| {
            let shaping = Shaping::Khr { inner_rad: 0.0, outer_rad: PI / 2.0 };
            s.lights[BULB].kind =
                LightKind::Spot { intensity_cd: Vec3::new(1.0, 2.0, 3.0), shaping };
        }),
        ("forced", "/bulb", |s| s.lights[BULB].forced = true),
        ("moves", "/bulb", |s| {
            channels(s, "/bulb").push(Channel::Translation(keys([Vec3::ZERO, Vec3::X])));
        }),
        ("varies", "/bulb", |s| s.lights[BULB].values = Some(keys([Vec3::ONE, Vec3::X]).into())),
        ("aim", "/torch", |s| {
            move_node(s, "/torch", |_, r, _| *r = DQuat::from_rotation_x(0.001));
        }),
        ("cone", "/torch", |s| {
            let LightKind::Spot { shaping, .. } = &mut s.lights[TORCH].kind else { return };
            *shaping = Shaping::Khr { inner_rad: 0.2, outer_rad: 0.51 };
        }),
        ("radius", "/moon", |s| {
            let LightKind::Sphere { radius, .. } = &mut s.lights[MOON].kind else { return };
            *radius = 0.51;
        }),
        ("scaled", "/moon", |s| move_node(s, "/moon", |_, _, scale| *scale *= 1.01)),
        ("radiance", "/moon", |s| {
            let LightKind::Sphere { radiance_nits, .. } = &mut s.lights[MOON].kind else { return };
            *radiance_nits *= 1.01;
        }),
        ("profile", "/moon", |s| {
            let LightKind::Sphere { shaping, .. } = &mut s.lights[MOON].kind else { return };
            *shaping = None;
        }),
        ("photometric profile", "/moon", |s| {
            let (polar_rad, around_rad, values) = (vec![0.0, 1.0], vec![0.0], vec![1.0, 2.0]);
            let table = IesTable { pole: Pole::Nadir, polar_rad, around_rad, values };
            s.profiles.push(IesProfile::new("moon.ies".into(), table, 0.0));
            let LightKind::Sphere { shaping, .. } = &mut s.lights[MOON].kind else { return };
            let Some(Shaping::Usd { profile, .. }) = shaping else { return };
            *profile = Some(0);
        }),
        ("the way", "/tram", |s| {
            *channels(s, "/tram") = vec![Channel::Translation(keys([Vec3::ZERO, Vec3::Y]))];
        }),
        ("the hour", "/tram", |s| {
            let later = Keys { times_s: vec![0.0, 0.2], ..keys([Vec3::ZERO, Vec3::X]) };
            *channels(s, "/tram") = vec![Channel::Translation(later)];
        }),
        ("halted", "/tram", |s| channels(s, "/tram").clear()),
        ("key", "/sign", |s| {
            s.lights[SIGN].values = Some(keys([Vec3::ONE, Vec3::splat(3.1)]).into());
        }),
        ("stepped", "/sign", |s| {
            s.lights[SIGN].values.as_mut().unwrap().interpolation = Interpolation::Step;
        }),
        ("turned", "/neon", |s| {
            move_node(s, "/neon", |_, r, _| *r = DQuat::from_rotation_z(0.001));
        }),
        ("stretched", "/neon", |s| move_node(s, "/neon", |_, _, scale| scale.x *= 1.001)),
        ("strength", "/neon", |s| s.materials[NEON].emission_nits *= 1.001),
        ("texels", "/neon", |s| s.textures[1] = texture([[1.0; 3], [0.21; 3]])),
        ("lookup", "/neon", |s| {
            s.meshes[NEON].uv_sets[0].iter_mut().for_each(|uv| *uv = Vec2::ONE - *uv);
        }),
        ("no texture", "/neon", |s| s.materials[NEON].emission_texture = None),
        ("other side", "/neon", |s| s.materials[NEON].double_sided = true),
        ("vertex", "/neon", |s| s.meshes[NEON].positions[2].z = 0.01),
        ("a triangle less", "/neon", |s| s.meshes[NEON].triangles.truncate(3)),
        ("a triangle turned over", "/neon", |s| s.meshes[NEON].triangles[0].reverse()),
        ("mesh varies", "/neon", |s| s.instances[NEON].values = Some(keys([Vec3::ONE; 2]).into())),
        ("mesh turns", "/neon", |s| {
            let values = vec![Quat::IDENTITY, Quat::from_rotation_x(1.0)];
            let (times_s, interpolation) = (vec![0.0, 0.1], Interpolation::Linear);
            let keys = Keys { times_s, values, interpolation };
            channels(s, "/neon").push(Channel::Rotation(keys));
        }),
        ("mesh shaped", "/neon", |s| {
            s.instances[NEON].shaping = Some(Shaping::Khr { inner_rad: 0.1, outer_rad: 0.4 });
        }),
        ("mesh forced", "/neon", |s| s.instances[NEON].forced = true),
        ("one instance", "/lantern_a", |s| move_node(s, "/lantern_a", |t, _, _| t.x += 0.01)),
        ("all instances", "/lantern_a /lantern_b", |s| s.meshes[LANTERN].positions[3].z = 0.01),
        ("all stronger", "/lantern_a /lantern_b", |s| {
            s.materials[LANTERN].emission_nits = Vec3::splat(1.01);
        }),
    ];
    for (name, paths, edit) in edits {
        let stale = staleness(&edited(edit)).unwrap_or_else(|| panic!("{name} is not seen"));
        assert_eq!(stale.dirtied.join(" "), paths, "{name}");
        assert!(stale.added.is_empty() && stale.removed.is_empty(), "{name}: {stale:?}");
    }
}

#[test]
fn lights_that_come_and_go_are_named() {
    let lists = |edit| {
        let StaleTree { added, removed, dirtied, .. } = staleness(&edited(edit)).unwrap();
        [added, removed, dirtied].map(|paths| paths.join(" "))
    };
    let gone = lists(|s| drop(s.lights.remove(BULB)));
    assert_eq!(gone, ["", "/bulb", ""]);
    let come = lists(|s| {
        s.nodes.push(Node::fixed("/lamp", None, Trs::default()));
        s.lights.push(Light { node: s.nodes.len() as u32 - 1, ..s.lights[BULB].clone() });
    });
    assert_eq!(come, ["/lamp", "", ""]);
    let renamed = lists(|s| s.nodes[s.lights[BULB].node as usize].path = "/globe".into());
    assert_eq!(renamed, ["/globe", "/bulb", ""]);
    // The last of two instances has its triangles for itself.
    let alone = lists(|s| drop(s.instances.remove(LANTERN)));
    assert_eq!(alone, ["", "/lantern_a", "/lantern_b"]);
}

#[test]
fn a_message_names_ten_lights_and_the_command() {
    let paths = |names: std::ops::Range<usize>| names.map(|i| format!("/lamp_{i}")).collect();
    let remedy = "candelabra build street.gltf -o street.ltree".into();
    let stale = StaleTree { added: paths(0..3), removed: vec![], dirtied: paths(3..14), remedy };
    assert_eq!(
        stale.to_string(),
        "the tree is stale; added: /lamp_0, /lamp_1, /lamp_2; dirtied: /lamp_3, /lamp_4, /lamp_5, \
         /lamp_6, /lamp_7, /lamp_8, /lamp_9 and 4 more. Build it again: candelabra build \
         street.gltf -o street.ltree"
    );
    let ten = StaleTree { added: paths(0..10), dirtied: vec![], ..stale };
    assert!(ten.to_string().contains("/lamp_9") && !ten.to_string().contains(" more"));
}
