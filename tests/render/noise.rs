//! The trade: what is told of a picture's noise is true, samples go where it is, and none of that biases
//! the picture.

use crate::stage::{Set, Stage, aimed, at, direct, facing, lambert};
use candelabra::math::color::luminance;
use candelabra::render::noise::{Grey, Reference};
use candelabra::render::passes::{ErrorGoal, Planned, Reached, ToError, Uniform};
use candelabra::render::{Control, Film, Progress, RenderDelegate, RenderSettings, RenderedFrame};
use candelabra::scene::{LightKind, Scene};
use glam::{DVec3, Vec3};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

const SIZE: u32 = 32;

/// A scene that is rendered again and again.
struct Studio<'a> {
    set: &'a Set<'a>,
    settings: RenderSettings,
}

impl Studio<'_> {
    fn delegate(&self, seed: u32) -> RenderDelegate<'_> {
        let scene: &Scene = self.set.scene;
        let settings = RenderSettings { seed, ..self.settings.clone() };
        RenderDelegate::new(scene, &self.set.emitters, scene.cameras[0].clone(), settings)
    }

    fn expose(&self, seed: u32, control: &mut dyn Control) -> (Film, RenderedFrame) {
        let delegate = self.delegate(seed);
        let mut film = delegate.film().unwrap();
        let frame = delegate.expose(&self.set.tree, 1, &mut film, control, &()).unwrap();
        (film, frame)
    }

    fn to_error(&self, seed: u32, goal: ErrorGoal) -> (Film, RenderedFrame, Reached) {
        let mut control = ToError::new(goal);
        let (film, frame) = self.expose(seed, &mut control);
        (film, frame, control.reached())
    }

    /// A converged picture, of many samples in each of which the noise is known.
    fn reference(&self, samples: u32) -> Reference {
        let (film, _) = self.expose(u32::MAX, &mut Uniform(samples));
        let halves = film.halves();
        Reference {
            width: SIZE as usize,
            luminance: halves.iter().map(|pixel| pixel.luminance()).collect(),
            variance: halves.iter().map(|pixel| pixel.variance()).collect(),
        }
    }
}

fn luminances(frame: &RenderedFrame) -> Vec<f64> {
    frame.buffers.beauty().map(|rgb| f64::from(luminance(rgb))).collect()
}

fn settings() -> RenderSettings {
    RenderSettings { float_beauty: true, ..direct(SIZE, 16) }
}

/// A floor under a few lamps, some of which a wall hides from parts of it: penumbras, dark and bright.
fn court() -> Stage {
    let mut stage = Stage::default();
    stage.quad([12.0; 2], lambert(Vec3::splat(0.5)), facing(DVec3::ZERO, DVec3::Y));
    stage.quad([3.0, 2.0], lambert(Vec3::splat(0.3)), facing(DVec3::new(0.5, 1.0, 0.3), DVec3::ONE));
    for i in 0..24 {
        let t = f64::from(i);
        let place = DVec3::new(2.5 * t.cos(), 0.4 + 0.1 * t, 2.5 * t.sin());
        let intensity_cd = Vec3::new(1.0, 0.8, 0.5) * (0.3 + 0.2 * f64::from(i % 5)) as f32;
        stage.light(LightKind::Point { intensity_cd }, at(place));
    }
    stage.look(DVec3::new(4.0, 6.0, 5.0), DVec3::ZERO, 0.7);
    stage
}

/// A floor that one lamp lights, through a hole which one ray in a few hundred finds.
fn crack() -> Stage {
    let mut stage = Stage::default();
    stage.quad([4.0; 2], lambert(Vec3::splat(0.5)), facing(DVec3::ZERO, DVec3::Y));
    // Four boards around a small hole, close below a wide lamp.
    const HOLE: f64 = 0.035;
    for (x, z) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
        let out = DVec3::new(x, 0.0, z) * (2.0 + HOLE);
        let wide = if x == 0.0 { [8.0, 4.0] } else { [4.0, 8.0] };
        let place = DVec3::new(0.0, 1.2, 0.0) + out;
        stage.quad(wide, lambert(Vec3::ZERO), facing(place, -DVec3::Y));
    }
    let lamp = facing(DVec3::new(0.0, 1.5, 0.0), -DVec3::Y);
    stage.quad([1.6; 2], crate::stage::glow(Vec3::splat(50.0)), lamp);
    stage.look(DVec3::new(0.0, 1.0, 1e-3), DVec3::ZERO, 0.5);
    stage
}

fn goal(error: f64, reference: &Reference) -> ErrorGoal {
    let lit: Vec<f64> = reference.luminance.iter().copied().filter(|&l| l > 0.0).collect();
    let middle = (lit.iter().map(|l| l.ln()).sum::<f64>() / lit.len() as f64).exp();
    ErrorGoal { error, grey: Grey::below(middle), most: 1 << 14 }
}
