//! `candelabra measure`: the trade of speed against accuracy in a scene.

use crate::display::{Display, Form, Progress};
use crate::shot::Shot;
use crate::stderr::say;
use crate::stop::{STOPPED, Stop};
use crate::{page, pilot};
use anyhow::{Context, Result, bail};
use candelabra::light_tree::learned::LearnedFile;
use candelabra::measure::{
    self, Asked, Budget, Cache, Converged, Entrant, Machine, Onlooker, ProbeOptions, Report,
    ShotCost, Subject, Terms, Trade, TradeError, TradeOptions, Way, at_probes,
};
use candelabra::pipeline::{
    Effort, Event, Stamper, Watch, caveat, open_learned, option, view_keys,
};
use candelabra::render::beauty::Beauty;
use candelabra::render::frames::Frames;
use candelabra::render::knob::{self, Aim};
use candelabra::render::noise::Grey;
use candelabra::render::{
    LightStrategy, RenderDelegate, RenderError, RenderSettings, Split, SplitBy,
};
use candelabra::store::write_atomically;
use clap::Args;
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    pub scene: crate::shot::Arguments,
    /// What to measure: STRATEGY[:SPLIT[:TEST]][@SAMPLES or @ERROR], such as tree, tree:0.3@16,
    /// tree:0.3:solid-angle@4, all@2. tree@0.05 gets its samples where the error is, until that is 0.05, as by
    /// candelabra-render --error. Without either at every budget. If nothing is named: uniform, power,
    /// distance:0, tree:0 and tree, and where there are few lights exhaustive and all
    ways: Vec<Asked>,
    /// Samples of each pixel to try
    #[arg(long, value_name = "SAMPLES", value_delimiter = ',', default_values_t = [2, 4, 8, 16, 32, 64],
        value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    budgets: Vec<u32>,
    /// The error that is to be reached: 0.1 for a draft, 0.05 for a preview, 0.02 for a final picture
    #[arg(long, default_value = "preview", value_parser = option::error)]
    pub error: f64,
    /// Size of the picture in pixels, WxH; 320x180 if not given, with --shot 1280x720
    #[arg(long, value_parser = option::size)]
    pub res: Option<(u32, u32)>,
    /// Bounces of light to the eye; 1 if not given, with --shot as many as a render has
    #[arg(long)]
    pub depth: Option<u32>,
    /// Render small pictures of some frames instead, and tell what each frame and the shot will take to reach
    /// the error
    #[arg(long, conflicts_with_all = ["ways", "exact", "csv", "html", "svg", "frame", "visibility", "budgets", "seeds",
        "reference_spp", "probes", "split", "cache", "fresh"])]
    pub shot: bool,
    /// With --shot, its frames, such as 1001-1048; those of the scene if not given
    #[arg(long, requires = "shot", allow_hyphen_values = true)]
    pub frames: Option<Frames>,
    /// With --shot, look at every so many frames; at about eight in all if not given
    #[arg(long, requires = "shot", value_name = "STEP", value_parser = clap::value_parser!(u32).range(1..))]
    pub every: Option<u32>,
    /// At most so many lights at a point
    #[arg(long, default_value_t = RenderSettings::default().max_lights, value_parser = clap::value_parser!(u32).range(1..))]
    pub max_lights: u32,
    /// Pictures by each, with different seeds
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1 << 16))]
    seeds: u32,
    /// Samples of the picture that all are compared with; 16 times the largest number of samples if not given
    #[arg(long, value_name = "SAMPLES", value_parser = clap::value_parser!(u32).range(2..=1 << 24))]
    reference_spp: Option<u32>,
    /// The luminance below which error is absolute; a tenth of the picture's middle if not given
    #[arg(long, value_name = "LUMINANCE", value_parser = option::grey)]
    pub grey: Option<Grey>,
    /// Render nothing: only compute exact variances at points that camera paths visit
    #[arg(long, conflicts_with_all = ["svg", "csv", "reference_spp", "fresh", "cache"])]
    exact: bool,
    /// Such points; 0 for none
    #[arg(long, default_value_t = 128, value_parser = clap::value_parser!(u32).range(0..=1 << 20))]
    probes: u32,
    /// Knobs of splitting to compute exact variances for, if no ways are named
    #[arg(long, value_delimiter = ',', default_values_t = [0.1, 0.2, 0.3, 0.5], value_parser = option::knob)]
    split: Vec<f32>,
    /// In exact variances, count what cannot be seen from a point as dark: one ray to each emitter
    #[arg(long)]
    visibility: bool,
    /// A table of what is hidden, from `candelabra learn`: pictures are rendered with it, and exact variances of
    /// the tree computed with it, too
    #[arg(long, value_name = "FILE", conflicts_with = "shot")]
    pub learned: Option<PathBuf>,
    /// With --visibility, measure the tree again with so many clusters weighed by how much of them is exactly
    /// seen: the most that --learned could give
    #[arg(long, value_name = "CLUSTERS", value_delimiter = ',', requires = "visibility")]
    oracle: Vec<u32>,
    /// Other noise, other points
    #[arg(long, default_value_t = 0)]
    pub seed: u32,
    /// Threads; as many as there are cores if not given
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Folder in which finished work is kept, so that a stopped run goes on; the user's cache if not given
    #[arg(long, value_name = "DIR")]
    cache: Option<PathBuf>,
    /// Measure everything again
    #[arg(long)]
    fresh: bool,
    /// Write JSON; - for standard output
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Write a table of the budgets as CSV; - for standard output
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Write a page with curves, pictures and maps of error
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Write the curves as a picture
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    #[command(flatten)]
    progress: Progress,
}

/// Passes on what the library tells.
pub struct Teller<'a>(pub &'a Display);

impl Onlooker for Teller<'_> {
    fn begins(&self, what: &str) {
        self.0.tell(Event::Stage { name: what.into() });
    }

    fn is_at(&self, done: f64) {
        self.0.tell(Event::Progress { done, frame: None });
    }

    fn is_stopped(&self) -> bool {
        self.0.is_stopped()
    }
}

/// Results, and pictures for a page.
type Measured = (Report, Option<(Converged, Vec<(Entrant, Beauty)>)>);

pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    let streams = [&arguments.json, &arguments.csv].into_iter().flatten();
    let to_stdout = streams.clone().filter(|file| is_stdout(file)).count();
    if to_stdout > 1 {
        bail!("--json - and --csv -: only one of them can go to standard output");
    }
    let files = streams.filter(|file| !is_stdout(file)).chain(&arguments.svg);
    for file in files.chain(&arguments.html) {
        page::check(file, &[arguments.scene.scene()])?;
    }
    if let Some(threads) = arguments.threads {
        rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global()?;
    }
    let stop = Stop::listen()?;
    // What others read on standard output is not mixed with lines about progress.
    let is_mute = to_stdout > 0 && !std::io::stderr().is_terminal();
    let form = if is_mute { Form::None } else { arguments.progress.form };
    let display = Display::new(Progress { form }, &stop);
    let outcome = if arguments.shot {
        let cost = pilot::run(arguments, &display);
        drop(display);
        cost.and_then(|cost| write_cost(arguments, &cost))
    } else {
        let measured = measure(arguments, &display);
        drop(display);
        measured.and_then(|(report, pictures)| write(arguments, &report, pictures.as_ref()))
    };
    match (outcome, stop.signal()) {
        (Err(error), Some(signal)) if is_stop(&error) => {
            say(match arguments.shot {
                true => "stopped",
                false => {
                    "stopped: what is finished is kept, and the same command goes on from there"
                }
            });
            Ok((STOPPED + signal).into())
        }
        (outcome, _) => outcome.map(|()| ExitCode::SUCCESS),
    }
}

fn write_cost(arguments: &Arguments, cost: &ShotCost) -> Result<()> {
    let is_told = put(&arguments.json, || Ok(serde_json::to_string_pretty(cost)? + "\n"))?;
    if is_told { Ok(()) } else { pilot::print(&mut std::io::stdout().lock(), cost) }
}

/// Writes a text to a file, if one is given. Whether it went to standard output.
fn put(file: &Option<PathBuf>, text: impl FnOnce() -> Result<String>) -> Result<bool> {
    let Some(file) = file else { return Ok(false) };
    let text = text()?;
    match is_stdout(file) {
        true => std::io::stdout().lock().write_all(text.as_bytes())?,
        false => write_atomically(file, |out| out.write_all(text.as_bytes()))?,
    }
    Ok(is_stdout(file))
}

fn is_stdout(file: &Path) -> bool {
    file == Path::new("-")
}

fn is_stop(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        matches!(cause.downcast_ref(), Some(RenderError::Stopped))
            || matches!(cause.downcast_ref(), Some(TradeError::Render(RenderError::Stopped)))
    })
}

fn measure(arguments: &Arguments, display: &Display) -> Result<Measured> {
    let (width, height) = arguments.res.unwrap_or((320, 180));
    display.tell(Event::Stage { name: "reading the scene".into() });
    let shot = Shot::prepare(&arguments.scene, width as f32 / height as f32)?;
    let depth = arguments.depth.unwrap_or(1);
    let (max_lights, seed) = (arguments.max_lights, arguments.seed);
    let base = RenderSettings { width, height, depth, max_lights, seed, ..Default::default() };
    let machine = Machine::this(rayon::current_num_threads());
    let scene = arguments.scene.scene().display().to_string();
    let mut report = Report::new(scene, shot.frame, machine, base.clone());
    let mut delegate =
        RenderDelegate::new(&shot.scene, &shot.emitters, shot.camera.clone(), base.clone());
    let learned = arguments.learned.as_ref().map(|path| open_learned(path, true)).transpose()?;
    if let Some((opened, path)) = learned.as_ref().zip(arguments.learned.as_ref()) {
        let view = view_keys(&shot.scene, &shot.camera);
        if let Some(text) = caveat(opened, path, shot.tree.still_key(), &view) {
            say(format_args!("note: {text}"));
        }
        delegate.set_learned(opened.view());
    }
    report.lights = delegate.at_frame(&shot.tree, shot.frame, |integrator| {
        integrator.emitters.emitters.len() + integrator.infinite.len()
    })?;
    if arguments.probes > 0 {
        display.tell(Event::Stage { name: "exact variances".into() });
        let options = ProbeOptions {
            probes: arguments.probes,
            visibility: arguments.visibility,
            ways: exact_ways(arguments),
            grey: arguments.grey,
            seed,
            oracles: arguments.oracle.clone(),
        };
        report.exact = Some(at_probes(&delegate, &shot.tree, shot.frame, &options)?);
        if display.is_stopped() {
            return Err(RenderError::Stopped.into());
        }
    }
    if arguments.exact {
        return Ok((report, None));
    }
    // What a render of this shot would find for itself.
    display.tell(Event::Stage { name: "choosing the knob of splitting".into() });
    let knobs = knob::pilot(&delegate, &shot.tree, shot.frame, Aim::Even)?;
    let base = RenderSettings { split: Split::ByBounce(knobs), ..base };
    report.settings = base.clone();
    let entrants = entrants(arguments, report.lights);
    let budgets = entrants.iter().map(|entrant| entrant.budget);
    let numbers = budgets.clone().filter_map(Budget::samples);
    // An error takes as many samples as it takes.
    let is_open = budgets.clone().any(|budget| budget.error().is_some());
    let others = arguments.budgets.iter().copied().filter(|_| is_open);
    let most = numbers.chain(others).max().unwrap_or(1);
    let options = TradeOptions {
        entrants,
        seeds: arguments.seeds,
        reference_samples: arguments.reference_spp.unwrap_or(16 * most).next_multiple_of(2),
        grey: arguments.grey,
        most: Effort::MOST,
        lights: report.lights,
    };
    let rest = format!("{} {:?}", options.reference_samples, options.grey);
    let effort = Effort::samples(base.samples);
    let table = learned.as_ref().map(LearnedFile::fingerprint);
    let stamper = Stamper::new(&shot.scene, &shot.camera, (&base, &effort), table)?;
    let root = cache_root(arguments)?;
    let fingerprint = stamper.fingerprint(shot.frame, None);
    let cache = Cache::new(&root, &fingerprint, &rest, &report.machine, arguments.fresh);
    let teller = Teller(display);
    let mut subject = Subject {
        delegate: &mut delegate,
        tree: &shot.tree,
        frame: shot.frame,
        base: base.clone(),
    };
    let (converged, rows) = measure::trade(&mut subject, &options, &cache, &teller)?;
    let terms = Terms {
        grey: converged.grey,
        reference_samples: options.reference_samples,
        reference_error: converged.error,
        seeds: options.seeds,
        error: arguments.error,
    };
    let trade = Trade::new(rows, terms, &base);
    let mut pictures = Vec::new();
    if arguments.html.is_some() {
        display.tell(Event::Stage { name: "pictures for the page".into() });
        for entrant in trade.at_equal_times() {
            let goal = (converged.grey, options.most);
            pictures.push((entrant, measure::again(&mut subject, &entrant, goal, &teller)?));
        }
    }
    report.trade = Some(trade);
    Ok((report, Some((converged, pictures))))
}

/// The ways whose exact variances are computed.
fn exact_ways(arguments: &Arguments) -> Vec<Way> {
    let mut ways: Vec<Way> = Vec::new();
    if arguments.ways.is_empty() {
        let blind = [LightStrategy::Uniform, LightStrategy::Power, LightStrategy::Distance];
        ways.extend(blind.map(|strategy| Way::new(strategy, 0.0)));
        ways.push(Way::new(LightStrategy::Tree, 0.0));
        for split_by in [SplitBy::Variance, SplitBy::SolidAngle] {
            let split = |&knob| Way { split_by, ..Way::new(LightStrategy::Tree, knob) };
            ways.extend(arguments.split.iter().map(split));
        }
        let all = [LightStrategy::Exhaustive, LightStrategy::All];
        ways.extend(all.map(|strategy| Way::new(strategy, 0.0)));
    }
    for Asked { way, .. } in &arguments.ways {
        if !ways.contains(way) {
            ways.push(*way);
        }
    }
    ways
}

/// Everything that takes part, the smallest budgets first.
fn entrants(arguments: &Arguments, lights: usize) -> Vec<Entrant> {
    let all = || Way::usual(lights).into_iter().map(|way| Asked { way, budget: None });
    let asked: Vec<Asked> =
        if arguments.ways.is_empty() { all().collect() } else { arguments.ways.clone() };
    let mut entrants: Vec<Entrant> = Vec::new();
    let usual = || arguments.budgets.iter().copied().map(Budget::Samples).collect();
    for Asked { way, budget } in asked {
        let budgets: Vec<Budget> = budget.map_or_else(usual, |budget| vec![budget]);
        for budget in budgets {
            let entrant = Entrant { way, budget };
            if !entrants.contains(&entrant) {
                entrants.push(entrant);
            }
        }
    }
    entrants.sort_by(|a, b| a.budget.by_work(&b.budget));
    entrants
}

/// The folder of finished work, after the XDG Base Directory Specification.
fn cache_root(arguments: &Arguments) -> Result<PathBuf> {
    if let Some(folder) = &arguments.cache {
        return Ok(folder.clone());
    }
    let folder = |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|f| f.is_absolute());
    let base = folder("XDG_CACHE_HOME").or_else(|| Some(folder("HOME")?.join(".cache")));
    let base =
        base.context("neither XDG_CACHE_HOME nor HOME is set: name a folder with --cache")?;
    Ok(base.join("candelabra").join("measure"))
}

fn write(
    arguments: &Arguments,
    report: &Report,
    pictures: Option<&(Converged, Vec<(Entrant, Beauty)>)>,
) -> Result<()> {
    let trade = report.trade.as_ref();
    let json = || Ok(candelabra::page::plain_json(&serde_json::to_string_pretty(report)?) + "\n");
    let is_told = put(&arguments.json, json)?
        | put(&arguments.csv, || Ok(trade.map_or(String::new(), measure::csv)))?;
    put(&arguments.svg, || Ok(trade.map_or(String::new(), measure::svg)))?;
    let shown = pictures.map(|(converged, pictures)| (converged, pictures.as_slice()));
    put(&arguments.html, || Ok(measure::html(report, shown)))?;
    if is_told {
        return Ok(());
    }
    crate::measure_table::print(&mut std::io::stdout().lock(), report)
}
