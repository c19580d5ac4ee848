//! A street with a light of every kind, to be edited.

use candelabra::diff::{Change, Diff, DiffOptions, Difference, Side, Verb, compare};
use candelabra::emitter::Emitters;
use candelabra::pipeline;
use candelabra::scene::{
    Camera, Instance, Light, LightKind, Material, Mesh, Node, Scene, Shaping, Trs,
};
use glam::{DQuat, DVec3, Vec3};
use std::path::Path;
use tempfile::TempDir;

/// Rows of [`Scene::lights`].
pub const POINT: usize = 0;
pub const SPOT: usize = 1;
pub const SPHERE: usize = 2;
pub const SUN: usize = 3;

/// A point, a spot and a sphere, a sun, a panel of two triangles, two bulbs that share a mesh of eight, a
/// wall.
pub fn street() -> Scene {
    let mut scene = Scene { source: "street.gltf".into(), ..Scene::default() };
    let mut light = |place: [f64; 3], name: &str, kind| {
        let node = put(&mut scene, name, place);
        scene.lights.push(Light {
            node,
            kind,
            values: None,
            range_m: None,
            forced: false,
            visibility: Default::default(),
        });
    };
    let (white, warm) = (Vec3::ONE, Vec3::new(1.0, 0.5, 0.25));
    light([0.0, 3.0, 0.0], "point", LightKind::Point { intensity_cd: 40.0 * white });
    let shaping = Shaping::Khr { inner_rad: 0.2, outer_rad: 0.6 };
    light([2.0, 3.0, 0.0], "spot", LightKind::Spot { intensity_cd: 50.0 * warm, shaping });
    let sphere = LightKind::Sphere { radiance_nits: 300.0 * warm, radius: 0.1, shaping: None };
    light([4.0, 2.0, 1.0], "sphere", sphere);
    let sun = LightKind::Distant { irradiance_lux: 2.0 * white, angle_rad: 0.01 };
    light([0.0, 0.0, 0.0], "sun", sun);

    let glow = |nits: Vec3| Material { emission_nits: nits, ..Material::default() };
    scene.materials = vec![glow(Vec3::splat(20.0)), glow(300.0 * warm), Material::default()];
    scene.meshes = vec![quad(0), octahedron(1), quad(2)];
    for (name, place, mesh) in [
        ("panel", [6.0, 2.0, 0.0], 0),
        ("bulb_1", [8.0, 2.0, 0.0], 1),
        ("bulb_2", [8.0, 2.0, 2.0], 1),
        ("wall", [4.0, 1.0, -3.0], 2),
    ] {
        let node = put(&mut scene, name, place);
        scene.instances.push(instance(&scene, node, mesh));
    }
    scene
}

/// An instance of a mesh at a node.
pub fn instance(scene: &Scene, node: u32, mesh: u32) -> Instance {
    let path = scene.nodes[node as usize].path.clone();
    Instance {
        path,
        node,
        mesh,
        values: None,
        shaping: None,
        forced: false,
        visibility: Default::default(),
    }
}

/// A camera that sees all of it.
pub fn with_camera(mut scene: Scene) -> Scene {
    let node = put(&mut scene, "eye", [4.0, 2.0, 14.0]);
    scene.cameras.push(Camera { aspect: Some(1.5), ..Camera::perspective(node, 0.8) });
    scene
}

/// A new node.
pub fn put(scene: &mut Scene, name: &str, place: [f64; 3]) -> u32 {
    scene.nodes.push(Node::fixed(format!("/street/{name}"), None, at(place, DQuat::IDENTITY, 1.0)));
    scene.nodes.len() as u32 - 1
}

pub fn at(place: [f64; 3], rotation: DQuat, scale: f64) -> Trs {
    Trs::Parts { translation: place.into(), rotation, scale: DVec3::splat(scale) }
}

/// The node of that name.
pub fn node<'a>(scene: &'a mut Scene, name: &str) -> &'a mut Node {
    let path = format!("/street/{name}");
    scene.nodes.iter_mut().find(|node| *node.path == path).expect("there is such a node")
}

/// Renames a prim.
pub fn rename(scene: &mut Scene, name: &str, path: &str) {
    let old = format!("/street/{name}");
    node(scene, name).path = path.into();
    scene.instances.iter_mut().filter(|i| *i.path == old).for_each(|i| i.path = path.into());
}

fn quad(material: u32) -> Mesh {
    Mesh {
        name: "quad".into(),
        positions: [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
            .map(|[x, y]| Vec3::new(x, y, 0.0))
            .into(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material: Some(material),
        ..Mesh::default()
    }
}

fn octahedron(material: u32) -> Mesh {
    let r = 0.1;
    let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| r * axis);
    let ring = [[0, 1], [1, 2], [2, 3], [3, 0]];
    let triangles = ring.iter().flat_map(|&[a, b]| [[a, b, 4], [b, a, 5]]);
    Mesh {
        name: "octahedron".into(),
        positions: vec![x, y, -x, -y, z, -z],
        triangles: triangles.collect(),
        material: Some(material),
        ..Mesh::default()
    }
}

/// What changed between two scenes.
pub fn diff(before: Scene, after: Scene) -> Diff {
    let (before, after) = (Side::of_scene(before), Side::of_scene(after));
    compare(&before, &after, &DiffOptions::default()).unwrap()
}

/// A scene's tree, in a file, opened.
pub fn tree_of(scene: &Scene, folder: &TempDir, name: &str) -> Side {
    let emitters = Emitters::collect(scene);
    let survey = pipeline::survey(scene, &emitters, &pipeline::frames_of(scene)).unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, pipeline::build_tree(&survey)).unwrap();
    Side::open(Path::new(&path)).unwrap()
}

/// What an edit of the street does, in scenes and in trees.
pub fn edited(edit: impl Fn(&mut Scene)) -> [Diff; 2] {
    let (before, mut after) = (street(), street());
    edit(&mut after);
    let folder = TempDir::new().unwrap();
    let trees =
        [tree_of(&before, &folder, "before.ltree"), tree_of(&after, &folder, "after.ltree")];
    let of_trees = compare(&trees[0], &trees[1], &DiffOptions::default()).unwrap();
    [diff(before, after), of_trees]
}

/// The only change of a comparison.
#[track_caller]
pub fn only(diff: &Diff) -> &Change {
    assert_eq!(diff.changes.len(), 1, "{:#?}", diff.changes);
    &diff.changes[0]
}

/// The aspects in which the only light that is dirtied differs.
#[track_caller]
pub fn aspects<'a>(diff: &'a Diff, name: &str) -> Vec<&'a str> {
    let change = only(diff);
    assert_eq!((change.verb, change.path()), (Verb::Dirtied, format!("/street/{name}").as_str()));
    change.differences.iter().map(Difference::aspect).collect()
}
