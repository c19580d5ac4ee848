//! Samples that are taken, left out, or given up.

use crate::layers::{File, all_layers, floor};
use crate::stage::{Stage, at, direct, glow};
use candelabra::render::passes::Uniform;
use candelabra::render::{FrameStats, Progress, RenderDelegate, RenderError, RenderSettings};
use candelabra::scene::LightKind;
use glam::{DVec3, Vec3};
use std::sync::atomic::{AtomicU64, Ordering};

/// Two skies that are together brighter than a 32-bit number holds, behind a card in the upper half.
#[test]
fn samples_that_are_not_finite_are_left_out_counted_and_located() {
    let mut stage = Stage::default();
    for _ in 0..2 {
        let radiance_nits = Vec3::splat(2e38);
        stage.light(LightKind::Dome { radiance_nits, texture: None }, at(DVec3::ZERO));
    }
    stage.quad([20.0, 10.0], glow([5.0; 3]), at([0.0, 5.1, 0.0]));
    stage.look([0.0, 0.0, 8.0], DVec3::ZERO, 1.0);
    let settings = RenderSettings { depth: 0, light_groups: Vec::new(), ..all_layers(16, 4) };
    let set = stage.set();
    let camera = stage.scene.cameras[0].clone();
    let delegate = RenderDelegate::new(&stage.scene, &set.emitters, camera, settings.clone());
    let mut film = delegate.film(1).unwrap();
    let frame = delegate.expose(&set.tree, 1, &mut film, &mut Uniform(4), &()).unwrap();
    let FrameStats { non_finite, first_non_finite, .. } = frame.stats;
    let left_out: Vec<u32> =
        film.halves().iter().map(|pixel| 4 - pixel.counts.iter().sum::<u32>()).collect();
    assert!(non_finite > 0 && u64::from(left_out.iter().sum::<u32>()) == non_finite);
    let first = left_out.iter().position(|&count| count > 0).unwrap() as u32;
    assert_eq!(first_non_finite, Some((first % 16, first / 16)));
    let file = File::of(&frame.buffers);
    let may_be_infinite = |name: &str| ["Z", "error"].contains(&name);
    let is_finite = |values: &Vec<f32>| values.iter().all(|value| value.is_finite());
    assert!(file.channels.iter().all(|(name, v)| may_be_infinite(name) || is_finite(v)));
    let mut errors = left_out.iter().zip(file.channel("error"));
    assert!(errors.all(|(&left_out, error)| left_out == 0 || error.is_infinite()));
    assert!(file.channel("G").contains(&5.0), "what is finite stays");
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert!(alone.install(|| delegate.render(&set.tree, 1, &()).unwrap()) == frame);
}

/// Stops after some questions.
struct Patience(AtomicU64, u64);

impl Progress for Patience {
    fn is_stopped(&self) -> bool {
        self.0.fetch_add(1, Ordering::Relaxed) >= self.1
    }
}

#[test]
fn a_stopped_frame_is_no_frame() {
    let stage = floor([true; 3]);
    let set = stage.set();
    let camera = stage.scene.cameras[0].clone();
    let settings = RenderSettings { width: 40, height: 8, samples: 16, ..direct(1, 1) };
    let delegate = RenderDelegate::new(&stage.scene, &set.emitters, camera, settings);
    // It is asked at the samples 0 and 256 of the 320 of each row in each of two passes.
    for questions in [0, 1, 13, 31] {
        let patience = Patience(AtomicU64::new(0), questions);
        assert!(
            matches!(delegate.render(&set.tree, 1, &patience), Err(RenderError::Stopped)),
            "{questions}"
        );
    }
    assert!(delegate.render(&set.tree, 1, &Patience(AtomicU64::new(0), 32)).is_ok());
}
