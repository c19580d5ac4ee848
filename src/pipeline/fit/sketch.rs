//! A scene in a few thousand samples of its surfaces: what hides what, and which sides light reaches.
//!
//! Samples are spread evenly over area. A triangle that is larger than a sample's share of the area
//! stands in the sketch as it is; of finer surfaces, each sample stands for its share, as a square. So a
//! wall hides what is behind it whether it has two triangles or two million.

use super::sight::{Sight, axes};
use super::subject::Subject;
use crate::bounds::Aabb;
use crate::math::random::hash;
use crate::math::{Frame, warp};
use crate::pipeline::frames_of;
use crate::render::rays::{Anchor, HitSurface, Passed, RayScene, Sender, Tracer};
use crate::scene::{AlphaMode, Instance, LightKind, Mesh, Node, Pose, Scene, Trs, Visibility};
use glam::{DAffine3, DMat3, DVec3, Vec2, Vec3};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::f32::consts::SQRT_2;

/// Samples of what the picture should show, and of all the rest.
const SAMPLES: [u32; 2] = [1024, 512];
/// At most so many lights are asked whether they reach a sample.
const MOST_LAMPS: usize = 32;
/// What a side is worth that no light reaches.
const DARK: f64 = 0.05;
/// What a surface is worth that is seen from its back.
const BACK: f64 = 0.7;
/// The cosine from which on a surface counts in full.
const STEEP: f32 = 0.3;

/// The instances of the sketch: triangles as they are, and squares that stand for finer ones.
const SQUARES: u32 = 1;

/// A sketch of a scene at its first frame.
pub(super) struct Sketch {
    rays: RayScene,
    scene: Scene,
    pose: Pose,
    /// Of what the picture should show.
    samples: Vec<Sample>,
    /// By sample, whether its front and its back are lit.
    lit: Vec<[bool; 2]>,
    has_light: bool,
}

/// A point of a surface, world space.
#[derive(Clone, Copy, Debug)]
struct Sample {
    point: Vec3,
    normal: Vec3,
    /// Half a diagonal of the square that may stand for it, metres.
    reach_m: f32,
    /// Whether the front and the back shine.
    shines: [bool; 2],
    /// Whether the camera sees it.
    is_visible: bool,
}

/// A light that may reach a sample.
#[derive(Clone, Copy, Debug)]
enum Lamp {
    /// At a point, through which the surface there faces this way if it is one.
    At(Vec3, Option<(Vec3, f32)>),
    /// From a direction.
    From(Vec3),
}

impl Sketch {
    /// Draws a scene.
    pub fn of(scene: &Scene, subject: &Subject) -> Sketch {
        let seconds = scene.timeline.seconds_at(f64::from(frames_of(scene)[0]));
        let pose = scene.pose_at(seconds);
        let mut drawing = Drawing::new(scene, &pose, subject);
        let [samples, rest] = [true, false]
            .map(|of_subject| drawing.add(of_subject, SAMPLES[usize::from(!of_subject)]));
        let lamps = lamps(scene, &pose, samples.iter().chain(&rest));
        let sketched = drawing.into_scene();
        let sketched_pose = sketched.pose_at(0.0);
        let mut sketch = Sketch {
            rays: RayScene::new(&sketched, &sketched_pose),
            scene: sketched,
            pose: sketched_pose,
            samples,
            lit: Vec::new(),
            has_light: !lamps.is_empty(),
        };
        sketch.lit = sketch.light(&lamps);
        sketch
    }

    /// Whether the scene has a light.
    pub fn has_light(&self) -> bool {
        self.has_light
    }

    /// The share of the surface that a view sees, of lit surface mostly; 0 to 1.
    pub fn seen_from(&self, sight: &Sight) -> f64 {
        let tracer = self.rays.for_pose(&self.scene, &self.pose);
        let back = (sight.from - sight.at).normalize_or(DVec3::Z);
        let [right, up] = axes(back);
        let eye = sight.from.as_vec3();
        let worth = |(sample, lit): (&Sample, &[bool; 2])| {
            if !sample.is_visible {
                return 0.0;
            }
            let to = sample.point.as_dvec3() - sight.from;
            let depth = -to.dot(back);
            let is_inside = to.dot(right).abs() <= depth * sight.slope.x
                && to.dot(up).abs() <= depth * sight.slope.y;
            if !(depth > 0.0 && is_inside) || is_blocked(&tracer, sample, eye, 0.0) {
                return 0.0;
            }
            let cosine = sample.normal.dot((eye - sample.point).normalize_or_zero());
            let side = usize::from(cosine < 0.0);
            let steepness = f64::from((cosine.abs() / STEEP).min(1.0));
            steepness * if side == 1 { BACK } else { 1.0 } * if lit[side] { 1.0 } else { DARK }
        };
        let sum: f64 = self.samples.iter().zip(&self.lit).map(worth).sum();
        sum / self.samples.len().max(1) as f64
    }

    /// Which sides of the samples light reaches. Where there is no light, all are as good.
    fn light(&self, lamps: &[Lamp]) -> Vec<[bool; 2]> {
        let tracer = self.rays.for_pose(&self.scene, &self.pose);
        let reaches = |sample: &Sample, sign: f32, lamp: &Lamp| match *lamp {
            Lamp::From(direction) => {
                // The dimmest light that counts is a little above the horizon.
                sign * sample.normal.dot(direction) > 0.05
                    && !is_blocked_toward(&tracer, sample, direction)
            }
            Lamp::At(place, surface) => {
                let to = (place - sample.point).normalize_or_zero();
                let shines_here = surface.is_none_or(|(normal, _)| normal.dot(to) < 0.0);
                shines_here
                    && sign * sample.normal.dot(to) > 0.05
                    && !is_blocked(&tracer, sample, place, surface.map_or(0.0, |(_, reach)| reach))
            }
        };
        let sides = |sample: &Sample| {
            [(1.0, sample.shines[0]), (-1.0, sample.shines[1])].map(|(sign, shines)| {
                shines || lamps.is_empty() || lamps.iter().any(|lamp| reaches(sample, sign, lamp))
            })
        };
        self.samples.par_iter().map(sides).collect()
    }
}

/// Whether anything is between a sample and a place. Squares are rough: near either end they are not
/// counted.
fn is_blocked(tracer: &Tracer, sample: &Sample, place: Vec3, reach_m: f32) -> bool {
    let to = place - sample.point;
    let length = to.length();
    length > 0.0 && blocks(tracer, sample, to / length, length, reach_m)
}

fn is_blocked_toward(tracer: &Tracer, sample: &Sample, direction: Vec3) -> bool {
    blocks(tracer, sample, direction, f32::INFINITY, 0.0)
}

fn blocks(tracer: &Tracer, sample: &Sample, direction: Vec3, length: f32, reach_m: f32) -> bool {
    let size = sample.point.abs().max_element();
    let mut anchor = Anchor::computed(sample.point, sample.normal, size);
    let (mut gone, mut passed) = (0.0, Passed::default());
    // A ray meets few squares near its ends; it cannot go on for ever.
    for _ in 0..16 {
        let origin = anchor.origin_toward(direction);
        let left = (length - gone) * (1.0 - 1e-4);
        let ray = (origin, direction, left);
        let seen = tracer.look(Sender::Surface, ray, &|_, _, _| true, &mut passed);
        let Some(hit) = seen.hit else { return false };
        gone += hit.t;
        let is_square = matches!(hit.surface, HitSurface::Triangle { instance: SQUARES, .. });
        if !is_square || (gone > sample.reach_m && gone < length - reach_m) {
            return true;
        }
        anchor = hit.anchor;
    }
    false
}

/// What is drawn so far.
struct Drawing<'a> {
    scene: &'a Scene,
    pose: &'a Pose,
    subject: &'a Subject,
    /// By mesh, the area of its triangles up to and with each, in its own space, square metres.
    areas: Vec<Vec<f64>>,
    triangles: Vec<[Vec3; 3]>,
    /// Instances and triangles that are in `triangles` already.
    drawn: BTreeSet<(usize, usize)>,
    squares: Vec<[Vec3; 3]>,
}

impl<'a> Drawing<'a> {
    fn new(scene: &'a Scene, pose: &'a Pose, subject: &'a Subject) -> Drawing<'a> {
        let areas = scene.meshes.par_iter().zip(&subject.reaches);
        Drawing {
            scene,
            pose,
            subject,
            areas: areas.map(|(mesh, reach)| areas_of(mesh, reach)).collect(),
            triangles: Vec::new(),
            drawn: BTreeSet::new(),
            squares: Vec::new(),
        }
    }

    fn area(&self, row: usize) -> f64 {
        self.areas[self.scene.instances[row].mesh as usize].last().copied().unwrap_or(0.0)
    }

    /// Samples the instances of the subject, or all others, evenly by area, and draws what the samples
    /// stand for.
    fn add(&mut self, of_subject: bool, count: u32) -> Vec<Sample> {
        let Subject { shown, .. } = self.subject;
        let rows: Vec<usize> = (0..shown.len()).filter(|&row| shown[row] == of_subject).collect();
        let in_world = |row: usize| {
            let world = world_of(self.pose, self.scene.instances[row].node);
            self.area(row) * growth(&world.matrix3)
        };
        let shares: Vec<f64> = rows.iter().map(|&row| in_world(row)).collect();
        let total: f64 = shares.iter().sum();
        let mut samples = Vec::new();
        if !(total > 0.0 && total.is_finite()) {
            return samples;
        }
        let step = total / f64::from(count);
        let (mut passed, mut number) = (0.0, 0);
        for (row, share) in rows.into_iter().zip(shares) {
            passed += share;
            while number < count && (f64::from(number) + 0.5) * step < passed {
                let place = 1.0 - (passed - (f64::from(number) + 0.5) * step) / share;
                samples.extend(self.sample(row, place, step, number));
                number += 1;
            }
        }
        samples
    }

    /// Samples an instance at a place along the sum of its triangles' areas, in [0, 1).
    fn sample(&mut self, row: usize, place: f64, share_m2: f64, salt: u32) -> Option<Sample> {
        let instance = &self.scene.instances[row];
        let mesh = &self.scene.meshes[instance.mesh as usize];
        let areas = &self.areas[instance.mesh as usize];
        let triangle = areas.partition_point(|&area| area <= place * self.area(row));
        let world = world_of(self.pose, instance.node);
        let [a, b, c] = mesh.triangles[triangle.min(areas.len() - 1)]
            .map(|corner| world.transform_point3(mesh.positions[corner as usize].as_dvec3()));
        let across = (b - a).cross(c - a);
        let normal = across.try_normalize()?.as_vec3();
        let is_mirrored = world.matrix3.determinant() < 0.0;
        let random = |salt: u32| (hash(salt, triangle as u32) >> 8) as f32 / 16_777_216.0;
        let uv = warp::triangle(Vec2::new(random(salt), random(!salt)));
        let material = self.scene.material_of(instance.mesh);
        let shines = self.scene.peak_rgb_of_instance(row as u32).max_element() > 0.0;
        // Squares overlap, or a wall of them would be half air.
        let half_side = (0.5 * share_m2).sqrt() as f32;
        let sample = Sample {
            point: (a + (b - a) * f64::from(uv.x) + (c - a) * f64::from(uv.y)).as_vec3(),
            normal: if is_mirrored { -normal } else { normal },
            reach_m: half_side * SQRT_2,
            shines: [shines, shines && material.is_some_and(|material| material.double_sided)],
            is_visible: instance.visibility.camera,
        };
        // What the camera does not see is in the way of no view.
        let is_opaque = sample.is_visible
            && material.is_none_or(|material| {
                material.alpha_mode == AlphaMode::Opaque && material.transmission.is_none()
            });
        let is_coarse = 0.5 * across.length() >= share_m2;
        // A square that stands for much of a ground must not cut through what stands on it.
        let is_rough = || {
            let reach = Vec3::splat(sample.reach_m);
            let around = Aabb { min: sample.point - reach, max: sample.point + reach };
            let bounds = &self.subject.bounds;
            let touches = around.min.cmple(bounds.max) & bounds.min.cmple(around.max);
            !self.subject.shown[row] && touches.all()
        };
        if is_opaque && is_coarse {
            if self.drawn.insert((row, triangle)) {
                self.triangles.push([a, b, c].map(|corner| corner.as_vec3()));
            }
        } else if is_opaque && !is_rough() {
            self.squares.extend(square(&sample, half_side));
        }
        Some(sample)
    }

    /// The sketch as a scene of two instances.
    fn into_scene(self) -> Scene {
        let mesh = |triangles: Vec<[Vec3; 3]>| Mesh {
            triangles: (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            positions: triangles.into_flattened(),
            ..Default::default()
        };
        let instance = |mesh: u32| Instance {
            path: "".into(),
            node: 0,
            mesh,
            values: None,
            shaping: None,
            forced: false,
            visibility: Visibility::default(),
        };
        Scene {
            nodes: vec![Node::fixed("/", None, Trs::default())],
            meshes: vec![mesh(self.triangles), mesh(self.squares)],
            instances: vec![instance(0), instance(SQUARES)],
            ..Default::default()
        }
    }
}

/// Two triangles about a sample, in the plane of its surface.
fn square(sample: &Sample, half_side: f32) -> [[Vec3; 3]; 2] {
    let frame = Frame::around(sample.normal);
    let corner =
        |x: f32, y: f32| sample.point + (frame.tangent * x + frame.bitangent * y) * half_side;
    let [a, b, c, d] = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    [[a, b, c], [a, c, d]]
}

/// The lights of a scene, or some of them.
fn lamps<'a>(scene: &Scene, pose: &Pose, samples: impl Iterator<Item = &'a Sample>) -> Vec<Lamp> {
    let shining: Vec<&Sample> = samples.filter(|sample| sample.shines[0]).collect();
    let on_surfaces = shining.iter().flat_map(|sample| {
        let side = |sign: f32| Lamp::At(sample.point, Some((sample.normal * sign, sample.reach_m)));
        [Some(side(1.0)), sample.shines[1].then(|| side(-1.0))].into_iter().flatten()
    });
    let shines = |row: &usize| scene.peak_rgb_of_light(*row as u32).max_element() > 0.0;
    let others = (0..scene.lights.len()).filter(shines).flat_map(|row| {
        let light = &scene.lights[row];
        let world = pose.world(light.node);
        match light.kind {
            LightKind::Distant { .. } => {
                vec![Lamp::From(Vec3::from(world.matrix3.z_axis).normalize_or_zero())]
            }
            LightKind::Dome { .. } => all_around().map(Lamp::From).into(),
            _ => vec![Lamp::At(world.translation.into(), None)],
        }
    });
    let all: Vec<Lamp> = others.chain(on_surfaces).collect();
    let stride = all.len().div_ceil(MOST_LAMPS).max(1);
    all.into_iter().step_by(stride).collect()
}

/// To the corners of a cube.
fn all_around() -> [Vec3; 8] {
    std::array::from_fn(|corner| {
        let sign = |axis: usize| if corner >> axis & 1 == 0 { 1.0 } else { -1.0 };
        Vec3::new(sign(0), sign(1), sign(2)).normalize()
    })
}

/// By how much a transform makes areas grow, in the mean over the three planes.
fn growth(linear: &DMat3) -> f64 {
    let [x, y, z] = [linear.x_axis, linear.y_axis, linear.z_axis];
    (x.cross(y).length() + y.cross(z).length() + z.cross(x).length()) / 3.0
}

/// The area of the triangles of a mesh up to and with each, in its own space. Those that reach out of a
/// box are strays, and count as nothing.
fn areas_of(mesh: &Mesh, reach: &Aabb) -> Vec<f64> {
    let area = |corners: &[u32; 3]| {
        let corners = corners.map(|corner| mesh.positions[corner as usize]);
        let [a, b, c] = corners.map(|corner| corner.as_dvec3());
        let is_stray = corners.iter().any(|&corner| !reach.contains(corner));
        if is_stray { 0.0 } else { 0.5 * (b - a).cross(c - a).length() }
    };
    let sum = |sum: &mut f64, area: f64| {
        *sum += area;
        Some(*sum)
    };
    mesh.triangles.iter().map(area).scan(0.0, sum).collect()
}

fn world_of(pose: &Pose, node: u32) -> DAffine3 {
    let world = pose.world(node);
    let matrix3 = world.matrix3.as_dmat3();
    DAffine3 { matrix3, translation: Vec3::from(world.translation).as_dvec3() }
}
