//! Views of scenes without a camera: what they must show, whatever else is in the scene.

use crate::deforming::morph;
use crate::stage::{Set, Stage, at, direct, facing, glow, lambert};
use candelabra::pipeline::{self, ASPECT, View};
use candelabra::render::RenderSettings;
use candelabra::render::buffers::RenderBuffers;
use candelabra::scene::{
    Camera, Channel, Interpolation, Keys, LightKind, Mesh, Pose, Projection, Scene, Trs, Visibility,
};
use glam::{DQuat, DVec3, Vec3};

fn look(scene: &mut Scene, aspect: f32) -> Camera {
    let found = pipeline::look(scene, &View::default(), aspect).unwrap();
    assert!(found.note.is_some_and(|note| note.contains("no camera; the view is --look-from")));
    found.camera
}

/// Where a point is in the picture, from -1 to 1 across and up.
fn in_picture(camera: &Camera, pose: &Pose, aspect: f32, point: DVec3) -> [f64; 2] {
    let Projection::Perspective { yfov_rad } = camera.projection else { panic!() };
    let local = pose.world(camera.node).inverse().transform_point3(point.as_vec3());
    assert!(local.z < 0.0, "{point} is behind the camera");
    let slope = f64::from((0.5 * yfov_rad).tan());
    let [x, y] = [local.x, local.y].map(|across| f64::from(across / -local.z) / slope);
    [x / f64::from(aspect), y]
}

/// Asserts that points are all in the picture and that they fill it, from edge to edge in one direction.
#[track_caller]
fn assert_framed(what: &str, scene: &mut Scene, points: &[DVec3]) {
    for aspect in [0.4, 1.0, ASPECT] {
        let mut scene = Scene {
            nodes: scene.nodes.clone(),
            meshes: scene.meshes.clone(),
            materials: scene.materials.clone(),
            instances: scene.instances.clone(),
            lights: scene.lights.clone(),
            ..Default::default()
        };
        let camera = look(&mut scene, aspect);
        let pose = scene.pose_at(0.0);
        let places: Vec<[f64; 2]> =
            points.iter().map(|&point| in_picture(&camera, &pose, aspect, point)).collect();
        let extent = |axis: usize| {
            let of = || places.iter().map(|place| place[axis]);
            of().fold(f64::NEG_INFINITY, f64::max) - of().fold(f64::INFINITY, f64::min)
        };
        let outside = places.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
        assert!(outside < 1.0, "{what}, aspect {aspect}: {places:?}");
        assert!(extent(0).max(extent(1)) > 0.8, "{what}, aspect {aspect}: {places:?}");
    }
}

fn corners(half: f64, middle: DVec3) -> Vec<DVec3> {
    let sign = |i: u32, bit: u32| if i >> bit & 1 == 0 { -half } else { half };
    (0..8).map(|i| middle + DVec3::new(sign(i, 0), sign(i, 1), sign(i, 2))).collect()
}

fn cube(half: f32, strays: &[Vec3]) -> Mesh {
    let sign = |i: u32, bit: u32| if i >> bit & 1 == 0 { -half } else { half };
    let mut positions: Vec<Vec3> =
        (0..8).map(|i| Vec3::new(sign(i, 0), sign(i, 1), sign(i, 2))).collect();
    let faces =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let mut triangles: Vec<[u32; 3]> =
        faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    for &stray in strays {
        triangles.push([0, 1, positions.len() as u32]);
        positions.push(stray);
    }
    Mesh { positions, triangles, ..Default::default() }
}

/// A cube of some size somewhere.
fn cube_stage(half: f64, middle: DVec3, strays: &[Vec3]) -> Stage {
    let mut stage = Stage::default();
    stage.mesh(cube(half as f32, strays), lambert(Vec3::splat(0.5)), at(middle));
    stage
}

fn lamp(stage: &mut Stage, place: DVec3) {
    stage.light(LightKind::Point { intensity_cd: Vec3::ONE }, at(place));
}

#[test]
fn a_thing_fills_the_picture_at_every_scale_and_place() {
    for half in [1e-6, 1e-3, 1.0, 1e3, 1e7] {
        for middle in [DVec3::ZERO, DVec3::new(3.0, -2.0, 5.0) * half, DVec3::X * 300.0 * half] {
            let mut stage = cube_stage(half, middle, &[]);
            assert_framed(
                &format!("{half} m at {middle}"),
                &mut stage.scene,
                &corners(half, middle),
            );
        }
    }
}

#[test]
fn strays_and_backdrops_do_not_shrink_it() {
    let things = corners(1.0, DVec3::ZERO);
    for far in [1e2, 1e3, 1e4, 1e6, 1e9] {
        let far_away = Vec3::new(far, -0.3 * far, 0.1 * far);
        let mut stage = cube_stage(1.0, DVec3::ZERO, &[far_away]);
        assert_framed(&format!("a vertex at {far}"), &mut stage.scene, &things);

        let mut stage = cube_stage(1.0, DVec3::ZERO, &[]);
        let ground = facing(-DVec3::Y, DVec3::ZERO);
        stage.quad([far; 2], lambert(Vec3::splat(0.5)), ground);
        assert_framed(&format!("a ground of {far}"), &mut stage.scene, &things);
        lamp(&mut stage, DVec3::Y * 2.0);
        stage.ball(far, 16, glow(Vec3::ONE), at(DVec3::ZERO));
        stage.ball(10.0 * far, 16, lambert(Vec3::ONE), at(DVec3::ZERO));
        assert_framed(&format!("skies of {far}"), &mut stage.scene, &things);

        let mut stage = cube_stage(1.0, DVec3::ZERO, &[]);
        lamp(&mut stage, far_away.as_dvec3());
        assert_framed(&format!("a light at {far}"), &mut stage.scene, &things);

        let mut stage = Stage::default();
        let place = |i: u32| DVec3::new(f64::from(i % 4) * 3.0, 0.0, f64::from(i / 4) * 3.0);
        for i in 0..16 {
            stage.mesh(cube(1.0, &[]), lambert(Vec3::splat(0.5)), at(place(i)));
        }
        stage.mesh(cube(1.0, &[]), lambert(Vec3::splat(0.5)), at(far_away.as_dvec3()));
        let all: Vec<DVec3> = (0..16).flat_map(|i| corners(1.0, place(i))).collect();
        assert_framed(&format!("a thing at {far}"), &mut stage.scene, &all);
    }
}

/// A small part of a large body is no reason to leave the body out.
#[test]
fn a_part_does_not_hide_the_whole() {
    let mut stage = Stage::default();
    stage.ball(5.0, 24, lambert(Vec3::splat(0.5)), at(DVec3::ZERO));
    stage.mesh(cube(0.2, &[]), lambert(Vec3::ONE), at(DVec3::new(0.0, 3.5, 3.5)));
    let all: Vec<DVec3> = [DVec3::X, DVec3::Y, DVec3::Z]
        .into_iter()
        .flat_map(|axis| [axis * 5.0, axis * -5.0])
        .collect();
    assert_framed("a ball with a badge", &mut stage.scene, &all);
}

#[test]
fn lights_near_by_are_in_the_picture() {
    let mut stage = cube_stage(1.0, DVec3::ZERO, &[]);
    lamp(&mut stage, DVec3::new(0.0, 2.5, 0.0));
    let mut all = corners(1.0, DVec3::ZERO);
    all.push(DVec3::new(0.0, 2.5, 0.0));
    assert_framed("a cube and a lamp", &mut stage.scene, &all);

    // Nothing but lights, two of them or many; one of many is far away.
    let mut stage = Stage::default();
    let row: Vec<DVec3> = (0..9).map(|i| DVec3::new(f64::from(i), f64::from(i % 2), 0.0)).collect();
    row.iter().for_each(|&place| lamp(&mut stage, place));
    assert_framed("lamps", &mut stage.scene, &row);
    lamp(&mut stage, DVec3::Z * 1e5);
    assert_framed("lamps and one far away", &mut stage.scene, &row);
}

#[test]
fn flat_and_thin_scenes_are_seen() {
    for normal in [DVec3::X, DVec3::Y, DVec3::Z, -DVec3::Z, DVec3::new(1.0, 1.0, 0.3)] {
        let mut stage = Stage::default();
        stage.quad([2.0, 1.0], glow(Vec3::ONE), facing(DVec3::ZERO, normal));
        let buffers = picture(&mut stage.scene);
        // It shines to one side only, and that is the one to be seen.
        let lit = buffers.beauty().filter(|beauty| beauty.x > 0.5).count();
        assert!(lit > buffers.beauty().count() / 20, "{normal}: {lit} pixels are lit");
    }
    let mut line = Stage::default();
    lamp(&mut line, DVec3::ZERO);
    lamp(&mut line, DVec3::X);
    assert_framed("a line", &mut line.scene, &[DVec3::ZERO, DVec3::X]);
}

#[test]
fn a_point_and_nothing_at_all_have_a_view() {
    let mut point = Stage::default();
    lamp(&mut point, DVec3::new(1e6, 2.0, -3.0));
    let mut sky = Stage::default();
    sky.light(LightKind::Dome { radiance_nits: Vec3::ONE, texture: None }, at(DVec3::ZERO));
    let mut flat = Stage::default();
    let nothing =
        Mesh { positions: vec![Vec3::ONE; 3], triangles: vec![[0, 1, 2]], ..Default::default() };
    flat.mesh(nothing, lambert(Vec3::ONE), at(DVec3::ZERO));
    for stage in [&mut Stage::default(), &mut point, &mut sky, &mut flat] {
        let buffers = picture(&mut stage.scene);
        assert!(buffers.beauty().all(|beauty| beauty.is_finite()));
    }
    assert!(picture(&mut sky.scene).beauty().all(|beauty| beauty == Vec3::ONE));
}

/// A small picture of direct light of the first frame.
fn picture(scene: &mut Scene) -> RenderBuffers {
    let camera = match scene.cameras.first() {
        Some(camera) => camera.clone(),
        None => look(scene, ASPECT),
    };
    let settings = RenderSettings { width: 64, height: 36, ..direct(36, 16) };
    let frame = pipeline::frames_of(scene)[0];
    Set::of(scene, &[frame]).seen_by(camera, &settings, frame)
}

/// A room whose walls face inwards, with a lamp on the ceiling and a block on the floor.
fn room(walls: &[DVec3], facets: u32) -> Stage {
    let mut stage = Stage::default();
    for &wall in walls {
        let step = 4.0 / f64::from(facets);
        let place = |i: u32| -2.0 + step * (f64::from(i) + 0.5);
        let (u, v) = (DVec3::new(wall.y, wall.z, wall.x), DVec3::new(wall.z, wall.x, wall.y));
        for i in 0..facets * facets {
            let middle = wall * 2.0 + u * place(i % facets) + v * place(i / facets);
            stage.quad([step as f32; 2], lambert(Vec3::splat(0.7)), facing(middle, middle - wall));
        }
    }
    stage.mesh(cube(0.5, &[]), lambert(Vec3::splat(0.4)), at(DVec3::new(0.6, -1.5, -0.5)));
    stage.quad([1.0; 2], glow(Vec3::splat(9.0)), facing(DVec3::Y * 1.99, DVec3::ZERO));
    stage
}

/// Rooms that are open on one side are seen through it, and closed ones from inside; whether a wall is
/// two triangles or many.
#[test]
fn rooms_are_seen_where_they_are_lit() {
    let walls = [DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y, DVec3::Z, -DVec3::Z];
    for facets in [1, 12] {
        for open in 0..7 {
            let mut walls = walls.to_vec();
            if open < 6 {
                walls.remove(open);
            }
            let mut stage = room(&walls, facets);
            let buffers = picture(&mut stage.scene);
            let lit = buffers.beauty().filter(|beauty| beauty.x > 0.01).count();
            let share = lit as f64 / buffers.beauty().count() as f64;
            assert!(share > 0.3, "wall {open} is open, {facets} facets: {share} of it is lit");
        }
    }
}

/// What the camera does not see is neither framed nor in the way.
#[test]
fn what_is_hidden_from_the_camera_decides_nothing() {
    let mut stage = cube_stage(1.0, DVec3::ZERO, &[]);
    let hidden = Visibility { camera: false, ..Visibility::ALL };
    for (side, size) in [(DVec3::Z, 5.0), (DVec3::X, 5.0), (DVec3::Y, 5.0), (-DVec3::X, 5.0)] {
        let place = facing(side * 1.5, DVec3::ZERO);
        stage.quad([size; 2], lambert(Vec3::ONE), place).visibility = hidden;
    }
    lamp(&mut stage, DVec3::new(0.3, 0.6, 1.2));
    assert_framed("a cube behind hidden cards", &mut stage.scene, &corners(1.0, DVec3::ZERO));
}

/// A view that is good for a whole shot, whichever frames of it a process renders.
#[test]
fn what_moves_is_framed_wherever_it_is() {
    let mut stage = cube_stage(1.0, DVec3::ZERO, &[]);
    let keys = Keys {
        times_s: vec![0.0, 1.0],
        values: vec![Vec3::ZERO, Vec3::X * 12.0],
        interpolation: Interpolation::Linear,
    };
    stage.scene.nodes[0].channels = vec![Channel::Translation(keys)];
    let mut all = corners(1.0, DVec3::ZERO);
    all.extend(corners(1.0, DVec3::X * 12.0));
    assert_framed("a cube on its way", &mut stage.scene, &all);
}

/// Displaced vertices are where they are at each moment, not where the first frame has them.
#[test]
fn what_deforms_is_framed_wherever_it_is() {
    let mut stage = cube_stage(1.0, DVec3::ZERO, &[]);
    morph(&mut stage.scene.meshes[0], |_| Vec3::X * 10.0);
    let points = [corners(1.0, DVec3::ZERO), corners(1.0, DVec3::X * 10.0)].concat();
    assert_framed("a cube that is displaced", &mut stage.scene, &points);
}

#[test]
fn options_place_the_camera() {
    let view = |edit: fn(&mut View)| {
        let mut stage = cube_stage(1.0, DVec3::new(5.0, 0.0, 0.0), &[]);
        stage.look(DVec3::ZERO, DVec3::X, 0.3);
        let mut view = View::default();
        edit(&mut view);
        let camera = pipeline::look(&mut stage.scene, &view, 1.0).unwrap().camera;
        let pose = stage.scene.pose_at(0.0);
        (camera.clone(), pose.world(camera.node))
    };
    let (own, _) = view(|_| ());
    assert_eq!(own.projection, Projection::Perspective { yfov_rad: 0.3 });
    let (fitted, place) = view(|view| (view.fit, view.fov) = (true, Some(90.0)));
    assert_eq!(fitted.projection, Projection::Perspective { yfov_rad: 90f32.to_radians() });
    let forward = -Vec3::from(place.matrix3.z_axis);
    assert!(forward.dot((Vec3::X * 5.0 - Vec3::from(place.translation)).normalize()) > 0.99);
    // Without a point to look at, it is the middle.
    let (placed, place) = view(|view| view.look_from = Some(DVec3::new(5.0, 0.0, 9.0)));
    assert_eq!(placed.projection, Projection::Perspective { yfov_rad: 40f32.to_radians() });
    assert_eq!(place.matrix3.z_axis, Vec3::Z.into());
}

/// The turn of a scene about +Y decides nothing about what is in the picture.
#[test]
fn turned_scenes_are_framed_too() {
    let mut stage = Stage::default();
    let rotation = DQuat::from_rotation_y(0.7) * DQuat::from_rotation_x(0.3);
    let place = Trs::Parts { translation: DVec3::ONE, rotation, scale: DVec3::new(1.0, 2.0, 0.1) };
    stage.mesh(cube(1.0, &[]), lambert(Vec3::splat(0.5)), place);
    let turned = |p: DVec3| DVec3::ONE + rotation * (p * DVec3::new(1.0, 2.0, 0.1));
    let all: Vec<DVec3> = corners(1.0, DVec3::ZERO).into_iter().map(turned).collect();
    assert_framed("a turned slab", &mut stage.scene, &all);
}
