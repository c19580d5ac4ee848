//! Building upon an earlier file gives the bytes that a full build gives, whatever has changed.

use candelabra::emitter::Emitters;
use candelabra::light_tree::{LightTree, TreeKind};
use candelabra::pipeline::{self, Rebuilt, Survey};
use candelabra::scene::{
    Channel, Deformation, Instance, Keys, Light, LightKind, Material, Mesh, Node, Scene, Shape,
    Shaping, Target, Trs,
};
use candelabra::store::AlignedBytes;
use glam::{DQuat, DVec3, Vec3};
use proptest::prelude::*;
use std::sync::Arc;

const FRAMES: [i32; 3] = [1, 2, 3];

/// A light of any class. Places and strengths are few, so that lights coincide and look alike.
#[derive(Clone, Debug)]
pub struct Prim {
    pub name: u16,
    pub kind: Kind,
    pub place: [i8; 3],
    pub strength: u8,
    pub moves: bool,
    pub varies: bool,
    pub forced: bool,
}

impl Prim {
    /// A point light that does nothing.
    pub fn lamp(name: u16, place: [i8; 3]) -> Prim {
        let [moves, varies, forced] = [false; 3];
        Prim { name, kind: Kind::Point, place, strength: 1, moves, varies, forced }
    }
}

#[derive(Clone, Copy, Debug)]
pub enum Kind {
    Point,
    Spot,
    /// A mesh of two triangles.
    Quad,
    /// A mesh of enough triangles to share a tree.
    Fan,
    /// A mesh of as many that deforms.
    Flame,
}

/// What somebody does to a scene. Prims are named by their place among those that there are.
#[derive(Clone, Debug)]
enum Edit {
    Move(prop::sample::Index, [i8; 3]),
    /// So far that the box around everything grows.
    MoveFar(prop::sample::Index),
    Strengthen(prop::sample::Index, u8),
    Rename(prop::sample::Index, u16),
    Force(prop::sample::Index),
    Remove(prop::sample::Index),
    Add(Prim),
    /// In the file; the names stay.
    Reverse,
    /// All at once: the numbers of all emitters change.
    RenameAll(u16),
}

pub fn prim() -> impl Strategy<Value = Prim> {
    let kind = prop_oneof![
        4 => Just(Kind::Point), 1 => Just(Kind::Spot), 1 => Just(Kind::Quad), 1 => Just(Kind::Fan),
        1 => Just(Kind::Flame),
    ];
    let rarely = || prop::bool::weighted(0.1);
    (any::<u16>(), kind, prop::array::uniform3(-4i8..4), 1u8..4, rarely(), rarely(), rarely())
        .prop_map(|(name, kind, place, strength, moves, varies, forced)| Prim {
            name,
            kind,
            place,
            strength,
            moves,
            varies,
            forced,
        })
}

fn edit() -> impl Strategy<Value = Edit> {
    let which = any::<prop::sample::Index>;
    prop_oneof![
        (which(), prop::array::uniform3(-4i8..4)).prop_map(|(i, place)| Edit::Move(i, place)),
        which().prop_map(Edit::MoveFar),
        (which(), 1u8..4).prop_map(|(i, strength)| Edit::Strengthen(i, strength)),
        (which(), any::<u16>()).prop_map(|(i, name)| Edit::Rename(i, name)),
        which().prop_map(Edit::Force),
        which().prop_map(Edit::Remove),
        prim().prop_map(Edit::Add),
        Just(Edit::Reverse),
        any::<u16>().prop_map(Edit::RenameAll),
    ]
}

fn apply(prims: &mut Vec<Prim>, edit: &Edit) {
    let count = prims.len();
    let at = |index: &prop::sample::Index| index.index(count);
    match edit {
        Edit::Add(prim) => prims.push(prim.clone()),
        _ if prims.is_empty() => {}
        Edit::Move(i, place) => prims[at(i)].place = *place,
        Edit::MoveFar(i) => prims[at(i)].place = [100, 3, 0],
        Edit::Strengthen(i, strength) => prims[at(i)].strength = *strength,
        Edit::Rename(i, name) => prims[at(i)].name = *name,
        Edit::Force(i) => prims[at(i)].forced ^= true,
        Edit::Remove(i) => drop(prims.remove(at(i))),
        Edit::Reverse => prims.reverse(),
        Edit::RenameAll(mask) => prims.iter_mut().for_each(|prim| prim.name ^= mask),
    }
    *prims = without_twins(std::mem::take(prims));
}

/// The same, but each name once.
pub fn without_twins(mut prims: Vec<Prim>) -> Vec<Prim> {
    let mut seen = std::collections::HashSet::new();
    prims.retain(|prim| seen.insert(prim.name));
    prims
}

fn fan(corners: u32) -> Mesh {
    let corner = |i: u32| Vec3::new((i as f32).cos(), (i as f32).sin(), 0.1 * i as f32);
    Mesh {
        positions: (0..corners + 2).map(corner).collect(),
        triangles: (0..corners).map(|i| [0, i + 1, i + 2]).collect(),
        material: Some(0),
        ..Mesh::default()
    }
}

/// What grows along its axis, until 0.1 s.
fn flame() -> Mesh {
    let mut mesh = fan(9);
    let by = mesh.positions.iter().map(|place| Vec3::Z * (1.0 + place.z)).collect();
    let rest = Shape { positions: mesh.positions.clone(), ..Shape::default() };
    let targets = vec![Target { positions: by, ..Target::default() }];
    let values = vec![Vec3::ZERO, Vec3::X];
    let weights = [Keys { times_s: vec![0.0, 0.1], values, interpolation: Default::default() }];
    let deformation = Deformation { rest, targets, weights: weights.into(), skin: None };
    mesh.deformation = Some(Arc::new(deformation));
    mesh
}

fn keys(strength: f32) -> Keys<Vec3> {
    let values = vec![Vec3::splat(strength), Vec3::splat(2.0 * strength)];
    Keys { times_s: vec![0.0, 0.1], values, interpolation: Default::default() }
}

pub fn scene_of(prims: &[Prim]) -> Scene {
    let glow = Material { emission_nits: Vec3::ONE, ..Material::default() };
    let meshes = vec![fan(2), fan(9), flame()];
    let mut scene = Scene { meshes, materials: vec![glow], ..Scene::default() };
    for prim in prims {
        let path = format!("/lights/{:05}", prim.name);
        let translation = Vec3::from(prim.place.map(f32::from));
        let rotation = DQuat::from_rotation_x(f64::from(prim.strength));
        let place = Trs::Parts { translation: translation.as_dvec3(), rotation, scale: DVec3::ONE };
        let mut at = Node::fixed(path.clone(), None, place);
        if prim.moves {
            let values = vec![translation, translation + Vec3::X];
            let keys = Keys { times_s: vec![0.0, 0.1], values, interpolation: Default::default() };
            at.channels.push(Channel::Translation(keys));
        }
        let node = scene.nodes.len() as u32;
        scene.nodes.push(at);
        let strength = f32::from(prim.strength);
        let values = prim.varies.then(|| keys(strength));
        let intensity_cd = Vec3::splat(strength);
        let shaping = Shaping::Khr { inner_rad: 0.2, outer_rad: 0.7 };
        let forced = prim.forced;
        let mut light = |kind| {
            scene.lights.push(Light {
                node,
                kind,
                values: values.clone().map(Box::new),
                range_m: None,
                forced,
                visibility: Default::default(),
            })
        };
        let mesh = match prim.kind {
            Kind::Point => {
                light(LightKind::Point { intensity_cd });
                continue;
            }
            Kind::Spot => {
                light(LightKind::Spot { intensity_cd, shaping });
                continue;
            }
            Kind::Quad => 0,
            Kind::Fan => 1,
            Kind::Flame => 2,
        };
        scene.instances.push(Instance {
            path: path.into(),
            node,
            mesh,
            values: values.map(Box::new),
            shaping: None,
            forced,
            visibility: Default::default(),
        });
    }
    scene
}

pub type Tree = LightTree<AlignedBytes>;

pub fn survey_of(scene: &Scene, frames: &[i32]) -> Survey {
    pipeline::survey(scene, &Emitters::collect(scene), frames).unwrap()
}

fn full(scene: &Scene) -> Tree {
    LightTree::open(pipeline::build_tree(&survey_of(scene, &FRAMES))).unwrap()
}

fn upon(base: &Tree, scene: &Scene) -> Rebuilt {
    pipeline::rebuild_tree(&survey_of(scene, &FRAMES), base)
}

fn is_same(file: Tree, rebuilt: &Rebuilt) -> bool {
    file.into_bytes().as_ref() == rebuilt.bytes.as_ref()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn any_edit_upon_any_base_gives_the_bytes_of_a_full_build(
        mut prims in prop::collection::vec(prim(), 0..120),
        edits in prop::collection::vec(edit(), 1..5),
    ) {
        apply(&mut prims, &Edit::Reverse);
        let first = full(&scene_of(&prims));
        let mut before = full(&scene_of(&prims));
        for edit in &edits {
            apply(&mut prims, edit);
            let scene = scene_of(&prims);
            // Upon the version before, itself built upon another; and upon the first of all.
            let chained = upon(&before, &scene);
            prop_assert!(is_same(full(&scene), &chained), "{edit:?}");
            prop_assert!(is_same(full(&scene), &upon(&first, &scene)), "{edit:?}, long after");
            before = LightTree::open(chained.bytes).unwrap();
            prop_assert_eq!(before.verify(), Ok(()));
        }
    }

    #[test]
    fn nothing_changed_is_all_taken_over(prims in prop::collection::vec(prim(), 1..60)) {
        let mut prims = prims;
        apply(&mut prims, &Edit::Reverse);
        let scene = scene_of(&prims);
        let base = full(&scene);
        let leaves: u32 = base.trees().iter().map(|tree| tree.leaf_count).sum();
        prop_assert_eq!(upon(&base, &scene).reused, leaves as usize);
    }
}

/// Many lights, without two alike, some of them moving.
fn spiral(count: u16) -> Vec<Prim> {
    (0..u32::from(count))
        .map(|i| Prim {
            name: 3 * i as u16,
            kind: if i % 100 == 0 { Kind::Fan } else { Kind::Point },
            place: [i % 251, i / 251 % 241, i * 7 % 239].map(|x| x as u8 as i8),
            strength: (1 + i % 3) as u8,
            moves: i % 4 == 0,
            varies: false,
            forced: false,
        })
        .collect()
}

fn with_threads<T: Send>(count: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(count).build().unwrap().install(work)
}

#[test]
fn of_many_lights_nearly_all_are_taken_over_by_any_number_of_threads() {
    let mut prims = spiral(20_000);
    let base = full(&scene_of(&prims));
    prims[10_001].strength = 9;
    prims[12_000].place = [0, 0, 0];
    let added = Prim { name: 31_000, ..prims[0].clone() };
    prims.push(added);
    let scene = scene_of(&prims);
    let [one, two] = [1, 2].map(|threads| with_threads(threads, || upon(&base, &scene)));
    assert!(is_same(full(&scene), &one) && is_same(full(&scene), &two));
    assert_eq!(one.reused, two.reused);
    let leaves: u32 = full(&scene).trees().iter().map(|tree| tree.leaf_count).sum();
    assert!(one.reused * 10 > leaves as usize * 9, "{} of {leaves}", one.reused);
}

#[test]
fn every_kind_of_tree_is_taken_over() {
    let mut prims = spiral(2000);
    let base = full(&scene_of(&prims));
    let kinds: std::collections::HashSet<u32> = base.trees().iter().map(|tree| tree.kind).collect();
    assert_eq!(kinds.len(), 3);
    let own = |kind| {
        let of_kind = base.trees().iter().filter(|tree| TreeKind::of(tree) == Some(kind));
        of_kind.map(|tree| tree.leaf_count as usize).sum::<usize>()
    };
    // A light that stands still, changed: the rest of its tree, and what moves, stays.
    prims[1].strength = 9;
    let rebuilt = upon(&base, &scene_of(&prims));
    let (still, frames) = (own(TreeKind::Still), own(TreeKind::Frame));
    assert!(is_same(full(&scene_of(&prims)), &rebuilt));
    let most = own(TreeKind::Shared) + still * 9 / 10 + frames * 9 / 10;
    assert!(rebuilt.reused > most, "{} of {most}", rebuilt.reused);
}
