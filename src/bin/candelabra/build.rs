//! `candelabra build`: a scene in, a tree file out.

use crate::display::{Display, Progress};
use crate::stderr::say;
use crate::stop::{STOPPED, Stop};
use anyhow::Result;
use candelabra::page::{Lines, counted};
use candelabra::pipeline::{
    BreakEven, BuildError, BuildJob, BuildReport, Built, StageOptions, Strict,
};
use candelabra::render::frames::Frames;
use clap::Args;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

#[derive(Args)]
pub struct Arguments {
    /// The scene: .gltf, .glb or .obj, or a USD stage
    scene: PathBuf,
    /// The tree file to write; the scene's name with .ltree if not given
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Frames to build for, if lights change: 1001-1048, 1001-1048x2, 1,5,9; the scene's own if not
    /// given
    #[arg(long, allow_hyphen_values = true)]
    frames: Option<Frames>,
    /// Leave the lights at or below a prim path out of all estimates and sample them at every point;
    /// may be given again
    #[arg(long, value_name = "PATH")]
    force_light: Vec<String>,
    /// Threads; as many as there are cores if not given
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// A tree file of an earlier version of the scene, of which to take over what has not changed; the
    /// output's own earlier version if not given
    #[arg(long, value_name = "TREE")]
    base: Option<PathBuf>,
    /// Build even if the output is up to date, and all of it
    #[arg(long, conflicts_with = "base")]
    force: bool,
    /// Take notes about the scene for errors: all, or those of the categories given, such as
    /// --strict=lights,cameras (lights, materials, geometry, cameras, animation, other)
    #[arg(long, value_name = "CATEGORIES", num_args = 0..=1, require_equals = true, default_missing_value = Strict::EVERYTHING)]
    strict: Option<Strict>,
    #[command(flatten)]
    stage: StageOptions,
    #[command(flatten)]
    progress: Progress,
}

pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    if let Some(threads) = arguments.threads {
        rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global()?;
    }
    let Arguments { scene, output, frames, force_light, base, force, strict, .. } = arguments;
    let job = BuildJob {
        scene: scene.clone(),
        stage: arguments.stage.clone(),
        output: output.clone(),
        frames: frames.clone(),
        force_light: force_light.clone(),
        base: base.clone(),
        force: *force,
        strict: strict.clone(),
    };
    let stop = Stop::listen()?;
    let display = Display::new(arguments.progress, &stop);
    let report = match job.run(&display) {
        Err(BuildError::Stopped) => {
            say(format_args!("candelabra: {}", BuildError::Stopped));
            return Ok((STOPPED + stop.signal().unwrap_or_default()).into());
        }
        report => report?,
    };
    drop(display);
    print(&mut Lines(std::io::stdout().lock()), &job, &report)?;
    Ok(ExitCode::SUCCESS)
}

fn print(out: &mut impl Write, job: &BuildJob, report: &BuildReport) -> Result<()> {
    writeln!(
        out,
        "{}: {}, {} ({} change), read in {}",
        job.scene.display(),
        counted(report.lights, "light"),
        counted(report.emitters, "emitter"),
        report.changing,
        Seconds(report.reading),
    )?;
    let output = report.output.display();
    let Some(built) = &report.built else {
        writeln!(out, "{output}: up to date")?;
        return Ok(());
    };
    if let Some(base) = &built.taken_over {
        writeln!(
            out,
            "{}: {} of {} leaves taken over, opened and verified in {}",
            base.base.display(),
            base.reused,
            base.leaves,
            Seconds(base.opening)
        )?;
    }
    let Built { bytes, collecting, surveying, building, writing, break_even, .. } = built;
    let each = *bytes as f64 / report.emitters.max(1) as f64;
    writeln!(out, "{output}: {bytes} bytes, {each:.1} an emitter")?;
    writeln!(
        out,
        "emitters found in {}, surveyed in {}, trees built in {}, written in {}",
        Seconds(*collecting),
        Seconds(*surveying),
        Seconds(*building),
        Seconds(*writing)
    )?;
    break_even.map_or(Ok(()), |break_even| print_break_even(out, &break_even))
}

/// Prints after how many processes the file has paid for itself.
fn print_break_even(out: &mut impl Write, break_even: &BreakEven) -> Result<()> {
    write!(
        out,
        "before its first frame a process spends {} on lights without the file, {} with it",
        Seconds(break_even.without),
        Seconds(break_even.with)
    )?;
    match break_even.processes() {
        Some(number) => {
            writeln!(out, ": the file has paid for itself with process number {number}")?;
        }
        None => writeln!(out, ": the file saves no time and serves as a record")?,
    }
    Ok(())
}

/// A duration with three digits.
struct Seconds(Duration);

impl std::fmt::Display for Seconds {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let seconds = self.0.as_secs_f64();
        if seconds < 0.1 {
            write!(f, "{:.2} ms", seconds * 1e3)
        } else {
            write!(f, "{seconds:.2} s")
        }
    }
}
