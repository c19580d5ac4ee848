//! How many rays a second one thread traces in a scene: rays of the camera, rays reflected evenly from what those hit, and
//! shadow rays from there to lights, each light as likely as any other.
//!
//! `cargo bench --bench rays -- SCENE [FOLDER]` prints, for each kind, its name, rays a second of processor time (the best of several
//! rounds) and how many rays hit something. With a folder it also writes the triangles and the rays there, for
//! `scripts/rays_beside_embree.py`. Sphere lights are left out and cut-outs are solid, as
//! they are to the other program.

use candelabra::emitter::{Emitters, PosedEmitters};
use candelabra::math::random::hash;
use candelabra::math::warp;
use candelabra::pipeline::load_scene;
use candelabra::render::camera::CameraRays;
use candelabra::render::rays::{Anchor, Passed, RayScene, Sender, Tracer};
use candelabra::scene::{LightKind, Pose, Scene};
use glam::{DVec3, Vec2, Vec3};
use rustix::time::{ClockId, clock_gettime};
use std::fs;
use std::path::Path;

const WIDTH: u32 = 640;
const HEIGHT: u32 = 360;
const ROUNDS: usize = 15;

/// From where, and where to: a direction of unit length, or all of the way to a light.
type Rays = Vec<(Vec3, Vec3)>;

fn main() {
    let is_path = |word: &String| !word.starts_with("--");
    let paths: Vec<String> = std::env::args().skip(1).filter(is_path).collect();
    let Some(path) = paths.first() else {
        return println!("usage: cargo bench --bench rays -- SCENE [FOLDER]");
    };
    let mut scene = load_scene(Path::new(path)).expect("a scene that can be read");
    let pose = scene.pose_at(0.0);
    let emitters = Emitters::collect(&scene);
    let posed = PosedEmitters { scene: &scene, emitters: &emitters, pose: &pose };
    let camera = scene.cameras.first().expect("a scene with a camera");
    let cameras = CameraRays::new(camera, &pose, [WIDTH, HEIGHT]);
    let primary = camera_rays(&cameras);
    let prepared = RayScene::new(&scene, &pose);
    let tracer = prepared.for_pose(&scene, &pose);
    let hits = anchors(&tracer, &primary);
    let diffuse: Rays = (0..).zip(&hits).map(|(i, (at, to))| reflected(i, at, *to)).collect();
    let to_light = |i: u32, (at, _): &(Anchor, Vec3)| {
        let emitter = hash(i, 3) % emitters.len().max(1) as u32;
        let light = posed.sample(emitter, at.position, Vec2::new(number(i, 4), number(i, 5)))?;
        let from = at.origin_toward(light.point - at.position);
        Some((from, (light.point - from) * 0.9999))
    };
    let shadow: Rays = (0..).zip(&hits).filter_map(|(i, hit)| to_light(i, hit)).collect();
    // They have given their light. No other program has them as geometry.
    for light in &mut scene.lights {
        if let LightKind::Sphere { radius, .. } = &mut light.kind {
            *radius = 0.0;
        }
    }
    let prepared = RayScene::new(&scene, &pose);
    let tracer = prepared.for_pose(&scene, &pose);
    let kinds = [("primary", &primary), ("diffuse", &diffuse), ("shadow", &shadow)];
    for (name, rays) in kinds {
        let (rate, hits) = measure(&tracer, rays, name == "shadow");
        println!("{name} {rate:.0} {hits} of {}", rays.len());
    }
    if let Some(folder) = paths.get(1) {
        let folder = Path::new(folder);
        fs::create_dir_all(folder).expect("a folder to write to");
        let write = |name: &str, numbers: Vec<f32>| {
            let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
            fs::write(folder.join(name), bytes).expect("a file that can be written");
        };
        write("triangles", triangles(&scene, &pose));
        for (name, rays) in kinds {
            let numbers = |(from, to): &(Vec3, Vec3)| [from.to_array(), to.to_array()];
            write(name, rays.iter().flat_map(numbers).flatten().collect());
        }
    }
}

/// The `n`th number of ray `i`, in `[0, 1)`.
fn number(i: u32, n: u32) -> f32 {
    (hash(i, n) >> 8) as f32 / 16_777_216.0
}

/// Tile by tile, as a renderer does.
fn camera_rays(camera: &CameraRays) -> Rays {
    let rows = (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| (x, y)));
    let ray = |(x, y)| {
        let ray = camera.ray(x, y, Vec2::splat(0.5), Vec2::splat(0.5));
        (ray.origin, ray.direction)
    };
    rows.map(ray).collect()
}

/// Where rays end, each with the normal of the side that they see.
fn anchors(tracer: &Tracer, rays: &Rays) -> Vec<(Anchor, Vec3)> {
    let mut passed = Passed::default();
    let mut hit = |&(from, to): &(Vec3, Vec3)| {
        let seen =
            tracer.look(Sender::Camera, (from, to, f32::INFINITY), &|_, _, _| true, &mut passed);
        let anchor = seen.hit?.anchor;
        let side = 1_f32.copysign(-anchor.normal.dot(to));
        Some((anchor, anchor.normal * side))
    };
    rays.iter().filter_map(&mut hit).collect()
}

fn reflected(i: u32, at: &Anchor, normal: Vec3) -> (Vec3, Vec3) {
    // A point of the unit sphere about the normal's end: as often as its cosine says.
    let direction = (normal + warp::sphere(Vec2::new(number(i, 1), number(i, 2)))).normalize();
    (at.origin_toward(direction), direction)
}

/// Of this thread's processor time.
fn seconds() -> f64 {
    let now = clock_gettime(ClockId::ThreadCPUTime);
    now.tv_sec as f64 + 1e-9 * now.tv_nsec as f64
}

/// Rays a second, and rays that hit something.
fn measure(tracer: &Tracer, rays: &Rays, shadow: bool) -> (f64, usize) {
    let mut passed = Passed::default();
    let all = |_, _, _: Vec2| true;
    let mut round = || {
        let started = seconds();
        let mut hits = 0;
        for &(from, to) in rays {
            let is_hit = match shadow {
                true => tracer.occluded(from, to, 1.0, &all),
                false => {
                    let ray = (from, to, f32::INFINITY);
                    tracer.look(Sender::Surface, ray, &all, &mut passed).hit.is_some()
                }
            };
            hits += usize::from(is_hit);
        }
        (rays.len() as f64 / (seconds() - started), hits)
    };
    let rounds: Vec<_> = (0..ROUNDS).map(|_| round()).collect();
    let best = rounds.iter().map(|(rate, _)| *rate).fold(0.0, f64::max);
    (best, rounds[0].1)
}

/// All triangles in world space.
fn triangles(scene: &Scene, pose: &Pose) -> Vec<f32> {
    let mut all = Vec::new();
    for instance in &scene.instances {
        let mesh = &scene.meshes[instance.mesh as usize];
        let world = pose.world(instance.node);
        let at = |&corner: &u32| {
            let point: DVec3 = mesh.positions[corner as usize].as_dvec3();
            let [x, y, z] = [world.matrix3.x_axis, world.matrix3.y_axis, world.matrix3.z_axis]
                .map(|axis| Vec3::from(axis).as_dvec3());
            let place =
                Vec3::from(world.translation).as_dvec3() + x * point.x + y * point.y + z * point.z;
            place.as_vec3().to_array()
        };
        all.extend(
            mesh.triangles
                .iter()
                .flat_map(|triangle| triangle.iter().flat_map(at).collect::<Vec<_>>()),
        );
    }
    all
}
