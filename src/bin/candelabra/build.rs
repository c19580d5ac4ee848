//! `candelabra build`: a scene in, a tree file out.

use anyhow::{Context, Result, bail};
use candelabra::emitter::Emitters;
use candelabra::light_tree::LightTree;
use candelabra::pipeline::{self, BuildOptions, Survey};
use candelabra::render::frames::Frames;
use candelabra::store::write_atomically;
use clap::Args;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

#[derive(Args)]
pub struct Arguments {
    /// The scene: .gltf, .glb or .obj
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
    /// Build even if the output is up to date
    #[arg(long)]
    force: bool,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    if let Some(threads) = arguments.threads {
        rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global()?;
    }
    let output = arguments.output.clone().unwrap_or(arguments.scene.with_extension("ltree"));
    let mut out = std::io::stdout().lock();

    let started = Instant::now();
    let mut scene = pipeline::load_scene(&arguments.scene)?;
    pipeline::force_lights(&mut scene, &arguments.force_light)
        .with_context(|| arguments.scene.display().to_string())?;
    for note in &scene.notes {
        eprintln!("note: {note}");
    }
    let loaded = started.elapsed();
    let real = |path: &Path| path.canonicalize().ok();
    if scene.files.iter().any(|input| real(input).is_some() && real(input) == real(&output)) {
        bail!("{}: is the scene's own file; choose another output", output.display());
    }
    let emitters = Emitters::collect(&scene);
    let frames = match &arguments.frames {
        Some(frames) => {
            let mut frames = frames.as_slice().to_vec();
            frames.sort_unstable();
            frames
        }
        None => pipeline::frames_of(&scene),
    };
    let survey = pipeline::survey(&scene, &emitters, &frames)
        .with_context(|| arguments.scene.display().to_string())?;
    writeln!(
        out,
        "{}: {} lights, {} emitters ({} change), read in {}",
        arguments.scene.display(),
        survey.lights.len(),
        emitters.len(),
        emitters.changing_count(),
        Seconds(loaded),
    )?;
    if !arguments.force && is_up_to_date(&output, &survey) {
        writeln!(out, "{}: up to date", output.display())?;
        return Ok(());
    }

    let started = Instant::now();
    let options =
        BuildOptions { program: concat!("candelabra ", env!("CARGO_PKG_VERSION")).into() };
    let bytes = pipeline::build_tree(&survey, &options);
    let built = started.elapsed();
    // What is about to replace a good file must be one.
    let tree = LightTree::open(bytes).and_then(|tree| tree.verify().map(|()| tree));
    let bytes = tree.with_context(|| format!("{}: not written", output.display()))?.into_bytes();
    write_atomically(&output, |file| file.write_all(bytes.as_ref()))?;

    let started = Instant::now();
    pipeline::open_tree(&output, true)?;
    let opened = started.elapsed();
    report(&mut out, &output, bytes.as_ref().len(), emitters.len(), built, opened)?;
    Ok(())
}

/// Whether the output is a sound tree of just this content.
fn is_up_to_date(output: &Path, survey: &Survey) -> bool {
    pipeline::open_tree(output, true).is_ok_and(|tree| pipeline::is_built_from(&tree, survey))
}

fn report(
    out: &mut impl Write,
    output: &Path,
    bytes: usize,
    emitters: usize,
    built: Duration,
    opened: Duration,
) -> Result<()> {
    let each = bytes as f64 / emitters.max(1) as f64;
    writeln!(out, "{}: {bytes} bytes, {each:.1} an emitter", output.display())?;
    let (build, open) = (built.as_secs_f64(), opened.as_secs_f64());
    write!(out, "built in {}, opens and verifies in {}: ", Seconds(built), Seconds(opened))?;
    if build > open {
        let renders = (build / (build - open)).ceil().max(2.0);
        writeln!(out, "the file has paid for itself when {renders:.0} processes have used it")?;
    } else {
        writeln!(out, "building anew is as fast as opening; the file pays as a record")?;
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
