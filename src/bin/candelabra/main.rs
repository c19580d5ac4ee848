//! `candelabra`: builds light trees and looks into them.

#![warn(clippy::print_stderr)]

mod build;
mod diff;
mod display;
mod farm;
mod inspect;
mod learn;
mod lost_pages;
mod measure;
mod measure_table;
mod page;
mod pilot;
mod run;
mod run_display;
mod shot;
mod stderr;
mod stop;
mod texture_bar;
mod verify;

use candelabra::pipeline::{BuildError, LearnError, ViewError};
use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// Builds light trees for scenes with very many lights, and looks into them.
#[derive(Parser)]
#[command(version, arg_required_else_help = true)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Build the light trees of a scene and write them to a file
    Build(build::Arguments),
    /// Compare two versions of a scene, or their trees: which lights changed, and by how much
    Diff(diff::Arguments),
    /// Write a job of a pipeline down for a farm: OpenJD, Slurm or OpenCue
    Farm(farm::Arguments),
    /// Print what is in a scene or in a tree file, and what the scene requires
    Inspect(inspect::Arguments),
    /// Learn what of its lights is hidden from where in a shot, and write that to a file that renders map
    Learn(learn::Arguments),
    /// Measure what each way of picking lights trades: error against time, and variance exactly
    Measure(Box<measure::Arguments>),
    /// Carry out the jobs of a pipeline on this machine
    Run(run::Arguments),
    /// Check that tree files keep every rule of the format, and name the first that is broken
    Verify(verify::Arguments),
}

impl Command {
    /// The exit code if a mapped file is lost. For some, 1 is an answer.
    fn lost(&self) -> u8 {
        match self {
            Command::Diff(_) | Command::Verify(_) => diff::TROUBLE,
            _ => FAILED,
        }
    }
}

const FAILED: u8 = 1;
/// Usage; mostly said by clap.
const USAGE: u8 = 2;

fn main() -> ExitCode {
    let command = Arguments::parse().command;
    if let Err(error) = lost_pages::explain(command.lost().into()) {
        stderr::say(format_args!("candelabra: {error}"));
        return command.lost().into();
    }
    let done = |()| ExitCode::SUCCESS;
    let outcome = match &command {
        Command::Build(arguments) => build::run(arguments),
        Command::Diff(arguments) => diff::run(arguments),
        Command::Farm(arguments) => farm::run(arguments).map(done),
        Command::Inspect(arguments) => inspect::run(arguments).map(done),
        Command::Learn(arguments) => learn::run(arguments),
        Command::Measure(arguments) => measure::run(arguments),
        Command::Run(arguments) => run::run(arguments),
        Command::Verify(arguments) => verify::run(arguments),
    };
    match outcome {
        Ok(code) => code,
        // A reader that has seen enough (`| head`) is no failure.
        Err(error) if is_closed_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            stderr::say(format_args!("candelabra: {error:#}"));
            match command {
                Command::Diff(_) | Command::Verify(_) => diff::TROUBLE.into(),
                _ if run::is_usage(&error) => USAGE.into(),
                _ if error.downcast_ref().is_some_and(ViewError::is_usage) => USAGE.into(),
                _ if error.downcast_ref().is_some_and(BuildError::is_usage) => USAGE.into(),
                _ if error.downcast_ref().is_some_and(LearnError::is_usage) => USAGE.into(),
                _ => ExitCode::FAILURE,
            }
        }
    }
}

fn is_closed_pipe(error: &anyhow::Error) -> bool {
    let io = error.chain().find_map(|cause| cause.downcast_ref::<std::io::Error>());
    io.is_some_and(|error| error.kind() == std::io::ErrorKind::BrokenPipe)
}
