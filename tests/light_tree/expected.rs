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
    let bounds = LightBounds {
        aabb: Aabb { min: (-half).as_vec3(), max: half.as_vec3() },
        cone: Cone { theta_o: theta_o as f32, ..Cone::flat(axis.as_vec3(), false) },
        energy: 1.0,
        range_m: f32::INFINITY,
    };
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
    let bounds = LightBounds {
        aabb: Aabb { min: at, max: at },
        cone: Cone::flat(Vec3::new(0.6, 0.0, 0.8), false),
        energy: 2.5,
        range_m: f32::INFINITY,
    };
    let receiver = Receiver { point: Vec3::new(1.0, 0.4, 1.9), normal: Vec3::NEG_Z };
    let way = (receiver.point - at).as_dvec3();
    let cosines = way.dot(DVec3::new(0.6, 0.0, 0.8)) * way.z / way.length_squared();
    let exact = 2.5 * cosines / way.length_squared();
    let told = Node::encode(&bounds, Link::Emitter(0)).importance(&receiver);
    assert!((told / exact - 1.0).abs() < 1e-3, "{told} {exact}");
}
