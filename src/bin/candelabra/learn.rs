//! `candelabra learn`: a scene and its tree in, a table of what is hidden from where out.

use crate::display::{Display, Progress};
use crate::stderr::say;
use crate::stop::{STOPPED, Stop};
use anyhow::Result;
use candelabra::page::{Lines, counted};
use candelabra::pipeline::{Budget, LearnError, LearnJob, StageOptions, Strict, View, option};
use candelabra::render::frames::Frames;
use clap::Args;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(Args)]
pub struct Arguments {
    /// The scene: .gltf, .glb or .obj, or a USD stage
    scene: PathBuf,
    /// Its light tree, from `candelabra build`; built in memory if not given
    #[arg(long)]
    tree: Option<PathBuf>,
    /// The frames that will be rendered, of which a few are looked at; the scene's own if not given
    #[arg(long, allow_hyphen_values = true)]
    frames: Option<Frames>,
    /// The table to write; the scene's name with .lvis if not given
    #[arg(short, long)]
    output: Option<PathBuf>,
    #[command(flatten)]
    view: View,
    /// Rays to lights, in millions
    #[arg(long, value_name = "MILLIONS", default_value_t = Budget::RAYS as f64 / 1e6, value_parser = millions)]
    rays: f64,
    /// How long it may take, in place of a number of rays: 90, 90s, 10m or 1.5h, from the start of the program.
    /// How many rays that allows is found out first, and told: with --rays, they give the same table anywhere
    #[arg(long, conflicts_with = "rays", value_parser = option::duration)]
    time: Option<f64>,
    /// As given to build; may be given again
    #[arg(long, value_name = "PATH")]
    force_light: Vec<String>,
    /// Threads; as many as there are cores if not given
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Take notes about the scene for errors: all, or those of the categories given, such as
    /// --strict=lights,cameras (lights, materials, geometry, cameras, animation, other)
    #[arg(long, value_name = "CATEGORIES", num_args = 0..=1, require_equals = true, default_missing_value = Strict::EVERYTHING)]
    strict: Option<Strict>,
    #[command(flatten)]
    stage: StageOptions,
    #[command(flatten)]
    progress: Progress,
}

fn millions(text: &str) -> Result<f64, String> {
    let [least, most] = Budget::RANGE.map(|rays| rays as f64 / 1e6);
    let number = text.parse().ok().filter(|millions| (least..=most).contains(millions));
    number.ok_or_else(|| "write a number from 0.001 to 4000".into())
}

pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    if let Some(threads) = arguments.threads {
        rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global()?;
    }
    let job = LearnJob {
        scene: arguments.scene.clone(),
        stage: arguments.stage.clone(),
        tree: arguments.tree.clone(),
        frames: arguments.frames.clone(),
        view: arguments.view.clone(),
        output: arguments.output.clone().unwrap_or_else(|| arguments.scene.with_extension("lvis")),
        budget: match arguments.time {
            Some(seconds) => Budget::Seconds(seconds),
            None => Budget::Rays((arguments.rays * 1e6).round() as u64),
        },
        force_lights: arguments.force_light.clone(),
        strict: arguments.strict.clone(),
    };
    let stop = Stop::listen()?;
    let display = Display::new(arguments.progress, &stop);
    let report = match job.run(&display) {
        Err(LearnError::Stopped) => {
            say(format_args!("candelabra: {}", LearnError::Stopped));
            return Ok((STOPPED + stop.signal().unwrap_or_default()).into());
        }
        report => report?,
    };
    drop(display);
    let mut out = Lines(std::io::stdout().lock());
    let output = job.output.display();
    writeln!(
        out,
        "{output}: {} rays from {} in {:.1} s: {:.1} % of a render's picks are hidden",
        report.rays,
        counted(report.frames, "frame"),
        report.learning.as_secs_f64(),
        100.0 * report.hidden
    )?;
    if arguments.time.is_some() {
        writeln!(out, "{output}: --rays {} gives the same table", report.budget as f64 / 1e6)?;
    }
    match report.cells {
        0 => writeln!(out, "{output}: next to nothing is hidden here: the table is empty")?,
        cells => writeln!(out, "{output}: {}, {} bytes", counted(cells, "cell"), report.bytes)?,
    }
    Ok(ExitCode::SUCCESS)
}
