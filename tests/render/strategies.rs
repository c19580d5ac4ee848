//! The same picture from every strategy.
//!
//! Lights are picked in many [`WAYS`], each with reflected rays that may find lights too and without.
//! All must agree in the mean of the picture and in every block of it. Uniform picking without
//! anything else is hardly more than the definition of direct light: it is the oracle of every room,
//! and it is noisy, so every way gets as many samples as its own noise asks for. A few rooms are
//! rendered in every way; of the others each takes every seventh, so that every kind of light and of
//! material meets ways of every kind.

use crate::rooms::{self, Room};
use crate::stage::{Set, Stage, aimed, by, direct};
use crate::statistics::{Estimate, Pixel, blocks, pixels};
use candelabra::light_tree::{Receiver, Scratch};
use candelabra::render::buffers::RenderBuffers;
use candelabra::render::{LightStrategy, RenderSettings, Split, SplitBy};
use candelabra::scene::{LightKind, Shaping};
use glam::{DVec3, Vec3};

/// Pixels along an edge.
pub const SIZE: u32 = 16;
/// The standard error of a picture's mean that is asked for, as a share of it, by its variance
/// buffer.
const WANTED: f64 = 0.010;
const MOST_SAMPLES: u32 = 32_768;
/// Standard errors by which the means of two pictures may differ.
const SIGMAS: f64 = 5.0;
/// The same by the spread of the differences between their pixels, which knows what stratification
/// is worth: a bias of some 1.5 % does not get past it.
const SIGMAS_OF_DIFFERENCES: f64 = 4.2;
/// The same for one of many blocks, by the variance buffer: 16 pixels do not tell their noise well.
const SIGMAS_OF_A_BLOCK: f64 = 8.0;

/// A way of picking lights.
#[derive(Clone, Copy, Debug)]
pub struct Way {
    pub strategy: LightStrategy,
    pub split: f32,
    pub split_by: SplitBy,
    pub most: u32,
}

impl Way {
    /// One light at a point, or all.
    pub const fn of(strategy: LightStrategy) -> Way {
        Way { strategy, split: 0.0, split_by: SplitBy::Variance, most: 64 }
    }

    /// As many as the knob says, through the tree.
    pub const fn split(split: f32) -> Way {
        Way { split, ..Way::of(LightStrategy::Tree) }
    }

    pub fn settings(&self, mis: bool, settings: &RenderSettings) -> RenderSettings {
        RenderSettings {
            split: Split::Fixed(self.split),
            split_by: self.split_by,
            max_lights: self.most,
            ..by(self.strategy, mis, settings)
        }
    }
}

/// The oracle comes first.
pub const WAYS: [Way; 14] = [
    Way::of(LightStrategy::Uniform),
    Way::of(LightStrategy::Power),
    Way::of(LightStrategy::Distance),
    Way::of(LightStrategy::Tree),
    Way::of(LightStrategy::Exhaustive),
    Way::of(LightStrategy::All),
    Way::split(0.1),
    Way::split(0.5),
    Way::split(1.0),
    Way { split_by: SplitBy::SolidAngle, ..Way::split(0.5) },
    Way { split_by: SplitBy::SolidAngle, most: 5, ..Way::split(0.3) },
    Way { most: 3, ..Way::split(0.5) },
    Way { most: 3, ..Way::split(1.0) },
    Way { strategy: LightStrategy::Distance, ..Way::split(0.5) },
];

/// Every way, with reflected rays that may find lights and without.
pub fn every_way() -> Vec<(Way, bool)> {
    WAYS.into_iter().flat_map(|way| [(way, false), (way, true)]).collect()
}

/// The oracle, and every seventh of the others from one on.
fn some_ways(first: usize) -> Vec<(Way, bool)> {
    let (oracle, others) = (every_way()[0], every_way().into_iter().skip(1));
    std::iter::once(oracle).chain(others.skip(first % 7).step_by(7)).collect()
}

/// A picture with no more noise than is wanted, if samples can make it: each look tells how many the
/// next one takes. The picture itself is not looked at: those that happen to lack light seem to be less
/// noisy, so one that is chosen by its own noise is too dark.
pub fn render(set: &Set, settings: RenderSettings, frame: i32) -> RenderBuffers {
    let mut next = RenderSettings { samples: 64, ..settings };
    loop {
        let look = set.render(&next, frame);
        let excess = Estimate::of_picture(&look).relative_error() / WANTED;
        next.seed += 1;
        if excess <= 1.0 || next.samples == MOST_SAMPLES {
            return set.render(&next, frame);
        }
        let samples = f64::from(next.samples) * 1.1 * excess * excess;
        next.samples = (samples as u32).min(MOST_SAMPLES);
    }
}

/// What is wrong with two pictures of the same thing, if they are not of the same thing.
pub fn disagreement(a: &RenderBuffers, b: &RenderBuffers) -> Option<String> {
    let (of_a, of_b) = (Estimate::of_picture(a), Estimate::of_picture(b));
    let apart = of_a.distance(&of_b);
    if apart > SIGMAS {
        return Some(format!("are {apart:.1} sigma apart"));
    }
    let apart = Estimate::of_difference(a, b).distance_from_zero(of_a.mean);
    if apart > SIGMAS_OF_DIFFERENCES {
        return Some(format!("differ by {apart:.1} sigma"));
    }
    let (pixels_a, pixels_b) = (pixels(a), pixels(b));
    blocks(a, SIZE / 4).enumerate().find_map(|(number, block)| {
        let of = |all: &[Pixel]| Estimate::of(block.iter().map(|&pixel| &all[pixel]));
        let apart = of(&pixels_a).distance(&of(&pixels_b));
        (apart > SIGMAS_OF_A_BLOCK).then(|| format!("are {apart:.1} sigma apart in block {number}"))
    })
}

/// Asserts that a room looks the same in some ways.
#[track_caller]
pub fn assert_agreement(room: &Room, ways: &[(Way, bool)]) {
    let set = room.stage.set();
    let mut pictures: Vec<(String, RenderBuffers)> = Vec::new();
    for (seed, (way, mis)) in (0..).step_by(10).zip(ways) {
        let settings = RenderSettings {
            width: SIZE,
            height: SIZE,
            depth: room.depth,
            seed,
            ..Default::default()
        };
        let buffers = render(&set, way.settings(*mis, &settings), 1);
        let estimate = Estimate::of_picture(&buffers);
        let what = format!("{}: {way:?}, mis {mis}: {estimate}", room.name);
        let noise = estimate.relative_error();
        // How many samples that takes was told by another picture.
        assert!(noise <= 1.6 * WANTED, "{what} is too noisy to tell");
        for (other, earlier) in &pictures {
            if let Some(wrong) = disagreement(&buffers, earlier) {
                panic!("{what} and\n{other} {wrong}");
            }
        }
        pictures.push((what, buffers));
    }
}

fn assert_all(rooms: Vec<Room>) {
    for (number, room) in rooms.iter().enumerate() {
        assert_agreement(room, &some_ways(number));
    }
}

#[test]
fn in_every_way() {
    const ROOMS: [&str; 3] = ["all lights together", "mesh lights", "points with ranges"];
    let rooms = rooms::of_every_light().into_iter();
    let rooms: Vec<Room> = rooms.filter(|room| ROOMS.contains(&room.name.as_str())).collect();
    assert_eq!(rooms.len(), ROOMS.len());
    rooms.iter().for_each(|room| assert_agreement(room, &every_way()));
}

#[test]
fn under_every_kind_of_light() {
    assert_all(rooms::of_every_light());
}

#[test]
fn on_every_material() {
    assert_all(rooms::of_every_material());
}

/// A picture with right and left exchanged.
fn turned(buffers: &RenderBuffers) -> RenderBuffers {
    let (mut turned, last) = (buffers.clone(), SIZE as usize - 1);
    let channels: usize = buffers.layers().iter().map(|layer| layer.channels.len()).sum();
    for (x, y) in (0..SIZE).flat_map(|y| (0..SIZE).map(move |x| (x, y))) {
        let value = |channel| buffers.row(channel, y as usize)[last - x as usize];
        turned.set(x, y, &(0..channels).map(value).collect::<Vec<f32>>());
    }
    turned
}

/// The picture of a mirrored scene is the mirrored picture: windings, normal maps, aims.
#[test]
fn in_the_mirror() {
    let settings = RenderSettings { width: SIZE, height: SIZE, depth: 2, ..Default::default() };
    let picture = |mirror, seed| {
        let stage = rooms::mirrored(mirror);
        render(&stage.set(), RenderSettings { seed, ..settings.clone() }, 1)
    };
    let expected = picture(DVec3::ONE, 100);
    for (seed, mirror) in (200..).zip(rooms::MIRRORS) {
        // A camera has no hand: it turns right and left around.
        let seen = turned(&picture(mirror, seed));
        let wrong = disagreement(&expected, &seen);
        assert!(wrong.is_none(), "a room and its mirror by {mirror} {}", wrong.unwrap());
    }
}

#[test]
fn on_both_sides_and_in_both_hands() {
    assert_all(rooms::of_every_side());
}

/// A plain room without anything that stands in a light's way, lit by points and spots.
fn open_room() -> Stage {
    let mut stage = rooms::lambert_room();
    stage.scene.instances.truncate(1);
    stage.scene.lights.clear();
    for i in 0..40 {
        let t = f64::from(i);
        let place = DVec3::new((1.7 * t).sin(), 0.5 + 0.4 * (0.9 * t).cos(), (2.3 * t).cos());
        let intensity_cd = Vec3::new(0.2 + 0.1 * (t as f32).sin(), 0.2, 0.3);
        let shaping = Shaping::Khr { inner_rad: 0.3, outer_rad: 0.8 };
        let kind = match i % 2 {
            0 => LightKind::Point { intensity_cd },
            _ => LightKind::Spot { intensity_cd, shaping },
        };
        stage.light(kind, aimed(place, DVec3::new(0.5 * t.cos(), 0.0, 0.5 * t.sin())));
    }
    stage
}

#[test]
fn splitting_everything_leaves_no_noise_of_picking() {
    let stage = open_room();
    let set = stage.set();
    let settings = RenderSettings { width: SIZE, height: SIZE, ..direct(SIZE, 64) };
    let picture = |way: Way| {
        let buffers = set.render(&way.settings(true, &settings), 1);
        let variance: f64 = pixels(&buffers).iter().map(|p| p.variance.as_dvec3().y).sum();
        (buffers, variance)
    };
    let (looped, noise_of_loop) = picture(Way::of(LightStrategy::All));
    for split_by in [SplitBy::Variance, SplitBy::SolidAngle] {
        let (split, noise) = picture(Way { most: u32::MAX, split_by, ..Way::split(1.0) });
        // What is left is where in its pixel a path begins, which is drawn alike.
        for (a, b) in looped.beauty().zip(split.beauty()) {
            let off = (a - b).abs().max_element();
            assert!(off <= 1e-4 * a.max_element(), "{a} {b}");
        }
        assert!((noise / noise_of_loop - 1.0).abs() < 1e-2, "{noise} {noise_of_loop}");
    }
    // And it is there to be left out; the more the knob is turned, the less of it.
    let excess = |knob| picture(Way { most: u32::MAX, ..Way::split(knob) }).1 / noise_of_loop - 1.0;
    let knobs = [0.0, 0.2, 0.5, 0.8].map(excess);
    assert!(knobs.is_sorted_by(|a, b| a > b) && knobs[0] > 5.0 && knobs[3] > 0.005, "{knobs:?}");
}

#[test]
fn no_point_samples_more_lights_than_it_may() {
    let stage = open_room();
    let set = stage.set();
    let tree = set.tree.at_frame(1).unwrap();
    let mut scratch = Scratch::default();
    // A sun and a dome stand beside the tree, or nothing does.
    for (beside, of_beside) in [(&[][..], 0), (&[0.3, 0.1][..], 2)] {
        for most in [1, 2, 3, 7, 20, u32::MAX] {
            let settings = RenderSettings::default();
            let by_angle = Way { split_by: SplitBy::SolidAngle, ..Way::split(0.5) };
            for way in [Way::split(0.3), Way::split(1.0), by_angle] {
                let how = Way { most, ..way }.settings(true, &settings).splitting(0);
                let (mut sum, mut largest) = (0, 0);
                for i in 0..1000 {
                    let t = i as f32;
                    let point = Vec3::new((1.3 * t).sin(), 0.0, (0.7 * t).cos());
                    let receiver = Receiver { point, normal: Vec3::Y };
                    let u = f64::from(t * 0.618_034).fract();
                    let mut count = 0;
                    tree.for_each_pick(&receiver, beside, &how, (u, i), &mut scratch, |_| {
                        count += 1
                    });
                    (sum, largest) = (sum + count, largest.max(count));
                }
                assert!(largest <= most.min(40 + of_beside) as usize, "{way:?}: {largest}");
                // Where everything is wanted, the budget is used.
                let wanted = if way.split == 1.0 { most.min(20) * 600 } else { 900 };
                assert!(sum >= wanted as usize, "{way:?} of {most}: {sum}");
            }
        }
    }
}
