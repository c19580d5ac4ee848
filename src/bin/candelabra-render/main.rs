//! `candelabra-render`: renders the frames of a shot through a light tree.

#![warn(clippy::print_stderr)]

mod arguments;
#[path = "../candelabra/display.rs"]
mod display;
#[path = "../candelabra/lost_pages.rs"]
mod lost_pages;
#[path = "../candelabra/stderr.rs"]
mod stderr;
#[path = "../candelabra/stop.rs"]
mod stop;

use arguments::{Arguments, StatsForm};
use candelabra::pipeline::{RenderError, RenderReport};
use clap::Parser;
use display::Display;
use std::io::Write;
use std::process::ExitCode;
use stderr::say;
use stop::{STOPPED, Stop};

/// Some frames failed, or nothing could be rendered at all.
const FAILED: u8 = 1;
/// Usage; mostly said by clap.
const USAGE: u8 = 2;
/// The tree file is stale or broken.
const BAD_TREE: u8 = 3;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    match run(&arguments) {
        Ok(code) => code.into(),
        Err(error) => {
            say(format_args!("candelabra-render: {error:#}"));
            ExitCode::from(match error.downcast_ref::<RenderError>() {
                Some(error) if error.is_bad_tree() => BAD_TREE,
                Some(error) if error.is_usage() => USAGE,
                _ => FAILED,
            })
        }
    }
}

fn run(arguments: &Arguments) -> anyhow::Result<u8> {
    if let Some(threads) = arguments.threads {
        rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global()?;
    }
    lost_pages::explain(BAD_TREE.into())?;
    let stop = Stop::listen()?;
    let display = Display::new(arguments.progress, &stop);
    let report = arguments.job().run(&display)?;
    drop(display);
    if let Some(form) = arguments.stats {
        tell_stats(&report, form)?;
    }
    Ok(code_of(&report, &stop))
}

/// The exit code, and on standard error what it means.
fn code_of(report: &RenderReport, stop: &Stop) -> u8 {
    let frames = &report.frames;
    if report.stopped {
        let (done, asked) = (frames.done + frames.up_to_date, frames.asked);
        say(format_args!(
            "candelabra-render: stopped; {done} of {asked} frames are done; go on with --resume"
        ));
        return STOPPED + stop.signal().unwrap_or_default();
    }
    if frames.failed > 0 {
        let plural = if frames.failed == 1 { "" } else { "s" };
        say(format_args!(
            "candelabra-render: {} frame{plural} failed; any others are done",
            frames.failed
        ));
        return FAILED;
    }
    0
}

fn tell_stats(report: &RenderReport, form: StatsForm) -> anyhow::Result<()> {
    let mut stats = serde_json::to_value(report)?;
    stats["peak_memory_bytes"] = peak_memory_bytes().into();
    let mut out = std::io::stdout().lock();
    match form {
        StatsForm::Json => writeln!(out, "{stats}")?,
        StatsForm::Text => writeln!(out, "{stats:#}")?,
    }
    Ok(())
}

/// The most memory that this process has had, if the system tells.
fn peak_memory_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
}
