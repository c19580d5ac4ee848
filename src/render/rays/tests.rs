//! The ray kernel against brute force in double precision; laws that need none are in `laws`.

mod laws;
mod sights;

use super::*;
use crate::math::color::Rgb;
use crate::math::random::hash;
use crate::math::warp;
use crate::scene::{
    AlphaMode, Channel, Interpolation, Keys, Light, LightKind, Material, Node, Trs,
};
use glam::{DQuat, DVec3, Quat, Vec2};
use std::sync::Arc;

const ALL: fn(u32, u32, Vec2) -> bool = |_, _, _| true;

/// What a ray of a surface ends on.
fn closest(
    tracer: &Tracer,
    origin: Vec3,
    direction: Vec3,
    tmax: f32,
    accept: &impl Fn(u32, u32, Vec2) -> bool,
) -> Option<Hit> {
    tracer.look(Sender::Surface, (origin, direction, tmax), accept, &mut Passed::default()).hit
}

/// Uniform numbers, the same every time.
struct Numbers(u32);

impl Numbers {
    fn next(&mut self) -> f32 {
        self.0 = hash(self.0, 0x5eed);
        (self.0 >> 8) as f32 / (1 << 24) as f32
    }
    fn point(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next())
    }
    fn direction(&mut self) -> Vec3 {
        warp::sphere(Vec2::new(self.next(), self.next()))
    }
}

fn mesh(triangles: &[[Vec3; 3]]) -> Mesh {
    let corners = |i: usize| [3 * i as u32, 3 * i as u32 + 1, 3 * i as u32 + 2];
    Mesh {
        positions: triangles.iter().flatten().copied().collect(),
        triangles: (0..triangles.len()).map(corners).collect(),
        ..Default::default()
    }
}

/// A scene of meshes placed by transforms.
fn scene(meshes: Vec<Mesh>, placed: &[(u32, Trs)]) -> Scene {
    let mut scene = Scene { meshes, ..Default::default() };
    for (i, &(mesh, local)) in placed.iter().enumerate() {
        let path: Arc<str> = format!("/prim_{i}").into();
        scene.nodes.push(Node::fixed(path.clone(), None, local));
        scene.instances.push(Instance {
            path,
            node: i as u32,
            mesh,
            values: None,
            shaping: None,
            forced: false,
            visibility: Default::default(),
        });
    }
    scene
}

fn soup(numbers: &mut Numbers, count: usize, scale: f32) -> Vec<[Vec3; 3]> {
    (0..count)
        .map(|_| {
            let at = numbers.point();
            [0, 1, 2].map(|_| (at + (numbers.point() - 0.5) * 0.3) * scale)
        })
        .collect()
}

/// World-space triangles of a scene in double precision, by instance and triangle.
fn world_triangles(scene: &Scene, pose: &Pose) -> Vec<(u32, u32, [DVec3; 3])> {
    let mut all = Vec::new();
    for (i, instance) in scene.instances.iter().enumerate() {
        let mesh = &scene.meshes[instance.mesh as usize];
        let world = world_of(pose, instance.node);
        for (t, corners) in mesh.triangles.iter().enumerate() {
            let place = |c: u32| world.transform_point3(mesh.positions[c as usize].as_dvec3());
            all.push((i as u32, t as u32, corners.map(place)));
        }
    }
    all
}

/// Nearest `(t, instance, triangle)`, and how far inside the triangle: its smallest weight.
fn brute(all: &[(u32, u32, [DVec3; 3])], o: Vec3, d: Vec3) -> Option<(f64, u32, u32, f64)> {
    let (o, d) = (o.as_dvec3(), d.as_dvec3());
    let mut best: Option<(f64, u32, u32, f64)> = None;
    for &(instance, triangle, [a, b, c]) in all {
        let (ab, ac) = (b - a, c - a);
        let p = d.cross(ac);
        let det = ab.dot(p);
        let s = o - a;
        let u = s.dot(p) / det;
        let q = s.cross(ab);
        let (v, t) = (d.dot(q) / det, ac.dot(q) / det);
        let inside = u.min(v).min(1.0 - u - v);
        if inside >= 0.0 && t > 0.0 && best.is_none_or(|found| t < found.0) {
            best = Some((t, instance, triangle, inside));
        }
    }
    best
}

/// Traces random rays through a scene and demands what brute force says. Rays that pass within
/// rounding of an edge may go either way.
fn agree(scene: &Scene, time_s: f64, center: Vec3, scale: f32, rays: usize) {
    let pose = scene.pose_at(time_s);
    let prepared = RayScene::new(scene, &scene.pose_at(0.0));
    let tracer = prepared.for_pose(scene, &pose);
    let all = world_triangles(scene, &pose);
    let mut numbers = Numbers(17);
    let (mut hits, mut unsure) = (0, 0);
    for _ in 0..rays {
        let origin = center + (numbers.point() * 3.0 - 1.5) * scale;
        // Most aim at a triangle.
        let [a, b, c] = all[(numbers.next() * all.len() as f32) as usize % all.len()].2;
        let uv = warp::triangle(Vec2::new(numbers.next(), numbers.next())).as_dvec2();
        let aim = a + (b - a) * uv.x + (c - a) * uv.y;
        let aimed = (aim - origin.as_dvec3()).normalize().as_vec3();
        let direction = if numbers.next() < 0.7 { aimed } else { numbers.direction() };
        let found = closest(&tracer, origin, direction, f32::INFINITY, &ALL);
        let expected = brute(&all, origin, direction);
        let name = found.map(|hit| match hit.surface {
            HitSurface::Triangle { instance, triangle, .. } => (instance, triangle),
            HitSurface::Sphere { .. } => panic!("there are no spheres"),
        });
        if name != expected.map(|e| (e.1, e.2)) {
            let margin = expected.map_or(0.0, |e| e.3);
            assert!(
                margin < 1e-4,
                "found {found:?}, expected {expected:?} from {origin} {direction}"
            );
            unsure += 1;
            continue;
        }
        let Some((t, ..)) = expected else { continue };
        let hit = found.unwrap();
        hits += 1;
        assert!((f64::from(hit.t) / t - 1.0).abs() < 1e-5, "{} {t}", hit.t);
        // The anchor is on the surface within its error, and the barycentrics lead to it.
        let HitSurface::Triangle { instance, triangle, barycentric } = hit.surface else { return };
        let corners = all.iter().find(|c| (c.0, c.1) == (instance, triangle)).unwrap().2;
        let [a, b, c] = corners;
        let plane = (b - a).cross(c - a).normalize();
        let off = plane.dot(hit.anchor.position.as_dvec3() - a).abs();
        // A copy in world space is rounded once more than the instance it came from.
        let rounding = f64::from(f32::EPSILON) * a.abs().max(b.abs()).max(c.abs()).max_element();
        assert!(off <= f64::from(hit.anchor.error_m) + 2.0 * rounding, "{off} {:?}", hit.anchor);
        let [u, v] = barycentric.to_array().map(f64::from);
        let at = a + (b - a) * u + (c - a) * v;
        let size = (b - a).length().max((c - a).length());
        assert!((at - hit.anchor.position.as_dvec3()).length() < 1e-5 * size + 4.0 * rounding);
        let limit = hit.t;
        assert!(tracer.occluded(origin, direction, limit.next_up(), &ALL));
        assert!(!tracer.occluded(origin, direction, limit * (1.0 - 1e-6), &ALL));
        assert!(closest(&tracer, origin, direction, limit * (1.0 - 1e-6), &ALL).is_none());
    }
    assert!(hits * 4 > rays, "only {hits} hits of {rays}");
    assert!(unsure * 200 < rays, "{unsure} rays disagree at an edge");
}

#[test]
fn random_triangles_agree_with_brute_force_at_every_scale() {
    for scale in [1e-9, 1e-6, 1e-3, 1.0, 1e3, 1e6, 1e9] {
        let mut numbers = Numbers(3);
        let triangles = soup(&mut numbers, 300, scale);
        let scene = scene(vec![mesh(&triangles)], &[(0, Trs::default())]);
        agree(&scene, 0.0, Vec3::splat(0.5 * scale), scale, 2000);
    }
}

fn parts(translation: DVec3, rotation: DQuat, scale: DVec3) -> Trs {
    Trs::Parts { translation, rotation, scale }
}

/// Transforms with rotation, mirroring, shear and uneven scale.
fn transforms() -> Vec<Trs> {
    let turn = DQuat::from_rotation_y(0.7) * DQuat::from_rotation_x(0.3);
    let shear = DAffine3::from_mat3(DMat3::from_cols(
        DVec3::X,
        DVec3::new(0.5, 1.0, 0.0),
        DVec3::new(0.0, -0.3, 0.8),
    ));
    vec![
        parts(DVec3::new(-2.0, 0.0, 0.0), turn, DVec3::ONE),
        parts(DVec3::new(2.0, 0.0, 0.0), turn, DVec3::new(-1.0, 1.0, 1.0)),
        parts(DVec3::new(0.0, 2.0, 0.0), DQuat::IDENTITY, DVec3::new(0.3, 2.0, 1.0)),
        Trs::Matrix(shear),
    ]
}

#[test]
fn copied_instances_agree_with_brute_force() {
    let triangles = soup(&mut Numbers(4), 100, 1.0);
    let placed: Vec<_> = transforms().into_iter().map(|trs| (0, trs)).collect();
    agree(&scene(vec![mesh(&triangles)], &placed), 0.0, Vec3::splat(0.5), 2.0, 2000);
}

/// A node whose only channel turns it about +Y, a radian a second.
fn turning(mut node: Node) -> Node {
    let keys = (0..=4).map(|i| i as f32 * 0.5);
    node.channels.push(Channel::Rotation(Keys {
        times_s: keys.clone().collect(),
        values: keys.map(Quat::from_rotation_y).collect(),
        interpolation: Interpolation::Linear,
    }));
    node
}

/// How many instances refer to shared sets.
fn in_own_space(prepared: &RayScene) -> usize {
    prepared.standing.items.len() + prepared.moving.instances.len()
}

#[test]
fn moving_instances_agree_with_brute_force() {
    let triangles = soup(&mut Numbers(5), 100, 1.0);
    let mut placed: Vec<_> = transforms()
        .into_iter()
        .filter(|t| matches!(t, Trs::Parts { .. }))
        .map(|t| (0, t))
        .collect();
    placed.push((1, Trs::default()));
    let still = soup(&mut Numbers(6), 50, 1.0);
    let mut scene = scene(vec![mesh(&triangles), mesh(&still)], &placed);
    for node in &mut scene.nodes[..3] {
        *node = turning(node.clone());
    }
    for time_s in [0.0, 0.8, 2.0] {
        agree(&scene, time_s, Vec3::splat(0.5), 2.0, 1000);
    }
    let prepared = RayScene::new(&scene, &scene.pose_at(0.0));
    assert_eq!((prepared.shared.len(), in_own_space(&prepared)), (1, 3));
}

#[test]
fn instances_far_from_the_origin_and_of_odd_scale_keep_their_hits() {
    let triangles = soup(&mut Numbers(7), 100, 1000.0);
    let far = DVec3::new(1e5, -2e5, 3e5);
    let local = parts(far, DQuat::from_rotation_z(1.0), DVec3::splat(1e-3));
    let mut scene = scene(vec![mesh(&triangles)], &[(0, local)]);
    // As an instance: a copy would be rounded to a 32nd of a metre out there.
    scene.nodes[0].channels.push(Channel::Translation(Keys {
        times_s: vec![0.0],
        values: vec![far.as_vec3()],
        interpolation: Interpolation::Step,
    }));
    agree(&scene, 0.0, far.as_vec3(), 2.0, 500);
}

#[test]
fn a_mesh_shared_by_many_is_kept_once() {
    let triangles = soup(&mut Numbers(8), 4000, 1.0);
    let grid =
        (0..27).map(|i| DVec3::new(f64::from(i % 3), f64::from(i / 3 % 3), f64::from(i / 9)));
    let placed: Vec<_> = grid.map(|at| (0, parts(at * 2.0, DQuat::IDENTITY, DVec3::ONE))).collect();
    let scene = scene(vec![mesh(&triangles)], &placed);
    let prepared = RayScene::new(&scene, &scene.pose_at(0.0));
    assert_eq!((prepared.shared.len(), in_own_space(&prepared)), (1, 27));
    agree(&scene, 0.0, Vec3::splat(2.5), 3.0, 150);
}
