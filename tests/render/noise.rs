//! The trade: what is told of a picture's noise is true, samples go where it is, and none of that biases
//! the picture.

use crate::stage::{Set, Stage, aimed, at, direct, facing, lambert};
use candelabra::math::color::luminance;
use candelabra::render::noise::{Grey, Reference};
use candelabra::render::passes::{ErrorGoal, Planned, Reached, ToError, Uniform};
use candelabra::render::{
    Aov, Control, Film, Progress, RenderDelegate, RenderError, RenderSettings, RenderedFrame, Split,
};
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
        let mut film = delegate.film(1).unwrap();
        let frame = delegate.expose(&self.set.tree, 1, &mut film, control, &()).unwrap();
        (film, frame)
    }

    fn to_error(&self, seed: u32, goal: ErrorGoal) -> (Film, RenderedFrame, Reached) {
        let mut control = ToError::new(goal);
        let (film, frame) = self.expose(seed, &mut control);
        let reached = goal.reached(&film);
        (film, frame, reached)
    }

    /// A converged picture.
    fn reference(&self, samples: u32) -> Reference {
        let (film, _) = self.expose(u32::MAX, &mut Uniform(samples));
        Reference::of(&film.halves(), self.settings.width as usize)
    }
}

fn luminances(frame: &RenderedFrame) -> Vec<f64> {
    frame.buffers.beauty().map(|rgb| f64::from(luminance(rgb))).collect()
}

fn settings() -> RenderSettings {
    // One light at a point: there is noise to be told of.
    RenderSettings { float_beauty: true, split: Split::Fixed(0.0), ..direct(SIZE, 16) }
}

/// The same of a quarter of the pixels.
fn small() -> RenderSettings {
    RenderSettings { width: SIZE / 2, height: SIZE / 2, ..settings() }
}

/// A floor under a few lamps, some of which a wall hides from parts of it: penumbras, dark and bright.
fn court() -> Stage {
    let mut stage = Stage::default();
    stage.quad([12.0; 2], lambert(Vec3::splat(0.5)), facing(DVec3::ZERO, DVec3::Y));
    stage.quad(
        [3.0, 2.0],
        lambert(Vec3::splat(0.3)),
        facing(DVec3::new(0.5, 1.0, 0.3), DVec3::ONE),
    );
    for i in 0..24 {
        let t = f64::from(i);
        let place = DVec3::new(2.5 * t.cos(), 0.4 + 0.1 * t, 2.5 * t.sin());
        let intensity_cd = Vec3::new(1.0, 0.8, 0.5) * (0.3 + 0.2 * f64::from(i % 5)) as f32;
        stage.light(LightKind::Point { intensity_cd }, at(place));
    }
    stage.look(DVec3::new(4.0, 6.0, 5.0), DVec3::ZERO, 0.7);
    stage
}

/// A floor that one lamp lights, through a hole of half a width in metres: which of 0.035 one ray in three
/// hundred finds, of 0.09 one in fifty.
fn crack(hole: f64) -> Stage {
    let mut stage = Stage::default();
    stage.quad([4.0; 2], lambert(Vec3::splat(0.5)), facing(DVec3::ZERO, DVec3::Y));
    // Four boards around a small hole, close below a wide lamp.
    for (x, z) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
        let out = DVec3::new(x, 0.0, z) * (2.0 + hole);
        let wide = if x == 0.0 { [8.0, 4.0] } else { [4.0, 8.0] };
        let place = DVec3::new(0.0, 1.2, 0.0) + out;
        stage.quad(wide, lambert(Vec3::ZERO), facing(place, place - DVec3::Y));
    }
    let lamp = facing(DVec3::new(0.0, 1.5, 0.0), -DVec3::Y);
    stage.quad([1.6; 2], crate::stage::glow(Vec3::splat(50.0)), lamp);
    stage.look(DVec3::new(0.0, 1.0, 1e-3), DVec3::ZERO, 0.5);
    stage
}

fn goal(error: f64, reference: &Reference) -> ErrorGoal {
    ErrorGoal { error, grey: Grey::of(reference.luminance()), most: 1 << 14 }
}

/// Told and true error of a frame, quadratic means over some seeds; and the worst ratios of the two in
/// blocks.
fn told_and_true(studio: &Studio, reference: &Reference, samples: u32) -> (f64, f64, [f64; 2]) {
    const SEEDS: u32 = 24;
    const BLOCK: usize = 8;
    let grey = goal(1.0, reference).grey;
    let side = SIZE as usize / BLOCK;
    let (mut told, mut real) = (0.0, 0.0);
    let mut blocks = vec![[0.0; 2]; side * side];
    for seed in 0..SEEDS {
        let (film, frame) = studio.expose(seed, &mut Uniform(samples));
        told += film.estimate(grey).of_frame().error.powi(2);
        real += reference.compare(&luminances(&frame), grey).error.powi(2);
        let off = reference.squared_errors(&luminances(&frame), grey);
        for (i, pixel) in film.halves().iter().enumerate() {
            let (x, y) = (i % SIZE as usize / BLOCK, i / SIZE as usize / BLOCK);
            let block = &mut blocks[y * side + x];
            *block = [block[0] + pixel.squared_error(grey), block[1] + off[i]];
        }
    }
    let mut ratios: Vec<f64> =
        blocks.iter().map(|[told, real]| (told / real.max(1e-12)).sqrt()).collect();
    ratios.sort_by(f64::total_cmp);
    let root = |sum: f64| (sum / f64::from(SEEDS)).sqrt();
    (root(told), root(real), [ratios[1], ratios[ratios.len() - 2]])
}

#[test]
fn what_is_told_of_the_noise_is_true() {
    let stage = court();
    let set = stage.set();
    let studio = Studio { set: &set, settings: settings() };
    let reference = studio.reference(1 << 12);
    for samples in [16, 64] {
        let (told, real, [low, high]) = told_and_true(&studio, &reference, samples);
        println!("{samples} samples: told {told:.4}, true {real:.4}, blocks {low:.2} to {high:.2}");
        assert!((0.95..1.05).contains(&(told / real)), "{samples}: {told} {real}");
        assert!(low > 0.75 && high < 1.33, "{samples}: {low} {high}");
    }
}

/// The layer of errors tells the error of the frame, in any unit of light; nothing where there is no noise; and
/// does not pretend to know it by one sample.
#[test]
fn the_layer_of_errors_tells_where_the_noise_is() {
    let layer = |stage: &Stage, samples: u32| {
        let set = stage.set();
        let aovs = vec![Aov::Beauty, Aov::Error];
        let studio = Studio { set: &set, settings: RenderSettings { aovs, ..settings() } };
        let (_, frame) = studio.expose(3, &mut Uniform(samples));
        let reference = studio.reference(1024);
        let real = reference.compare(&luminances(&frame), Grey::of(reference.luminance())).error;
        let layer: Vec<f64> = frame.buffers.channel("error").unwrap().map(f64::from).collect();
        (layer, real)
    };
    let mut stage = court();
    let (errors, real) = layer(&stage, 64);
    let noisy: Vec<f64> = errors.iter().copied().filter(|error| *error > 0.0).collect();
    let told = (noisy.iter().map(|error| error * error).sum::<f64>() / noisy.len() as f64).sqrt();
    assert!((told / real - 1.0).abs() < 0.15, "{told} told, {real} true");
    stage.scene.cameras[0].exposure_scale = 1e6;
    let (brighter, _) = layer(&stage, 64);
    for (own, same) in errors.iter().zip(brighter) {
        assert!((own - same).abs() <= 1e-3 * own, "{own} {same}");
    }
    assert!(layer(&stage, 1).0.iter().all(|error| error.is_infinite()));
    let mut sky = Stage::default();
    sky.light(LightKind::Point { intensity_cd: Vec3::ONE }, at(DVec3::Y));
    sky.look(DVec3::ZERO, DVec3::Z, 0.7);
    assert!(layer(&sky, 64).0.iter().all(|error| *error == 0.0));
}

#[test]
fn an_error_that_is_asked_for_is_reached() {
    let stage = court();
    let set = stage.set();
    let studio = Studio { set: &set, settings: settings() };
    let reference = studio.reference(1 << 12);
    for error in [0.1, 0.05] {
        let goal = goal(error, &reference);
        let (mut real, mut told, mut samples) = (0.0, 0.0, 0);
        const SEEDS: u32 = 3;
        for seed in 0..SEEDS {
            let (film, frame, reached) = studio.to_error(seed, goal);
            assert!(reached.frame.bound <= error && reached.capped == 0, "{reached:?}");
            told += reached.frame.error.powi(2);
            real += reference.compare(&luminances(&frame), goal.grey).error.powi(2);
            samples += film.samples();
        }
        let root = |sum: f64| (sum / f64::from(SEEDS)).sqrt();
        let (told, real) = (root(told), root(real));
        let each = samples as f64 / f64::from(SEEDS * SIZE * SIZE);
        println!("{error} asked: told {told:.4}, true {real:.4}, {each:.0} samples a pixel");
        assert!((0.8..1.05).contains(&(real / error)), "{error} asked, {real} true");
        // As many samples in every pixel do worse.
        let (_, even) = studio.expose(99, &mut Uniform(each.round() as u32));
        let even = reference.compare(&luminances(&even), goal.grey).error;
        assert!(real < even, "{real} and {even} with {each} samples everywhere");
    }
}

/// Of many pictures of a scene in which light is rare, the mean is that of as many samples everywhere.
/// A rule that stops a pixel by its own samples fails this by a fourth.
#[test]
fn samples_that_go_where_the_error_is_do_not_bias_the_picture() {
    const PICTURES: u32 = 400;
    let stage = crack(0.09);
    let set = stage.set();
    let studio =
        Studio { set: &set, settings: RenderSettings { width: 12, height: 12, ..settings() } };
    let reference = studio.reference(1 << 12);
    let goal = ErrorGoal { most: 1024, ..goal(0.5, &reference) };
    let mean = |luminances: Vec<f64>| luminances.iter().sum::<f64>() / luminances.len() as f64;
    let moments = |values: &[f64]| {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let spread: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        (mean, spread / (values.len() * (values.len() - 1)) as f64)
    };
    let (mut adaptive, mut uniform, mut counts) = (Vec::new(), Vec::new(), Vec::new());
    for seed in 0..PICTURES {
        let (film, frame, _) = studio.to_error(seed, goal);
        adaptive.push(mean(luminances(&frame)));
        counts.extend_from_slice(film.taken());
        let (_, frame) = studio.expose(PICTURES + seed, &mut Uniform(48));
        uniform.push(mean(luminances(&frame)));
    }
    let ((a, var_a), (b, var_b)) = (moments(&adaptive), moments(&uniform));
    let z = (a - b) / (var_a + var_b).sqrt();
    counts.sort_unstable();
    let told = format!("{a:.6} and {b:.6}, {:+.2} %, z {z:.2}", 100.0 * (a / b - 1.0));
    let tenths: Vec<u32> = (0..10).map(|tenth| counts[counts.len() * tenth / 10]).collect();
    println!("{told}; counts {tenths:?}");
    assert!(
        2 * counts[counts.len() * 9 / 10] >= 3 * counts[counts.len() / 10],
        "samples go nowhere"
    );
    assert!((var_a + var_b).sqrt() < 0.01 * b, "{told}: too noisy to tell");
    assert!(z.abs() < 3.3, "{told}");
}

/// Few rays find the lamp, and after the first pass most pixels are black. That is not convergence.
#[test]
fn light_that_few_rays_find_is_not_taken_for_none() {
    let stage = crack(0.035);
    let set = stage.set();
    let studio = Studio { set: &set, settings: small() };
    let reference = studio.reference(1 << 12);
    for seed in 0..8 {
        let goal = ErrorGoal { most: 1 << 11, ..goal(0.1, &reference) };
        let (film, frame, reached) = studio.to_error(seed, goal);
        let first = studio.expose(seed, &mut Uniform(8)).0;
        let black = first.halves().iter().filter(|pixel| pixel.luminance() == 0.0).count();
        assert!(black > film.taken().len() / 2, "only {black} pixels are black");
        let least = film.taken().iter().min().unwrap();
        assert!(*least >= 64, "{least} samples were thought enough");
        let real = reference.compare(&luminances(&frame), goal.grey).error;
        assert!(reached.frame.error > 0.7 * real, "{real} is told as {}", reached.frame.error);
    }
}

/// The small pictures that decide the floor may be black: because the lights are walled in, or because they are switched on
/// in another frame. The first is done soon, the other has an error that can be told.
#[test]
fn a_shot_whose_small_pictures_are_black_has_a_floor() {
    let grey = Grey::of([0.0; 4].into_iter());
    for hole in [-0.05, 0.09] {
        let stage = crack(hole);
        let set = stage.set();
        let studio = Studio { set: &set, settings: small() };
        let goal = ErrorGoal { error: 0.1, grey, most: 1 << 12 };
        let (film, _, reached) = studio.to_error(1, goal);
        let lit = film.halves().iter().any(|pixel| pixel.luminance() > 0.0);
        assert_eq!(lit, hole > 0.0);
        assert!(reached.frame.error <= 0.1, "{hole}: {}", reached.frame.error);
        let samples = film.taken().iter().sum::<u32>() as usize / film.taken().len();
        assert!(samples < 1 << 11, "{hole}: {samples} samples");
    }
}

/// Counts have no edge at rows or tiles: the mean difference between neighbours is the same across
/// every multiple as elsewhere.
#[test]
fn the_map_of_counts_has_no_edges() {
    let stage = court();
    let set = stage.set();
    let studio = Studio { set: &set, settings: settings() };
    let goal = goal(0.05, &studio.reference(1 << 10));
    let mut steps = vec![[0.0; 2]; SIZE as usize];
    for seed in 0..16 {
        let (film, ..) = studio.to_error(seed, goal);
        let count = |x: usize, y: usize| f64::from(film.taken()[y * SIZE as usize + x]).ln();
        for (x, step) in steps.iter_mut().enumerate().skip(1) {
            for y in 0..SIZE as usize {
                step[0] += (count(x, y) - count(x - 1, y)).abs();
                step[1] += (count(y, x) - count(y, x - 1)).abs();
            }
        }
    }
    for direction in 0..2 {
        for period in [4, 8] {
            let mean = |on: bool| {
                let chosen =
                    steps.iter().enumerate().skip(1).filter(|(x, _)| (x % period == 0) == on);
                let steps: Vec<f64> = chosen.map(|(_, steps)| steps[direction]).collect();
                steps.iter().sum::<f64>() / steps.len() as f64
            };
            let ratio = mean(true) / mean(false);
            assert!((0.7..1.4).contains(&ratio), "period {period}: {ratio}");
        }
    }
}

#[test]
fn brighter_light_needs_the_same_samples() {
    let mut stage = court();
    let counts = |stage: &Stage, factor: f64| {
        let set = stage.set();
        let studio = Studio { set: &set, settings: settings() };
        let grey = Grey::new(0.01 * factor).unwrap();
        studio.to_error(3, ErrorGoal { error: 0.05, grey, most: 1 << 12 }).0.taken().to_vec()
    };
    let plain = counts(&stage, 1.0);
    // By the camera, and by the lights; a power of two has no roundings.
    stage.scene.cameras[0].exposure_scale = 1024.0;
    assert_eq!(counts(&stage, 1024.0), plain);
    stage.scene.cameras[0].exposure_scale = 1000.0;
    let thousand = counts(&stage, 1000.0);
    let same = thousand.iter().zip(&plain).filter(|(a, b)| a == b).count();
    assert!(same as f64 > 0.995 * plain.len() as f64, "{same} of {}", plain.len());
}

/// Stops after so many samples.
struct Impatient {
    left: AtomicU64,
}

impl Progress for Impatient {
    fn is_stopped(&self) -> bool {
        self.left.fetch_update(Relaxed, Relaxed, |left| left.checked_sub(1)).is_err()
    }
}

#[test]
fn a_frame_that_is_gone_on_with_is_the_one_that_was_never_stopped() {
    let stage = court();
    let set = stage.set();
    let aovs = vec![Aov::Beauty, Aov::Cryptomatte, Aov::Motion, Aov::Direct, Aov::Variance];
    let studio = Studio { set: &set, settings: RenderSettings { aovs, ..settings() } };
    let goal = goal(0.05, &studio.reference(256));
    let (film, whole, _) = studio.to_error(5, goal);
    for patience in [1, 7, 40] {
        let delegate = studio.delegate(5);
        let mut kept = delegate.film(1).unwrap();
        let mut stops = 0;
        let frame = loop {
            let progress = Impatient { left: AtomicU64::new(patience) };
            let mut control = ToError::new(goal);
            let done = delegate.expose(&set.tree, 1, &mut kept, &mut control, &progress);
            let mut bytes = Vec::new();
            kept.save(&mut bytes).unwrap();
            for end in [0, 1, bytes.len() / 2, bytes.len() - 1] {
                assert!(delegate.film(1).unwrap().restored(&bytes[..end]).is_none());
            }
            kept = delegate.film(1).unwrap().restored(&bytes).unwrap();
            match done {
                Ok(frame) => break frame,
                Err(error) => assert!(matches!(error, RenderError::Stopped), "{error}"),
            }
            stops += 1;
        };
        assert!(stops > 0 && kept == film && frame == whole, "{patience}: {stops} stops");
    }
}

#[test]
fn a_plan_repeats_a_picture_to_the_last_bit() {
    let stage = court();
    let set = stage.set();
    let studio = Studio { set: &set, settings: settings() };
    let goal = goal(0.1, &studio.reference(256));
    let (film, frame, _) = studio.to_error(5, goal);
    let (_, again) = studio.expose(5, &mut Planned(film.taken().to_vec()));
    assert_eq!(frame, again);
    let counts: Vec<f32> = frame.buffers.channel("sampleCount").unwrap().collect();
    assert!(counts.iter().zip(film.taken()).all(|(told, taken)| *told == *taken as f32));
}

#[test]
fn frames_of_a_pan_are_equally_noisy() {
    let mut stage = court();
    let mut errors = Vec::new();
    let mut fixed = None;
    for frame in 0..4 {
        let turn = f64::from(frame) * 0.4;
        let node = stage.scene.cameras[0].node as usize;
        let from = DVec3::new(4.0 + turn, 6.0, 5.0 - turn);
        stage.scene.nodes[node].local = aimed(from, DVec3::new(turn, 0.0, 0.0));
        let set = stage.set();
        let studio = Studio { set: &set, settings: settings() };
        let reference = studio.reference(1 << 11);
        // One goal and one floor for the shot.
        let goal = *fixed.get_or_insert_with(|| goal(0.05, &reference));
        // What is left is how well the error of one picture can be told.
        let error = |seed| {
            let (_, picture, _) = studio.to_error(seed, goal);
            reference.compare(&luminances(&picture), goal.grey).error
        };
        errors.push((0..4).map(|seed| error(4 * frame + seed)).sum::<f64>() / 4.0);
    }
    let [least, most] = [f64::min, f64::max].map(|of| errors.iter().copied().reduce(of).unwrap());
    assert!(most < 1.1 * least, "{errors:?}");
}
