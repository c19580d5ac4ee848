//! `candelabra measure`: how far off each strategy is, computed exactly.

use crate::shot::Shot;
use anyhow::Result;
use candelabra::measure::{ProbeOptions, ProbeReport, at_probes};
use candelabra::pipeline::{ASPECT, option};
use candelabra::render::{RenderDelegate, RenderSettings, SplitBy};
use clap::Args;
use std::io::Write;

#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    shot: crate::shot::Arguments,
    /// Points that camera paths visit
    #[arg(long, default_value_t = 128, value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    probes: u32,
    /// Knobs of splitting to try
    #[arg(long, value_delimiter = ',', default_values_t = [0.1, 0.2, 0.3, 0.5], value_parser = option::knob)]
    split: Vec<f32>,
    /// At most so many lights at a point
    #[arg(long, default_value_t = RenderSettings::default().max_lights, value_parser = clap::value_parser!(u32).range(1..))]
    max_lights: u32,
    /// Count what cannot be seen from a point as dark: one ray to each emitter
    #[arg(long)]
    visibility: bool,
    /// Other points
    #[arg(long, default_value_t = 0)]
    seed: u32,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let shot = Shot::prepare(&arguments.shot, ASPECT)?;
    let settings = RenderSettings { width: 1024, height: 1024, ..Default::default() };
    let delegate = RenderDelegate::new(&shot.scene, &shot.emitters, shot.camera.clone(), settings);
    let options = ProbeOptions {
        probes: arguments.probes,
        visibility: arguments.visibility,
        knobs: arguments.split.clone(),
        max_lights: arguments.max_lights,
        seed: arguments.seed,
    };
    let report = at_probes(&delegate, &shot.tree, shot.frame, &options)?;
    let mut out = std::io::stdout().lock();
    if arguments.json {
        writeln!(out, "{}", serde_json::to_string_pretty(&report)?)?;
    } else {
        print(&mut out, &report)?;
    }
    Ok(())
}

fn print(out: &mut impl Write, report: &ProbeReport) -> Result<()> {
    writeln!(out, "{} lights at {} points", report.lights, report.probes)?;
    writeln!(
        out,
        "{:<36} {:>11} {:>11} {:>11} {:>8} {:>8}",
        "strategy", "variance", "median", "9 of 10", "lights", "ns"
    )?;
    for row in &report.strategies {
        let name = serde_json::to_value(row.strategy)?;
        let mut name = name.as_str().unwrap_or_default().to_owned();
        if let Some(split) = row.split {
            let by =
                if row.split_by == Some(SplitBy::SolidAngle) { "solid angle" } else { "variance" };
            name = format!("{name}, split {split} by {by}");
        }
        writeln!(
            out,
            "{name:<36} {:>11.5} {:>11.5} {:>11.5} {:>8.2} {:>8.0}",
            row.relative_variance, row.median, row.ninth_decile, row.lights, row.nanoseconds
        )?;
    }
    writeln!(out, "variance: of the light reflected, over its square, in the mean; ideally 0")?;
    Ok(())
}
