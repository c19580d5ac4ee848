//! `candelabra farm`: a job for a farm.

use crate::run::Wanted;
use anyhow::{Context, Result};
use candelabra::farm::{Job, Plan, opencue, openjd, slurm};
use candelabra::store::write_atomically;
use clap::{Args, ValueEnum};
use std::io::{self, Write};
use std::path::PathBuf;

#[derive(Args)]
#[command(
    after_help = "openjd: a template for `openjd run` and Deadline Cloud. slurm: a script of sh that submits the job.\n\
    opencue: the job file, made independent of the folder in which it is run; submit it with cueadmin or\n\
    PyCue's launchSpecAndWait. docs/farms.md tells what each farm makes of a job."
)]
pub struct Arguments {
    /// The job file, CJSL 1.15
    job: PathBuf,
    /// The farm
    #[arg(long, value_enum)]
    to: Farm,
    /// The file to write; standard output if not given
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// The folder in which commands run, as the farm's machines see it
    #[arg(long, value_name = "FOLDER")]
    root: Option<PathBuf>,
    #[command(flatten)]
    wanted: Wanted,
}

#[derive(Clone, Copy, ValueEnum)]
enum Farm {
    Openjd,
    Slurm,
    Opencue,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let job = Job::read(&arguments.job)?;
    let plan = Plan::new(&job, &arguments.wanted.selection())?;
    let root = arguments.root.as_ref().unwrap_or(&job.root);
    let root = root
        .to_str()
        .with_context(|| format!("{}: is no UTF-8, as farms need it", root.display()))?;
    let mut text = Vec::new();
    match arguments.to {
        Farm::Openjd => {
            serde_json::to_writer_pretty(&mut text, &openjd(&plan, root))?;
            text.push(b'\n');
        }
        Farm::Slurm => text = slurm(&plan, root, crate::run::LOGS).into_bytes(),
        Farm::Opencue => opencue(&plan, root, &mut text)?,
    }
    match &arguments.output {
        Some(path) => write_atomically(path, |file| file.write_all(&text))?,
        None => io::stdout().write_all(&text)?,
    }
    Ok(())
}
