//! Extremes that only a scene can have: suns, triangles as a file has them, numbers that ingest and
//! survey refuse.

use crate::support::dead_probability_in;
use candelabra::emitter::{Emitters, infinite_lights};
use candelabra::light_tree::{LightTree, Receiver};
use candelabra::math::random::hash;
use candelabra::pipeline::{self, SurveyError};
use candelabra::scene::{Light, LightKind, Node, Scene, Trs};
use glam::{DMat3, DQuat, DVec3, Vec2, Vec3};
use std::path::PathBuf;

/// A scene with one light at each place.
fn scene_with(lights: &[(LightKind, Trs)]) -> Scene {
    let mut scene = Scene::default();
    for (i, (kind, place)) in lights.iter().enumerate() {
        scene.nodes.push(Node::fixed(format!("/light_{i}"), None, *place));
        let kind = kind.clone();
        let node = i as u32;
        scene.lights.push(Light {
            node,
            kind,
            values: None,
            range_m: None,
            forced: false,
            visibility: Default::default(),
        });
    }
    scene
}

fn at(translation: DVec3, rotation: DQuat) -> Trs {
    Trs::Parts { translation, rotation, scale: DVec3::ONE }
}

/// The worst found over suns of some angle, high and low, all over the sky.
#[derive(Clone, Copy, Debug, Default)]
pub struct SunWorst {
    /// Off one: the irradiance that the samples bring, over the sun's.
    pub irradiance: f64,
    /// Samples whose direction the sun does not own up to, by its radiance or its density.
    pub missed: usize,
}

pub fn worst_of_suns(angle_rad: f32) -> SunWorst {
    const SAMPLES: u32 = 4096;
    let mut worst = SunWorst::default();
    for turn in 0..50u32 {
        let rotation = DQuat::from_mat3(&DMat3::from_euler(
            glam::EulerRot::XYZ,
            f64::from(turn) * 0.37,
            f64::from(turn) * 1.3,
            0.2,
        ));
        let kind = LightKind::Distant { irradiance_lux: Vec3::splat(1e5), angle_rad };
        let scene = scene_with(&[(kind, at(DVec3::ZERO, rotation))]);
        let suns = infinite_lights(&scene, &scene.pose_at(0.0));
        let towards = (rotation * DVec3::Z).as_vec3();
        let mut sum = 0.0;
        for i in 0..SAMPLES {
            let u = Vec2::new(
                (i as f32 + 0.5) / SAMPLES as f32,
                hash(i, turn) as f32 / u32::MAX as f32 * 0.999_999,
            );
            let sample = suns[0].sample(towards, u).unwrap();
            let pdf = sample.pdf.unwrap();
            let told = suns[0].pdf(towards, sample.direction);
            let is_own = suns[0].radiance(sample.direction) == sample.radiance && told == pdf;
            worst.missed += usize::from(!is_own);
            let cosine = f64::from(towards.dot(sample.direction));
            sum += f64::from(sample.radiance.x) * cosine / f64::from(pdf);
        }
        let off = (sum / f64::from(SAMPLES) / 1e5 - 1.0).abs();
        worst.irradiance = worst.irradiance.max(off);
    }
    worst
}

#[test]
fn a_sun_of_a_ten_thousandth_radian_brings_its_irradiance() {
    let worst = worst_of_suns(1e-4);
    assert!(worst.irradiance < 1e-3, "{worst:?}");
    // At the rim, rounding of a direction decides.
    assert!(worst.missed * 1000 < 50 * 4096, "{worst:?}");
}

/// Suns compete with the tree by their irradiance, whatever their size in the sky.
#[test]
fn a_small_sun_is_as_important_as_a_large_one() {
    let importance = |angle_rad| {
        let kind = LightKind::Distant { irradiance_lux: Vec3::splat(1e5), angle_rad };
        let scene = scene_with(&[(kind, at(DVec3::ZERO, DQuat::IDENTITY))]);
        infinite_lights(&scene, &scene.pose_at(0.0))[0].importance(Vec3::new(0.0, 0.6, 0.8))
    };
    for angle in [0.0, 1e-7, 1e-4, 1e-2] {
        assert!((importance(angle) / 8e4 - 1.0).abs() < 0.01, "{angle}: {}", importance(angle));
    }
}

/// A file in a folder of its own.
fn written(text: &str, material: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scene.mtl"), material).unwrap();
    let path = folder.path().join("scene.obj");
    std::fs::write(&path, text).unwrap();
    (folder, path)
}

#[test]
fn triangles_without_area_leave_the_light_to_those_with_one() {
    let text = "mtllib scene.mtl\nusemtl glow\n\
                v 0 0 1\nv 1 0 1\nv 0 1 1\nv 2 0 1\nv 0.5 1e-7 1\n\
                f 1 3 2\nf 1 1 2\nf 1 2 4\nf 1 5 2\nf 3 3 3\n";
    let (_folder, path) = written(text, "newmtl glow\nKd 0 0 0\nKe 1 1 1\n");
    let scene = pipeline::load_scene(&path).unwrap();
    let emitters = Emitters::collect(&scene);
    let survey = pipeline::survey(&scene, &emitters, &[]).unwrap();
    let tree = LightTree::open(pipeline::build_tree(&survey)).unwrap();
    assert_eq!(tree.verify(), Ok(()));
    let frame = tree.at_frame(0).unwrap();
    // Below the triangles, which face down.
    let receiver = Receiver { point: Vec3::new(0.2, 0.2, 0.0), normal: Vec3::Z };
    let shares: Vec<f64> =
        (0..emitters.len() as u32).map(|e| frame.probability(&receiver, e)).collect();
    let sum = shares.iter().sum::<f64>() + dead_probability_in(&tree, 0, &receiver);
    assert!((sum - 1.0).abs() < 1e-9, "{shares:?}");
    assert!(shares.iter().any(|&share| share > 0.999), "{shares:?}");
}

#[test]
fn what_is_beyond_numbers_is_refused_by_name() {
    let point = |cd: f32| LightKind::Point { intensity_cd: Vec3::splat(cd) };
    let here = at(DVec3::ZERO, DQuat::IDENTITY);
    let refused = |scene: &Scene| {
        let emitters = Emitters::collect(scene);
        pipeline::survey(scene, &emitters, &[]).err().map(|error| match error {
            SurveyError::Overflow(overflow) => overflow.path,
            SurveyError::TooMany { .. } => panic!("{error}"),
        })
    };
    assert_eq!(refused(&scene_with(&[(point(1e38), here)])), None);
    for broken in [
        scene_with(&[(point(f32::INFINITY), here)]),
        scene_with(&[(point(1.0), at(DVec3::splat(1e39), DQuat::IDENTITY))]),
        scene_with(&[(point(1.0), at(DVec3::splat(f64::NAN), DQuat::IDENTITY))]),
        // Each of them is a number, and their sum is none.
        scene_with(&[(point(3e38), here), (point(3e38), here)]),
    ] {
        let path = refused(&broken).expect("it is refused");
        assert!(path.starts_with("/light_"), "{path}");
    }
    let nan = scene_with(&[(point(f32::NAN), here)]);
    assert!(Emitters::collect(&nan).is_empty() || refused(&nan).is_some());
    let text = "mtllib scene.mtl\nusemtl glow\nv 0 0 1\nv 1 0 nan\nv 0 1 1\nf 1 3 2\n";
    let (_folder, path) = written(text, "newmtl glow\nKe 1 1 1\n");
    match pipeline::load_scene(&path) {
        Err(fault) => assert!(!fault.to_string().is_empty()),
        Ok(scene) => assert!(refused(&scene).is_some()),
    }
}
