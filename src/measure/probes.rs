//! Exact variance at points that camera paths visit.
//!
//! All lights are enumerated at each point, and the variance of each strategy's estimate of the light
//! reflected there follows in closed form. It is the variance from *which* lights are picked. The
//! variance from where on a light a sample falls is left out, and shadows are left out unless they are
//! asked for. Contributions have the multiple importance sampling weights that a render gives them, so
//! the part that is left to reflected rays does not count. The ideal is 0.
//!
//! Variances are relative as every error is (see [`noise`](crate::render::noise)): over the square of the light
//! at the point plus a grey floor, a tenth of the geometric mean of the light at all points. Without a floor the mean over the
//! points would be that of the few that next to nothing reaches.

use super::contributions::{Contributions, shares};
use super::entrant::Way;
use super::oracle;
use crate::light_tree::{Cell, LightTree, Moments, NoSuchFrame, Receiver, Veil, Veils};
use crate::math::random::{Sampler, hash};
use crate::render::noise::Grey;
use crate::render::path::Integrator;
use crate::render::picker::{LightPicker, PickScratch, Wanted};
use crate::render::vertex::Vertex;
use crate::render::{LightStrategy, RenderDelegate, RenderSettings};
use rayon::prelude::*;
use serde::Serialize;
use std::time::Instant;

/// What to measure.
#[derive(Clone, Debug)]
pub struct ProbeOptions {
    /// How many points.
    pub probes: u32,
    /// Whether lights that cannot be seen from a point contribute nothing.
    pub visibility: bool,
    /// Ways to measure.
    pub ways: Vec<Way>,
    /// The grey floor, if it is not to follow from the points.
    pub grey: Option<Grey>,
    /// The seed that chooses the points.
    pub seed: u32,
    /// Measure the ways of the tree again, with so many clusters weighed by how much of them is
    /// exactly seen. With `visibility`.
    pub oracles: Vec<u32>,
}

/// What was measured.
#[derive(Clone, Debug, Serialize)]
pub struct ProbeReport {
    /// Points that lights reach.
    pub probes: usize,
    /// Lights at each: emitters and those at infinity.
    pub lights: usize,
    /// The grey floor, in the unit of the picture.
    pub grey: Grey,
    /// One row a way.
    pub strategies: Vec<StrategyReport>,
}

/// What one way does.
#[derive(Clone, Debug, Serialize)]
pub struct StrategyReport {
    /// What it is called.
    pub name: String,
    /// The way.
    #[serde(flatten)]
    pub way: Way,
    /// Relative variance, in the mean over all points: the square of what
    /// [`error`](Self::error) says.
    pub variance: f64,
    /// The error of one estimate: the root of the mean squared error of all points.
    pub error: f64,
    /// The median of the relative variance over all points.
    pub median: f64,
    /// Nine points in ten have less.
    pub ninth_decile: f64,
    /// Lights sampled at a point, in the mean.
    pub lights: f64,
    /// Most lights expected at any point.
    pub most_lights: f64,
    /// Nanoseconds that picking takes at a point, the median of several rounds. Not repeatable.
    pub nanoseconds: f64,
}

/// So many times a probe is put into a cell, which is random near a border.
const CELLS_OF_PROBE: u32 = 8;

/// A point, and what all lights give it.
struct Probe {
    receiver: Receiver,
    wanted: Wanted,
    contributions: Contributions,
    sum: f64,
    /// The cells that it may be in, each as often as the others.
    cells: Vec<Cell>,
    /// The same without shadows, for oracles.
    all: Option<Contributions>,
}

/// Measures ways of picking lights at points that paths from the delegate's camera visit in a frame.
///
/// # Errors
/// If the tree lacks the frame.
pub fn at_probes(
    delegate: &RenderDelegate,
    tree: &LightTree<impl AsRef<[u8]>>,
    frame: i32,
    options: &ProbeOptions,
) -> Result<ProbeReport, NoSuchFrame> {
    delegate.at_frame(tree, frame, |integrator| report(integrator, options))
}

fn report(integrator: &Integrator, options: &ProbeOptions) -> ProbeReport {
    let mut probes: Vec<Probe> =
        (0..options.probes).into_par_iter().filter_map(|i| probe(integrator, i, options)).collect();
    let grey = options.grey.unwrap_or_else(|| Grey::of(probes.iter().map(|probe| probe.sum)));
    let of_all = |veils: Option<Veils>, told: &str, ways: &[Way], probes: &[Probe]| {
        let of = |way: &Way| {
            let Way { strategy, split, split_by } = *way;
            let settings =
                RenderSettings { strategy, split, split_by, ..integrator.settings.clone() };
            let mut tree = integrator.picker.tree().clone();
            if let Some(veils) = veils {
                tree = tree.veiled(veils);
            }
            let picker = LightPicker::new(&settings, tree, integrator.infinite);
            let picker = picker.linked(integrator.links);
            StrategyReport {
                name: format!("{way}{told}"),
                ..of_way(way, &picker, &settings, grey, probes)
            }
        };
        ways.iter().map(of).collect::<Vec<_>>()
    };
    let mut strategies = of_all(None, "", &options.ways, &probes);
    let walking: Vec<Way> =
        options.ways.iter().filter(|way| way.strategy.splits()).copied().collect();
    if let Some(cells) = integrator.cells {
        for probe in &mut probes {
            let Receiver { point, normal } = probe.receiver;
            let cell = |u: u32| cells.find(point, normal, (u as f32 + 0.5) / CELLS_OF_PROBE as f32);
            probe.cells = (0..CELLS_OF_PROBE).map(cell).collect();
        }
        strategies.extend(of_all(None, ", learned", &walking, &probes));
    }
    for &clusters in &options.oracles {
        let of = |probe: &Probe| {
            let all = probe.all.as_ref().unwrap_or(&probe.contributions);
            let tree = integrator.picker.tree();
            oracle::veils(tree, &probe.receiver, clusters, (&probe.contributions, all))
        };
        let rows = Veil::padded(probes.par_iter().map(of).collect());
        for (probe, cell) in probes.iter_mut().zip(0..) {
            probe.cells = vec![Cell(cell)];
        }
        let veils = Veils::new(probes.len(), &rows);
        strategies.extend(of_all(Some(veils), &format!(", oracle {clusters}"), &walking, &probes));
    }
    ProbeReport {
        probes: probes.len(),
        lights: integrator.picker.tree().unforced_count() as usize
            + integrator.infinite.iter().filter(|light| !light.forced).count(),
        grey,
        strategies,
    }
}

/// Point `number` of `of` points that camera paths visit. Even numbers are at the first hit of a path,
/// odd ones after one bounce. `None` if the path hits nothing that reflects.
pub fn visited(integrator: &Integrator, number: u32, of: u32, seed: u32) -> Option<Vertex> {
    let (x, y) = integrator.spread_pixel(number, of);
    integrator.probe(x, y, hash(seed, number), number % 2)
}

fn probe(integrator: &Integrator, number: u32, options: &ProbeOptions) -> Option<Probe> {
    let seed = hash(options.seed, number);
    let vertex = visited(integrator, number, options.probes, options.seed)?;
    let contributions = Contributions::at(integrator, &vertex, options.visibility);
    let sum = contributions.sum();
    let wanted = vertex.wanted(Some(&mut Sampler::new(seed, 1)));
    let is_asked = !options.oracles.is_empty();
    let all = is_asked.then(|| Contributions::at(integrator, &vertex, false));
    let (receiver, cells) = (vertex.receiver, vec![Cell::NONE]);
    (sum > 0.0).then_some(Probe { receiver, wanted, contributions, sum, cells, all })
}

fn of_way(
    way: &Way,
    picker: &LightPicker,
    settings: &RenderSettings,
    grey: Grey,
    probes: &[Probe],
) -> StrategyReport {
    let rows: Vec<(f64, f64)> = probes
        .par_iter()
        .map(|probe| {
            let (variance, lights) = of_probe(picker, settings.strategy, probe);
            (grey.of_deviation(variance, probe.sum), lights)
        })
        .collect();
    let mean =
        |of: fn(&(f64, f64)) -> f64| rows.iter().map(of).sum::<f64>() / rows.len().max(1) as f64;
    let mut sorted: Vec<f64> = rows.iter().map(|row| row.0).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let quantile = |share: f64| {
        let at = (share * sorted.len() as f64) as usize;
        sorted.get(at.min(sorted.len().saturating_sub(1))).copied().unwrap_or(0.0)
    };
    StrategyReport {
        name: way.to_string(),
        way: *way,
        variance: mean(|row| row.0),
        error: mean(|row| row.0).sqrt(),
        median: quantile(0.5),
        ninth_decile: quantile(0.9),
        lights: mean(|row| row.1),
        most_lights: rows.iter().map(|row| row.1).fold(0.0, f64::max),
        nanoseconds: nanoseconds(picker, probes),
    }
}

/// The variance of the estimate, and the expected number of lights that it samples.
fn of_probe(picker: &LightPicker, strategy: LightStrategy, probe: &Probe) -> (f64, f64) {
    let wanted = &probe.wanted;
    match strategy {
        LightStrategy::All => (0.0, f64::from(picker.count())),
        LightStrategy::Tree | LightStrategy::Distance => {
            let of_cell = |&cell: &Cell| {
                let wanted = Wanted { cell, ..*wanted };
                picker.moments(&wanted, picker.splitting(0), &|light, expected| {
                    probe.contributions.of(light, expected)
                })
            };
            let all: Vec<Moments> = probe.cells.iter().map(of_cell).collect();
            let mean = |of: fn(&Moments) -> f64| all.iter().map(of).sum::<f64>() / all.len() as f64;
            (mean(|moments| moments.variance), mean(|moments| moments.lights))
        }
        LightStrategy::Exhaustive => {
            let mut importances = Vec::new();
            picker.for_each_importance(wanted, |light, importance| {
                importances.push((light, importance));
            });
            let shares = shares(importances);
            let share = |light| shares.get(&light).copied().unwrap_or(0.0);
            (probe.contributions.variance_of_one(share), 1.0)
        }
        LightStrategy::Uniform | LightStrategy::Power => {
            let share = |light| picker.blind_probability(light);
            (probe.contributions.variance_of_one(share), 1.0)
        }
    }
}

/// What picking takes at a point.
fn nanoseconds(picker: &LightPicker, probes: &[Probe]) -> f64 {
    const ROUNDS: usize = 9;
    let mut scratch = PickScratch::default();
    let mut times: Vec<f64> = (0..ROUNDS as u32)
        .map(|round| {
            let started = Instant::now();
            let mut picked = 0u32;
            for (number, probe) in (0..).zip(probes) {
                let u = (hash(round, number) >> 8) as f32 / 16_777_216.0;
                let wanted = Wanted { cell: probe.cells[0], ..probe.wanted };
                picker
                    .pick(&wanted, picker.splitting(0), (u, number), &mut scratch, |_| picked += 1);
            }
            std::hint::black_box(picked);
            started.elapsed().as_nanos() as f64 / probes.len().max(1) as f64
        })
        .collect();
    times.sort_unstable_by(f64::total_cmp);
    times[ROUNDS / 2]
}
