//! `candelabra run`: a pipeline, carried out on this machine.

use crate::display::Progress;
use crate::run_display::Display;
use crate::stderr::say;
use anyhow::Result;
use candelabra::farm::{
    Job, JobError, OpenCueError, Outcome, Plan, PlanError, RunOptions, Selection, Summary, Task,
    check_logs, log_path, read_jobs, run as carry_out,
};
use candelabra::page::Plain;
use candelabra::render::frames::Frames;
use clap::Args;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

#[derive(Args)]
#[command(
    after_help = "A job file is an OpenCue job (CJSL 1.15); docs/farms.md tells all. Its commands run by sh, in the folder\n\
    that holds pipelines/ if the file is in a folder of that name, else in its own. What is up to date the\n\
    commands find out themselves: to go on after a failure or Ctrl-C, run the same again.\n\
    Exit codes: 0 all is done, 1 something failed, 2 usage or a job file that is refused, 128 + n ended by\n\
    signal n."
)]
pub struct Arguments {
    /// A job file, or a folder of them
    jobs: PathBuf,
    #[command(flatten)]
    wanted: Wanted,
    /// Print the commands, in order, and run none
    #[arg(long)]
    dry_run: bool,
    /// How often a task that fails is tried again; the job's <maxretries> if not given
    #[arg(long, value_parser = clap::value_parser!(u32).range(..=1000))]
    retries: Option<u32>,
    /// The folder in which commands run
    #[arg(long, value_name = "FOLDER")]
    root: Option<PathBuf>,
    /// The folder of the logs, seen from the folder in which commands run
    #[arg(long, value_name = "FOLDER", default_value = LOGS)]
    logs: PathBuf,
    #[command(flatten)]
    progress: Progress,
}

/// A part of a job.
#[derive(Args)]
#[group(skip)]
pub struct Wanted {
    /// This layer alone; may be given again. What it waits for is taken as done
    #[arg(long, value_name = "NAME")]
    pub layer: Vec<String>,
    /// These frames alone, of layers of several frames: 1001-1048, 1001-1048x2, 1,5,9
    #[arg(short, long, allow_hyphen_values = true)]
    pub frames: Option<Frames>,
}

/// Where logs go if nobody says where.
pub const LOGS: &str = "out/logs";
const FAILED: u8 = 1;
const USAGE: u8 = 2;
/// Failures that a summary lists.
const LISTED: usize = 20;

impl Wanted {
    pub fn selection(&self) -> Selection {
        Selection { layers: self.layer.clone(), frames: self.frames.clone() }
    }
}

/// Whether what is asked for cannot be carried out by anybody.
pub fn is_usage(error: &anyhow::Error) -> bool {
    let is_job = error.is::<JobError>() || error.is::<PlanError>();
    is_job || matches!(error.downcast_ref(), Some(OpenCueError::NegativeFrame { .. }))
}

pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    let jobs = match read_jobs(&arguments.jobs) {
        Ok(jobs) => jobs,
        Err(refused) => {
            for error in refused {
                say(format_args!("candelabra: {error}"));
            }
            return Ok(USAGE.into());
        }
    };
    let selection = arguments.wanted.selection();
    let plan = |job| -> Result<_> { Ok((Plan::new(job, &selection)?, options(arguments, job)?)) };
    let runs: Vec<(Plan, RunOptions)> = jobs.iter().map(plan).collect::<Result<_>>()?;
    check_logs(&runs)?;
    if arguments.dry_run {
        runs.iter().try_for_each(|(plan, options)| print_commands(plan, options))?;
        return Ok(ExitCode::SUCCESS);
    }
    let layers = runs.iter().flat_map(|(plan, _)| &plan.layers);
    let frames = layers.map(|planned| planned.frames.len()).sum();
    let mut display = Display::new(arguments.progress.form, frames)?;
    let (mut is_done, mut rest) = (true, runs.iter());
    while let Some((plan, options)) = rest.next() {
        display.begin(plan);
        let summary = match carry_out(plan, options, &mut display) {
            Ok(summary) => summary,
            Err(error) => {
                display.end(&format!("{}: not begun: {error}", plan.job.name), false);
                is_done = false;
                continue;
            }
        };
        display.end(&summarise(arguments, plan, options, &summary), summary.is_done());
        is_done &= summary.is_done();
        if let Some(signal) = summary.signal {
            tell_rest(arguments, rest.map(|(plan, _)| plan.job.name.clone()).collect());
            return Ok(u8::try_from(128 + signal).unwrap_or(FAILED).into());
        }
    }
    Ok(if is_done { ExitCode::SUCCESS } else { FAILED.into() })
}

/// Says which jobs of a folder a signal has kept from beginning, and how to go on with all.
fn tell_rest(arguments: &Arguments, names: Vec<String>) {
    if !names.is_empty() {
        let names =
            names.into_iter().map(|name| format!("  {name} not begun: the run was stopped"));
        shortened(names.collect(), "jobs").iter().for_each(say);
        let all = again(arguments, &arguments.jobs, &arguments.wanted.layer);
        say(format_args!("go on with all jobs: {all}"));
    }
}

fn options(arguments: &Arguments, job: &Job) -> io::Result<RunOptions> {
    // The commands are told of the logs and run elsewhere.
    let root = std::path::absolute(arguments.root.as_ref().unwrap_or(&job.root))?;
    let retries = arguments.retries.unwrap_or(job.retries);
    Ok(RunOptions { logs: root.join(&arguments.logs), root, retries })
}

fn print_commands(plan: &Plan, options: &RunOptions) -> io::Result<()> {
    let mut out = io::stdout().lock();
    writeln!(out, "# {} in {}", plan.job.name, Plain(options.root.display()))?;
    plan.tasks().try_for_each(|task| writeln!(out, "# {}\n{}", task.name, task.command))
}

/// What came of a job, what failed, and how to go on.
fn summarise(
    arguments: &Arguments,
    plan: &Plan,
    options: &RunOptions,
    summary: &Summary,
) -> String {
    let count =
        |is: fn(&Outcome) -> bool| summary.tasks.iter().filter(|(_, outcome)| is(outcome)).count();
    let done = count(|outcome| matches!(outcome, Outcome::Done { .. }));
    let kept = count(|outcome| matches!(outcome, Outcome::Done { up_to_date: true }));
    let (name, all) = (&plan.job.name, summary.tasks.len());
    let mut lines = vec![match kept {
        0 => format!("{name}: {done} of {all} tasks done"),
        _ => format!("{name}: {done} of {all} tasks done, {kept} of them up to date before"),
    }];
    let failed = summary.tasks.iter().filter_map(|(task, outcome)| match outcome {
        Outcome::Failed(fault) => Some(format!(
            "  {} failed: {fault}; log {}",
            task.name,
            log_path(options, plan, task).display()
        )),
        _ => None,
    });
    lines.extend(shortened(failed.collect(), "tasks"));
    let waiting = summary.tasks.iter().filter_map(|(task, outcome)| match outcome {
        Outcome::Blocked { by } => Some(format!("  {} not run: it waits for {by}", task.name)),
        Outcome::Stopped => Some(format!("  {} not done: the run was stopped", task.name)),
        _ => None,
    });
    lines.extend(shortened(waiting.collect(), "tasks"));
    if !summary.is_done() {
        let again = again(arguments, &plan.job.path, &layers_left(plan, summary));
        lines.push(format!("go on with: {again}"));
    }
    lines.join("\n")
}

fn shortened(mut lines: Vec<String>, what: &str) -> Vec<String> {
    if lines.len() > LISTED {
        let more = lines.len() - LISTED;
        lines.truncate(LISTED);
        lines.push(format!("  ... and {more} more {what}"));
    }
    lines
}

/// The layers of which not all is done.
fn layers_left(plan: &Plan, summary: &Summary) -> Vec<String> {
    let is_left = |place: usize| {
        let is_missed = |(task, outcome): &(Task, Outcome)| {
            task.layer == place && !matches!(outcome, Outcome::Done { .. })
        };
        summary.tasks.iter().any(is_missed)
    };
    let left = (0..plan.layers.len()).filter(|&place| is_left(place));
    left.map(|place| plan.layers[place].layer.name.clone()).collect()
}

/// The command that carries out layers of jobs, with the options of this run.
fn again(arguments: &Arguments, jobs: &Path, layers: &[String]) -> String {
    let word = |text: &str| {
        shlex::try_quote(text).map_or_else(|_| text.to_owned(), |quoted| quoted.into_owned())
    };
    let mut words = vec!["candelabra run".into(), word(&jobs.display().to_string())];
    let mut option = |name: &str, value: &str| words.push(format!("{name} {}", word(value)));
    layers.iter().for_each(|layer| option("--layer", layer));
    if let Some(frames) = &arguments.wanted.frames {
        option("--frames", &candelabra::farm::range::format(frames.as_slice()));
    }
    if let Some(retries) = arguments.retries {
        option("--retries", &retries.to_string());
    }
    if let Some(root) = &arguments.root {
        option("--root", &root.display().to_string());
    }
    if arguments.logs.as_os_str() != LOGS {
        option("--logs", &arguments.logs.display().to_string());
    }
    words.join(" ")
}
