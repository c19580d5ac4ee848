//! What holds for every ray, shape and transform, without a second implementation.

use super::*;

#[test]
fn the_normal_is_the_fronts_whatever_the_transform() {
    let triangle = [Vec3::ZERO, Vec3::X, Vec3::Y];
    for moving in [false, true] {
        for (scale, front) in
            [(DVec3::ONE, 1.0), (DVec3::new(1.0, 1.0, -1.0), -1.0), (-DVec3::ONE, -1.0)]
        {
            let local = parts(DVec3::ZERO, DQuat::IDENTITY, scale);
            let mut scene = scene(vec![mesh(&[triangle])], &[(0, local)]);
            if moving {
                scene.nodes[0] = turning(scene.nodes[0].clone());
            }
            let pose = scene.pose_at(0.0);
            let prepared = RayScene::new(&scene, &pose);
            let tracer = prepared.for_pose(&scene, &pose);
            let s = scale.as_vec3() * Vec3::new(0.2, 0.2, 0.0);
            let hit = closest(&tracer, s + Vec3::Z, -Vec3::Z, 9.0, &ALL).unwrap();
            assert_eq!(hit.anchor.normal, Vec3::Z * front, "{scale} {moving}");
        }
    }
}

fn with_sphere(radius: f32, at: DVec3, scale: f64) -> Scene {
    let mut scene = Scene::default();
    let local = parts(at, DQuat::IDENTITY, DVec3::splat(scale));
    scene.nodes.push(Node::fixed("/lamp", None, local));
    let kind = LightKind::Sphere { radiance_nits: Rgb::ONE, radius, shaping: None };
    scene.lights.push(Light {
        node: 0,
        kind,
        values: None,
        range_m: None,
        forced: false,
        visibility: Default::default(),
    });
    scene
}

#[test]
fn spheres_are_met_from_outside_and_from_inside() {
    for scale in [1e-6_f32, 1.0, 1e6] {
        let center = Vec3::new(3.0, -1.0, 2.0) * scale;
        let scene = with_sphere(0.5, center.as_dvec3(), f64::from(scale));
        let pose = scene.pose_at(0.0);
        let prepared = RayScene::new(&scene, &pose);
        let tracer = prepared.for_pose(&scene, &pose);
        let mut numbers = Numbers(9);
        for _ in 0..500 {
            let toward = numbers.direction();
            for (from, sign) in [(2.0, -1.0), (0.3, 1.0)] {
                let origin = center + toward * (from * scale);
                let hit = closest(&tracer, origin, toward * sign, f32::INFINITY, &ALL).unwrap();
                assert_eq!(hit.surface, HitSurface::Sphere { light: 0 });
                assert!((hit.t - (from - 0.5).abs() * scale).abs() < 1e-5 * scale);
                assert!((hit.anchor.normal - toward).length() < 1e-5);
                // Outward the sphere is left behind; inward its other side is seen.
                let away = hit.anchor.origin_toward(toward);
                assert!(closest(&tracer, away, toward, f32::INFINITY, &ALL).is_none());
                let inward = hit.anchor.origin_toward(-toward);
                let across = closest(&tracer, inward, -toward, f32::INFINITY, &ALL).unwrap();
                assert!((across.t - scale).abs() < 1e-5 * scale);
            }
            let side = toward.any_orthonormal_vector();
            let past = center + side * (0.51 * scale) - toward * scale;
            assert!(!tracer.occluded(past, toward, f32::INFINITY, &ALL));
        }
    }
}

#[test]
fn a_ray_never_meets_the_surface_it_leaves() {
    // A huge floor with a hit near its middle and far from it, small triangles, and instances.
    for scale in [1e-6_f32, 1.0, 1e6] {
        for reach in [1.0, 1e4] {
            let tilt = DQuat::from_rotation_x(0.3) * DQuat::from_rotation_z(1.1);
            let corner = |x: f32, z: f32| Vec3::new(x, 0.0, z) * (reach * scale);
            let (a, b, c, d) =
                (corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0));
            let at = DVec3::new(0.3, -0.7, 0.2) * f64::from(scale);
            let mut floor =
                scene(vec![mesh(&[[a, c, b], [a, d, c]])], &[(0, parts(at, tilt, DVec3::ONE))]);
            for moving in [false, true] {
                if moving {
                    floor.nodes[0].channels.push(Channel::Scale(Keys {
                        times_s: vec![0.0],
                        values: vec![Vec3::new(1.0, 2.0, 0.7)],
                        interpolation: Interpolation::Step,
                    }));
                }
                let pose = floor.pose_at(0.0);
                let prepared = RayScene::new(&floor, &pose);
                let tracer = prepared.for_pose(&floor, &pose);
                let up = pose.world(0).matrix3.y_axis;
                let up = Vec3::from(up).normalize();
                let mut numbers = Numbers(10);
                let (mut hits, mut lamps) = (0, 0);
                for _ in 0..300 {
                    let origin = (numbers.point() * 4.0 - 2.0) * scale;
                    let toward = numbers.direction();
                    let Some(hit) = closest(&tracer, origin, toward, f32::INFINITY, &ALL) else {
                        continue;
                    };
                    hits += 1;
                    for _ in 0..10 {
                        let leave = numbers.direction();
                        let start = hit.anchor.origin_toward(leave);
                        assert!(!tracer.occluded(start, leave, f32::INFINITY, &ALL), "{hit:?}");
                    }
                    // From the floor to a lamp above it, and from the lamp to the floor.
                    let lamp = Anchor::free(Vec3::from(pose.world(0).translation) + up * scale);
                    lamps += usize::from(tracer.occluded_between(&hit.anchor, &lamp, &ALL));
                    lamps += usize::from(tracer.occluded_between(&lamp, &hit.anchor, &ALL));
                }
                assert!(hits > 10, "only {hits} hits");
                assert_eq!(lamps, 0);
            }
        }
    }
}

#[test]
fn no_ray_slips_between_triangles() {
    // A closed sphere of small triangles around every origin: every ray must end on it.
    let n = 24;
    let at = |i: usize, j: usize| {
        let (theta, phi) = (i as f32 / n as f32, (j % (2 * n)) as f32 / n as f32);
        let (theta, phi) = (theta * std::f32::consts::PI, phi * std::f32::consts::PI);
        let around = if i.is_multiple_of(n) { 0.0 } else { theta.sin() };
        Vec3::new(around * phi.cos(), theta.cos(), around * phi.sin()) * 3.0 + 10.0
    };
    let mut triangles = Vec::new();
    for i in 0..n {
        for j in 0..2 * n {
            triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    let scene = scene(vec![mesh(&triangles)], &[(0, Trs::default())]);
    let pose = scene.pose_at(0.0);
    let prepared = RayScene::new(&scene, &pose);
    let tracer = prepared.for_pose(&scene, &pose);
    let mut numbers = Numbers(11);
    for i in 0..40_000 {
        // Half of them aim at corners and edges, where leaks would be.
        let origin = Vec3::splat(10.0) + (numbers.point() - 0.5);
        let target = at(i % n, (i / n) % (2 * n));
        let next = at(i % n + 1, (i / n + i % 2) % (2 * n));
        let aim = if i % 4 < 2 { target.lerp(next, numbers.next()) } else { target };
        let direction = if i % 2 == 0 { numbers.direction() } else { (aim - origin).normalize() };
        assert!(closest(&tracer, origin, direction, f32::INFINITY, &ALL).is_some(), "leak {i}");
        assert!(tracer.occluded(origin, direction, 10.0, &ALL));
    }
}

#[test]
fn cutouts_ask_and_others_do_not() {
    let at = |z: f32| [Vec3::new(0.0, 0.0, z), Vec3::new(1.0, 0.0, z), Vec3::new(0.0, 1.0, z)];
    let mut leaf = mesh(&[at(1.0)]);
    leaf.material = Some(0);
    let mut scene =
        scene(vec![leaf, mesh(&[at(0.0)])], &[(0, Trs::default()), (1, Trs::default())]);
    scene.materials.push(Material { alpha_mode: AlphaMode::Mask(0.5), ..Default::default() });
    for moving in [false, true] {
        if moving {
            scene.nodes[0] = turning(scene.nodes[0].clone());
        }
        let pose = scene.pose_at(0.0);
        let prepared = RayScene::new(&scene, &pose);
        let tracer = prepared.for_pose(&scene, &pose);
        let left_half = |instance: u32, triangle: u32, weights: Vec2| {
            assert_eq!((instance, triangle), (0, 0));
            weights.x < 0.5
        };
        for (x, t) in [(0.2, 1.0), (0.7, 2.0)] {
            let origin = Vec3::new(x, 0.1, 2.0);
            let hit = closest(&tracer, origin, -Vec3::Z, 9.0, &left_half).unwrap();
            assert_eq!(hit.t, t);
            let blocked = tracer.occluded(origin, -Vec3::Z, 1.5, &left_half);
            assert_eq!(blocked, t == 1.0);
        }
    }
}

#[test]
fn empty_and_broken_geometry_is_never_hit() {
    let broken = [
        [Vec3::ZERO; 3],
        [Vec3::ZERO, Vec3::X, 2.0 * Vec3::X],
        [Vec3::NAN, Vec3::X, Vec3::Y],
        [Vec3::new(f32::INFINITY, 0.0, 0.0), Vec3::X, Vec3::Y],
        [Vec3::splat(1e30), Vec3::X, Vec3::Y],
    ];
    let zero = parts(DVec3::ZERO, DQuat::IDENTITY, DVec3::ZERO);
    let whole = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let unreal = parts(DVec3::NAN, DQuat::IDENTITY, DVec3::ONE);
    let mut scenes = vec![
        Scene::default(),
        scene(vec![mesh(&[])], &[(0, Trs::default())]),
        scene(vec![mesh(&broken)], &[(0, Trs::default())]),
        scene(vec![mesh(&[whole])], &[(0, zero), (0, unreal)]),
        with_sphere(0.0, DVec3::ZERO, 1.0),
        with_sphere(f32::NAN, DVec3::ZERO, 1.0),
        with_sphere(1.0, DVec3::NAN, 1.0),
    ];
    let mut moving = scene(vec![mesh(&[whole]), mesh(&[])], &[(0, zero), (1, zero), (0, unreal)]);
    moving.nodes = moving.nodes.into_iter().map(turning).collect();
    scenes.push(moving);
    for scene in &scenes {
        let pose = scene.pose_at(0.0);
        let prepared = RayScene::new(scene, &pose);
        let tracer = prepared.for_pose(scene, &pose);
        let mut numbers = Numbers(12);
        for _ in 0..200 {
            let (o, d) = (numbers.point() - 0.5, numbers.direction());
            assert!(closest(&tracer, o, d, f32::INFINITY, &ALL).is_none());
            assert!(!tracer.occluded(o, d, f32::INFINITY, &ALL));
        }
        for bad in [Vec3::NAN, Vec3::INFINITY, Vec3::ZERO] {
            assert!(closest(&tracer, Vec3::ZERO, bad, 1.0, &ALL).is_none());
            assert!(tracer.occluded(Vec3::ZERO, bad, 1.0, &ALL));
        }
    }
}

#[test]
fn a_flat_scaled_moving_mesh_is_a_flat_mesh() {
    let triangles = soup(&mut Numbers(13), 60, 1.0);
    let flat = parts(DVec3::ZERO, DQuat::IDENTITY, DVec3::new(1.0, 1.0, 0.0));
    let mut scene = scene(vec![mesh(&triangles)], &[(0, flat)]);
    scene.nodes[0] = turning(scene.nodes[0].clone());
    let pose = scene.pose_at(0.0);
    let prepared = RayScene::new(&scene, &pose);
    let tracer = prepared.for_pose(&scene, &pose);
    let all = world_triangles(&scene, &pose);
    let mut numbers = Numbers(14);
    for _ in 0..500 {
        let origin = numbers.point() + Vec3::Z;
        let expected = brute(&all, origin, -Vec3::Z).is_some();
        assert_eq!(closest(&tracer, origin, -Vec3::Z, 9.0, &ALL).is_some(), expected);
    }
}

#[test]
fn a_light_sample_is_not_hidden_by_its_own_triangle() {
    for scale in [1e-6_f32, 1.0, 1e6] {
        for moving in [false, true] {
            let mut numbers = Numbers(18);
            let triangles = soup(&mut numbers, 1, scale);
            let at = parts(
                DVec3::new(3.0, -2.0, 5.0) * f64::from(scale),
                DQuat::from_rotation_x(0.4),
                DVec3::new(1.0, 2.0, 0.5),
            );
            let mut scene = scene(vec![mesh(&triangles)], &[(0, at)]);
            if moving {
                scene.nodes[0] = turning(scene.nodes[0].clone());
            }
            let pose = scene.pose_at(0.3);
            let prepared = RayScene::new(&scene, &pose);
            let tracer = prepared.for_pose(&scene, &pose);
            // As an integrator finds it: corners transformed and interpolated in f32.
            let [a, b, c] = triangles[0].map(|p| pose.world(0).transform_point3(p));
            let normal = (b - a).cross(c - a).normalize();
            let magnitude = a.abs().max(b.abs()).max(c.abs()).max_element();
            for _ in 0..2000 {
                let uv = warp::triangle(Vec2::new(numbers.next(), numbers.next()));
                let point = a * (1.0 - uv.x - uv.y) + b * uv.x + c * uv.y;
                let light = Anchor::computed(point, normal, magnitude);
                let eye = Anchor::free(point + (numbers.point() * 8.0 - 4.0) * scale);
                assert!(!tracer.occluded_between(&eye, &light, &ALL), "{eye:?} {light:?}");
                assert!(!tracer.occluded_between(&light, &eye, &ALL));
            }
        }
    }
}
