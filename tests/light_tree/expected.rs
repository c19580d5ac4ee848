//! The importance is what a cluster is expected to send, not the most that it might.

use candelabra::bounds::{Aabb, Cone, LightBounds};
use candelabra::light_tree::{Link, Node, Receiver};
use candelabra::math::random::hash;
use glam::{DVec3, Vec3};

/// Random numbers in `[0, 1)`, one after the other.
struct Numbers(u32);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(1);
        f64::from(hash(self.0, 0x65_78_70)) / 2f64.powi(32)
    }

    /// Evenly over the logarithm.
    fn spread_between(&mut self, least: f64, most: f64) -> f64 {
        least * (most / least).powf(self.next())
    }

    /// Evenly over the directions that are at most `angle` off an axis.
    fn within(&mut self, axis: DVec3, angle: f64) -> DVec3 {
        let cosine = 1.0 - (1.0 - angle.cos()) * self.next();
        let (sin, cos) = (std::f64::consts::TAU * self.next()).sin_cos();
        let across = axis.any_orthonormal_vector();
        let sine = (1.0 - cosine * cosine).sqrt();
        axis * cosine + (across * cos + axis.cross(across) * sin) * sine
    }
}

/// Faces spread evenly over a box, with normals spread evenly over a cone, and a receiver outside the box's
/// sphere: what the importance says, and what reaches the receiver on average.
fn told_and_sent(numbers: &mut Numbers) -> (f64, f64) {
    const FACES: usize = 4000;
    let half = DVec3::from_array([(); 3].map(|()| numbers.spread_between(1e-3, 1.0)));
    let distance = half.length() * numbers.spread_between(1.05, 30.0);
    let axis = numbers.within(DVec3::Z, std::f64::consts::PI);
    let theta_o = 3.1 * numbers.next();
    let to = numbers.within(DVec3::Z, std::f64::consts::PI);
    let point = to * distance;
    let normal = numbers.within(-to, 2.0);
    let mut sum = 0.0;
    for _ in 0..FACES {
        let from = DVec3::from_array([(); 3].map(|()| 2.0 * numbers.next() - 1.0)) * half;
        let facing = numbers.within(axis, theta_o);
        let way = point - from;
        let unit = way.normalize();
        sum += facing.dot(unit).max(0.0) * normal.dot(-unit).max(0.0) / way.length_squared();
    }
    let bounds = LightBounds::of_emitter(
        Aabb { min: (-half).as_vec3(), max: half.as_vec3() },
        Cone { theta_o: theta_o as f32, ..Cone::flat(axis.as_vec3(), false) },
        1.0,
        f32::INFINITY,
    );
    let receiver = Receiver { point: point.as_vec3(), normal: normal.as_vec3() };
    let told = Node::encode(&bounds, Link::Emitter(0)).importance(&receiver);
    (told, sum / FACES as f64)
}

#[test]
fn faces_send_on_average_what_the_importance_says() {
    let mut numbers = Numbers(1);
    let mut off: Vec<f64> = Vec::new();
    while off.len() < 2000 {
        let (told, sent) = told_and_sent(&mut numbers);
        // Too few faces reach it to tell a mean.
        if sent > 1e-3 * told {
            off.push((told / sent).log2());
        }
    }
    off.sort_by(f64::total_cmp);
    let at = |share: f64| off[(share * (off.len() - 1) as f64) as usize];
    println!("octaves: {:.2} {:.2} {:.2} {:.2}", at(0.01), at(0.1), at(0.5), at(0.75));
    assert!(at(0.1) > -0.4 && at(0.5).abs() < 0.2 && at(0.75) < 1.0, "{} {}", at(0.1), at(0.75));
    // Too little costs more than too much: what is left out is rare and bright.
    assert!(at(0.01) > -1.5, "{}", at(0.01));
}

/// Where nothing is spread, nothing has to be guessed.
#[test]
fn a_small_face_is_told_exactly() {
    let at = Vec3::new(0.3, -0.2, 0.5);
    let bounds = LightBounds::of_emitter(
        Aabb { min: at, max: at },
        Cone::flat(Vec3::new(0.6, 0.0, 0.8), false),
        2.5,
        f32::INFINITY,
    );
    let receiver = Receiver { point: Vec3::new(1.0, 0.4, 1.9), normal: Vec3::NEG_Z };
    let way = (receiver.point - at).as_dvec3();
    let cosines = way.dot(DVec3::new(0.6, 0.0, 0.8)) * way.z / way.length_squared();
    let exact = 2.5 * cosines / way.length_squared();
    let told = Node::encode(&bounds, Link::Emitter(0)).importance(&receiver);
    assert!((told / exact - 1.0).abs() < 1e-3, "{told} {exact}");
}

/// Points and faces in one box, faces with normals on all sides: what a cluster of both is expected to send lies
/// between the quarter of the faces and the whole of the points, as their energies do.
#[test]
fn points_and_faces_on_all_sides_send_on_average_what_the_importance_says() {
    let mut numbers = Numbers(7);
    for of_points in [0.0, 0.1, 0.5, 0.9, 1.0] {
        for both_sides in [false, true] {
            let mut off = Vec::new();
            for _ in 0..60 {
                let (told, sent) = of_points_and_faces(&mut numbers, of_points, both_sides);
                off.push((told / sent).log2());
            }
            off.sort_by(f64::total_cmp);
            let [low, middle, high] = [6, 30, 53].map(|at| off[at]);
            assert!(
                low > -0.25 && middle.abs() < 0.1 && high < 0.25,
                "{of_points} {both_sides}: {low} {middle} {high}"
            );
        }
    }
}

/// Of 1500 emitters, of which points send a share of the energy, with energies over four decades: what the cluster's
/// node tells a point that is not near, and what reaches it.
fn of_points_and_faces(numbers: &mut Numbers, of_points: f64, both_sides: bool) -> (f64, f64) {
    let half = DVec3::from_array([(); 3].map(|()| numbers.spread_between(0.1, 1.0)));
    let distance = half.length() * numbers.spread_between(3.0, 30.0);
    let point = numbers.within(DVec3::Z, std::f64::consts::PI) * distance;
    let emitters: Vec<(DVec3, Option<DVec3>, f64)> = (0..1500)
        .map(|i| {
            let at = DVec3::from_array([(); 3].map(|()| 2.0 * numbers.next() - 1.0)) * half;
            let face = numbers.within(DVec3::Z, std::f64::consts::PI);
            let is_point = i % 2 == 0;
            let share = if is_point { of_points } else { 1.0 - of_points };
            (at, (!is_point).then_some(face), share * numbers.spread_between(1e-2, 1e2))
        })
        .filter(|&(_, _, energy)| energy > 0.0)
        .collect();
    let parts: Vec<LightBounds> = emitters
        .iter()
        .map(|&(at, face, energy)| {
            let cone = face.map_or(Cone::ALL, |n| Cone::flat(n.as_vec3(), both_sides));
            LightBounds::of_emitter(
                Aabb::around([at.as_vec3()]),
                cone,
                energy as f32,
                f32::INFINITY,
            )
        })
        .collect();
    let mut around = LightBounds::around(&parts);
    // Sheets that emit from both sides have a cone of a hemisphere together.
    around.cone.theta_o = std::f32::consts::PI;
    let receiver = Receiver { point: point.as_vec3(), normal: Vec3::ZERO };
    let told = Node::encode(&around, Link::Emitter(0)).importance(&receiver);
    let sent = emitters.iter().map(|&(at, face, energy)| {
        let way = point - at;
        let cosine = face.map_or(1.0, |face| {
            let cosine = face.dot(way.normalize());
            if both_sides { cosine.abs() } else { cosine.max(0.0) }
        });
        energy * cosine / way.length_squared()
    });
    (told, sent.sum())
}
