//! The same picture from every strategy.
//!
//! Each scene below is rendered in eight ways: lights picked uniformly, by power, through the tree
//! and exhaustively, each with reflected rays that may find lights too and without. All must agree
//! in the mean of the picture and in every block of it. Uniform picking without anything else is
//! hardly more than the definition of direct light: it is the oracle, and it is noisy, so every way
//! gets as many samples as its own noise asks for.

use crate::rooms::{self, Room};
use crate::stage::{Set, by};
use crate::statistics::{Estimate, blocks};
use candelabra::render::buffers::{Pixel, RenderBuffers};
use candelabra::render::{LightStrategy, RenderSettings};
use glam::DVec3;

/// Pixels along an edge.
pub const SIZE: u32 = 16;
/// The standard error of a picture's mean that is asked for, as a share of it, by its variance
/// buffer. (Stratified samples are about three times as good.)
const WANTED: f64 = 0.007;
const MOST_SAMPLES: u32 = 32_768;
/// Standard errors by which the means of two pictures may differ.
const SIGMAS: f64 = 3.0;
/// The same by the spread of the differences between their pixels, which knows what stratification
/// is worth: a bias of some 1.5 % does not get past it.
const SIGMAS_OF_DIFFERENCES: f64 = 4.2;
/// The same for one of many blocks, by the variance buffer.
const SIGMAS_OF_A_BLOCK: f64 = 5.0;

const WAYS: [(LightStrategy, bool); 8] = [
    (LightStrategy::Uniform, false),
    (LightStrategy::Uniform, true),
    (LightStrategy::Power, false),
    (LightStrategy::Power, true),
    (LightStrategy::Tree, false),
    (LightStrategy::Tree, true),
    (LightStrategy::Exhaustive, false),
    (LightStrategy::Exhaustive, true),
];

/// A picture with no more noise than is wanted, if samples can make it: each look tells how many the
/// next one takes.
pub fn render(set: &Set, settings: RenderSettings, frame: i32) -> RenderBuffers {
    let mut next = RenderSettings { samples: 64, ..settings };
    loop {
        let buffers = set.render(&next, frame);
        let excess = Estimate::of_picture(&buffers).relative_error() / WANTED;
        if excess <= 1.0 || next.samples == MOST_SAMPLES {
            return buffers;
        }
        let samples = f64::from(next.samples) * 1.1 * excess * excess;
        next.samples = (samples as u32).min(MOST_SAMPLES);
        next.seed += 1;
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
    blocks(a, SIZE / 4).enumerate().find_map(|(number, block)| {
        let of = |buffers: &RenderBuffers| {
            Estimate::of(block.iter().map(|&pixel| &buffers.pixels()[pixel]))
        };
        let apart = of(a).distance(&of(b));
        (apart > SIGMAS_OF_A_BLOCK).then(|| format!("are {apart:.1} sigma apart in block {number}"))
    })
}

fn assert_agreement(room: &Room) {
    let set = room.stage.set();
    let mut pictures: Vec<(String, RenderBuffers)> = Vec::new();
    for (seed, (strategy, mis)) in (0..).step_by(10).zip(WAYS) {
        let settings = RenderSettings {
            width: SIZE,
            height: SIZE,
            depth: room.depth,
            seed,
            ..Default::default()
        };
        let buffers = render(&set, by(strategy, mis, &settings), 1);
        let estimate = Estimate::of_picture(&buffers);
        let what = format!("{}: {strategy:?}, mis {mis}: {estimate}", room.name);
        let noise = estimate.relative_error();
        assert!(noise <= WANTED, "{what} is too noisy to tell");
        for (other, earlier) in &pictures {
            if let Some(wrong) = disagreement(&buffers, earlier) {
                panic!("{what} and\n{other} {wrong}");
            }
        }
        pictures.push((what, buffers));
    }
}

fn assert_all(rooms: Vec<Room>) {
    rooms.iter().for_each(assert_agreement);
}

#[test]
fn under_every_kind_of_light() {
    assert_all(rooms::of_every_light());
}

#[test]
fn on_every_material() {
    assert_all(rooms::of_every_material());
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
        let mut seen = picture(mirror, seed);
        // A camera has no hand: it turns right and left around.
        seen.pixels_mut().chunks_mut(SIZE as usize).for_each(<[Pixel]>::reverse);
        let wrong = disagreement(&expected, &seen);
        assert!(wrong.is_none(), "a room and its mirror by {mirror} {}", wrong.unwrap());
    }
}

#[test]
fn on_both_sides_and_in_both_hands() {
    assert_all(rooms::of_every_side());
}
