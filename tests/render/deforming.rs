//! Meshes that change their shape: a frame shows the shape of its time, whoever looks at it.

use crate::rooms;
use crate::stage::{Set, Stage, at, direct, facing, glow, lambert, scaled};
use candelabra::pipeline;
use candelabra::render::buffers::RenderBuffers;
use candelabra::render::{Aov, RenderSettings};
use candelabra::scene::{
    Camera, Channel, Deformation, Interpolation, Keys, Material, Mesh, Node, Scene, Shape, Shutter,
    Skeleton, Skin, Target, Trs,
};
use glam::{DAffine3, DQuat, DVec3, Quat, Vec3};
use std::sync::Arc;

const SIZE: u32 = 32;
const WAY: Vec3 = Vec3::new(0.5, 0.25, -0.125);

/// From 0 to 1 in a second, and on to 0.5 in the next.
fn one_weight() -> Arc<[Keys<Vec3>]> {
    let values = [0.0, 1.0, 0.5].map(|weight| Vec3::new(weight, 0.0, 0.0)).into();
    [Keys { times_s: vec![0.0, 1.0, 2.0], values, interpolation: Interpolation::Linear }].into()
}

fn shape_of(mesh: &Mesh) -> Shape {
    let Mesh { positions, normals, tangents, .. } = mesh.clone();
    Shape { positions, normals, tangents }
}

/// Adds a morph target to a mesh, by which it is displaced most at second 1.
pub fn morph(mesh: &mut Mesh, by: impl Fn(Vec3) -> Vec3) {
    let rest = shape_of(mesh);
    let positions = rest.positions.iter().map(|&place| by(place)).collect();
    let targets = vec![Target { positions, ..Target::default() }];
    let deformation = Deformation { rest, targets, weights: one_weight(), skin: None };
    mesh.deformation = Some(Arc::new(deformation));
}

/// A room with lamps and a ball that is squashed, and throws a shadow.
fn squashed() -> Stage {
    let mut stage = rooms::lambert_room();
    rooms::all_lights(&mut stage);
    stage.ball(0.35, 6, lambert(Vec3::splat(0.6)), at(DVec3::new(0.1, 0.5, 0.2)));
    let mesh = stage.scene.meshes.last_mut().unwrap();
    mesh.normals = mesh.positions.iter().map(|place| place.normalize()).collect();
    morph(mesh, |place| place * Vec3::new(0.5, -0.8, 0.25));
    stage
}

/// The same scene with all meshes as they are in a frame, for good.
pub fn frozen(mut scene: Scene, frame: i32) -> Scene {
    let pose = scene.pose_at(scene.timeline.seconds_at(frame.into()));
    for number in 0..scene.meshes.len() {
        let shape = pose.shape(&scene, number as u32).cloned();
        let mesh = &mut scene.meshes[number];
        mesh.deformation = None;
        shape.into_iter().for_each(|shape| shape.put(mesh));
    }
    scene
}

fn render(scene: &Scene, settings: &RenderSettings, frame: i32) -> RenderBuffers {
    Set::of(scene, &[1, 13, 25, 49]).render(settings, frame)
}

pub fn bits(picture: &RenderBuffers) -> Vec<[u32; 3]> {
    picture.beauty().map(|rgb| rgb.to_array().map(f32::to_bits)).collect()
}

#[test]
fn a_frame_shows_the_shape_of_its_time() {
    let settings = RenderSettings { depth: 3, samples: 4, ..direct(SIZE, 4) };
    let mut pictures = Vec::new();
    // Between keys, at keys, and after the last.
    for frame in [1, 13, 25, 49] {
        let moving = bits(&render(&squashed().scene, &settings, frame));
        let still = bits(&render(&frozen(squashed().scene, frame), &settings, frame));
        assert_eq!(moving, still, "frame {frame}");
        // What is seen at all is the shape, and not only the noise of another frame.
        pictures.push(bits(&render(&frozen(squashed().scene, frame), &settings, 1)));
    }
    assert!(pictures.windows(2).all(|pair| pair[0] != pair[1]));
}

/// Four of them, one in a mirror and one flat.
fn crowd() -> Scene {
    let mut stage = squashed();
    let mesh = stage.scene.meshes.len() as u32 - 1;
    for (place, scale) in [
        (DVec3::new(-0.6, 0.3, 0.1), DVec3::splat(0.5)),
        (DVec3::new(0.5, 0.2, 0.5), DVec3::new(-0.6, 0.4, 0.8)),
        (DVec3::new(-0.2, 0.9, 0.0), DVec3::new(0.8, 0.8, 0.0)),
    ] {
        let node = stage.node(scaled(at(place), scale));
        stage.again(mesh, node);
    }
    stage.scene
}

/// Several instances search one set in the mesh's own space; what is flat has a set of its own in the world's.
#[test]
fn a_crowd_has_the_shape_of_its_time() {
    let settings = RenderSettings { depth: 2, ..direct(SIZE, 16) };
    for frame in [13, 25] {
        let moving = render(&crowd(), &settings, frame);
        let still = render(&frozen(crowd(), frame), &settings, frame);
        let alone = render(&squashed().scene, &settings, frame);
        assert!(disagree(&moving, &still) <= 16, "frame {frame}: {}", disagree(&moving, &still));
        assert!(disagree(&moving, &alone) > 100, "the crowd is seen");
    }
}

/// A bar of two joints along X, whose outer one turns by a quarter in a second.
pub fn bar() -> Mesh {
    let quarter = std::f32::consts::FRAC_PI_2;
    let turn = Keys {
        times_s: vec![0.0, 1.0],
        values: vec![Quat::IDENTITY, Quat::from_rotation_z(quarter)],
        interpolation: Interpolation::Linear,
    };
    let inner = Node::fixed("", None, at(DVec3::X));
    let mut outer = Node::fixed("", None, at(DVec3::X));
    outer.channels = vec![Channel::Rotation(turn)];
    let joints = vec![
        Some((0, DAffine3::from_translation(-DVec3::X))),
        Some((1, DAffine3::from_translation(-2.0 * DVec3::X))),
    ];
    // The corners at x = 2 follow both joints by half.
    let positions: Vec<Vec3> =
        (0..8).map(|i| Vec3::new((i / 2) as f32, (i % 2) as f32, 0.0)).collect();
    let of = |place: &Vec3| match place.x {
        x if x < 2.0 => vec![(0, 1.0)],
        2.0 => vec![(0, 0.5), (1, 0.5)],
        _ => vec![(1, 1.0)],
    };
    let (mut ends, mut influences) = (Vec::new(), Vec::new());
    for place in &positions {
        influences.extend(of(place));
        ends.push(influences.len() as u32);
    }
    let nodes = vec![(None, Arc::new(inner)), (Some(0), Arc::new(outer))];
    let skeleton = Arc::new(Skeleton { nodes, joints });
    let rest =
        Shape { normals: vec![Vec3::Z; 8], positions: positions.clone(), ..Shape::default() };
    let skin = Some(Skin { skeleton, ends, influences });
    let (targets, weights) = (Vec::new(), Arc::from([]));
    let deformation = Some(Arc::new(Deformation { rest, targets, weights, skin }));
    let triangles =
        (0..3).flat_map(|i| [[2 * i, 2 * i + 2, 2 * i + 3], [2 * i, 2 * i + 3, 2 * i + 1]]);
    Mesh {
        positions,
        normals: vec![Vec3::Z; 8],
        triangles: triangles.collect(),
        deformation,
        ..Mesh::default()
    }
}

/// Against the same bar, bent by hand.
#[test]
fn joints_bend_a_mesh_at_every_time() {
    let quarter = std::f32::consts::FRAC_PI_2;
    let mut scene = Scene { meshes: vec![bar()], ..Scene::default() };
    scene.timeline.zero_frame = 0.0;
    for (second, angle) in [(0.0, 0.0), (0.5, 0.5 * quarter), (1.0, quarter), (7.0, quarter)] {
        let pose = scene.pose_at(second);
        let shape = pose.shape(&scene, 0).unwrap();
        for (place, rest) in shape.positions.iter().zip(&scene.meshes[0].positions) {
            let from_elbow = *rest - 2.0 * Vec3::X;
            let turned = 2.0 * Vec3::X + Quat::from_rotation_z(angle) * from_elbow;
            let expected = match rest.x {
                x if x < 2.0 => *rest,
                2.0 => 0.5 * (*rest + turned),
                _ => turned,
            };
            assert!(place.distance(expected) < 1e-6, "{second} s: {place} {expected}");
        }
        assert!(shape.normals.iter().all(|normal| normal.distance(Vec3::Z) < 1e-6));
    }
}

/// A card that is displaced by its vertices, and one that is moved by its node.
fn pair(deforms: bool) -> Stage {
    let mut stage = Stage::default();
    stage.quad([8.0; 2], lambert(Vec3::splat(0.7)), at(DVec3::new(0.0, 0.0, -1.0)));
    stage.quad([1.0; 2], lambert(Vec3::new(0.2, 0.5, 0.9)), at(DVec3::ZERO));
    if deforms {
        morph(stage.scene.meshes.last_mut().unwrap(), |_| WAY);
    } else {
        let values = [0.0, 1.0, 0.5].map(|share| WAY * share).into();
        let keys =
            Keys { times_s: vec![0.0, 1.0, 2.0], values, interpolation: Interpolation::Linear };
        stage.scene.nodes.last_mut().unwrap().channels = vec![Channel::Translation(keys)];
    }
    stage.quad([0.5; 2], glow(Vec3::splat(20.0)), facing(DVec3::new(1.0, 2.0, 3.0), DVec3::ZERO));
    stage.look(DVec3::new(0.2, -0.3, 4.0), DVec3::ZERO, 0.8);
    stage
}

fn disagree(a: &RenderBuffers, b: &RenderBuffers) -> usize {
    let far = |(a, b): &(Vec3, Vec3)| (*a - *b).abs().max_element() > 1e-3 * a.max_element();
    a.beauty().zip(b.beauty()).filter(far).count()
}

#[test]
fn to_be_displaced_is_to_be_moved() {
    let settings = direct(SIZE, 16);
    for frame in [1, 13, 25, 49] {
        let [by_vertices, by_node] = [true, false].map(|deforms| pair(deforms).scene);
        let [one, other] = [by_vertices, by_node].map(|scene| render(&scene, &settings, frame));
        // A ray may pass an edge on the other side.
        assert!(disagree(&one, &other) <= 4, "frame {frame}: {}", disagree(&one, &other));
    }
}

#[test]
fn what_deforms_is_blurred_like_what_moves() {
    let pictures = [true, false].map(|deforms| {
        let mut stage = pair(deforms);
        stage.scene.cameras[0].shutter = Shutter::new(0.0, 24.0);
        render(&stage.scene, &direct(SIZE, 64), 1)
    });
    assert!(disagree(&pictures[0], &pictures[1]) <= 4);
    let sharp = render(&pair(true).scene, &direct(SIZE, 64), 1);
    assert!(disagree(&pictures[0], &sharp) > 50, "it is not blurred");
    // Its triangles count among what is posed at every time.
    let camera = Camera { shutter: Shutter::new(0.0, 24.0), ..Camera::perspective(0, 1.0) };
    let times = |stage: Stage| stage.scene.times_of(&camera, 1).len();
    let mut large = pair(true);
    let triangles = &mut large.scene.meshes[1].triangles;
    *triangles = triangles.repeat(40_000);
    assert_eq!((times(pair(true)), times(large)), (128, 16));
}

#[test]
fn motion_vectors_follow_the_shape() {
    let settings = RenderSettings { aovs: vec![Aov::Motion], ..direct(SIZE, 4) };
    let names = ["forward.u", "forward.v", "backward.u", "backward.v"];
    let [one, other] = [true, false].map(|deforms| {
        let picture = render(&pair(deforms).scene, &settings, 13);
        names.map(|name| picture.channel(name).unwrap().collect::<Vec<f32>>()).concat()
    });
    let far = |(a, b): &(&f32, &f32)| (**a - **b).abs() > 1e-3;
    let far = one.iter().zip(&other).filter(far).count();
    assert!(far <= 16, "{far} of {}", one.len());
    assert!(one.iter().any(|pixels| pixels.abs() > 0.1));
}

/// A table of what is hidden, and a picture that is kept, are of a shape and of how it changes.
#[test]
fn keys_of_geometry_tell_shapes_apart() {
    let key = |stage: Stage| {
        let camera = stage.scene.cameras[0].clone();
        pipeline::view_keys(&stage.scene, &camera).geometry
    };
    let mut faster = pair(true);
    let mesh = &mut faster.scene.meshes[1];
    let mut deformation = Deformation::clone(mesh.deformation.as_ref().unwrap());
    let mut keys = deformation.weights[0].clone();
    keys.times_s[1] = 0.5;
    deformation.weights = [keys].into();
    mesh.deformation = Some(Arc::new(deformation));
    let mut farther = pair(true);
    morph(&mut farther.scene.meshes[1], |_| 2.0 * WAY);
    let keys = [key(pair(true)), key(pair(false)), key(faster), key(farther)];
    assert_eq!(keys[0], key(pair(true)));
    for (i, own) in keys.iter().enumerate() {
        assert!(keys[..i].iter().all(|other| other != own), "{i}");
    }
}

/// Places and scales over many decades: what deforms is as exact as what stands still.
#[test]
fn shapes_are_as_exact_as_their_size() {
    for exponent in [-6, -3, 0, 3, 6] {
        let size = 10_f64.powi(exponent);
        let mut stage = Stage::default();
        let place = Trs::Parts {
            translation: DVec3::ZERO,
            rotation: DQuat::IDENTITY,
            scale: DVec3::splat(size),
        };
        stage.quad([2.0; 2], Material::default(), place);
        morph(&mut stage.scene.meshes[0], |_| Vec3::Z);
        let light = facing(DVec3::Z * 5.0 * size, DVec3::ZERO);
        stage.quad([size as f32; 2], glow(Vec3::splat(30.0)), light);
        stage.look(DVec3::Z * 4.0 * size, DVec3::ZERO, 0.3);
        let settings = direct(8, 16);
        let moving = bits(&render(&stage.scene, &settings, 25));
        let still = bits(&render(&frozen(stage.scene, 25), &settings, 25));
        assert_eq!(moving, still, "{size}");
        assert!(moving.iter().all(|pixel| f32::from_bits(pixel[1]) > 0.0));
    }
}
