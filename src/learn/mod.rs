//! Floor 4: what of each cluster is seen from where, learned by the renderer's own picks.
//!
//! Paths from the shot's cameras find receivers, and receivers are divided into [cells](crate::light_tree::learned).
//! In each cell the tree is opened where most light is expected to come from, as far as a table has room: the
//! *front*. Then paths are traced again, in rounds. At their points lights are picked as a render picks
//! them, with one sample, and a ray to each pick tells whether it is seen. That is counted for the cell and
//! the lane of the front that the pick came through. After each round the counts become weights, and the
//! next round picks by them: what is hidden is soon looked at no more, and rays go where doubt is left.
//!
//! Counts are whole numbers and weights change between rounds only, so the table does not depend on threads.

mod counts;

use crate::light_tree::learned::{Coordinates, Table, coordinates, divide};
use crate::light_tree::{Picked, Receiver, Splitting};
use crate::light_tree::{LightTree, NoSuchFrame};
use crate::math::random::hash;
use crate::render::RenderDelegate;
use crate::render::path::{Integrator, Vertex};
use crate::render::picker::{PickScratch, Wanted};
use counts::Counts;
use glam::{Vec2, Vec3};
use rayon::prelude::*;

/// How much is learned.
#[derive(Clone, Copy, Debug)]
pub struct LearnOptions {
    /// There are `2^levels` cells.
    pub levels: u32,
    /// Groups of the tree that are looked into in a cell.
    pub groups: usize,
    /// Rays to lights.
    pub rays: u64,
}

impl Default for LearnOptions {
    fn default() -> LearnOptions {
        LearnOptions { levels: 12, groups: 16, rays: 1 << 22 }
    }
}

/// Rounds, if there are not more frames.
const ROUNDS: usize = 4;
/// Receivers that a cell is made for, in the mean.
const RECEIVERS_OF_CELL: usize = 64;
/// Receivers of a cell that decide what is looked into.
const LOOKERS: usize = 8;
/// Points of a path that are looked at.
const BOUNCES: u32 = 2;
/// Rays to lights from each.
const RAYS: u32 = 4;
/// The random numbers are not those of any frame.
const SEED: u32 = 0x6c65_6172;

/// Learns from some frames. `tree_at` gives the trees of each: that of what stands still must be the same in all.
///
/// # Errors
/// If a tree lacks its frame.
pub fn learn<E: From<NoSuchFrame>>(
    delegate: &RenderDelegate,
    frames: &[i32],
    mut at_frame: impl FnMut(i32, &mut dyn FnMut(&LightTree<&[u8]>) -> Result<(), NoSuchFrame>) -> Result<(), E>,
    options: &LearnOptions,
) -> Result<Table, E> {
    let LearnOptions { levels, groups, rays } = *options;
    let cells = 1_usize << levels;
    let mut receivers: Vec<Coordinates> = Vec::new();
    let of_frame = (cells * RECEIVERS_OF_CELL / BOUNCES as usize).div_ceil(frames.len().max(1)) as u32;
    for &frame in frames {
        at_frame(frame, &mut |tree| {
            delegate.at_frame(tree, frame, |integrator| {
                receivers.extend(visited(integrator, of_frame, hash(SEED, frame as u32)));
            })
        })?;
    }
    let (planes, ranges) = divide(&mut receivers, levels);
    let mut counts: Option<Counts> = None;
    let mut table = Table { planes, ..Table::default() };
    let rounds = ROUNDS.next_multiple_of(frames.len().max(1)).min(ROUNDS.max(frames.len()));
    let paths = rays / u64::from(BOUNCES * RAYS) / rounds as u64;
    for round in 0..rounds {
        let frame = frames[round % frames.len()];
        at_frame(frame, &mut |tree| {
            let known = table.view();
            let known = (!table.rows.is_empty()).then_some(known);
            let counted = delegate.at_frame_knowing(tree, frame, known, |integrator| {
                let counts = counts.get_or_insert_with(|| {
                    let lookers = ranges.iter().map(|&[begin, end]| lookers(&receivers[begin..end]));
                    Counts::new(integrator.picker.tree(), &lookers.collect::<Vec<_>>(), groups, integrator.infinite.len())
                });
                let seed = hash(hash(SEED, round as u32 + 1), frame as u32);
                (0..paths as u32).into_par_iter().for_each_init(PickScratch::default, |scratch, number| {
                    look(integrator, &table, counts, (number, paths as u32, hash(seed, number)), scratch);
                });
            });
            counted.map(|()| {
                if let Some(counts) = &counts {
                    (table.rows, table.beside) = counts.weights();
                }
            })
        })?;
    }
    Ok(table)
}

/// Receivers that paths of a frame visit.
fn visited(integrator: &Integrator, paths: u32, seed: u32) -> Vec<Coordinates> {
    let of_path = |number: u32| {
        let mut found = Vec::new();
        let (x, y) = pixel(integrator, number, paths);
        integrator.for_each_vertex((x, y), hash(seed, number), BOUNCES, |vertex| {
            found.push(coordinates(vertex.receiver.point, vertex.receiver.normal));
        });
        found
    };
    (0..paths).into_par_iter().flat_map_iter(of_path).collect()
}

/// Spread over the picture by a lattice of rank 1.
fn pixel(integrator: &Integrator, number: u32, of: u32) -> (u32, u32) {
    let (width, height) = (integrator.settings.width, integrator.settings.height);
    let x = (number as f64 + 0.5) / f64::from(of) * f64::from(width);
    let y = (f64::from(number) * 0.618_033_988_749_895).fract() * f64::from(height);
    ((x as u32).min(width - 1), (y as u32).min(height - 1))
}

/// A few of the receivers of a cell, from all over it.
fn lookers(of_cell: &[Coordinates]) -> Vec<Receiver> {
    let step = of_cell.len().div_ceil(LOOKERS).max(1);
    let receiver = |&[x, y, z, i, j, k]: &Coordinates| Receiver {
        point: Vec3::new(x, y, z),
        normal: Vec3::new(i, j, k),
    };
    of_cell.iter().step_by(step).map(receiver).collect()
}

/// Traces a path, picks lights at its points and counts which are seen.
fn look(
    integrator: &Integrator,
    table: &Table,
    counts: &Counts,
    (number, of, seed): (u32, u32, u32),
    scratch: &mut PickScratch,
) {
    let (x, y) = pixel(integrator, number, of);
    let accept = integrator.cutouts(hash(seed, 1));
    let mut bounce = 0;
    integrator.for_each_vertex((x, y), seed, BOUNCES, |vertex| {
        bounce += 1;
        let number = |salt: u32| (hash(hash(seed, bounce), salt) >> 8) as f32 / 16_777_216.0;
        let Receiver { point, normal } = vertex.receiver;
        let cell = table.view().cells.find(point, normal, number(0));
        let wanted = Wanted { cell, ..vertex.wanted(None) };
        for ray in 0..RAYS {
            let u = (ray as f32 + number(1)) / RAYS as f32;
            let salt = hash(seed, bounce * RAYS + ray);
            integrator.picker.pick(&wanted, &Splitting::NONE, (u, salt), scratch, |pick| {
                let u = Vec2::new(number(2 * ray + 2), number(2 * ray + 3));
                if let Some(seen) = is_seen(integrator, vertex, pick.light, u, &accept) {
                    counts.count(integrator.picker.tree(), cell, pick.light, seen);
                }
            });
        }
    });
}

/// Whether a light is seen from a vertex; `None` if that does not matter.
fn is_seen(
    integrator: &Integrator,
    vertex: &Vertex,
    light: Picked,
    u: Vec2,
    accept: &impl Fn(u32, u32, Vec2) -> bool,
) -> Option<bool> {
    let incoming = integrator.incoming(light, vertex.receiver.point, vertex.receiver.normal, u)?;
    let counts = vertex.lets_through(incoming.direction);
    counts.then(|| integrator.arriving(&vertex.anchor, &incoming, accept).max_element() > 0.0)
}
