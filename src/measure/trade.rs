//! Error against time: every way of picking lights at every budget, against one converged picture.
//!
//! Entrants are interleaved in time: all render their first picture, then all their second, so that what
//! else the machine does meanwhile hits all of them. Times are medians over the seeds. The error of an entrant
//! is the root of its mean squared error over the seeds: that of a median would be too small where
//! few samples carry much of the light.

use super::cache::Cache;
use super::entrant::{Budget, Entrant};
use super::picture::{Picture, Subject, luminances};
use super::reference::Converged;
use super::report::Row;
use crate::math::random::hash;
use crate::render::beauty::Beauty;
use crate::render::noise::Grey;
use crate::render::{LightStrategy, Progress, RenderError, RenderSettings, Split};
use serde::{Deserialize, Serialize};
use std::io;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use thiserror::Error;

/// How the trade is measured.
#[derive(Clone, Debug)]
pub struct TradeOptions {
    /// Who takes part.
    pub entrants: Vec<Entrant>,
    /// Pictures by each, at least 1.
    pub seeds: u32,
    /// Samples of each pixel of the reference, both halves together.
    pub reference_samples: u32,
    /// The grey floor, if it is not to follow from the reference.
    pub grey: Option<Grey>,
    /// Where an error is asked for, no pixel gets more samples.
    pub most: u32,
    /// Lights in the scene: ways that look at each of them are expected to take longer.
    pub lights: usize,
}

/// Hears how far the work is.
pub trait Onlooker: Sync {
    /// Something else is done now.
    fn begins(&self, what: &str);
    /// How far all of it is, from 0 to 1.
    fn is_at(&self, done: f64);
    /// Whether it is to be given up. Asked often, from all threads.
    fn is_stopped(&self) -> bool;
}

/// Why there is no result.
#[derive(Debug, Error)]
pub enum TradeError {
    /// A picture could not be rendered.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// Finished work could not be kept.
    #[error(transparent)]
    Cache(#[from] io::Error),
}

/// What was measured of one picture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cell {
    /// Samples of a pixel, in the mean.
    pub samples: f64,
    /// Seconds it took.
    pub seconds: f64,
    /// Its error.
    pub error: f64,
    /// The pooled error that 99 % of its noisy pixels do not exceed.
    pub worst_percent: f64,
    /// Its mean luminance over that of the reference, less 1.
    pub mean_off: f64,
    /// Lights sampled for a path, in the mean.
    pub lights: f64,
    /// Samples left out because they were infinite or no number.
    pub non_finite: u64,
}

/// Work that is done and work to be done, in samples of a pixel.
pub(super) struct Account<'a> {
    onlooker: &'a dyn Onlooker,
    all: f64,
    before: f64,
    /// What is rendered now, and how many samples it has and will have.
    now: f64,
    taken: AtomicU64,
    expected: AtomicU64,
}

impl<'a> Account<'a> {
    pub fn new(onlooker: &'a dyn Onlooker, all: f64) -> Account<'a> {
        let (taken, expected) = (AtomicU64::new(0), AtomicU64::new(1));
        Account { onlooker, all, before: 0.0, now: 0.0, taken, expected }
    }

    pub fn begin(&mut self, what: &str, weight: f64) {
        self.before += self.now;
        self.now = weight;
        self.taken = AtomicU64::new(0);
        self.onlooker.begins(what);
    }
}

impl Progress for Account<'_> {
    fn expects(&self, taken: u64, all: u64) {
        self.taken.store(taken, Relaxed);
        self.expected.store(all, Relaxed);
    }

    fn samples_taken(&self, samples: u64) {
        let done = self.taken.fetch_add(samples, Relaxed) + samples;
        let share = done as f64 / self.expected.load(Relaxed).max(1) as f64;
        self.onlooker.is_at((self.before + self.now * share.min(1.0)) / self.all.max(1.0));
    }

    fn is_stopped(&self) -> bool {
        self.onlooker.is_stopped()
    }
}

/// Measures the trade; what is in the cache is not measured again.
///
/// # Errors
/// If a picture cannot be rendered or the cache not be written, or if the onlooker stops it: then the
/// cache has all finished pictures.
pub fn trade<D: AsRef<[u8]>>(
    subject: &mut Subject<D>,
    options: &TradeOptions,
    cache: &Cache,
    onlooker: &dyn Onlooker,
) -> Result<(Converged, Vec<Row>), TradeError> {
    let all = f64::from(options.reference_samples)
        + f64::from(options.seeds)
            * options.entrants.iter().map(|e| weight(e, options.lights)).sum::<f64>();
    let mut account = Account::new(onlooker, all);
    let converged = converge(subject, options, cache, &mut account)?;
    let mut cells: Vec<Vec<Cell>> = vec![Vec::new(); options.entrants.len()];
    for number in 0..options.seeds {
        for (entrant, own) in options.entrants.iter().zip(&mut cells) {
            let name = format!("{entrant}-{number}");
            account.begin(&entrant.to_string(), weight(entrant, options.lights));
            let cell = match cache.result(&name) {
                Some(cell) => cell,
                None => {
                    let settings = settings_of(entrant, subject, number);
                    let goal = entrant.goal(converged.grey, options.most);
                    let picture = subject.render(settings, goal, &account)?;
                    let cell = of_picture(&picture, &converged);
                    cache.keep_result(&name, &cell)?;
                    cell
                }
            };
            own.push(cell);
        }
    }
    let rows = options.entrants.iter().zip(cells).map(|(entrant, cells)| Row::of(*entrant, &cells));
    Ok((converged, rows.collect()))
}

/// A picture of an entrant, the one of its first seed. It is rendered again: the same input gives the same
/// bytes, and times do not matter here. The grey floor and the most samples of a pixel are those of the trade.
///
/// # Errors
/// As for every picture.
pub fn again<D: AsRef<[u8]>>(
    subject: &mut Subject<D>,
    entrant: &Entrant,
    (grey, most): (Grey, u32),
    onlooker: &dyn Onlooker,
) -> Result<Beauty, RenderError> {
    let mut account = Account::new(onlooker, 1.0);
    account.begin("pictures for the page", 1.0);
    let goal = entrant.goal(grey, most);
    Ok(subject.render(settings_of(entrant, subject, 0), goal, &account)?.beauty)
}

fn settings_of<D>(entrant: &Entrant, subject: &Subject<D>, number: u32) -> RenderSettings {
    let seed = hash(subject.base.seed, number);
    RenderSettings { seed, ..entrant.settings(&subject.base) }
}

fn converge<D: AsRef<[u8]>>(
    subject: &mut Subject<D>,
    options: &TradeOptions,
    cache: &Cache,
    account: &mut Account,
) -> Result<Converged, TradeError> {
    let samples = options.reference_samples.div_ceil(2).max(1);
    let mut half = |number: u32| {
        let name = format!("half-{number}-of-{}", 2 * samples);
        account.begin("the reference", f64::from(samples));
        let size = (subject.base.width, subject.base.height);
        if let Some(picture) = cache.picture(&name).filter(|half| (half.width, half.height) == size)
        {
            return Ok(picture);
        }
        // Seeds that no entrant has.
        let seed = hash(!subject.base.seed, number);
        let settings = RenderSettings { samples, seed, ..subject.base.clone() };
        let picture = subject.render(settings, None, account)?.beauty;
        cache.keep_picture(&name, &picture)?;
        Ok::<_, TradeError>(picture)
    };
    Ok(Converged::of(&[half(0)?, half(1)?], options.grey))
}

fn of_picture(picture: &Picture, converged: &Converged) -> Cell {
    let found = converged.reference.compare(&luminances(&picture.beauty), converged.grey);
    Cell {
        samples: picture.samples,
        seconds: picture.seconds,
        error: found.error,
        worst_percent: found.worst_percent,
        mean_off: found.mean_off,
        lights: picture.lights,
        non_finite: picture.non_finite,
    }
}

/// What a picture is expected to take, for the bar.
fn weight(entrant: &Entrant, lights: usize) -> f64 {
    let each = match entrant.way.strategy {
        LightStrategy::All | LightStrategy::Exhaustive => lights.max(1) as f64,
        _ if entrant.way.split != Split::Fixed(0.0) => 2.0,
        _ => 1.0,
    };
    each * match entrant.budget {
        Budget::Samples(samples) => f64::from(samples),
        // About as many as a scene of many lights takes.
        Budget::Error(error) => (0.5 / error).powi(2),
    }
}
