//! What a ray sees where surfaces share a place, and of prims that some rays do not meet.

use super::*;
use crate::scene::{Transmission, Visibility};

/// A square about the origin that faces -Z, at the height that is given.
fn panel(half: f32, z: f32) -> Mesh {
    let corner = |x: f32, y: f32| Vec3::new(x * half, y * half, z);
    let (a, b, c, d) = (corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0));
    mesh(&[[a, b, c], [a, c, d]])
}

fn glowing(mut mesh: Mesh) -> Mesh {
    mesh.material = Some(0);
    mesh
}

/// Meshes with names, placed; the first material glows.
fn named(meshes: Vec<(&str, Mesh, Trs)>) -> Scene {
    let mut scene = Scene::default();
    scene.materials.push(Material { emission_nits: Rgb::ONE, ..Default::default() });
    for (path, mesh, local) in meshes {
        let row = scene.nodes.len() as u32;
        scene.nodes.push(Node::fixed(path, None, local));
        scene.meshes.push(mesh);
        scene.instances.push(Instance {
            path: path.into(),
            node: row,
            mesh: row,
            values: None,
            shaping: None,
            forced: false,
            visibility: Visibility::ALL,
        });
    }
    scene
}

/// A tilt about the origin, and the same with a turn about the panels' normal before it.
fn tilts() -> Vec<[Trs; 2]> {
    let mut numbers = Numbers(23);
    let mut tilts = vec![DQuat::IDENTITY, DQuat::from_rotation_x(0.5)];
    tilts.extend((0..20).map(|_| {
        DQuat::from_axis_angle(
            numbers.direction().as_dvec3().normalize(),
            0.1 + f64::from(numbers.next()),
        )
    }));
    let placed = |turn: DQuat| parts(DVec3::ZERO, turn, DVec3::ONE);
    tilts
        .into_iter()
        .map(|tilt| [placed(tilt), placed(tilt * DQuat::from_rotation_z(0.3))])
        .collect()
}

#[test]
fn a_light_flush_with_a_ceiling_is_seen_whatever_comes_first() {
    for scale in [1e-3_f32, 1.0, 1e3] {
        for [plain, turned] in tilts() {
            let Trs::Parts { rotation: tilt, .. } = plain else { unreachable!() };
            let ceiling = ("/ceiling", panel(5.0 * scale, 3.0 * scale), plain);
            let light = ("/light", glowing(panel(0.5 * scale, 3.0 * scale)), turned);
            for order in [[0, 1], [1, 0]] {
                for moving in [[false, false], [true, false], [false, true]] {
                    let prims = [ceiling.clone(), light.clone()];
                    let mut scene = named(order.map(|i| prims[i].clone()).into());
                    for (node, &row) in scene.nodes.iter_mut().zip(&order) {
                        if moving[row] {
                            let still = Keys {
                                times_s: vec![0.0],
                                values: vec![Vec3::ONE],
                                interpolation: Interpolation::Step,
                            };
                            node.channels.push(Channel::Scale(still));
                        }
                    }
                    flush(&scene, tilt.as_quat(), scale);
                }
            }
        }
    }
}

/// Looks at a ceiling with a light in it from below and from above.
fn flush(scene: &Scene, tilt: Quat, scale: f32) {
    let pose = scene.pose_at(0.0);
    let prepared = RayScene::new(scene, &pose);
    let tracer = prepared.for_pose(scene, &pose);
    let mut numbers = Numbers(24);
    let mut passed = Passed::default();
    for _ in 0..20 {
        let at = Vec3::new(numbers.next() * 0.6 - 0.3, numbers.next() * 0.6 - 0.3, 3.0);
        let to = tilt * at * scale;
        let below = tilt * Vec3::new(numbers.next() * 4.0 - 2.0, numbers.next() * 4.0 - 2.0, 0.0);
        let ray = (below * scale, to - below * scale, f32::INFINITY);
        let seen = tracer.look(Sender::Surface, ray, &ALL, &mut passed);
        let path = |hit: &Hit| match hit.surface {
            HitSurface::Triangle { instance, .. } => scene.instance_path(instance as usize),
            HitSurface::Sphere { .. } => panic!("there are no spheres"),
        };
        assert_eq!(
            passed.lights.iter().map(|light| path(&light.hit)).collect::<Vec<_>>(),
            ["/light"]
        );
        let hit = seen.hit.unwrap();
        assert_eq!(path(&hit), "/light");
        // What leaves it downwards leaves the ceiling, too.
        let start = hit.anchor.origin_toward(-ray.1);
        assert!(!tracer.occluded(start, -ray.1, 0.9, &ALL));
        // From above there is a ceiling, and no light.
        let above = to + tilt * Vec3::Z * scale;
        let ray = (above, to - above, f32::INFINITY);
        let seen = tracer.look(Sender::Camera, ray, &ALL, &mut passed);
        assert!(passed.lights.is_empty());
        let start = seen.hit.unwrap().anchor.origin_toward(-ray.1);
        assert!(!tracer.occluded(start, -ray.1, 0.9, &ALL));
        // A sample of the light arrives.
        let point = Anchor::computed(to, tilt * -Vec3::Z, 4.0 * scale);
        assert!(!tracer.occluded_between(&Anchor::free(below * scale), &point, &ALL));
    }
}

#[test]
fn of_two_surfaces_in_one_place_the_first_by_path_is_hit() {
    for order in [[0, 1], [1, 0]] {
        let prims = ["/a", "/b"].map(|path| (path, panel(1.0, 1.0), Trs::default()));
        let scene = named(order.map(|i| prims[i].clone()).into());
        let pose = scene.pose_at(0.0);
        let prepared = RayScene::new(&scene, &pose);
        let hit = closest(&prepared.for_pose(&scene, &pose), Vec3::ZERO, Vec3::Z, 9.0, &ALL);
        let HitSurface::Triangle { instance, .. } = hit.unwrap().surface else { panic!() };
        assert_eq!(scene.instance_path(instance as usize), "/a");
    }
}

#[test]
fn lights_in_one_place_are_all_seen() {
    for [plain, turned] in tilts() {
        let Trs::Parts { rotation: tilt, .. } = plain else { unreachable!() };
        let lamp = |path, place| (path, glowing(panel(1.0, 2.0)), place);
        let scene = named(vec![lamp("/a", plain), lamp("/b", turned), lamp("/c", plain)]);
        let pose = scene.pose_at(0.0);
        let prepared = RayScene::new(&scene, &pose);
        let tracer = prepared.for_pose(&scene, &pose);
        let mut passed = Passed::default();
        let toward = tilt.as_quat() * Vec3::new(0.1, 0.3, 2.0);
        for sender in [Sender::Camera, Sender::Surface] {
            tracer.look(sender, (Vec3::ZERO, toward, 9.0), &ALL, &mut passed);
            assert_eq!(passed.lights.len(), 3);
        }
    }
}

#[test]
fn a_light_behind_a_thin_wall_is_not_seen() {
    for gap in [1e-5_f32, 1e-3, 0.1] {
        for tilt in [DQuat::IDENTITY, DQuat::from_rotation_x(0.4)] {
            let place = parts(DVec3::ZERO, tilt, DVec3::ONE);
            let wall = ("/wall", panel(5.0, 2.0), place);
            let lamp = ("/lamp", glowing(panel(1.0, 2.0 + 2.0 * gap)), place);
            let scene = named(vec![wall, lamp]);
            let pose = scene.pose_at(0.0);
            let prepared = RayScene::new(&scene, &pose);
            let toward = tilt.as_quat() * Vec3::new(0.1, 0.2, 2.0);
            let mut passed = Passed::default();
            let ray = (Vec3::ZERO, toward, f32::INFINITY);
            prepared.for_pose(&scene, &pose).look(Sender::Surface, ray, &ALL, &mut passed);
            assert!(passed.lights.is_empty(), "{gap}");
        }
    }
}

/// A lamp a metre off, and a wall and a second lamp in one plane behind it.
fn lamp_before_a_wall(visibility: Visibility, kind: usize) -> Scene {
    let forth = Trs::default();
    let mut scene = named(vec![
        ("/wall", panel(5.0, 2.0), forth),
        ("/far", glowing(panel(1.0, 2.0)), forth),
        ("/lamp", glowing(panel(1.0, 1.0)), forth),
    ]);
    match kind {
        0 => scene.instances[2].visibility = visibility,
        1 => {
            scene.instances[2].visibility = visibility;
            scene.nodes[2] = turning(scene.nodes[2].clone());
        }
        _ => {
            scene.instances.truncate(2);
            let kind = LightKind::Sphere { radiance_nits: Rgb::ONE, radius: 0.2, shaping: None };
            scene.nodes[2] =
                Node::fixed("/lamp", None, parts(DVec3::Z, DQuat::IDENTITY, DVec3::ONE));
            scene.lights.push(Light {
                node: 2,
                kind,
                values: None,
                range_m: None,
                forced: false,
                visibility,
            });
        }
    }
    scene
}

#[test]
fn who_sends_a_ray_decides_what_it_meets() {
    let all = (0..8).map(|bits| Visibility {
        camera: bits & 1 != 0,
        reflections: bits & 2 != 0,
        shadows: bits & 4 != 0,
    });
    for visibility in all {
        for kind in 0..3 {
            let scene = lamp_before_a_wall(visibility, kind);
            let pose = scene.pose_at(0.0);
            let prepared = RayScene::new(&scene, &pose);
            let tracer = prepared.for_pose(&scene, &pose);
            let Visibility { camera, reflections, shadows } = visibility;
            let mut passed = Passed::default();
            let mut look = |sender, from: Vec3, toward: Vec3| {
                let seen = tracer.look(sender, (from, toward, 9.0), &ALL, &mut passed);
                let near = passed.lights.iter().filter(|light| light.hit.t < 1.5).count();
                let t = seen.hit.map_or(f32::INFINITY, |hit| hit.t);
                (t < 1.5, near, passed.lights.len() - near)
            };
            let (from, toward) = (Vec3::new(0.05, 0.07, 0.0), Vec3::Z);
            let (stops, passes) = ((true, 1, 0), (false, 0, 1));
            assert_eq!(look(Sender::Camera, from, toward), if camera { stops } else { passes });
            let expected = match (reflections, shadows) {
                (true, true) => stops,
                // The lamp, and the one behind it.
                (true, false) => (false, 1, 1),
                (false, false) => passes,
                // Not the lamp; and a ray to the one behind it would not arrive.
                (false, true) => (false, 0, 0),
            };
            assert_eq!(look(Sender::Surface, from, toward), expected, "{visibility:?} {kind}");
            assert_eq!(tracer.occluded(from, toward, 1.5, &ALL), shadows);
            // A lamp without a surface of its own is not there for who is behind it; a ball has no
            // behind.
            if kind < 2 && !shadows {
                let behind = Vec3::new(0.05, 0.07, 1.5);
                assert_eq!(look(Sender::Camera, behind, -toward), (false, 0, 0));
                assert_eq!(look(Sender::Surface, behind, -toward), (false, 0, 0));
            }
        }
    }
}

#[test]
fn an_unlit_lamp_is_not_there() {
    for kind in 0..3 {
        let lamp = Visibility { camera: true, ..Visibility::LAMP };
        let mut scene = lamp_before_a_wall(lamp, kind);
        scene.materials[0].emission_nits = Rgb::ZERO;
        if let Some(light) = scene.lights.first_mut() {
            light.kind = LightKind::Sphere { radiance_nits: Rgb::ZERO, radius: 0.2, shaping: None };
        }
        let pose = scene.pose_at(0.0);
        let prepared = RayScene::new(&scene, &pose);
        let tracer = prepared.for_pose(&scene, &pose);
        let (from, mut passed) = (Vec3::new(0.05, 0.07, 0.0), Passed::default());
        for sender in [Sender::Camera, Sender::Surface] {
            let hit = tracer.look(sender, (from, Vec3::Z, 9.0), &ALL, &mut passed).hit;
            assert!(hit.unwrap().t > 1.5 && passed.lights.is_empty());
        }
        assert!(!tracer.occluded(from, Vec3::Z, 1.5, &ALL));
    }
}

/// What a look finds, the boxes around what shines must not rule out; and they do rule out what is elsewhere.
#[test]
fn a_ray_that_sees_a_light_may_meet_light() {
    let mut numbers = Numbers(61);
    let (mut seen, mut ruled_out) = (0, 0);
    for scale in [1e-6_f32, 1.0, 1e6] {
        // Lamps that stand and lamps that move, among walls; one sphere.
        let lamp = || glowing(panel(0.05 * scale, 0.0));
        let mut parts_of = Vec::new();
        for i in 0..40 {
            let at = (numbers.point() - 0.5) * scale;
            let turn =
                DQuat::from_rotation_arc(DVec3::Z, numbers.direction().as_dvec3().normalize());
            let mesh = if i % 4 == 0 { panel(0.3 * scale, 0.0) } else { lamp() };
            parts_of.push((
                ["/wall", "/lamp"][usize::from(i % 4 != 0)],
                mesh,
                parts(at.as_dvec3(), turn, DVec3::ONE),
            ));
        }
        let mut scene = named(parts_of);
        for node in scene.nodes.iter_mut().step_by(3) {
            *node = turning(node.clone());
        }
        let node = scene.nodes.len() as u32;
        scene.nodes.push(Node::fixed(
            "/ball",
            None,
            parts(DVec3::splat(0.6 * f64::from(scale)), DQuat::IDENTITY, DVec3::ONE),
        ));
        scene.lights.push(Light {
            node,
            kind: LightKind::Sphere { radiance_nits: Rgb::ONE, radius: 0.1 * scale, shaping: None },
            values: None,
            range_m: None,
            forced: false,
            visibility: Visibility::ALL,
        });
        for time in [0.0, 0.7] {
            let pose = scene.pose_at(time);
            let prepared = RayScene::new(&scene, &scene.pose_at(0.0));
            let tracer = prepared.for_pose(&scene, &pose);
            let mut passed = Passed::default();
            for _ in 0..4000 {
                let (origin, direction) =
                    ((numbers.point() * 2.0 - 1.0) * scale, numbers.direction());
                let ray = (origin, direction, f32::INFINITY);
                tracer.look(Sender::Surface, ray, &ALL, &mut passed);
                let may = tracer.may_meet_light(origin, direction);
                assert!(may || passed.lights.is_empty(), "{scale}, {time}: {passed:?}");
                seen += usize::from(!passed.lights.is_empty());
                ruled_out += usize::from(!may);
            }
        }
    }
    assert!(seen > 100 && ruled_out > 12_000, "{seen} saw a light, {ruled_out} were ruled out");
}

/// What half-tinting panes let through of a ray, as a ray that looks and as one that asks for a light, from either end.
fn halved(tracer: &Tracer, from: Vec3, to: Vec3) -> Vec<f32> {
    let half = |_: &Hit| Rgb::splat(0.5);
    let mut passed = Passed::default();
    let mut shares = Vec::new();
    for (from, to) in [(from, to), (to, from)] {
        let ray = (from, to - from, 1.0);
        tracer.look(Sender::Surface, ray, &ALL, &mut passed);
        passed.panes.iter_mut().for_each(|pane| pane.tint = Rgb::splat(0.5));
        shares.push(passed.tint_of_sky().x);
        shares.push(tracer.transmitted(ray, &ALL, &|_| true, &half).share.x);
        let ends = [from, to].map(Anchor::free);
        let between = tracer.transmitted_between(&ends[0], &ends[1], &ALL, &|_| true, &half);
        shares.push(between.share.x);
    }
    shares
}

/// A mesh that is all of glass.
fn panes(quads: &[[Vec3; 4]], triangles: &[usize]) -> Mesh {
    let all: Vec<[Vec3; 3]> =
        quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    glowing(mesh(&triangles.iter().map(|&i| all[i]).collect::<Vec<_>>()))
}

fn of_panes(meshes: Vec<Mesh>) -> Scene {
    let mut scene =
        named(meshes.into_iter().map(|mesh| ("/panes", mesh, Trs::default())).collect());
    let transmission = Some(Transmission { factor: 1.0, factor_texture: None, volume: None });
    scene.materials = vec![Material { transmission, roughness: 0.0, ..Default::default() }];
    scene
}

#[test]
fn panes_of_one_mesh_are_one_only_where_they_meet() {
    let mut numbers = Numbers(31);
    for scale in [1e-3_f32, 1.0, 1e3] {
        // Far out, the gaps are less than what is taken to be one surface.
        let quad = |x: f32| {
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                .map(|(y, z)| Vec3::new(1000.0 + x, y, z) * scale)
        };
        let walls = [0.0, 0.02, 0.04].map(quad);
        let orders = [[0, 1, 2, 3, 4, 5], [5, 2, 0, 4, 3, 1], [2, 4, 0, 1, 5, 3]];
        for order in orders {
            let mesh = panes(&walls, &order);
            let between = panes(&[quad(0.01)], &[0, 1]);
            let scenes = [
                (vec![mesh.clone()], 0.125),
                (vec![mesh.clone(), between.clone()], 0.0625),
                (vec![between, mesh], 0.0625),
            ];
            for (meshes, expected) in scenes {
                let scene = of_panes(meshes);
                let pose = scene.pose_at(0.0);
                let prepared = RayScene::new(&scene, &pose);
                let tracer = prepared.for_pose(&scene, &pose);
                // On the diagonals, straight, and anywhere.
                let straight =
                    [0.25, -0.5].map(|y| [-0.5, 0.5].map(|x| Vec3::new(1000.0 + x, y, y)));
                let anywhere = (0..20).map(|_| {
                    [-0.5, 0.5]
                        .map(|x| Vec3::new(1000.0 + x, numbers.next() - 0.5, numbers.next() - 0.5))
                });
                for [from, to] in straight.into_iter().chain(anywhere) {
                    for share in halved(&tracer, from * scale, to * scale) {
                        assert_eq!(share, expected, "scale {scale}, {from} to {to}");
                    }
                }
            }
        }
    }
}

/// Near the edges of a sheet far out, a ray enters one face and leaves another that has a corner of it.
#[test]
fn a_ray_through_the_edge_of_a_sheet_passes_two_faces() {
    let corner = |x: f32, y: f32, z: f32| Vec3::new(1000.0 + x, y, z);
    let (near, far) = (0.0, 0.0625);
    let [a, b, c, d] = [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)]
        .map(|(y, z)| [corner(near, y, z), corner(far, y, z)]);
    let sides = [(a, b), (b, c), (c, d), (d, a)].map(|(a, b)| [a[1], b[1], b[0], a[0]]);
    let faces = [[a[0], b[0], c[0], d[0]], [d[1], c[1], b[1], a[1]]];
    let all: Vec<[Vec3; 4]> = faces.into_iter().chain(sides).collect();
    let scene = of_panes(vec![panes(&all, &(0..12).collect::<Vec<_>>())]);
    let pose = scene.pose_at(0.0);
    let prepared = RayScene::new(&scene, &pose);
    let tracer = prepared.for_pose(&scene, &pose);
    for z in [-0.3, 0.1, 0.6] {
        // Enters 5 mm from the edge, and leaves the side 5 mm behind the face.
        let (from, to) = (corner(-0.5, 0.5, z), corner(0.5, 1.5, z));
        let aside = Vec3::Y * -0.0078125;
        for share in halved(&tracer, from + aside, to + aside) {
            assert_eq!(share, 0.25, "at {z}");
        }
    }
}
