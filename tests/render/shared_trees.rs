//! Mesh lights with trees of their own: shared by instances, carried along by what moves.

use crate::moving::FRAMES;
use crate::rooms::{self, Room};
use crate::stage::{Set, Stage, aimed, at, by, direct, facing, glow, scaled};
use crate::strategies::{WAYS, Way, assert_agreement, disagreement, render};
use candelabra::light_tree::{LightTree, Link, TreeKind, TreeRow};
use candelabra::render::buffers::RenderBuffers;
use candelabra::render::{LightStrategy, RenderSettings};
use candelabra::scene::{Channel, Interpolation, Keys, LightKind, Mesh, Trs};
use candelabra::store::AlignedBytes;
use glam::{DVec3, Quat, Vec2, Vec3};
use std::f32::consts::TAU;

/// Triangles of a shade.
const SIDES: u32 = 12;

/// A cone, open at its base, whose sides shine outwards and towards local +Z; one of them is drawn
/// out, so that it has a hand.
fn shade() -> Mesh {
    let rim = |i: u32| {
        let reach = if i == 1 { 0.4 } else { 0.2 };
        (Vec2::from_angle(i as f32 * TAU / SIDES as f32) * reach).extend(0.0)
    };
    let positions = std::iter::once(Vec3::Z * 0.15).chain((0..SIDES).map(rim)).collect();
    let triangles = (0..SIDES).map(|i| [0, 1 + i, 1 + (i + 1) % SIDES]).collect();
    Mesh { positions, triangles, ..Default::default() }
}

/// Scales of the shades below: five that keep shapes, among them two that mirror; two that do not.
const SIMILAR: [DVec3; 5] = [
    DVec3::ONE,
    DVec3::splat(0.5),
    DVec3::splat(-1.2),
    DVec3::new(-0.8, 0.8, 0.8),
    DVec3::new(0.9, -0.9, 0.9),
];
const BENT: [DVec3; 2] = [DVec3::new(1.0, 2.0, 0.5), DVec3::new(0.4, -1.0, 1.0)];

/// A room with many shades, all of one mesh.
fn lamp_shop() -> Stage {
    let mut stage = rooms::lambert_room();
    let mut mesh = None;
    for (i, scale) in SIMILAR.into_iter().chain(BENT).enumerate() {
        let t = i as f64;
        let place = DVec3::new((2.2 * t).sin(), 0.5 + 0.1 * t, 0.9 * (2.2 * t).cos());
        let target = DVec3::new(0.3 * t.cos(), 0.2 * (3.0 * t).sin(), 0.3 * t.sin());
        let place = scaled(facing(place, target), scale);
        match mesh {
            None => {
                stage.mesh(shade(), glow(Vec3::new(5.0, 3.0, 1.0)), place);
                mesh = Some(stage.scene.meshes.len() as u32 - 1);
            }
            Some(mesh) => {
                let node = stage.node(place);
                stage.again(mesh, node);
            }
        }
    }
    stage
}

fn trees(tree: &LightTree<AlignedBytes>, kind: TreeKind) -> Vec<&TreeRow> {
    tree.trees().iter().filter(|row| TreeKind::of(row) == Some(kind)).collect()
}

/// How many leaves the trees of a kind have.
fn leaves(tree: &LightTree<AlignedBytes>, kind: TreeKind) -> Vec<u32> {
    trees(tree, kind).into_iter().map(|row| row.leaf_count).collect()
}

#[test]
fn instances_share_one_tree_unless_they_are_bent() {
    let stage = lamp_shop();
    let set = stage.set();
    assert_eq!(leaves(&set.tree, TreeKind::Shared), [SIDES]);
    let flat = set.emitters.len() as u32 - SIMILAR.len() as u32 * SIDES;
    assert_eq!(leaves(&set.tree, TreeKind::Still), [flat + SIMILAR.len() as u32]);
    assert_eq!(set.tree.instances().len(), SIMILAR.len());
    // A thousand more are a thousand leaves.
    let mut many = lamp_shop();
    let mesh = many.scene.meshes.len() as u32 - 1;
    for i in 0..1000 {
        let node = many.node(at(DVec3::new(f64::from(i), 2.0, 0.0)));
        many.again(mesh, node);
    }
    let many = many.set();
    assert_eq!(many.emitters.len(), set.emitters.len() + 1000 * SIDES as usize);
    assert_eq!(leaves(&many.tree, TreeKind::Shared), [SIDES]);
    assert_eq!(leaves(&many.tree, TreeKind::Still), [flat + SIMILAR.len() as u32 + 1000]);
}

#[test]
fn shared_trees_give_the_same_picture() {
    let room = Room { name: "a lamp shop".into(), stage: lamp_shop(), depth: 2 };
    assert_agreement(&room, &WAYS.map(|way| (way, true)));
    let ways = [WAYS[0], Way::of(LightStrategy::Tree), Way::split(0.5), Way::split(1.0)];
    assert_agreement(&room, &ways.map(|way| (way, false)));
}

fn keys<T>(values: [T; 3]) -> Keys<T> {
    let times_s = vec![0.0, 0.5, 1.0];
    Keys { times_s, values: values.into(), interpolation: Interpolation::Linear }
}

/// Asserts that all frames look the same whether lights are picked through the tree or not, and
/// that each is another picture.
#[track_caller]
fn assert_frames(set: &Set) {
    let small = direct(16, 64);
    let mut last: Option<RenderBuffers> = None;
    for frame in FRAMES {
        let oracle = by(LightStrategy::Uniform, false, &small);
        let oracle = render(set, oracle, frame);
        for (seed, way) in (10..).zip([0.0, 0.5, 1.0].map(Way::split)) {
            let settings = way.settings(true, &RenderSettings { seed, ..small.clone() });
            let wrong = disagreement(&oracle, &render(set, settings, frame));
            assert!(wrong.is_none(), "frame {frame}, {way:?} {}", wrong.unwrap());
        }
        let is_another = |last: &RenderBuffers| disagreement(last, &oracle).is_some();
        assert!(last.as_ref().is_none_or(is_another), "frame {frame}");
        last = Some(oracle);
    }
}

#[test]
fn instances_may_shine_by_values_of_their_own() {
    let mut stage = lamp_shop();
    let shades = stage.scene.instances.iter_mut().rev();
    let (dark, dim, bright) = (Vec3::ZERO, Vec3::new(1.0, 2.0, 4.0), Vec3::new(90.0, 30.0, 9.0));
    // Two that are bent, then two that are not.
    let values =
        [[dim, bright, dark], [dark, dim, bright], [bright, dark, dim], [bright, dark, dark]];
    for (instance, values) in shades.zip(values) {
        instance.values = Some(keys(values).into());
    }
    let set = Set::of(&stage.scene, &FRAMES);
    assert_eq!(set.emitters.changing_count(), 4 * SIDES as usize);
    // The same peak of each channel is the same tree.
    assert_eq!(leaves(&set.tree, TreeKind::Shared), [SIDES; 2]);
    assert_frames(&set);
}

/// A lamp shop in which some of the shades hang from a thing that turns and sinks.
fn chandelier() -> Stage {
    let mut stage = lamp_shop();
    let mesh = stage.scene.meshes.len() as u32 - 1;
    let hub = stage.node(scaled(at(DVec3::Y), DVec3::splat(0.7)));
    let turn = |angle: f32| Quat::from_rotation_y(angle) * Quat::from_rotation_x(0.3 * angle);
    stage.scene.nodes[hub as usize].channels = vec![
        Channel::Rotation(keys([0.0, 1.0, 2.5].map(turn))),
        Channel::Translation(keys([1.1, 0.9, 0.6].map(|height| Vec3::Y * height))),
    ];
    for scale in SIMILAR {
        let out = facing(DVec3::new(scale.x, 0.2, scale.y), DVec3::new(0.0, -1.0, 0.0));
        let node = stage.node(scaled(out, scale));
        stage.scene.nodes[node as usize].parent = Some(hub);
        stage.again(mesh, node);
    }
    stage
}

#[test]
fn what_moves_as_a_whole_carries_its_tree_along() {
    let stage = chandelier();
    let set = Set::of(&stage.scene, &FRAMES);
    let moving = SIMILAR.len() as u32;
    assert_eq!(set.emitters.changing_count() as u32, moving * SIDES);
    assert_eq!(leaves(&set.tree, TreeKind::Shared), [SIDES]);
    // Each frame has a leaf for each shade that moves, and one for all that stands still.
    assert_eq!(leaves(&set.tree, TreeKind::Frame), [moving + 1; FRAMES.len()]);
    for row in trees(&set.tree, TreeKind::Frame) {
        assert_eq!(row.group_count, 1);
    }
    assert_frames(&set);
}

#[test]
fn a_mesh_light_on_its_own_has_a_tree_of_its_own_only_if_it_changes() {
    // Moving, flickering, or neither; and one of too few triangles to be worth it.
    let leaves_of = |moves: bool, varies: bool, mesh: Mesh| {
        let mut stage = Stage::default();
        stage.light(LightKind::Point { intensity_cd: Vec3::ONE }, Trs::default());
        let node = drifting(&mut stage, 3);
        let lamp = stage.mesh(mesh, glow(Vec3::ONE), at(DVec3::Y));
        if moves {
            lamp.node = node;
        }
        lamp.values = varies.then(|| keys([1.0, 2.0, 0.5].map(Vec3::splat)).into());
        let set = Set::of(&stage.scene, &FRAMES);
        [TreeKind::Shared, TreeKind::Still, TreeKind::Frame].map(|kind| leaves(&set.tree, kind))
    };
    assert_eq!(leaves_of(false, false, shade()), [vec![], vec![SIDES + 1], vec![]]);
    for (moves, varies) in [(true, false), (false, true), (true, true)] {
        assert_eq!(leaves_of(moves, varies, shade()), [vec![SIDES], vec![1], vec![2; 3]]);
    }
    let few = Mesh { triangles: shade().triangles[..7].to_vec(), ..shade() };
    assert_eq!(leaves_of(true, false, few), [vec![], vec![1], vec![8; 3]]);
}

/// A scale that varies but is the same along all axes is a similarity in each frame.
#[test]
fn what_grows_evenly_keeps_its_tree() {
    let mut stage = chandelier();
    let hub = stage.scene.nodes.iter().position(|node| !node.channels.is_empty()).unwrap();
    let grows = |scales: [f32; 3]| Channel::Scale(keys(scales.map(Vec3::splat)));
    stage.scene.nodes[hub].channels.push(grows([1.0, 0.6, 0.3]));
    let set = Set::of(&stage.scene, &FRAMES);
    assert_eq!(leaves(&set.tree, TreeKind::Shared), [SIDES]);
    let moving = SIMILAR.len() as u32;
    assert_eq!(leaves(&set.tree, TreeKind::Frame), [moving + 1; FRAMES.len()]);
    assert_frames(&set);
    // One that shrinks to nothing has no space of its own then.
    *stage.scene.nodes[hub].channels.last_mut().unwrap() = grows([1.0, 0.0, 1.0]);
    let set = Set::of(&stage.scene, &FRAMES);
    assert_eq!(leaves(&set.tree, TreeKind::Frame), [moving * SIDES + 1; FRAMES.len()]);
}

#[test]
fn a_shape_that_changes_is_built_anew() {
    let mut stage = chandelier();
    let hub = stage.scene.nodes.iter().position(|node| !node.channels.is_empty()).unwrap();
    let scales = [Vec3::ONE, Vec3::new(1.0, 0.6, 1.0), Vec3::splat(0.5)];
    stage.scene.nodes[hub].channels.push(Channel::Scale(keys(scales)));
    let set = Set::of(&stage.scene, &FRAMES);
    let moving = SIMILAR.len() as u32;
    assert_eq!(leaves(&set.tree, TreeKind::Frame), [moving * SIDES + 1; FRAMES.len()]);
    assert_frames(&set);
}

/// The size of the tree file of a scene, and of that of its first frame alone.
fn sizes(stage: &Stage) -> (usize, usize) {
    let size = |frames: &[i32]| Set::of(&stage.scene, frames).tree.byte_length();
    (size(&(1..=24).collect::<Vec<_>>()), size(&[1]))
}

/// Many panels that stand still: so many emitters.
fn crowd(emitters: u32) -> Stage {
    let mut stage = Stage::default();
    stage.quad([0.1; 2], glow(Vec3::ONE), at(DVec3::ZERO));
    for i in 1..emitters / 2 {
        let t = f64::from(i);
        let place = DVec3::new(f64::from(i % 100), (0.7 * t).sin(), f64::from(i / 100));
        let node = stage.node(facing(place, place + DVec3::new(t.sin(), -1.0, t.cos())));
        stage.again(0, node);
    }
    stage
}

/// A node that drifts.
fn drifting(stage: &mut Stage, i: u32) -> u32 {
    let from = Vec3::new((i % 10) as f32 * 9.0, 1.0, (i / 10) as f32 * 9.0);
    let node = stage.node(at(from.as_dvec3()));
    let to = from + Vec3::new((i as f32).sin(), 0.5, (i as f32).cos());
    stage.scene.nodes[node as usize].channels =
        vec![Channel::Translation(keys([from, to, 2.0 * to - from]))];
    node
}

#[test]
fn a_shot_in_which_little_moves_is_hardly_larger_than_a_frame() {
    const EMITTERS: u32 = 20_000;
    let mut shades = crowd(EMITTERS);
    shades.mesh(shade(), glow(Vec3::ONE), Trs::default());
    let mesh = shades.scene.meshes.len() as u32 - 1;
    for i in 0..EMITTERS / 100 / SIDES {
        let node = drifting(&mut shades, i);
        shades.again(mesh, node);
    }
    let mut points = crowd(EMITTERS);
    for i in 0..EMITTERS / 100 {
        let node = drifting(&mut points, i);
        points.light(LightKind::Point { intensity_cd: Vec3::ONE }, Trs::default()).node = node;
    }
    for (what, stage) in [("shades", shades), ("points", points)] {
        let (shot, frame) = sizes(&stage);
        let ratio = shot as f64 / frame as f64;
        println!("{what}: {shot} bytes of 24 frames, {frame} of one: {ratio:.3}");
        assert!(ratio <= 1.3, "{what}: {shot} bytes of 24 frames, {frame} of one: {ratio:.3}");
    }
}

#[test]
fn lights_that_flicker_where_they_are_keep_their_bounds() {
    let mut stage = crowd(40);
    stage.look(DVec3::new(5.0, 3.0, 5.0), DVec3::ZERO, 0.8);
    for i in 0..60 {
        let t = f64::from(i);
        let place = DVec3::new((1.7 * t).sin(), (0.9 * t).cos(), (2.3 * t).cos());
        let intensity_cd = Vec3::splat(1.0);
        let light = stage.light(LightKind::Point { intensity_cd }, aimed(place, DVec3::Y * 9.0));
        let strength = |salt: f64| Vec3::splat((1.0 + (t * salt).sin()) as f32);
        light.values = Some(keys([1.3, 3.7, 5.1].map(strength)).into());
    }
    let set = Set::of(&stage.scene, &FRAMES);
    let frames = trees(&set.tree, TreeKind::Frame);
    assert_eq!(frames.len(), FRAMES.len());
    let leaves = |row: &TreeRow| -> Vec<_> {
        let nodes = set.tree.groups_of(row).iter().flat_map(|group| group.nodes());
        let mut leaves: Vec<_> =
            nodes.filter(|node| !matches!(node.link(), Link::Inner(_))).collect();
        leaves.sort_by_key(|node| format!("{:?}", node.link()));
        leaves
    };
    let first = leaves(frames[0]);
    assert_eq!(first.len(), 61);
    for row in &frames[1..] {
        let now = leaves(row);
        let alike = first.iter().zip(&now).all(|(a, b)| {
            let (a_bounds, b_bounds) = (a.bounds(), b.bounds());
            a.link() == b.link() && a_bounds.aabb == b_bounds.aabb && a_bounds.cone == b_bounds.cone
        });
        assert!(alike && first.len() == now.len());
        let differ = first.iter().zip(&now).filter(|(a, b)| a.energy() != b.energy()).count();
        // The first of them shines alike at all times, and so does what stands still.
        assert_eq!(differ, 59);
        // Clusters are worth what is in them now: the root as much as all leaves.
        let leaves: f64 = now.iter().map(|node| f64::from(node.energy())).sum();
        assert!((f64::from(row.root.energy()) / leaves - 1.0).abs() < 1e-5);
    }
}
