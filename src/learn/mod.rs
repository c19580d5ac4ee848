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
mod pool;

use crate::light_tree::learned::{Cells, Coordinates, Table, coordinates, divide};
use crate::light_tree::{LightTree, NoSuchFrame, Picked, Receiver, Splitting, Veil};
use crate::math::random::hash;
use crate::render::RenderDelegate;
use crate::render::path::Integrator;
use crate::render::picker::{PickScratch, Wanted};
use crate::render::vertex::Vertex;
use counts::Counts;
use glam::{Vec2, Vec3};
use pool::{Known, Pool, Share};
use rayon::prelude::*;
use std::sync::{Mutex, PoisonError};

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

impl LearnOptions {
    /// So many rays, and as many cells as they can tell apart.
    pub fn of_rays(rays: u64) -> LearnOptions {
        let levels = (rays / RAYS_OF_CELL).max(1).ilog2().min(MOST_LEVELS);
        LearnOptions { levels, groups: 16, rays }
    }
}

/// What was learned.
#[derive(Clone, Debug)]
pub struct Lesson {
    /// The table; without rows if nothing is hidden.
    pub table: Table,
    /// Rays to lights.
    pub rays: u64,
    /// The share of the first round's rays that did not arrive: what a render picks in vain without a table.
    pub hidden: f64,
}

/// Rays that a cell is worth.
const RAYS_OF_CELL: u64 = 256;
/// With more levels the table would not be small.
const MOST_LEVELS: u32 = 16;
/// Each takes twice as many rays as the one before it, but the second, which takes as many as the first:
/// what is hidden and bright is found out by few.
const ROUNDS: u32 = 6;
/// Receivers that a cell is made for, in the mean.
const RECEIVERS_OF_CELL: usize = 64;
/// Receivers of a cell that decide what is looked into.
const LOOKERS: usize = 8;
/// Points of a path that are looked at.
const BOUNCES: u32 = 2;
/// Rays to lights from each.
const RAYS: u32 = 8;
/// If a smaller share of the rays is stopped, there is nothing to learn.
const NOTHING: f64 = 0.01;
/// The random numbers are not those of any frame.
const SEED: u32 = 0x6c65_6172;

/// Work in a frame that is ready to be traced.
pub type Work<'w> = &'w mut dyn FnMut(&LightTree<&[u8]>) -> Result<(), NoSuchFrame>;

/// Learns from some frames, at least one. `at_frame` calls work with the trees of a frame; that of what
/// stands still must be the same in all. `go_on` is told how much is done, and says whether to go on.
/// `None` if it said no.
///
/// # Errors
/// Those of `at_frame`, which passes on what the work says.
pub fn learn<E>(
    delegate: &RenderDelegate,
    frames: &[i32],
    mut at_frame: impl FnMut(i32, Work) -> Result<(), E>,
    options: &LearnOptions,
    go_on: &mut dyn FnMut(f64) -> bool,
) -> Result<Option<Lesson>, E> {
    let LearnOptions { levels, groups, rays } = *options;
    let paths = |all: u64| all.div_ceil(frames.len() as u64) as u32;
    let mut receivers: Vec<Coordinates> = Vec::new();
    let mut table = Table::default();
    let of_frame = paths(((RECEIVERS_OF_CELL as u64) << levels) / u64::from(BOUNCES));
    for &frame in frames {
        at_frame(frame, &mut |tree| {
            table.tree = tree.still_key();
            delegate.at_frame_knowing(tree, frame, None, |integrator| {
                receivers.extend(visited(integrator, of_frame, hash(SEED, frame as u32)));
            })
        })?;
    }
    let (planes, ranges) = divide(&mut receivers, levels);
    table.planes = planes;
    table.area = area(&receivers);
    let mut counts: Option<Counts> = None;
    let (mut done, mut hidden) = (0, 0.0);
    for round in 0..ROUNDS {
        let of_frame = paths((rays >> (ROUNDS - round.max(1))) / u64::from(BOUNCES * RAYS)).max(1);
        for &frame in frames {
            if !go_on(done as f64 / rays as f64) {
                return Ok(None);
            }
            at_frame(frame, &mut |tree| {
                delegate.at_frame_knowing(tree, frame, table.view().as_ref(), |integrator| {
                    let counts = counts.get_or_insert_with(|| {
                        let of_cell = |&[begin, end]: &[usize; 2]| lookers(&receivers[begin..end]);
                        let lookers: Vec<Vec<Receiver>> = ranges.iter().map(of_cell).collect();
                        let beside = integrator.infinite;
                        Counts::new(integrator.picker.tree(), &lookers, groups, beside)
                    });
                    let seed = hash(hash(SEED, round + 1), frame as u32);
                    let look = |scratch: &mut PickScratch, number: u32| {
                        let path = (number, of_frame, hash(seed, number));
                        look(integrator, Cells(&table.planes), counts, path, scratch);
                    };
                    (0..of_frame).into_par_iter().for_each_init(PickScratch::default, look);
                })
            })?;
            done += u64::from(of_frame * BOUNCES * RAYS);
        }
        let Some(counts) = &counts else { break };
        if round == 0 {
            hidden = counts.hidden();
            if hidden < NOTHING {
                (table.planes, table.rows, table.area) = Default::default();
                break;
            }
        }
        (table.rows, table.hidden) = rows(counts, 1 << levels);
    }
    let rays = counts.map_or(0, |counts| counts.sent());
    Ok(Some(Lesson { table, rays, hidden }))
}

/// The veils that counts give, and of each cell the share of the light that is hidden, in parts of 255.
fn rows(counts: &Counts, cells: usize) -> (Vec<Veil>, Vec<u8>) {
    let found: Vec<Mutex<(Vec<Veil>, u8)>> = (0..cells).map(|_| Mutex::default()).collect();
    let pool = Pool::new((0..cells).into_par_iter().map(|cell| counts.tallies(cell)).collect());
    let rays_above = pool.rays_above(|cell| counts.last_lanes(cell));
    pool.for_each_cell(rays_above, &|cell, mut known| {
        counts.sum_up(cell, &mut known);
        let veil =
            |known: &Known| Veil { group: known.group, weights: known.lanes.map(Share::weight) };
        let rows = known.iter().map(veil).collect();
        let hidden = (255.0 * counts.hidden_in(cell, &known)).round() as u8;
        *found[cell].lock().unwrap_or_else(PoisonError::into_inner) = (rows, hidden);
    });
    let found =
        found.into_iter().map(|cell| cell.into_inner().unwrap_or_else(PoisonError::into_inner));
    let (rows, hidden) = found.unzip();
    (Veil::padded(rows), hidden)
}

/// The box around some receivers.
fn area(receivers: &[Coordinates]) -> Option<[[f32; 3]; 2]> {
    let first = receivers.first()?;
    let place = |&[x, y, z, ..]: &Coordinates| Vec3::new(x, y, z);
    let [low, high] = receivers
        .iter()
        .map(place)
        .fold([place(first); 2], |[low, high], place| [low.min(place), high.max(place)]);
    Some([low.to_array(), high.to_array()])
}

/// Receivers that paths of a frame visit.
fn visited(integrator: &Integrator, paths: u32, seed: u32) -> Vec<Coordinates> {
    let of_path = |number: u32| {
        let mut found = Vec::new();
        let (x, y) = integrator.spread_pixel(number, paths);
        integrator.for_each_vertex((x, y), hash(seed, number), BOUNCES, |vertex| {
            found.push(coordinates(vertex.receiver.point, vertex.receiver.normal));
        });
        found
    };
    (0..paths).into_par_iter().flat_map_iter(of_path).collect()
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
    cells: Cells,
    counts: &Counts,
    (number, of, seed): (u32, u32, u32),
    scratch: &mut PickScratch,
) {
    let (x, y) = integrator.spread_pixel(number, of);
    let accept = integrator.cutouts(hash(seed, 1));
    let mut bounce = 0;
    integrator.for_each_vertex((x, y), seed, BOUNCES, |vertex| {
        bounce += 1;
        let number = |salt: u32| (hash(hash(seed, bounce), salt) >> 8) as f32 / 16_777_216.0;
        let Receiver { point, normal } = vertex.receiver;
        let cell = cells.find(point, normal, number(0));
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
    let incoming = integrator.incoming(light, vertex.lit(), vertex.receiver.normal, u)?;
    let counts = vertex.lets_through(incoming.direction);
    counts.then(|| integrator.arriving(vertex, &incoming, accept).max_element() > 0.0)
}
