//! `candelabra race`: settings against each other, by error and time.

use crate::shot::Shot;
use anyhow::Result;
use candelabra::measure::{Entrant, RaceOptions, race};
use candelabra::pipeline::option;
use candelabra::render::{LightStrategy, RenderDelegate, RenderSettings, Split, SplitBy};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::Write;

#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    shot: crate::shot::Arguments,
    /// Who takes part: STRATEGY[:SPLIT[:TEST]]@SAMPLES, such as tree@64, tree:0.3@4,
    /// tree:0.3:solid-angle@4, all@1; the first is what the others are compared with
    #[arg(required = true, value_parser = way)]
    ways: Vec<Way>,
    /// Size of the picture in pixels, WxH
    #[arg(long, default_value = "320x180", value_parser = option::size)]
    res: (u32, u32),
    /// Bounces of light to the eye
    #[arg(long, default_value_t = 1)]
    depth: u32,
    /// At most so many lights at a point
    #[arg(long, default_value_t = RenderSettings::default().max_lights, value_parser = clap::value_parser!(u32).range(1..))]
    max_lights: u32,
    /// Pictures by each
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(2..))]
    pictures: u32,
    /// Threads; as many as there are cores if not given
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// One that takes part.
#[derive(Clone, Debug)]
struct Way {
    name: String,
    strategy: LightStrategy,
    split: Split,
    split_by: SplitBy,
    samples: u32,
}

fn way(text: &str) -> Result<Way, String> {
    let wrong = || format!("'{text}' is not STRATEGY[:SPLIT[:TEST]]@SAMPLES");
    let (how, samples) = text.split_once('@').ok_or_else(wrong)?;
    let samples = samples.parse().ok().filter(|&samples| samples > 0).ok_or_else(wrong)?;
    let mut parts = how.split(':');
    let read = |text: &str| serde_json::from_value(serde_json::Value::String(text.into()));
    let strategy = read(parts.next().unwrap_or_default()).map_err(|_| wrong())?;
    let split = parts.next().map_or(Ok(RenderSettings::default().split), |text| {
        option::knob(text)
            .map(Split::Fixed)
            .map_err(|help| format!("{}; for SPLIT, {help}", wrong()))
    })?;
    let read = |text: &str| serde_json::from_value(serde_json::Value::String(text.into()));
    let split_by =
        parts.next().map_or(Ok(SplitBy::Variance), |text| read(text).map_err(|_| wrong()))?;
    Ok(Way { name: text.into(), strategy, split, split_by, samples })
}

pub fn run(arguments: &Arguments) -> Result<()> {
    if let Some(threads) = arguments.threads {
        rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global()?;
    }
    let (width, height) = arguments.res;
    let shot = Shot::prepare(&arguments.shot, width as f32 / height as f32)?;
    let base = RenderSettings {
        width,
        height,
        depth: arguments.depth,
        max_lights: arguments.max_lights,
        ..Default::default()
    };
    let entrants: Vec<Entrant> = arguments
        .ways
        .iter()
        .map(|way| Entrant {
            name: way.name.clone(),
            settings: RenderSettings {
                samples: way.samples,
                strategy: way.strategy,
                split: way.split,
                split_by: way.split_by,
                ..base.clone()
            },
        })
        .collect();
    let mut delegate =
        RenderDelegate::new(&shot.scene, &shot.emitters, shot.camera.clone(), base.clone());
    let style = ProgressStyle::with_template("{bar:30} {pos}/{len} pictures, {eta} left");
    let bar = ProgressBar::new(entrants.len() as u64 * u64::from(arguments.pictures));
    let bar = bar.with_style(style.expect("the template is sound"));
    let options = RaceOptions { frame: shot.frame, pictures: arguments.pictures };
    let results = race(&mut delegate, &shot.tree, &entrants, &options, || bar.inc(1))?;
    bar.finish_and_clear();
    let mut out = std::io::stdout().lock();
    if arguments.json {
        writeln!(out, "{}", serde_json::to_string_pretty(&results)?)?;
        return Ok(());
    }
    writeln!(
        out,
        "{:<32} {:>9} {:>9} {:>12} {:>14} {:>10}",
        "", "seconds", "lights", "error", "s to the first", "mean"
    )?;
    for row in results {
        writeln!(
            out,
            "{:<32} {:>9.2} {:>9.2} {:>12.6} {:>14.2} {:>10.4}",
            row.name, row.seconds, row.lights, row.error, row.seconds_to_error_of_first, row.mean
        )?;
    }
    writeln!(out, "error: variance over squared luminance, in the mean over the pixels")?;
    Ok(())
}
