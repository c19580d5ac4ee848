//! Knobs of splitting that differ from bounce to bounce, and the pilot that chooses them.

use crate::rooms;
use crate::stage::{Set, Stage, by, direct, facing, lambert};
use crate::strategies::{SIZE, disagreement, render};
use candelabra::math::color::luminance;
use candelabra::render::beauty::Beauty;
use candelabra::render::knob::{Aim, pilot};
use candelabra::render::noise::Grey;
use candelabra::render::passes::ErrorGoal;
use candelabra::render::{Knobs, LightStrategy, RenderDelegate, RenderSettings, Split};
use candelabra::scene::{Camera, LightKind};
use glam::{DVec3, Vec3};

/// Paths enough for a pilot.
fn plenty(depth: u32) -> RenderSettings {
    RenderSettings { depth, samples: 256, ..direct(48, 0) }
}

fn knobs(set: &Set, settings: RenderSettings) -> Knobs {
    let camera = set.scene.cameras[0].clone();
    let delegate = RenderDelegate::new(set.scene, &set.emitters, camera, settings);
    pilot(&delegate, &set.tree, 1, Aim::Even).unwrap()
}

/// A floor under a lattice of points, so far above each other that they are like one or not.
fn floor_under_points(height: f64) -> Stage {
    let mut stage = Stage::default();
    stage.quad([6.0; 2], lambert(Vec3::splat(0.5)), facing(DVec3::ZERO, DVec3::Y));
    for i in 0..225 {
        let place = DVec3::new(f64::from(i % 15) - 7.0, 0.0, f64::from(i / 15) - 7.0) * 0.4;
        let intensity_cd = Vec3::splat(1.0 + 3.0 * (i % 2) as f32);
        let place = crate::stage::at(place + height * DVec3::Y);
        stage.light(LightKind::Point { intensity_cd }, place);
    }
    stage.look([0.0, 2.0, 4.0], DVec3::ZERO, 0.7);
    stage
}

/// Were a reflected ray that hits a light weighed by another knob than that of the point it comes from, light
/// would be lost or counted twice.
#[test]
fn knobs_that_differ_leave_the_mean_of_the_picture() {
    let rooms = rooms::of_every_light();
    let room = rooms.iter().find(|room| room.name == "mesh lights").unwrap();
    let set = room.stage.set();
    let settings =
        RenderSettings { width: SIZE, height: SIZE, depth: 4, ..RenderSettings::default() };
    let oracle = render(&set, by(LightStrategy::Uniform, true, &settings), 1);
    for (seed, by_bounce) in (10..).step_by(10).zip([[0.9, 0.0, 0.5], [0.0, 0.8, 0.05]]) {
        let split = Split::ByBounce(Knobs { by_bounce });
        let picture = render(&set, RenderSettings { split, seed, ..settings.clone() }, 1);
        if let Some(wrong) = disagreement(&picture, &oracle) {
            panic!("{by_bounce:?} and uniform picking {wrong}");
        }
    }
}

#[test]
fn more_lights_are_picked_where_picking_is_what_is_noisy() {
    let [near, far] = [0.4, 60.0].map(|height| {
        let stage = floor_under_points(height);
        knobs(&stage.set(), plenty(1)).by_bounce[0]
    });
    // From far away all lights give the same: one of each strength tells everything.
    assert!(near > 0.2 && far < near, "{near} {far}");
}

#[test]
fn threads_do_not_show_in_the_knobs() {
    let mut stage = floor_under_points(1.0);
    rooms::all_lights(&mut stage);
    let set = stage.set();
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| knobs(&set, plenty(4)))
    };
    let alone = with(1);
    assert_ne!(alone, Knobs::default(), "the pilot has found something");
    assert_eq!(with(3), alone);
}

#[test]
fn a_knob_that_is_given_is_kept() {
    let stage = floor_under_points(1.0);
    let set = stage.set();
    let fixed = RenderSettings { split: Split::Fixed(0.8), ..plenty(2) };
    assert_eq!(knobs(&set, fixed).by_bounce, [0.8; Knobs::KINDS]);
    // Paths too few to learn from get what is usual.
    let few = RenderSettings { samples: 1, ..plenty(2) };
    assert_eq!(knobs(&set, few), Knobs::default());
}

/// The knobs of a frame that is rendered to an error, by a camera whose exposure is scaled.
fn knobs_to(error: f64, set: &Set, exposure_scale: f32) -> Knobs {
    let settings = RenderSettings { samples: 16_384, ..direct(48, 0) };
    let camera = Camera { exposure_scale, ..set.scene.cameras[0].clone() };
    let mut delegate = RenderDelegate::new(set.scene, &set.emitters, camera, settings.clone());
    delegate.set_settings(RenderSettings {
        samples: 1,
        split: Split::Fixed(1.0),
        ..settings.clone()
    });
    let picture = delegate.render(&set.tree, 1, &()).unwrap().buffers;
    let lights = Beauty::of(&picture, false).pixels;
    let grey = Grey::of(lights.into_iter().map(|light| luminance(light).into()));
    delegate.set_settings(settings);
    let goal = ErrorGoal { error, grey, most: 16_384 };
    pilot(&delegate, &set.tree, 1, Aim::Error(goal)).unwrap()
}

/// A frame that takes few samples to its error is not worth a pilot that one of many is.
#[test]
fn a_pilot_is_as_large_as_the_error_makes_the_frame() {
    let stage = floor_under_points(0.4);
    let set = stage.set();
    assert_eq!(knobs_to(2.0, &set, 1.0), Knobs::default());
    assert_ne!(knobs_to(0.005, &set, 1.0), Knobs::default());
}

/// The floor is in the unit of the picture, paths are in that of radiance.
#[test]
fn exposure_does_not_show_in_the_knobs() {
    let stage = floor_under_points(0.4);
    let set = stage.set();
    let plain = knobs_to(0.005, &set, 1.0);
    assert_ne!(plain, Knobs::default());
    for scale in [1.0 / 1024.0, 1024.0] {
        assert_eq!(knobs_to(0.005, &set, scale), plain);
    }
}
